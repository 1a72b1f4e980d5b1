"""Placing things by chance until as much of the walls is hidden as wanted."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.simulate import decor
from scan2bim.simulate.effects import World
from scan2bim.simulate.mesh import box_patches_of, build_mesh, gather
from scan2bim.simulate.scene import (
    Box,
    DoorSpec,
    Placement,
    Point2,
    Rgb,
    Scene,
    StoreySpec,
    WallSpec,
    room_outlines,
    wall_directions,
)
from scan2bim.simulate.visibility import hidden_outline, outline_places, seen_by, wall_places

F64 = NDArray[np.float64]
Rng = np.random.Generator
Piece = list[Box]

CLEAR = 0.75
"""Metres round a scanner that stay free."""
COARSE = 0.2
"""Metres between the places of walls that are asked for while things are placed."""
BESIDE = 0.12
"""Metres between a door's casing or a window and what hangs beside it."""
CLOTHES: tuple[Rgb, ...] = ((120, 40, 44), (46, 74, 110), (200, 196, 186), (60, 92, 70), (38, 40, 46))


class Sights:
    """What of a scene of one storey its stations see, kept while boxes are added."""

    def __init__(self, scene: Scene) -> None:
        storey = scene.storeys[0]
        self._storey = storey
        self._eyes: F64 = np.array([s.position for s in scene.stations], dtype=np.float64)
        self._faces, self._outlines = wall_places(storey, COARSE), outline_places(storey)
        self._points = np.concatenate([self._faces.points, self._outlines.points])
        world = World(build_mesh(replace(scene, placement=Placement())))
        self._seen = seen_by(world, self._eyes, self._points)

    def wall_hidden(self, wall: int, seen: NDArray[np.bool_] | None = None) -> float:
        """Share of a wall's inner faces that no station sees, now or for what is ``seen``."""
        return _mean(
            self._hidden(self._seen if seen is None else seen)[: len(self._faces.points)][self._faces.owner == wall]
        )

    def walls_hidden(self) -> float:
        """Mean over the walls."""
        numbers = np.unique(self._faces.owner)
        return float(np.mean([self.wall_hidden(int(n)) for n in numbers]))

    def with_boxes(self, boxes: Iterable[Box]) -> NDArray[np.bool_]:
        """What would be seen, stations by places, with more boxes."""
        patches = gather([p for box in boxes for p in box_patches_of(box, self._storey)], Placement())
        return self._seen & seen_by(World(patches), self._eyes, self._points)

    def worst_door(self, seen: NDArray[np.bool_]) -> float:
        """The greatest hidden share of a door's outline, for what is ``seen``."""
        hidden = self._hidden(seen)[len(self._faces.points) :]
        doors = sum(len(wall.doors) for wall in self._storey.walls)
        shares = [hidden_outline(self._outlines, hidden, number) for number in range(doors)]
        return max((share for share in shares if share is not None), default=0.0)

    def keep(self, seen: NDArray[np.bool_]) -> None:
        """Go on with what ``with_boxes`` gave."""
        self._seen = seen

    @staticmethod
    def _hidden(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        return np.asarray(~seen.any(axis=0))


def _mean(hidden: NDArray[np.bool_]) -> float:
    return float(hidden.mean()) if len(hidden) else 0.0


@dataclass(slots=True)
class Along:
    """Stretches of a wall's face that are taken already, for what hangs or stands at it."""

    wall: WallSpec
    side: float
    taken: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])

    @classmethod
    def of(cls, wall: WallSpec, side: float) -> Along:
        """With the wall's own doors and windows taken."""
        doors = [(d.offset - d.casing - BESIDE, d.offset + d.width + d.casing + BESIDE) for d in wall.doors]
        windows = [(w.offset - BESIDE, w.offset + w.width + BESIDE) for w in wall.windows]
        return cls(wall, side, [*doors, *windows])

    def place(self, width: float, rng: Rng, margin: float = 0.35) -> float | None:
        """The middle of a free stretch of ``width``, by chance; None where there is none."""
        low, high = margin + width / 2, self.wall.length - margin - width / 2
        for _ in range(12 if high > low else 0):
            x = float(rng.uniform(low, high))
            if all(x + width / 2 < a or x - width / 2 > b for a, b in self.taken):
                self.taken.append((x - width / 2 - 0.05, x + width / 2 + 0.05))
                return x
        return None


def hang(along: Along, number: int, rng: Rng, wall_colour: Rgb) -> list[Piece]:
    """Up to ``number`` things on a face: pictures, posters, boards, radiators, cabinets, electrical cabinets."""
    pieces: list[Piece] = []

    def add(width: float, make: Callable[[float], Piece]) -> None:
        x = along.place(width, rng)
        if x is not None:
            pieces.append(make(x))

    w, s = along.wall, along.side
    name = f"on {w.name}"
    for _ in range(number):
        kind = rng.choice(["picture", "poster", "board", "radiator", "cabinet", "electrical", "panel"])
        size = float(rng.uniform(0.45, 1.1))
        high = float(rng.uniform(0.5, 1.2))
        if kind == "picture":
            add(size, lambda x, a=size, b=high: decor.picture(f"picture {name}", w, s, x, a, b))
        elif kind == "poster":
            add(size, lambda x, a=size, b=high: decor.poster(f"poster {name}", w, s, x, a, b))
        elif kind == "board":
            add(2 * size, lambda x, a=2 * size: decor.whiteboard(f"board {name}", w, s, x, a))
        elif kind == "radiator":
            add(1.6 * size, lambda x, a=1.6 * size: decor.radiator(f"radiator {name}", w, s, x, a))
        elif kind == "cabinet":
            colour: Rgb = (190, 160, 120) if rng.random() < 0.5 else wall_colour
            tall = float(rng.choice([0.8, 1.2, 1.95]))
            add(0.9, lambda x, t=tall, c=colour: decor.cabinet(f"cabinet {name}", w, s, x, 0.9, t, c))
        else:
            full = bool(kind == "electrical")
            add(0.7, lambda x, f=full: decor.electrical_cabinet(f"electrical cabinet {name}", w, s, x, 0.7, f))
    return pieces


def stand_before(wall: WallSpec, side: float, rng: Rng, span: tuple[float, float] | None = None) -> Piece:
    """Something that stands 0.35 to 1.3 m before a face: a person, plant, screen, bench or machine.

    span: the stretch of the wall, from the start, that its middle stands before; the whole wall by default.
    """
    along, left = wall_directions(wall)
    low, high = (0.3, max(wall.length - 0.3, 0.31)) if span is None else span
    x = float(rng.uniform(low, high))
    out = wall.thickness / 2 + float(rng.uniform(0.35, 1.3))
    centre: Point2 = (
        float(wall.start[0] + along[0] * x + side * left[0] * out),
        float(wall.start[1] + along[1] * x + side * left[1] * out),
    )
    facing = math.atan2(along[1], along[0]) + (math.pi if side < 0 else 0.0)
    turned = facing + float(rng.normal(0.0, 0.3))
    kind = rng.choice(["person", "person", "plant", "screen", "bench", "machine"])
    if kind == "person":
        clothes = CLOTHES[int(rng.integers(len(CLOTHES)))]
        return decor.person("person", centre, turned, float(rng.uniform(1.55, 1.9)), clothes)
    if kind == "plant":
        return decor.plant("plant", centre, float(rng.uniform(1.0, 2.0)), int(rng.integers(1 << 30)))
    if kind == "screen":
        return decor.screen("screen", centre, turned, float(rng.uniform(0.8, 1.5)), float(rng.uniform(1.3, 1.9)))
    if kind == "bench":
        return decor.bench("bench", centre, facing, float(rng.uniform(1.0, 2.0)))
    return decor.machine("machine", centre, facing + math.pi)


def fits(scene: Scene, piece: Piece, others: list[Piece], within: shapely.geometry.base.BaseGeometry) -> bool:
    """Whether a piece stands wholly in a room, in no other piece, in no door's swing, and clear of all stations."""
    plan = shapely.union_all([box_plan(box) for box in piece])
    if not within.contains(plan):
        return False
    if any(plan.distance(shapely.Point(s.position[:2])) < CLEAR for s in scene.stations):
        return False
    return all(not plan.intersects(shapely.union_all([box_plan(box) for box in other])) for other in others)


def box_plan(box: Box) -> shapely.Polygon:
    """A box's rectangle in plan."""
    c, s = math.cos(box.yaw), math.sin(box.yaw)
    x, y = box.size[0] / 2, box.size[1] / 2
    ring = [
        (box.centre[0] + c * a - s * b, box.centre[1] + s * a + c * b) for a, b in ((-x, -y), (x, -y), (x, y), (-x, y))
    ]
    return shapely.Polygon(ring)


def open_swings(storey: StoreySpec) -> shapely.geometry.base.BaseGeometry:
    """The plan of all leaves that stand open, with room round them: nothing is to stand in them."""
    found: list[shapely.geometry.base.BaseGeometry] = []
    for wall in storey.walls:
        along, left = wall_directions(wall)
        for door in wall.doors:
            if door.leaf and door.angle > 0.0:
                found.append(_swing(wall, door, along[:2], left[:2]))
    return shapely.union_all(found)


def _swing(wall: WallSpec, door: DoorSpec, along: F64, left: F64) -> shapely.geometry.base.BaseGeometry:
    middle = np.array(wall.start) + along * (door.offset + door.width / 2)
    side = 1.0 if door.swing == "left" else -1.0
    reach = door.width / door.leaves + 0.1
    centre = middle + side * left * (wall.thickness + reach) / 2
    half = along * (door.width / 2 + reach), left * (wall.thickness + reach) / 2
    ring = [centre + a * half[0] + b * half[1] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return shapely.Polygon([tuple(p) for p in ring])


def hide(
    scene: Scene,
    sights: Sights,
    targets: dict[int, float],
    rng: Rng,
    most_of_a_door: float = 1.0,
    tries: int = 60,
    spans: dict[int, tuple[float, float]] | None = None,
) -> Scene:
    """The scene with things standing before walls, until the wanted share of each wall's inner face is hidden.

    targets: wanted share by the wall's number. most_of_a_door: no more of any door's outline is hidden. tries: for
    each wall. Where a piece would go past either it is left out; a wall may so stay below its target.
    """
    storey = scene.storeys[0]
    room = shapely.union_all(list(room_outlines(storey).values())).difference(open_swings(storey))
    fixed = [[box] for box in storey.boxes if box.base < 1.9]
    added: list[Piece] = []
    for number, target in targets.items():
        wall = storey.walls[number]
        sides = [1.0] if wall.external else [1.0, -1.0]
        for _ in range(tries):
            before = sights.wall_hidden(number)
            if before >= target - 0.005:
                break
            side = float(rng.choice(sides))
            piece = stand_before(wall, side, rng, None if spans is None else spans.get(number))
            if not fits(scene, piece, [*fixed, *added], room):
                continue
            seen = sights.with_boxes(piece)
            if sights.worst_door(seen) > most_of_a_door:
                continue
            if sights.wall_hidden(number, seen) > target + 0.03:
                continue
            sights.keep(seen)
            added.append(piece)
    boxes = (*storey.boxes, *(box for piece in added for box in piece))
    return replace(scene, storeys=(replace(storey, boxes=boxes),))
