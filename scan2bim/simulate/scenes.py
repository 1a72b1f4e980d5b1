"""Ready scenes: what tests and samples are made of."""

from __future__ import annotations

import math

from scan2bim.simulate import furniture
from scan2bim.simulate.scene import (
    DoorSpec,
    Placement,
    Rgb,
    Room,
    Scene,
    Shaft,
    Station,
    StoreySpec,
    WallSpec,
    WindowSpec,
)

EYE = 1.55
"""Height of a scanner on its tripod above the floor, metres."""
OUTER = 0.3
PARQUET: Rgb = (178, 138, 94)
TILES: Rgb = (168, 172, 176)
SAGE: Rgb = (196, 206, 188)
SAND: Rgb = (224, 208, 178)


def _outer(
    points: list[tuple[float, float]], openings: dict[int, tuple[tuple[DoorSpec, ...], tuple[WindowSpec, ...]]]
) -> tuple[WallSpec, ...]:
    """Outer walls along a counter-clockwise ring of axis points, the inside on their left; openings by wall number."""
    walls: list[WallSpec] = []
    for i, (a, b) in enumerate(zip(points, points[1:] + points[:1], strict=True)):
        doors, windows = openings.get(i, ((), ()))
        walls.append(WallSpec(f"outer wall {i + 1}", a, b, OUTER, True, doors, windows, right_colour=(188, 172, 150)))
    return tuple(walls)


def two_rooms(yaw: float = 0.0) -> Scene:
    """Two rooms of 4 x 4 m side by side, an open door between them, a closed one outside, a window each; 2 stations."""
    entrance = DoorSpec("entrance", offset=0.8, width=1.01, height=2.13, recess=0.1, swing="left")
    south = ((entrance,), (WindowSpec("east window", offset=5.6),))
    north = ((), (WindowSpec("west window", offset=5.6),))
    walls = (
        *_outer([(0.0, 0.0), (8.4, 0.0), (8.4, 4.3), (0.0, 4.3)], {0: south, 2: north}),
        WallSpec(
            "middle wall",
            (4.2, 0.0),
            (4.2, 4.3),
            0.1,
            doors=(DoorSpec("middle door", offset=1.5, angle=math.radians(95)),),
        ),
    )
    rooms = (Room("west room", (2.0, 2.0), PARQUET), Room("east room", (6.0, 2.0), TILES))
    boxes = (*furniture.table("table", (2.0, 3.2)), *furniture.shelves("shelves", (7.6, 3.98), width=0.9))
    stations = (Station("west", (2.2, 1.9, EYE), 0.3), Station("east", (6.3, 2.1, EYE), 2.1))
    return Scene("two rooms", (StoreySpec("ground floor", walls, rooms, boxes=boxes),), stations, Placement(yaw))


def l_shaped(yaw: float = 0.0) -> Scene:
    """An L of three rooms, one of them L-shaped itself, joined by a passage and an ajar door; 4 stations."""
    ring = [(0.0, 0.0), (9.0, 0.0), (9.0, 4.0), (4.5, 4.0), (4.5, 8.0), (0.0, 8.0)]
    openings = {
        0: (
            (DoorSpec("entrance", offset=3.4, width=1.01, height=2.13, recess=0.08),),
            (WindowSpec("south window", offset=6.6),),
        ),
        5: ((), (WindowSpec("west window", offset=5.0), WindowSpec("north-west window", offset=1.5))),
    }
    passage = DoorSpec("passage", offset=1.4, width=1.2, height=2.1, leaf=False, casing=0.0)
    ajar = DoorSpec("north door", offset=0.6, width=0.76, angle=math.radians(25), hinge="end", swing="right")
    walls = (
        *_outer(ring, openings),
        WallSpec("passage wall", (5.8, 0.0), (5.8, 4.0), 0.115, doors=(passage,)),
        WallSpec("north wall", (0.0, 5.2), (4.5, 5.2), 0.1, doors=(ajar,)),
    )
    rooms = (
        Room("hall", (2.0, 2.0), PARQUET),
        Room("east room", (7.5, 2.0), TILES),
        Room("north room", (2.0, 6.5), PARQUET),
    )
    boxes = (*furniture.sofa("sofa", (1.1, 2.0), yaw=math.pi / 2), *furniture.bed("bed", (3.2, 6.72)))
    points = [(3.0, 2.5), (4.6, 1.6), (7.6, 1.9), (1.5, 6.4)]
    stations = tuple(Station(f"station {i + 1}", (*p, EYE), 0.7 * i) for i, p in enumerate(points))
    return Scene("L-shaped", (StoreySpec("ground floor", walls, rooms, boxes=boxes),), stations, Placement(yaw))


def two_storeys(yaw: float = 0.0) -> Scene:
    """Two storeys of 3 m, a straight stair through an opening in the slab; below two rooms, above three; 6 stations."""
    ring = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.6), (0.0, 5.6)]
    low_openings = {
        0: (
            (DoorSpec("entrance", offset=1.0, width=1.01, height=2.13, recess=0.1),),
            (WindowSpec("kitchen window", offset=5.4),),
        ),
        2: ((), (WindowSpec("hall window", offset=4.9),)),
    }
    high_openings = {0: ((), (WindowSpec("south window", offset=1.4), WindowSpec("south-east window", offset=5.6)))}
    kitchen = DoorSpec("kitchen door", offset=0.7, angle=math.radians(90), swing="right")
    low = (*_outer(ring, low_openings), WallSpec("kitchen wall", (4.6, 0.0), (4.6, 5.6), 0.12, doors=(kitchen,)))
    east = DoorSpec("east door", offset=1.2, angle=math.radians(80), swing="left")
    west = DoorSpec("west door", offset=2.9, recess=0.03, swing="right")
    high = (
        *_outer(ring, high_openings),
        WallSpec("landing wall", (0.0, 3.0), (4.6, 3.0), 0.1, doors=(west,)),
        WallSpec("upper east wall", (4.6, 5.6), (4.6, 0.0), 0.12, doors=(east,)),
    )
    low_rooms = (Room("hall", (2.0, 2.0), TILES), Room("kitchen", (6.0, 2.0), TILES))
    high_rooms = (
        Room("landing", (3.0, 3.4), PARQUET),
        Room("bedroom", (2.0, 1.5), PARQUET),
        Room("study", (6.0, 2.0), PARQUET),
    )
    steps = furniture.stair("stair", (0.25, 4.85), 0.0, width=0.9, rise=2.75, risers=15, going=0.25)
    storeys = (
        StoreySpec("ground floor", low, low_rooms, boxes=(*steps, *furniture.kitchen_row("kitchen row", (6.2, 5.14)))),
        StoreySpec(
            "upper floor", high, high_rooms, elevation=2.75, slab=0.25, shafts=(Shaft((0.15, 4.35), (3.75, 5.45)),)
        ),
    )
    points = [(2.2, 2.0, 0.0), (1.2, 3.4, 0.0), (6.2, 2.4, 0.0), (3.6, 3.7, 2.75), (2.0, 1.5, 2.75), (6.2, 2.8, 2.75)]
    stations = tuple(Station(f"station {i + 1}", (x, y, z + EYE), 0.9 * i) for i, (x, y, z) in enumerate(points))
    return Scene("two storeys", storeys, stations, Placement(yaw))


def rotated_flat(yaw: float = math.radians(23.7)) -> Scene:
    """A furnished flat of five rooms and a corridor, turned against the coordinate axes; 7 stations."""
    walls = (*_flat_outer(), *_flat_inner())
    rooms = (
        Room("corridor", (5.0, 4.2), TILES),
        Room("living room", (2.0, 1.5), PARQUET),
        Room("kitchen", (8.5, 1.5), TILES),
        Room("bedroom", (2.0, 6.4), PARQUET),
        Room("bathroom", (5.4, 6.4), TILES),
        Room("study", (8.6, 6.4), PARQUET),
    )
    points = [(1.6, 4.25), (8.4, 4.2), (2.6, 1.9), (8.3, 1.9), (2.6, 6.0), (5.4, 6.2), (8.2, 6.2)]
    stations = tuple(Station(f"station_{i + 1}", (*p, EYE), 0.8 * i) for i, p in enumerate(points))
    storey = StoreySpec("ground floor", walls, rooms, height=2.52, boxes=_flat_furniture())
    return Scene("flat", (storey,), stations, Placement(yaw, (4.0, -3.0, 0.0)))


def _flat_outer() -> tuple[WallSpec, ...]:
    entrance = DoorSpec("entrance", 3.49, width=1.01, height=2.13, recess=0.12, hinge="end", colour=(96, 66, 48))
    south = (
        WindowSpec("living room window 1", 0.9, width=1.5, mullions=1),
        WindowSpec("living room window 2", 3.7, width=1.5, mullions=1),
        WindowSpec("kitchen window", 8.0, sill=1.05, height=1.15),
    )
    east = (WindowSpec("study window", 6.0, width=1.2),)
    north = (
        WindowSpec("bathroom window", 4.9, sill=1.5, width=0.6, height=0.65),
        WindowSpec("bedroom window", 7.6, width=1.5),
    )
    ring = [(0.0, 0.0), (10.6, 0.0), (10.6, 8.2), (0.0, 8.2)]
    return _outer(ring, {0: ((), south), 1: ((), east), 2: ((), north), 3: ((entrance,), ())})


def _flat_inner() -> tuple[WallSpec, ...]:
    south = (
        DoorSpec("living room door", 2.0, angle=math.radians(97), hinge="start", swing="right"),
        DoorSpec("kitchen door", 7.6, angle=math.radians(62), hinge="end", swing="right"),
    )
    north = (
        DoorSpec("bedroom door", 2.7, hinge="start", swing="left", colour=(232, 230, 224)),
        DoorSpec("bathroom door", 5.0, width=0.76, hinge="end", swing="right", colour=(232, 230, 224)),
        DoorSpec("study door", 7.3, angle=math.radians(112), hinge="start", swing="left"),
    )
    passage = DoorSpec("passage", 1.9, width=1.2, height=2.1, leaf=False, casing=0.0)
    cupboard = DoorSpec("bathroom side door", 1.6, width=0.76, angle=math.radians(22), hinge="start", swing="left")
    return (
        WallSpec("corridor south wall", (0.0, 3.5), (10.6, 3.5), 0.12, doors=south, right_colour=SAND),
        WallSpec("corridor north wall", (0.0, 4.95), (10.6, 4.95), 0.12, doors=north, left_colour=SAGE),
        WallSpec("kitchen wall", (6.2, 0.0), (6.2, 3.5), 0.1, doors=(passage,), left_colour=SAND),
        WallSpec("bedroom wall", (4.3, 4.95), (4.3, 8.2), 0.1, left_colour=SAGE),
        WallSpec("study wall", (6.6, 4.95), (6.6, 8.2), 0.1, doors=(cupboard,), left_colour=SAGE),
    )


def _flat_furniture() -> tuple[furniture.Box, ...]:
    return (
        *furniture.sofa("sofa", (3.4, 0.62), yaw=math.pi),
        *furniture.table("dining table", (5.0, 2.2), yaw=math.pi / 2),
        *furniture.shelves("bookcase", (0.3, 2.2), yaw=math.pi / 2, width=1.2),
        *furniture.kitchen_row("kitchen row", (10.15, 1.7), yaw=-math.pi / 2),
        *furniture.bed("bed", (1.3, 7.02)),
        *furniture.wardrobe("wardrobe", (3.2, 7.76)),
        *furniture.table("desk", (9.6, 7.6), length=1.4, depth=0.7),
        *furniture.shelves("study shelves", (7.1, 7.9)),
        *furniture.table("washstand", (4.75, 7.7), length=0.7, depth=0.5),
        *furniture.wardrobe("corridor wardrobe", (6.55, 3.87), yaw=math.pi, width=1.2),
    )
