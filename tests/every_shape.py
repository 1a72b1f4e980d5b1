"""A hand-made building with every shape that the model can hold: ``from every_shape import every_shape``.

Ground floor: a hall with a curved front, open to a kitchen, a store under a slanted wall. Upper floor: gable walls and
roof planes. Between them a stair of two flights with a landing.
"""

from __future__ import annotations

import numpy as np
import shapely
from buildings import assumed, corner, door, measured, opening, wall, window

from scan2bim.geometry.arcs import Arc
from scan2bim.model.elements import (
    Beam,
    Building,
    Column,
    Covering,
    Door,
    Evidence,
    FaceView,
    Flight,
    Frame,
    OpenSide,
    Point2,
    Ring,
    RoofPlane,
    ScanSource,
    Slab,
    Space,
    Stair,
    Storey,
    Wall,
    Window,
)

HEIGHT = 2.6
SEEN = (
    FaceView(side="left", area=12.5, seen=0.8, occluded=0.15, unseen=0.05, points=8000, rms=0.003),
    FaceView(side="right", seen=0.0, occluded=0.0, unseen=1.0),
)


def straight(key: str, start: Point2, end: Point2, thickness: float = 0.24, base: float = 0.0, **more) -> Wall:
    """A wall that is not turned by the test house's yaw."""
    evidence = Evidence(points=9000, rms=0.004, coverage=0.7, faces_seen=1, faces=SEEN, position_sigma=0.002)
    made = wall(key, start, end, thickness, base, **more)
    return made.model_copy(update={"start": start, "end": end, "evidence": evidence})


def box(x0: float, y0: float, x1: float, y1: float) -> Ring:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def room(
    key: str, name: str, outline: Ring, base: float, open_sides: tuple[OpenSide, ...] = (), height: float = HEIGHT
) -> Space:
    area = shapely.Polygon(outline).area
    return Space(
        id=f"room-{key}",
        name=name,
        confidence=0.9,
        outline=outline,
        base=base,
        height=measured(height),
        area=area,
        volume=area * height,
        open_sides=open_sides,
    )


def niche(key: str, offset: float, side: str) -> object:
    made = opening(f"niche-{key}", offset, 0.6, 0.9, 1.0, None)
    return made.model_copy(update={"depth": measured(0.12), "side": side})


def measured_door() -> Door:
    return Door(
        id="door-measured",
        name="Measured door",
        confidence=0.9,
        state="closed",
        hinge_side="start",
        swing_side="left",
        operation="SINGLE_SWING_LEFT",
        leaves=1,
        glazed=False,
        leaf_thickness=measured(0.045),
        recess=measured(0.06),
        recess_side="left",
        handle_height=measured(1.05),
        threshold=measured(0.02),
        lining_depth=measured(0.1),
        lining_thickness=measured(0.06),
    )


def measured_window() -> Window:
    return Window(
        id="window-measured",
        name="Measured window",
        confidence=0.9,
        partitioning="DOUBLE_PANEL_VERTICAL",
        frame_thickness=measured(0.09),
        recess=measured(0.15),
        recess_side="right",
    )


def ground_walls() -> tuple[Wall, ...]:
    """Counter-clockwise about 8 x 6 m: the south front is an arc, the west wall leans."""
    south = straight(
        "south", (0.0, 0.0), (8.0, 0.0), bulge=0.2, external=True,
        joins=(corner("west", "start", "end"), corner("east", "end", "start")),
        openings=(window("arc", 3.0, 1.4), niche("arc", 6.0, "left")),
        left_spaces=("room-hall", "room-kitchen"),
    )  # fmt: skip
    east = straight(
        "east", (8.0, 0.0), (8.0, 6.0), 0.36, external=True,
        joins=(corner("south", "start", "end"), corner("north", "end", "start")),
        openings=(opening("mw", 2.0, 1.5, 0.9, 1.2, measured_window()),), left_spaces=("room-kitchen",),
    )  # fmt: skip
    north = straight(
        "north", (8.0, 6.0), (0.0, 6.0), 0.36, external=True,
        joins=(corner("east", "start", "end"), corner("west", "end", "start")),
        openings=(
            door("entrance", 1.0, 1.6, state="closed", leaves=2),
            niche("back", 4.0, "left"),
            window("twin", 6.0, 1.2),
        ),
        left_spaces=("room-hall", "room-kitchen", "room-store"),
    )  # fmt: skip
    west = straight(
        "west", (0.0, 6.0), (0.0, 0.0), lean=0.12, external=True,
        joins=(corner("north", "start", "end"), corner("south", "end", "start")),
        openings=(window("lean", 1.5, 1.0),), left_spaces=("room-store",),
    )  # fmt: skip
    inner = straight(
        "inner", (2.5, front(2.5)), (2.5, 6.0), 0.12, use="PARTITIONING",
        joins=(corner("south", "start", "path"), corner("north", "end", "path")),
        openings=(opening("md", 3.8, 0.9, 0.0, 2.1, measured_door()), opening("pass", 2.3, 0.8, 0.0, 2.0, None)),
        left_spaces=("room-store",), right_spaces=("room-hall",),
    )  # fmt: skip
    counter = straight("counter", (5.5, 5.82), (5.5, 4.0), 0.1, use="PARAPET").model_copy(
        update={"height": measured(1.1), "left_spaces": ("room-kitchen",), "right_spaces": ("room-hall",)}
    )
    return south, east, north, west, inner, counter


def front(x: float) -> float:
    """Y of the south wall's arc at a place along its chord."""
    arc = Arc(8.0, 0.2)
    return float(arc.place(np.array(arc.nearest(x, -0.7)), np.array(0.0))[1])


def behind_front(outline: Ring) -> Ring:
    """The part of an outline that lies on the inner side of the curved wall, counter-clockwise."""
    arc = Arc(8.0, 0.2)
    inner = arc.place(np.linspace(0.0, arc.length, 41), np.full(41, 0.12))
    inside = shapely.Polygon([*inner.tolist(), (9.0, 0.0), (9.0, 7.0), (-1.0, 7.0), (-1.0, 0.0)])
    room = shapely.orient_polygons(shapely.Polygon(outline).intersection(inside))
    return tuple((round(x, 6), round(y, 6)) for x, y in list(room.exterior.coords)[:-1])


def ground_rooms() -> tuple[Space, ...]:
    """The hall is open to the kitchen from the curved wall to the counter."""
    low = behind_front(((5.5, -1.0), (6.0, -1.0), (6.0, 4.0), (5.5, 4.0)))
    foot = min(y for x, y in low if x == 5.5)
    kitchen = OpenSide(start=(5.5, foot), end=(5.5, 4.0), to="room-kitchen")
    hall = OpenSide(start=(5.5, 4.0), end=(5.5, foot), to="room-hall")
    return (
        room("store", "Store", behind_front(box(0.12, -1.0, 2.44, 5.82)), 0.0),
        room("hall", "Hall",
             behind_front(((2.56, -1.0), (5.5, -1.0), (5.5, 4.0), (5.45, 4.0), (5.45, 5.82), (2.56, 5.82))), 0.0,
             (kitchen,)),
        room("kitchen", "Kitchen",
             behind_front(((5.5, -1.0), (7.82, -1.0), (7.82, 5.82), (5.55, 5.82), (5.55, 4.0), (5.5, 4.0))), 0.0,
             (hall,)),
    )  # fmt: skip


def stair() -> Stair:
    return Stair(
        id="stair", name="Stair", confidence=0.8, outline=box(2.6, 1.0, 4.9, 3.2), base=0.0, height=measured(2.8),
        shape="unknown", risers=16, width=measured(1.0),
        flights=(
            Flight(start=(2.6, 1.5), end=(4.0, 1.5), base=0.0, height=1.4, width=measured(1.0), risers=8),
            Flight(start=(4.0, 2.7), end=(2.6, 2.7), base=1.4, height=1.4, width=measured(1.0), risers=8),
        ),
    )  # fmt: skip


def gable(key: str, start: Point2, end: Point2, ring: tuple[Point2, ...], neighbours: tuple[str, str]) -> Wall:
    before, after = neighbours
    made = straight(
        key, start, end, 0.3, 2.8, external=True,
        joins=(corner(before, "start", "end"), corner(after, "end", "start")), left_spaces=("room-attic",),
    )  # fmt: skip
    return made.model_copy(update={"profile": ring, "height": measured(max(z for _, z in ring))})


def upper_floor() -> Storey:
    """Gables in the east and west; the north wall steps down, which no gable does."""
    south = straight(
        "u-south", (0.0, 0.0), (8.0, 0.0), 0.3, 2.8, external=True, openings=(window("u", 3.0, 1.2, 0.4, 0.8),),
        joins=(corner("u-west", "start", "end"), corner("u-east", "end", "start")), left_spaces=("room-attic",),
    ).model_copy(update={"height": measured(1.4)})  # fmt: skip
    peak = ((0.0, 1.4), (3.0, 3.6), (6.0, 1.4))
    steps = ((0.0, 1.4), (3.0, 1.4), (4.0, 0.9), (8.0, 1.4))
    walls = (
        south,
        gable("u-east", (8.0, 0.0), (8.0, 6.0), peak, ("u-south", "u-north")),
        gable("u-north", (8.0, 6.0), (0.0, 6.0), steps, ("u-east", "u-west")),
        gable("u-west", (0.0, 6.0), (0.0, 0.0), peak, ("u-north", "u-south")),
    )
    low, ridge = 2.8 + 1.4, 2.8 + 3.6
    planes = (
        ((0.0, 0.0, low), (8.0, 0.0, low), (8.0, 3.0, ridge), (0.0, 3.0, ridge)),
        ((0.0, 3.0, ridge), (8.0, 3.0, ridge), (8.0, 6.0, low), (0.0, 6.0, low)),
    )
    return Storey(
        id="upper",
        name="Upper floor",
        elevation=measured(2.8),
        walls=walls,
        spaces=(room("attic", "Attic", box(0.15, 0.15, 7.85, 5.85), 2.8, height=1.39),),
        slabs=(plate(Slab, "upper", 2.8, 0.2, holes=(tuple(reversed(box(2.6, 1.0, 4.9, 3.2))),)),),
        roofs=tuple(
            RoofPlane(id=f"plane-{i}", name=f"Plane {i}", confidence=0.7, outline=outline, thickness=assumed(0.25))
            for i, outline in enumerate(planes)
        ),
    )


def plate(kind: type, key: str, top: float, thickness: float, **more):
    return kind(
        id=f"plate-{key}",
        name=f"Plate {key}",
        confidence=0.8,
        outline=more.pop("outline", ((-0.2, -1.2), (4.0, -1.2), (8.2, -1.2), (8.2, 6.2), (-0.2, 6.2), (-0.2, 0.0))),
        top=measured(top),
        thickness=assumed(thickness),
        **more,
    )


def every_shape() -> Building:
    ground = Storey(
        id="ground",
        name="Ground floor",
        elevation=measured(0.0),
        height=measured(HEIGHT),
        walls=ground_walls(),
        spaces=ground_rooms(),
        slabs=(plate(Slab, "ground", 0.0, 0.25, use="BASESLAB"),),
        coverings=(plate(Covering, "store", HEIGHT + 0.02, 0.02, outline=box(0.12, 0.12, 2.44, 5.82)),),
        columns=(
            Column(
                id="post", name="Post", confidence=0.8, outline=box(6.5, 1.5, 6.8, 1.9), base=0.0,
                height=measured(HEIGHT),
            ),
        ),
        beams=(
            Beam(
                id="beam", name="Beam", confidence=0.8, outline=box(5.4, 0.1, 5.6, 4.0), base=2.3, height=measured(0.3)
            ),
        ),
        stairs=(stair(),),
    )  # fmt: skip
    return Building(
        id="every-shape",
        name="Every shape",
        frame=Frame(shift=(500_000.0, 5_400_000.0, 300.0), crs="25832"),
        scans=(ScanSource(id="s1", name="Scan 1", file="a.e57", points=1_000_000, position=(3.0, 2.0, 1.5)),),
        storeys=(ground, upper_floor()),
    )
