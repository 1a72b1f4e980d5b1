"""The structure stage: storeys, wall faces, spaces and walls, from the merged surfels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon

from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.scene import Scene, load_scene
from scan2bim.cloud.surfels import PLAN
from scan2bim.config import StructureSettings
from scan2bim.errors import PrecheckError
from scan2bim.geometry.polygons import largest_part, polygons_of
from scan2bim.structure.arcs import Bend, bent_to, find_bends
from scan2bim.structure.axes import Axis, AxisJoin
from scan2bim.structure.beams import beam_of, find_beams, without_beams
from scan2bim.structure.evidence import FaceEvidence
from scan2bim.structure.faces import BAND, Face, find_faces, main_direction
from scan2bim.structure.flooring import Flooring, flooring_of, split_at_floors
from scan2bim.structure.hanging import without_hanging
from scan2bim.structure.orientation import in_survey
from scan2bim.structure.overlaps import Bodies, clear_of, up_to
from scan2bim.structure.panes import as_glass, with_panes
from scan2bim.structure.pillars import column_of, find_pillars, without_pillars, without_posts
from scan2bim.structure.plan import Plan, pixels_in, plan_of
from scan2bim.structure.portals import Lintel, split_at_portals, under_lintel
from scan2bim.structure.precision import wall_sigmas
from scan2bim.structure.reveals import outer_thickness, reveal_depths
from scan2bim.structure.risers import without_risers
from scan2bim.structure.roofs import LEVEL, Slope, crown_of, find_roofs, roof_of, upper_edge
from scan2bim.structure.shapes import (
    BeamShape,
    ColumnShape,
    JoinShape,
    Ring,
    SpaceShape,
    StairShape,
    StoreyShape,
    StructureShape,
    WallShape,
    ring_of,
)
from scan2bim.structure.soffits import soffits_of
from scan2bim.structure.spaces import find_spaces
from scan2bim.structure.stairs import FoundStair, find_stairs
from scan2bim.structure.storeys import StoreyLevels, find_storeys, layers_of, other_floors
from scan2bim.structure.thicknesses import OneFaced, StoreyFaces, one_faced, sole_faces
from scan2bim.structure.walls import find_walls
from scan2bim.structure.wells import wells_of, without_stairs, without_wells

DEEPEST = 5.0
"""Depth, metres, under a storey's floor down to which one looks for what is seen through its wells: the floor below."""
LEAST_CEILING = 0.2
"""Share of a space under which a ceiling must have been seen to give it a height: less are shelves and lintels."""
LEAST_FLOOR = 0.01
"""Share of a space's floor that must have been seen: in each space somebody stood, or looked into it."""
PODIUM, LEVEL_STEP = 1.2, 0.02
"""Metres up to which a floor can be raised over the storey's, and steps in which its height is told."""
LEAST_RAISED = 0.3
"""Share of a space on which a raised floor must have been seen: more than tables and beds."""
LEAST_LEVEL = 1.0
"""Square metres of level ceiling beside roof planes from which on they have a height of their own."""
F64 = NDArray[np.float64]


def find_structure(
    surfel_folder: Path,
    scan_folders: Sequence[Path],
    folder: Path,
    settings: StructureSettings,
    progress: Callable[[float], None],
) -> None:
    """Find the building's structure and write it to ``folder``/structure.json."""
    scene = load_scene(surfel_folder, scan_folders)
    progress(0.1)
    structure = in_survey(structure_of(scene.in_lattice(), settings, progress), scene.lattice)
    structure.save(folder / "structure.json")


def structure_of(scene: Scene, settings: StructureSettings, progress: Callable[[float], None]) -> StructureShape:
    """Storeys, each with its spaces and walls, in the scene's own coordinates."""
    layers = layers_of(scene.surfels, scene.stations)
    levels = find_storeys(scene.surfels, layers, scene.stations)
    if not levels:
        raise PrecheckError(
            "No floor was found: no flat surface of 3 m2 or more with 1.5 m of clear height above it. Expected scans "
            "of a building's inside in metres with z up; check --unit and --up, and what `scan2bim info` says of the "
            "files."
        )
    lost = other_floors(scene.surfels, layers, levels)
    doubtful = layers_of(scene.doubtful, scene.stations)
    steps = {number: panorama.step for number, panorama in scene.panoramas.items()}
    faces: list[Face] = []
    depths: list[float] = []
    seen: list[StoreyFaces] = []
    rooms: list[Rooms] = []
    stairs: list[FoundStair] = []
    for number, level in enumerate(levels):
        low, high = level.floor - DEEPEST, level.top + 0.2
        near = [p for p in scene.panoramas.values() if level.floor - 0.5 < p.position[2] < level.top + 0.5]
        slab = layers.between(scene.surfels, low, high)
        plan = plan_of(level, scene.surfels, slab, scene.stations, steps)
        walls = without_hanging(find_faces(plan), plan)
        below, main = stairs, main_direction(walls)
        above = levels[number + 1].floor if number + 1 < len(levels) else None
        stairs = find_stairs(plan, above, scene.surfels, slab, main)
        pillars = find_pillars(plan, main, [s.outline for s in (*below, *stairs)])
        beams = find_beams(plan, main, pillars)
        members = tuple(column_of(p, plan) for p in pillars), tuple(beam_of(b, plan) for b in beams)
        if pillars or beams:
            plan = without_pillars(without_beams(plan, beams), pillars)
            walls = without_hanging(find_faces(plan), plan)
        spirals = [s.outline for s in (*below, *stairs) if s.kind == "spiral"]
        walls = without_risers(walls, stairs, plan.columns)
        found = [as_glass(f, plan, near) for f in without_posts(walls, spirals)]
        behind = doubtful.between(scene.doubtful, low, high)
        plan, panes = with_panes(plan, found, scene.doubtful, behind, scene.stations)
        wells = wells_of(below, plan)
        flooring = flooring_of(plan.grid, scene.surfels, slab)
        room = _rooms(plan, flooring, found, panes, near, wells, stairs, *members)
        rooms.append(room if number + 1 < len(levels) else _under_roof(room, plan))
        faces += found
        last = rooms[-1]
        axes = find_walls(last.polygons, last.cuts, panes=last.panes, bends=last.bends)[0]
        depths += reveal_depths(plan, axes)
        sole = sole_faces(axes, last.polygons, level.floor, plan.levels.ceiling or plan.levels.top, near)
        seen.append(StoreyFaces(last.polygons, axes, sole))
        progress(0.1 + 0.9 * (number + 1) / len(levels))
    soles = one_faced(seen, outer_thickness(depths))
    storeys = [_storey(r, sole) for r, sole in zip(rooms, soles, strict=True)]
    notes = _notes([r.levels for r in rooms], storeys, scene, lost)
    return StructureShape(tuple(storeys), main_direction(faces), notes)


def _notes(
    levels: Sequence[StoreyLevels],
    storeys: Sequence[StoreyShape],
    scene: Scene,
    lost: Sequence[tuple[float, float]],
) -> tuple[str, ...]:
    """Remarks for people; ``lost`` are (height, area) of floors that belong to no storey."""
    notes: list[str] = []
    for height, area in lost:
        number = int(np.argmin([abs(height - level.floor) for level in levels]))
        rise = height - levels[number].floor
        where = f"{abs(rise):.2f} m {'over' if rise > 0 else 'under'} that of storey {number}"
        notes.append(f"{area:.0f} m2 of floor were seen {where}: half storeys are not made, its spaces are missing.")
    if not scene.panoramas:
        notes.append("No scanner positions are known: what was looked through cannot be told from what was never seen.")
    for number, (level, storey) in enumerate(zip(levels, storeys, strict=True)):
        if level.ceiling is None:
            notes.append(f"Storey {number}: no ceiling was seen; heights end where the scan ends.")
        if level.sigma is None:
            notes.append(
                f"Storey {number}: stations stand over the ceiling below, but its floor was not seen; its height is "
                "assumed."
            )
        elif not storey.spaces:
            notes.append(f"Storey {number}: its floor was seen but no space closes round it.")
    return tuple(notes)


@dataclass(frozen=True, slots=True, eq=False)
class Rooms:
    """The spaces of one storey, the virtual borders between them, and what speaks for its walls; no rasters.

    ``crown`` is the height (z) of the ridge or of the ceiling under it.

    ``polygons`` are those of the spaces, then those of the wells in the floor, which bound walls, too.
    """

    levels: StoreyLevels
    polygons: list[Polygon]
    spaces: tuple[SpaceShape, ...]
    cuts: list[LineString]
    panes: list[LineString]
    evidence: FaceEvidence
    stairs: tuple[StairShape, ...]
    wells: tuple[Ring, ...]
    columns: tuple[ColumnShape, ...]
    beams: tuple[BeamShape, ...]
    bends: tuple[Bend, ...] = ()
    roofs: tuple[Slope, ...] = ()
    crown: float = 0.0


def _under_roof(rooms: Rooms, plan: Plan) -> Rooms:
    """The topmost storey with its roof planes, its spaces' ceilings being what is level beside them."""
    crown = crown_of(plan, rooms.polygons)
    roofs = tuple(find_roofs(plan, rooms.polygons, crown))
    spaces = tuple(_level_ceiling(s, roofs, plan) for s in rooms.spaces)
    return replace(rooms, spaces=spaces, roofs=roofs, crown=crown)


def _level_ceiling(space: SpaceShape, roofs: Sequence[Slope], plan: Plan) -> SpaceShape:
    """A space with the height of its ceiling beside roof planes, or of the highest of those if it has little beside."""
    over = [r for r in roofs if r.outline.intersects(space.polygon)]
    if not over:
        return space
    beside = space.polygon.difference(shapely.union_all([r.outline for r in over]).buffer(0.1))
    parts = [p for p in polygons_of(beside) if p.area > PLAN**2]
    heights = [plan.ceiling_z[pixels_in(p, plan)] for p in parts]
    level = np.concatenate([h[np.isfinite(h)] for h in heights] or [np.zeros(0, np.float32)])
    if len(level) * PLAN**2 > LEAST_LEVEL:
        return replace(space, ceiling=round(float(np.median(level)), 4))
    top = max(float(r.height(shapely.get_coordinates(r.outline.intersection(space.polygon))).max()) for r in over)
    return replace(space, ceiling=round(top, 4))


def _rooms(
    plan: Plan,
    flooring: Flooring,
    walls: Sequence[Face],
    panes: Sequence[Face],
    panoramas: Sequence[Panorama],
    wells: Sequence[Polygon],
    stairs: Sequence[FoundStair],
    columns: tuple[ColumnShape, ...],
    beams: tuple[BeamShape, ...],
) -> Rooms:
    found, lintels = find_spaces(plan, [*walls, *panes], panoramas)
    bends = find_bends(plan, walls)
    cuts: list[LineString] = []
    rooms: list[Polygon] = []
    open_parts: list[Polygon] = []
    bare = without_stairs(wells, stairs)
    for space in (s for s in found if has_floor(s, plan)):
        parts, below, borders = parts_and_wells(space, bare, partial(under_lintel, plan=plan))
        laid = [split_at_floors(part, flooring) for part in parts]
        open_parts += below
        rooms += [bent_to(p, bends) for pieces, _ in laid for p in pieces]
        cuts += [*borders, *(border for _, changes in laid for border in changes)]
    return Rooms(
        plan.levels,
        [*rooms, *open_parts],
        tuple(_space(p, plan) for p in rooms),
        cuts,
        [LineString(f.ends()) for f in [*walls, *panes] if f.glass],
        FaceEvidence(plan.columns, [LineString(f.ends()) for f in lintels]),
        tuple(_stair(s) for s in stairs),
        tuple(ring_of(shapely.get_coordinates(w.exterior)) for w in wells),
        columns,
        beams,
        tuple(bends),
    )


def parts_and_wells(
    space: Polygon, wells: Sequence[Polygon], lintel: Lintel
) -> tuple[list[Polygon], list[Polygon], list[LineString]]:
    """The parts of a space between portals, the wells in their floors, and the borders between all of them.

    ``lintel`` tells whether a lintel hangs over a line.
    """
    parts, portals = split_at_portals(space, lintel, wells)
    rooms: list[Polygon] = []
    below: list[Polygon] = []
    borders = list(portals)
    for part in parts:
        rest, holes, rims = without_wells(part, wells)
        rooms, below, borders = [*rooms, *rest], [*below, *holes], [*borders, *rims]
    return rooms, below, borders


def has_floor(space: Polygon, plan: Plan) -> bool:
    """Whether any of a space's floor was seen, if any of the storey's was: else it is the upper part of a high room.

    Also a raised floor is one, if it is level on much of the space.
    """
    inside = pixels_in(space, plan)
    height = plan.standing_z[inside] - np.float32(plan.levels.floor)
    on_podium = height[(height > 0) & (height < PODIUM)]
    same = np.convolve(np.bincount((on_podium / LEVEL_STEP).astype(np.int64), minlength=3), np.ones(3))
    raised = float(same.max()) > LEAST_RAISED * np.count_nonzero(inside)
    return plan.levels.sigma is None or raised or bool((plan.floor | plan.things)[inside].mean() > LEAST_FLOOR)


def _stair(stair: FoundStair) -> StairShape:
    climb = (round(float(stair.climb[0]), 4), round(float(stair.climb[1]), 4))
    ring = ring_of(shapely.get_coordinates(stair.outline.exterior))
    base, top, width = round(stair.base, 4), round(stair.top, 4), round(stair.width, 3)
    return StairShape(ring, base, top, stair.kind, climb, width, stair.risers)


def _storey(rooms: Rooms, sole: OneFaced) -> StoreyShape:
    seen = rooms.evidence.seen_share
    axes, joins = find_walls(rooms.polygons, rooms.cuts, sole, rooms.panes, seen, rooms.bends)
    spaces = frozenset(range(len(rooms.spaces)))
    walls = tuple(
        _wall(number, replace(axis, left=axis.left & spaces, right=axis.right & spaces), joins, rooms)
        for number, axis in enumerate(axes)
    )
    bodies, outlines = Bodies.of(axes), [space.polygon for space in rooms.spaces]
    clear = tuple(_clear(space, bodies, outlines[:k] + outlines[k + 1 :]) for k, space in enumerate(rooms.spaces))
    clear = tuple(_under_slopes(space, rooms.roofs) for space in clear)
    level = rooms.levels
    heights = level.floor, level.sigma, level.ceiling, level.top
    return StoreyShape(
        *heights, clear, walls, rooms.stairs, rooms.wells, rooms.columns, rooms.beams, tuple(map(roof_of, rooms.roofs))
    )


def _clear(space: SpaceShape, walls: Bodies, others: Sequence[Polygon]) -> SpaceShape:
    whole = space.polygon
    rest = clear_of(up_to(whole, walls, others), walls)
    if rest is whole and Polygon(space.outline, space.holes).is_valid:
        return space
    rest = largest_part(shapely.set_precision(rest, 1e-4), rest)
    outline, *holes = (ring_of(shapely.get_coordinates(ring)) for ring in (rest.exterior, *rest.interiors))
    return replace(space, outline=outline, holes=tuple(holes))


def _under_slopes(space: SpaceShape, roofs: Sequence[Slope]) -> SpaceShape:
    """A space with the pieces of roof planes over it, as high as the highest of them."""
    soffits = soffits_of(space.polygon, roofs, space.ceiling) if roofs and space.ceiling is not None else ()
    return replace(space, soffits=soffits, ceiling=max(z for s in soffits for _, _, z in s)) if soffits else space


def _space(polygon: Polygon, plan: Plan) -> SpaceShape:
    inside = pixels_in(polygon, plan)
    heights = plan.ceiling_z[inside]
    heights = heights[np.isfinite(heights)]
    return SpaceShape(
        ring_of(shapely.get_coordinates(polygon.exterior)),
        tuple(ring_of(shapely.get_coordinates(r)) for r in polygon.interiors),
        round(plan.levels.floor, 4),
        round(float(np.median(heights)), 4) if len(heights) > LEAST_CEILING * inside.sum() else None,
        round(float(plan.floor[inside].mean()), 3) if inside.any() else 0.0,
        round(float(plan.ceiling[inside].mean()), 3) if inside.any() else 0.0,
    )


def _wall(number: int, axis: Axis, joins: Sequence[AxisJoin], rooms: Rooms) -> WallShape:
    levels, evidence = rooms.levels, rooms.evidence
    beside = [rooms.spaces[s] for s in (*axis.left, *axis.right)]
    ceilings = [s.ceiling for s in beside if s.ceiling is not None]
    top = max(ceilings, default=levels.ceiling if levels.ceiling is not None else levels.top)
    ends = axis.start + axis.inset, axis.end + axis.inset
    edge = () if axis.bulge else upper_edge(*ends, rooms.roofs, levels.floor, rooms.crown)
    top = levels.floor + max(h for _, h in edge) if edge else top
    at, along, distance = evidence.on_faces(axis)
    position_sigma, thickness_sigma = wall_sigmas(along, distance, axis.length)
    columns = evidence.columns
    rms = float(np.sqrt(np.average(distance**2, weights=columns.bins[at]))) if len(at) else BAND
    colour = np.median(columns.rgb[at], axis=0) if len(at) else np.full(3, 200.0)
    stations = np.unique(columns.station[at])
    start, end = ring_of(np.array([axis.start, axis.end]))
    return WallShape(
        start,
        end,
        round(axis.thickness, 4),
        round(thickness_sigma or max(0.001, rms), 4) if axis.measured else axis.sigma,
        round(levels.floor, 4),
        round(top, 4),
        bool(ceilings),
        tuple(sorted(axis.left)),
        tuple(sorted(axis.right)),
        round(rms, 4),
        int(columns.points[at].sum()),
        round(evidence.seen_share(axis), 3),
        2 if axis.measured else 1,
        tuple(int(s) for s in stations),
        (int(colour[0]), int(colour[1]), int(colour[2])),
        tuple(
            JoinShape(j.other, j.at, j.other_at, "T" if j.other_at == "path" else "L") for j in joins if j.one == number
        ),
        edge if edge and np.ptp([h for _, h in edge]) > LEVEL else (),
        round(axis.bulge, 6),
        None if position_sigma is None else round(position_sigma, 4),
    )
