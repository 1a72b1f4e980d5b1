"""The openings stage: doors, windows and passages in the walls of all storeys."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely

from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.scene import Scene, load_scene
from scan2bim.cloud.surfels import Surfels
from scan2bim.config import OpeningSettings
from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.openings.alike import completed
from scan2bim.openings.closed.below_windows import without_windows
from scan2bim.openings.closed.find import closed_doors, closed_openings, faces_of
from scan2bim.openings.closed.rectangles import Face
from scan2bim.openings.confidence import probability
from scan2bim.openings.debug_images import draw_wall
from scan2bim.openings.door_frames import FLAT, with_frame, with_pane
from scan2bim.openings.leaves import AJAR, WIDEST, find_leaf, reach_up
from scan2bim.openings.linings import with_lining, with_usual_linings
from scan2bim.openings.near_points import WallPoints, points_by_wall
from scan2bim.openings.open import find_open
from scan2bim.openings.outside import enclosed_parts, leads_somewhere
from scan2bim.openings.paper.closed import paper_openings
from scan2bim.openings.shapes import OpeningShape, save_openings
from scan2bim.openings.virtual import virtual_panoramas
from scan2bim.openings.wall_image import REACH, wall_image
from scan2bim.structure.shapes import StoreyShape, StructureShape, WallShape

WIDEST_LEAF = 1.1
"""Clear width, metres, above which an opening without a leaf is a passage: a single leaf is seldom wider, and two would
be seen."""
TALLEST_DOOR = 3.0
"""Height, metres, above which an opening is a gap in a wall or a glass front: most doors end at 2.5. It is a door if a
leaf that goes up to UNDER_HEAD below its head stands at it, seen on a share of TALL_LEAF of its upper part."""
UNDER_HEAD, TALL_LEAF = 0.2, 0.4
SWUNG = np.radians(70)
"""Angle from closed up to which a leaf still hangs in its opening and may be taken for a pane."""
NARROWEST_LEAF = 0.5
"""Clear width, metres, below which no leaf is looked for."""
BELOW = 0.9
"""Share of an opening that lies below its wall's upper edge: what is seen beyond a roof's slope is no opening."""
SURER = 0.1
"""Difference of probabilities by which a window must be surer than a closed door to replace it: what both err by."""
TOUCHING = 0.001
"""Metres by which openings that stand side by side may overlap: places are rounded."""
STRIP = 0.25
"""Share of an opening's width up to which another may reach into it and stand beside it all the same."""
ALL_SIDES = 4
"""Sides of a window that have the wall's face beside them where it does not stand on the floor."""
ALIKE, OTHERS = 0.03, 2
"""Metres within which windows of a row agree, and how many others make one."""
HALF = (0.35, 0.65)
"""Share of a doorway's width that one of its two leaves has."""
JAMB = 0.06
"""Metres within which a leaf's edge is at the jamb or head that it hangs in: frames."""
LOOKED_THROUGH = 0.15
"""Share of a rectangle that was looked through from which on it is no closed leaf, but glazed or open."""


def find_openings(
    structure_folder: Path,
    surfel_folder: Path,
    scan_folders: Sequence[Path],
    folder: Path,
    settings: OpeningSettings,
    progress: Callable[[float], None],
) -> None:
    """Find the openings of all walls and write them to ``folder``/openings.json."""
    scene = load_scene(surfel_folder, scan_folders)
    structure = StructureShape.load(structure_folder / "structure.json")
    found = openings_of(structure, scene, scan_folders, folder, settings, progress)
    found = completed(with_usual_linings(found))
    if settings.method != "paper":
        found = _judged(found, structure.storeys)
    save_openings(without_overlaps(found, structure.storeys), folder / "openings.json")


def _judged(found: Sequence[OpeningShape], storeys: Sequence[StoreyShape]) -> list[OpeningShape]:
    """With the probability of those that were looked through; closed leaves have theirs."""
    return [replace(o, confidence=probability(o, storeys[o.storey].walls[o.wall])) if o.sides > 0 else o for o in found]


def draw_openings(
    structure_folder: Path,
    surfel_folder: Path,
    scan_folders: Sequence[Path],
    pictures: Path,
    settings: OpeningSettings,
    progress: Callable[[float], None],
) -> None:
    """Write pictures of each step on each face of all walls into a folder."""
    scene = load_scene(surfel_folder, scan_folders)
    structure = StructureShape.load(structure_folder / "structure.json")
    pictures.mkdir(parents=True, exist_ok=True)
    for near in near_walls(structure, scene, scan_folders, pictures, progress):
        name = f"storey{near.storey}-wall{near.place + 1:02d}"
        faces = near.faces(structure, scene)
        draw_wall(pictures, name, faces, closed_doors(faces), settings)


def openings_of(
    structure: StructureShape,
    scene: Scene,
    scan_folders: Sequence[Path],
    folder: Path,
    settings: OpeningSettings,
    progress: Callable[[float], None],
) -> list[OpeningShape]:
    """Openings of all walls, storey by storey: those that were looked through, and closed doors.

    ``folder`` holds points meanwhile.
    """
    virtual = virtual_stations(structure, scene)
    index = PlanIndex(scene.surfels.xyz)
    enclosed = [enclosed_parts(storey) for storey in structure.storeys]
    found: list[OpeningShape] = []
    for near in near_walls(structure, scene, scan_folders, folder, progress):
        seen = near.looked_through(scene, virtual)
        if enclosed[near.storey]:
            parts = enclosed[near.storey]
            seen = [o for o in seen if leads_somewhere(o, near.wall, parts, scene.surfels.xyz, index)]
        faces = near.faces(structure, scene)
        if settings.method == "paper":
            found += [*seen, *paper_openings(near.storey, near.place, faces, settings)]
        else:
            images = [face.image for face in faces]
            hung = [with_lining(with_leaf(o, near.wall, scene.surfels, index), images) for o in seen]
            hung = [with_frame(with_pane(o, near.wall, faces), near.wall, faces, near.points) for o in hung]
            hung = [with_found_leaf(o, near.wall, scene.surfels, index) for o in hung]
            doors = closed_openings(near.storey, near.place, near.wall, faces, near.points)
            found += [*hung, *without_windows(doors, hung, faces)]
    found.sort(key=lambda o: (o.storey, o.wall))
    walls = [storey.walls for storey in structure.storeys]
    return [o for o in found if walls[o.storey][o.wall].share_below(o.offset, o.sill, o.width, o.height) > BELOW]


@dataclass(frozen=True, slots=True, eq=False)
class NearWall:
    """A wall with its place in its storey, the points near it and the stations near enough to be asked about it."""

    storey: int
    place: int
    wall: WallShape
    points: WallPoints
    panoramas: dict[int, Panorama]

    def looked_through(self, scene: Scene, virtual: Sequence[Mapping[int, Panorama]]) -> list[OpeningShape]:
        """Its openings that were looked through; ``virtual`` stations of each storey."""
        panoramas = self.panoramas or _close(virtual[self.storey], self.wall)
        return find_open(
            self.storey, self.place, self.wall, wall_image(self.wall, self.points, panoramas, scene.stations)
        )

    def faces(self, structure: StructureShape, scene: Scene) -> list[Face]:
        """Its faces that were seen."""
        spaces = structure.storeys[self.storey].spaces
        return faces_of(self.wall, spaces, self.points, scene.stations, self.panoramas)


def near_walls(
    structure: StructureShape,
    scene: Scene,
    scan_folders: Sequence[Path],
    folder: Path,
    progress: Callable[[float], None],
) -> Iterator[NearWall]:
    """The walls of all storeys with what is near them, from one side of the building to the other; ``folder`` holds
    points meanwhile.
    """
    places = [(s, w) for s, storey in enumerate(structure.storeys) for w in range(len(storey.walls))]
    walls = [structure.storeys[s].walls[w] for s, w in places]
    for done, (k, points) in enumerate(points_by_wall(scan_folders, walls, folder)):
        yield NearWall(*places[k], walls[k], points, _close(scene.panoramas, walls[k]))
        progress((done + 1) / len(walls))


def virtual_stations(structure: StructureShape, scene: Scene) -> list[dict[int, Panorama]]:
    """Made-up stations of each storey, none where the scans' own positions are known."""
    return [{} if scene.panoramas else _virtual(storey, scene.surfels) for storey in structure.storeys]


def _virtual(storey: StoreyShape, surfels: Surfels) -> dict[int, Panorama]:
    """Made-up stations in a storey."""
    z = surfels.xyz[:, 2]
    return virtual_panoramas(storey, surfels.pick((z > storey.floor - 0.2) & (z < storey.top + 0.2)))


def _close(panoramas: Mapping[int, Panorama], wall: WallShape) -> dict[int, Panorama]:
    """Those of stations near enough to a wall to be asked about it."""
    if not panoramas:
        return {}
    numbers = list(panoramas)
    places = shapely.points(np.array([panoramas[n].position[:2] for n in numbers]))
    near = np.atleast_1d(shapely.distance(wall.line, places) <= REACH)
    return {n: panoramas[n] for n, is_near in zip(numbers, near, strict=True) if is_near}


def with_leaf(opening: OpeningShape, wall: WallShape, surfels: Surfels, index: PlanIndex) -> OpeningShape:
    """A door with the leaf that was seen at it; a wide opening without one is a passage. One that seems glazed and has
    a leaf that stands open is not: what hung in it was that.
    """
    if opening.kind == "window" or opening.sill > 0.0 or opening.width < NARROWEST_LEAF:
        return opening
    wall = wall.straight_at(opening.offset + opening.width / 2)
    middle = wall.place(np.array([opening.offset + opening.width / 2]))[0]
    rows = index.along(np.array([middle, middle]), 1.5 * opening.width + wall.thickness, ordered=False)
    z = surfels.xyz[rows, 2]
    points = surfels.xyz[rows[(z > wall.base) & (z < wall.top)]].astype(np.float64)
    head = opening.sill + opening.height
    leaf = find_leaf(wall, opening.offset, opening.width, head, points)
    if opening.height > TALLEST_DOOR and not opening.glazed:
        top = head - UNDER_HEAD
        if leaf is None or reach_up(wall, opening.offset, opening.width, top, leaf, points) < TALL_LEAF:
            return replace(opening, kind="passage", state="unknown")
    if leaf is not None and not (opening.glazed and leaf.angle > SWUNG):
        return replace(
            opening,
            kind="door",
            state="ajar" if leaf.angle < AJAR else "open",
            angle=round(leaf.angle, 3),
            hinge=leaf.hinge,
            swing=leaf.side,
            leaves=1 if opening.width <= WIDEST else 2,
            glazed=None,
        )
    if opening.width > WIDEST_LEAF and not opening.glazed:
        return replace(opening, kind="passage", state="unknown")
    return opening


def with_found_leaf(opening: OpeningShape, wall: WallShape, surfels: Surfels, index: PlanIndex) -> OpeningShape:
    """An open door of which no leaf was found with the one that hangs on its sides as its frame has told them since."""
    if opening.kind != "door" or opening.state != "open" or opening.angle is not None:
        return opening
    seen = with_leaf(opening, wall, surfels, index)
    return opening if seen.angle is None else seen


def without_overlaps(found: list[OpeningShape], storeys: Sequence[StoreyShape]) -> list[OpeningShape]:
    """Without the less sure of two openings that overlap in one wall; a closed leaf that nobody looked through is surer
    than rays that did not return, unless it is one of two whose other one stands open. Of those that stand side by
    side, the less sure one ends where the other begins; none goes on beyond its wall.
    """
    kept: list[OpeningShape] = []
    found = [
        o
        for o in found
        if not (
            o.state == "closed"
            and any(_surer_window(w, o, found) or _one_of_two(o, w) or _stands_open(w, o) for w in found)
        )
    ]
    for opening in sorted(found, key=lambda o: (not _shut(o), -o.confidence, o.storey, o.wall, o.offset)):
        rivals = [k for k in kept if (k.storey, k.wall) == (opening.storey, opening.wall)]
        length = storeys[opening.storey].walls[opening.wall].length
        alone = _within(_beside(opening, [k for k in rivals if _overlap(opening, k)]), length)
        fits = alone.offset > -0.01 and alone.offset + alone.width < length + 0.01
        if fits and not any(_overlap(alone, k) for k in rivals):
            kept.append(alone)
    return sorted(kept, key=lambda o: (o.storey, o.wall, o.offset))


def _beside(opening: OpeningShape, rivals: Sequence[OpeningShape]) -> OpeningShape:
    """An opening without the strips at its ends that belong to rivals."""
    low, high = opening.offset, opening.offset + opening.width
    for rival in rivals:
        start, end = rival.offset, rival.offset + rival.width
        if low < start and high - start < STRIP * opening.width:
            high = min(high, start)
        elif end < high and end - low < STRIP * opening.width:
            low = max(low, end)
    return _between(opening, low, high)


def _within(opening: OpeningShape, length: float) -> OpeningShape:
    """An opening without a strip that lies beyond its wall's end: linings lie before the walls that meet there."""
    low, high = max(opening.offset, 0.0), min(opening.offset + opening.width, length)
    return _between(opening, low, high) if high - low > (1 - STRIP) * opening.width else opening


def _between(opening: OpeningShape, low: float, high: float) -> OpeningShape:
    """An opening with its jambs at two places along its wall."""
    if (low, high) == (opening.offset, opening.offset + opening.width):
        return opening
    return replace(opening, offset=round(low, 4), width=round(high - low, 4))


def _one_of_two(leaf: OpeningShape, doorway: OpeningShape) -> bool:
    """Whether a closed leaf hangs at a jamb of a doorway that was looked through, whose other leaf was seen open."""
    if (leaf.storey, leaf.wall) != (doorway.storey, doorway.wall) or doorway.angle is None:
        return False
    ends = abs(leaf.offset - doorway.offset), abs(leaf.offset + leaf.width - doorway.offset - doorway.width)
    heads = abs(leaf.sill + leaf.height - doorway.sill - doorway.height)
    return HALF[0] < leaf.width / doorway.width < HALF[1] and max(min(ends), heads) < JAMB


def _stands_open(door: OpeningShape, closed: OpeningShape) -> bool:
    """Whether a door whose leaf was seen to stand open is in the place of a closed one that was looked through, too,
    and not through a pane in a leaf with a handle.
    """
    same = (door.storey, door.wall) == (closed.storey, closed.wall) and _overlap(door, closed)
    swung = door.angle is not None and door.angle < FLAT
    return same and swung and closed.looked_through >= LOOKED_THROUGH and closed.handle_height is None


def _surer_window(window: OpeningShape, door: OpeningShape, found: Sequence[OpeningShape]) -> bool:
    """Whether a window is in the place of a closed door, and surer by far, or has wall on all sides where rays went
    through what would be the leaf, or is one of a row of the windows ``found``.
    """
    same = (window.storey, window.wall) == (door.storey, door.wall) and _overlap(window, door)
    inner = min(window.offset + window.width, door.offset + door.width) - max(window.offset, door.offset)
    if window.kind != "window" or not same or inner < STRIP * min(window.width, door.width):
        return False
    clear = window.sides == ALL_SIDES and door.looked_through >= LOOKED_THROUGH
    return clear or window.confidence > door.confidence + SURER or _in_row(window, found)


def _in_row(window: OpeningShape, found: Sequence[OpeningShape]) -> bool:
    """Whether the wall has other windows of a window's width and height, sill by sill with it."""
    alike = (window.sill, window.width, window.height)
    row = [
        o
        for o in found
        if (o.storey, o.wall, o.kind) == (window.storey, window.wall, "window")
        and all(abs(a - b) < ALIKE for a, b in zip(alike, (o.sill, o.width, o.height), strict=True))
    ]
    return window.sill > 0.0 and len(row) > OTHERS


def _shut(opening: OpeningShape) -> bool:
    return opening.state == "closed" and opening.looked_through < LOOKED_THROUGH


def _overlap(a: OpeningShape, b: OpeningShape) -> bool:
    sideways = min(a.offset + a.width, b.offset + b.width) - max(a.offset, b.offset)
    upwards = min(a.sill + a.height, b.sill + b.height) - max(a.sill, b.sill)
    return min(sideways, upwards) > TOUCHING
