"""The paper's hall in our own modelling: 8 x 34 m, 24 walls and 5 columns, 18 closed doors, much of it hidden.

Made after what section VI.B of the paper states: the size, the number of structural elements and doors, how many doors
each wall has and how large they are (absolute over relative error in Table I), that some are flush with their wall and
nearly of its colour, and that up to 39 % of a wall is hidden. All else is varied by the seed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scan2bim.simulate import decor
from scan2bim.simulate.clutter import Along, Rng, Sights, hang, hide
from scan2bim.simulate.scene import Box, DoorSpec, Placement, Point2, Room, Scene, Station, StoreySpec, WallSpec
from scan2bim.simulate.variation import EYE, FLOOR_COLOURS, WALL_COLOURS, dress, one_of, spread

SIZE = (34.0, 8.0)
THICKNESS = 0.2
DOORS: dict[str, tuple[float, ...]] = {
    "wall 1": (3.32,),
    "wall 2": (3.30,),
    "wall 3": (4.40,),
    "wall 4": (3.73,),
    "wall 5": (2.89, 2.87),
    "wall 6": (1.99,),
    "wall 7": (3.90,),
    "wall 8": (2.22, 2.15),
    "wall 9": (3.37, 2.92, 1.64),
    "wall 10": (2.29, 2.20),
    "wall 11": (2.29, 2.27),
    "wall 12": (3.77,),
}
"""Areas of the doors in each wall, square metres: absolute over relative error, Table I."""
DOUBLE_FROM = 1.3
"""Metres: wider doors have two leaves."""
MOST_HIDDEN = 0.39
"""Of a wall: the paper's greatest occlusion."""
MOST_OF_A_DOOR = 0.30
"""Of a door's outline: what the paper's method permits."""


def hall(seed: int) -> Scene:
    """A variant of the hall with stations; the same seed gives the same scene."""
    rng = np.random.default_rng([seed, 8, 34])
    colour = one_of(WALL_COLOURS, rng)
    walls = tuple(_walls(rng, colour))
    columns = _columns(rng, colour)
    storey = StoreySpec(
        "ground floor",
        walls,
        (Room("hall", (SIZE[0] / 2, SIZE[1] / 2), one_of(FLOOR_COLOURS, rng)),),
        height=float(rng.uniform(2.7, 3.3)),
        boxes=(*columns, *(box for wall in walls for box in _hung(wall, rng, colour))),
    )
    turned = Placement(float(rng.uniform(-0.7, 0.7)), (float(rng.uniform(-20, 20)), float(rng.uniform(-20, 20)), 0.0))
    scene = Scene(f"hall {seed}", (storey,), _stations(rng, columns), turned)
    return hide(scene, Sights(scene), _targets(walls, rng), rng, MOST_OF_A_DOOR)


def _walls(rng: Rng, colour: tuple[int, int, int]) -> list[WallSpec]:
    """The ring of walls, counter-clockwise, the hall on their left; parallel stretches get the named walls' doors."""
    singles = [name for name, areas in DOORS.items() if len(areas) == 1]
    doubles = [name for name, areas in DOORS.items() if len(areas) > 1]
    south, north = list(rng.permutation(singles)), list(rng.permutation(doubles))
    doors = {name: _doors(name, rng) for name in DOORS}
    ring: list[tuple[Point2, str]] = []
    ring += _side(south, doors, rng, 0.0, 1.0)
    ring += [((SIZE[0] - x, SIZE[1] - y), name) for (x, y), name in _side(north, doors, rng, 0.0, 1.0)]
    points = [point for point, _ in ring]
    skirting = 0.08 if rng.random() < 0.6 else 0.0
    hard = set(map(str, rng.choice(list(DOORS), 3, replace=False)))
    walls: list[WallSpec] = []
    for i, (start, name) in enumerate(ring):
        end = points[(i + 1) % len(points)]
        wall = WallSpec(name or f"side {i}", start, end, THICKNESS, True, (), (), colour, colour, "paint", skirting)
        mine = [dress(d, colour, THICKNESS, rng, hard=name in hard) for d in doors.get(name, [])]
        sides = ["left" if d.recess < 0.06 or rng.random() < 0.5 else "right" for d in mine]
        mine = [replace(d, swing=side) for d, side in zip(mine, sides, strict=True)]
        starts = spread(wall, [d.width for d in mine], rng) if mine else []
        walls.append(replace(wall, doors=tuple(replace(d, offset=x) for d, x in zip(mine, starts, strict=True))))
    return walls


def _side(
    names: list[str], doors: dict[str, list[DoorSpec]], rng: Rng, y: float, depth: float
) -> list[tuple[Point2, str]]:
    """Starts of the walls along one long side, from x = 0: stretches at y and ``depth`` further in by turns."""
    need = np.array([sum(d.width for d in doors[n]) + 0.5 * (len(doors[n]) + 1) + 0.5 for n in names])
    share = rng.uniform(0.5, 1.5, len(names))
    lengths = need + (SIZE[0] - need.sum()) * share / share.sum()
    edges = np.concatenate([[0.0], np.cumsum(lengths)])
    out: list[tuple[Point2, str]] = []
    for i, name in enumerate(names):
        inset = float(rng.uniform(0.35, depth)) if i % 2 else y
        if i % 2:
            out.append(((float(edges[i]), y), ""))
        out.append(((float(edges[i]), inset), str(name)))
        if i % 2:
            out.append(((float(edges[i + 1]), inset), ""))
    out.append(((SIZE[0], y), ""))
    return out


def _doors(name: str, rng: Rng) -> list[DoorSpec]:
    found: list[DoorSpec] = []
    for i, area in enumerate(DOORS[name]):
        height = float(rng.uniform(2.0, 2.2))
        width = area * float(rng.uniform(0.96, 1.04)) / height
        leaves = 2 if width > DOUBLE_FROM else 1
        found.append(DoorSpec(f"{name} door {i + 1}", 0.0, width, height, leaves=leaves))
    return found


def _columns(rng: Rng, colour: tuple[int, int, int]) -> list[Box]:
    """Five, in a row or two along the hall."""
    places = np.linspace(4.0, SIZE[0] - 4.0, 5) + rng.uniform(-0.8, 0.8, 5)
    rows = rng.uniform(2.4, SIZE[1] - 2.4, 5)
    size = float(rng.uniform(0.35, 0.5))
    return [
        Box(f"column {i + 1}", (float(x), float(y)), (size, size, 3.4), colour=colour, finish="paint")
        for i, (x, y) in enumerate(zip(places, rows, strict=True))
    ]


def _hung(wall: WallSpec, rng: Rng, colour: tuple[int, int, int]) -> list[Box]:
    pieces = hang(Along.of(wall, 1.0), int(rng.integers(0, 4)), rng, colour)
    if rng.random() < 0.1 and wall.length > 3.0 and not wall.doors:
        pieces.append(decor.curtain("curtain", wall, 1.0, wall.length / 2, 1.2, 0.05, 2.4))
    return [box for piece in pieces for box in piece]


def _stations(rng: Rng, columns: list[Box]) -> tuple[Station, ...]:
    """Six along the hall, each clear of the columns."""
    return tuple(
        Station(f"station_{i + 1}", (*_clear(float(x), columns, rng), EYE), float(rng.uniform(0, 6.28)))
        for i, x in enumerate(np.linspace(3.0, SIZE[0] - 3.0, 6))
    )


def _clear(x: float, columns: list[Box], rng: Rng) -> Point2:
    """A place near x along the hall, at least a metre from all columns; the last of 50 tries where none is."""
    place: Point2 = (x, SIZE[1] / 2)
    for _ in range(50):
        place = (x + float(rng.uniform(-0.9, 0.9)), float(rng.uniform(2.4, SIZE[1] - 2.4)))
        if all(max(abs(place[0] - c.centre[0]), abs(place[1] - c.centre[1])) > 1.0 for c in columns):
            break
    return place


def _targets(walls: tuple[WallSpec, ...], rng: Rng) -> dict[int, float]:
    """The hidden share wanted of each wall with doors: two near the paper's greatest, the others from 5 to 25 %."""
    hosts = [i for i, wall in enumerate(walls) if wall.doors]
    worst = rng.choice(hosts, 2, replace=False)
    return {i: MOST_HIDDEN - 0.03 if i in worst else float(rng.uniform(0.05, 0.25)) for i in hosts}
