"""The paper's office in our own modelling: 27 x 21 m, 5 adjacent rooms, 66 wall faces, 6 doors, 9 windows, 14 % hidden.

Made after what section VI.A of the paper states. The rooms' sizes, what stands in which place, the doors' states and
all colours are varied by the seed.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scan2bim.simulate import decor, furniture
from scan2bim.simulate.clutter import Along, Rng, Sights, hang, hide
from scan2bim.simulate.scene import (
    Box,
    DoorSpec,
    Placement,
    Point2,
    Rgb,
    Room,
    Scene,
    Station,
    StoreySpec,
    WallSpec,
    wall_directions,
)
from scan2bim.simulate.variation import EYE, FLOOR_COLOURS, WALL_COLOURS, dress, one_of, spread, window

SIZE = (27.0, 21.0)
OUTER, INNER = 0.3, 0.15
MEAN_HIDDEN = 0.14
"""Of the walls: the paper's mean occlusion."""
MOST_OF_A_DOOR = 0.30
"""Of a door's outline: what the paper's method permits."""
OPENINGS = {"south": 2, "south-east": 1, "east": 2, "north": 3, "west": 1}
"""Windows in the outer walls: nine."""
PILASTERS = 11
"""On the walls; each adds four wall faces, so that with the rooms' own 24 there are some 66."""


def office(seed: int) -> Scene:
    """A variant of the office with stations; the same seed gives the same scene."""
    rng = np.random.default_rng([seed, 27, 21])
    colours = {name: one_of(WALL_COLOURS, rng) for name in "ABCDE"}
    plan = _Plan(rng)
    walls = tuple(_furnish(wall, rng) for wall in _walls(plan, colours))
    rooms = tuple(Room(f"room {n}", p, one_of(FLOOR_COLOURS, rng)) for n, p in plan.rooms().items())
    taken = {(w.name, side): Along.of(w, side) for w in walls for side in (1.0, -1.0)}
    boxes = [*_pilasters(walls, taken, rng), *_hung(walls, taken, rng), *_tables(plan, rng)]
    storey = StoreySpec("ground floor", walls, rooms, height=float(rng.uniform(2.6, 3.0)), boxes=tuple(boxes))
    turned = Placement(float(rng.uniform(-0.7, 0.7)), (float(rng.uniform(-20, 20)), float(rng.uniform(-20, 20)), 0.0))
    scene = Scene(f"office {seed}", (storey,), _stations(plan, rng), turned)
    sights = Sights(scene)
    # Standing things bring the mean to the wanted share; what hangs and stands already counts.
    missing = max(MEAN_HIDDEN - sights.walls_hidden(), 0.0)
    targets = {i: sights.wall_hidden(i) + missing * float(rng.uniform(0.6, 1.4)) for i in range(len(walls))}
    return hide(scene, sights, targets, rng, MOST_OF_A_DOOR)


class _Plan:
    """Where the rooms meet: A, B, C in a row along the south, D and E, both L-shaped, along the north."""

    def __init__(self, rng: Rng) -> None:
        self.ab = float(rng.uniform(8.0, 10.5))
        self.bc = self.ab + float(rng.uniform(7.0, 9.0))
        self.middle = float(rng.uniform(9.0, 11.5))
        self.de = float(rng.uniform(self.ab + 2.0, self.bc - 3.2))
        self.step = self.de + float(rng.uniform(2.2, 3.2))
        self.turn = self.middle + float(rng.uniform(4.0, 6.0))

    def rooms(self) -> dict[str, Point2]:
        """A place in each room, in its largest part."""
        width, depth = SIZE
        return {
            "A": (self.ab / 2, self.middle / 2),
            "B": ((self.ab + self.bc) / 2, self.middle / 2),
            "C": ((self.bc + width) / 2, self.middle / 2),
            "D": (self.de / 2, (self.middle + depth) / 2),
            "E": ((self.step + width) / 2, (self.middle + depth) / 2),
        }

    def areas(self) -> dict[str, tuple[float, float, float, float]]:
        """The rectangle of the largest part of each room: x0, y0, x1, y1."""
        width, depth = SIZE
        return {
            "A": (0.0, 0.0, self.ab, self.middle),
            "B": (self.ab, 0.0, self.bc, self.middle),
            "C": (self.bc, 0.0, width, self.middle),
            "D": (0.0, self.middle, self.de, depth),
            "E": (self.step, self.middle, width, depth),
        }


def _walls(plan: _Plan, colours: dict[str, Rgb]) -> list[WallSpec]:
    width, depth = SIZE
    a, b, m, d, s, t = plan.ab, plan.bc, plan.middle, plan.de, plan.step, plan.turn

    def outer(name: str, start: Point2, end: Point2, room: str) -> WallSpec:
        return WallSpec(name, start, end, OUTER, True, left_colour=colours[room], right_colour=(188, 172, 150))

    def inner(name: str, start: Point2, end: Point2, rooms: str, doors: int) -> WallSpec:
        found = tuple(DoorSpec(f"door {rooms[0]}-{rooms[1]}", 0.0) for _ in range(doors))
        left, right = colours[rooms[0]], colours[rooms[1]]
        return WallSpec(name, start, end, INNER, False, found, left_colour=left, right_colour=right)

    return [
        outer("south", (0.0, 0.0), (b, 0.0), "A"),
        outer("south-east", (b, 0.0), (width, 0.0), "C"),
        outer("east", (width, 0.0), (width, depth), "E"),
        outer("north", (width, depth), (0.0, depth), "D"),
        outer("west", (0.0, depth), (0.0, 0.0), "D"),
        inner("wall A-B", (a, 0.0), (a, m), "AB", 1),
        inner("wall B-C", (b, 0.0), (b, m), "BC", 1),
        inner("wall D-A", (0.0, m), (a, m), "DA", 1),
        inner("wall D-B", (a, m), (d, m), "DB", 1),
        inner("wall E-B", (d, m), (b, m), "EB", 0),
        inner("wall E-C", (b, m), (width, m), "EC", 1),
        inner("wall D-E 1", (d, m), (d, t), "DE", 1),
        inner("wall D-E 2", (d, t), (s, t), "DE", 0),
        inner("wall D-E 3", (s, t), (s, depth), "DE", 0),
    ]


def _furnish(wall: WallSpec, rng: Rng) -> WallSpec:
    """The wall with its doors and windows as they look, placed, and with its finish."""
    doors = [_door(door, wall, rng) for door in wall.doors]
    windows = [window(f"window {wall.name} {i + 1}", rng) for i in range(OPENINGS.get(wall.name, 0))]
    found = [*doors, *windows]
    margin = 0.6 if wall.length > 4.0 else 0.3
    places = _apart_from_joints(wall, [o.width for o in found], rng, margin)
    return replace(
        wall,
        doors=tuple(replace(d, offset=x) for d, x in zip(doors, places, strict=False)),
        windows=tuple(replace(w, offset=x) for w, x in zip(windows, places[len(doors) :], strict=True)),
        finish="paint",
        skirting=0.08,
    )


def _apart_from_joints(wall: WallSpec, widths: list[float], rng: Rng, margin: float) -> list[float]:
    """Places along a wall; in long outer walls spread over its parts, so that none meets an inner wall's end."""
    if not widths:
        return []
    if wall.name == "north" and len(widths) == 3:
        # From the east: E's part, then D's.
        return [2.0 + float(rng.uniform(0, 1)), wall.length - 8.0, wall.length - 4.0]
    if wall.name == "east":
        return [3.0 + float(rng.uniform(0, 2)), wall.length - 5.0 - float(rng.uniform(0, 1))]
    if wall.name == "south":
        return [2.0 + float(rng.uniform(0, 2)), wall.length - 4.5 - float(rng.uniform(0, 0.4))]
    if wall.name == "west":
        return [3.0 + float(rng.uniform(0, 2))]
    return spread(wall, widths, rng, margin)


def _door(door: DoorSpec, wall: WallSpec, rng: Rng) -> DoorSpec:
    """One door in two stands open, by 60 to 110 degrees."""
    sized = replace(door, width=float(rng.uniform(0.8, 1.02)), height=float(rng.uniform(2.0, 2.15)))
    dressed = dress(sized, wall.left_colour, wall.thickness, rng, hard=rng.random() < 0.15)
    swing = "left" if rng.random() < 0.5 else "right"
    angle = math.radians(float(rng.uniform(60, 110))) if rng.random() < 0.5 else 0.0
    recess = 0.0 if angle > 0.0 else dressed.recess
    return replace(dressed, swing=swing, angle=angle, recess=recess)


def _pilasters(walls: tuple[WallSpec, ...], taken: dict[tuple[str, float], Along], rng: Rng) -> list[Box]:
    """Full-height projections on walls, away from openings."""
    boxes: list[Box] = []
    for _ in range(20 * PILASTERS):
        if len(boxes) == PILASTERS:
            break
        wall = walls[int(rng.integers(len(walls)))]
        side = 1.0 if wall.external or rng.random() < 0.5 else -1.0
        along = taken[wall.name, side]
        x = along.place(0.4, rng, margin=0.8)
        if x is None or _meets_another(wall, x, walls):
            continue
        colour = wall.left_colour if side > 0 else wall.right_colour
        size = (0.4, float(rng.uniform(0.12, 0.3)), 3.0)
        boxes.append(decor.mounted(f"pilaster {len(boxes) + 1}", wall, side, (x, 0.0), size, colour, "paint"))
    return boxes


def _meets_another(wall: WallSpec, x: float, walls: tuple[WallSpec, ...], clear: float = 0.8) -> bool:
    """Whether another wall ends on this one near x."""
    along, _ = wall_directions(wall)
    point = np.array(wall.start) + along[:2] * x
    ends = [end for other in walls if other is not wall for end in (other.start, other.end)]
    return any(math.dist(point, end) < clear for end in ends)


def _hung(walls: tuple[WallSpec, ...], taken: dict[tuple[str, float], Along], rng: Rng) -> list[Box]:
    boxes: list[Box] = []
    for wall in walls:
        for side in (1.0,) if wall.external else (1.0, -1.0):
            along = taken[wall.name, side]
            along.taken += [(x - 0.5, x + 0.5) for x in _joints(wall, walls)]
            colour = wall.left_colour if side > 0 else wall.right_colour
            number = int(rng.integers(0, 2 + int(wall.length / 6)))
            boxes += [box for piece in hang(along, number, rng, colour) for box in piece]
        for w in wall.windows:
            if rng.random() < 0.5:
                share = float(rng.uniform(0.15, 0.35)) * w.width
                x = w.offset + (share / 2 if rng.random() < 0.5 else w.width - share / 2)
                boxes += decor.curtain(f"curtain {w.name}", wall, 1.0, x, share, 0.1, w.sill + w.height + 0.15)
    return boxes


def _joints(wall: WallSpec, walls: tuple[WallSpec, ...]) -> list[float]:
    """Where other walls end on this one, along it."""
    along, left = wall_directions(wall)
    out: list[float] = []
    for other in walls:
        for end in (other.start, other.end):
            local = np.array(end) - np.array(wall.start)
            if other is not wall and abs(float(local @ left[:2])) < 1e-6:
                out.append(float(local @ along[:2]))
    return out


def _tables(plan: _Plan, rng: Rng) -> list[Box]:
    """Desks and shelves inside the rooms, away from walls and from where the scanner stands."""
    boxes: list[Box] = []
    for name, (x0, y0, x1, y1) in plan.areas().items():
        for fx, fy in ((0.28, 0.3), (0.72, 0.3), (0.28, 0.72), (0.72, 0.72)):
            if rng.random() < 0.7:
                place = (x0 + (x1 - x0) * fx, y0 + (y1 - y0) * fy)
                yaw = float(rng.choice([0.0, math.pi / 2, math.pi]))
                boxes += furniture.table(f"desk {name}", place, yaw, 1.6, 0.8)
                boxes += decor.bench(f"chair {name}", (place[0], place[1] + 0.75), 0.0, 0.5)
    return boxes


def _stations(plan: _Plan, rng: Rng) -> tuple[Station, ...]:
    """Two in each room, in its middle third, and one in the narrow part of each L."""
    found: list[Point2] = []
    for x0, y0, x1, y1 in plan.areas().values():
        for fx in (0.36, 0.64) if x1 - x0 > y1 - y0 else (0.5, 0.5):
            fy = 0.5 if x1 - x0 > y1 - y0 else (0.36 if len(found) % 2 == 0 else 0.64)
            jitter = rng.uniform(-0.4, 0.4, 2)
            found.append((x0 + (x1 - x0) * fx + float(jitter[0]), y0 + (y1 - y0) * fy + float(jitter[1])))
    found.append(((plan.de + plan.step) / 2 + 1.0, (plan.middle + plan.turn) / 2))
    found.append(((plan.de + plan.step) / 2, (plan.turn + SIZE[1]) / 2))
    return tuple(Station(f"station_{i + 1}", (*p, EYE), float(rng.uniform(0, 6.28))) for i, p in enumerate(found))
