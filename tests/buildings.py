"""A hand-made building of two storeys, turned by 20 degrees, with every element and every state of doors."""

from __future__ import annotations

import math

from scan2bim.model.elements import (
    Beam,
    Building,
    Column,
    Covering,
    Dimension,
    Door,
    Evidence,
    Flight,
    Frame,
    Join,
    Opening,
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

YAW = math.radians(20)
HEIGHT = 2.6


def turned(x: float, y: float) -> Point2:
    c, s = math.cos(YAW), math.sin(YAW)
    return round(c * x - s * y, 6), round(s * x + c * y, 6)


def ring(*points: Point2) -> Ring:
    return tuple(turned(*point) for point in points)


def measured(value: float) -> Dimension:
    return Dimension(value=value, source="measured", sigma=0.002)


def assumed(value: float) -> Dimension:
    return Dimension(value=value, source="assumed")


def wall(key: str, start: Point2, end: Point2, thickness: float, base: float, joins=(), openings=(), **more) -> Wall:
    return Wall(
        id=f"wall-{key}",
        name=f"Wall {key}",
        confidence=0.9,
        evidence=Evidence(
            points=12_000, rms=0.003, coverage=0.8, faces_seen=2, scans=("s1",), sentence="Both faces seen."
        ),
        colour=(0.82, 0.79, 0.72),
        start=turned(*start),
        end=turned(*end),
        thickness=more.pop("thickness_as", measured)(thickness),
        base=base,
        height=measured(HEIGHT),
        joins=joins,
        openings=openings,
        **more,
    )


def door(key: str, offset: float, width: float = 0.9, **more) -> Opening:
    fill = Door(id=f"door-{key}", name=f"Door {key}", confidence=0.8, colour=(0.35, 0.2, 0.1), **more)
    return opening(key, offset, width, 0.0, 2.05, fill)


def window(key: str, offset: float, width: float = 1.4, sill: float = 0.9, height: float = 1.3) -> Opening:
    fill = Window(id=f"window-{key}", name=f"Window {key}", confidence=0.7)
    return opening(f"w{key}", offset, width, sill, height, fill)


def opening(key: str, offset: float, width: float, sill: float, height: float, fill: Door | Window | None) -> Opening:
    return Opening(
        id=f"opening-{key}",
        name=f"Opening {key}",
        confidence=0.85,
        offset=measured(offset),
        sill=measured(sill),
        width=measured(width),
        height=measured(height),
        fill=fill,
    )


def corner(other: str, at: str, other_at: str) -> Join:
    return Join(wall=f"wall-{other}", at=at, other_at=other_at, kind="L" if other_at != "path" else "T")


def space(key: str, name: str, outline: Ring, base: float, area: float, holes: tuple[Ring, ...] = ()) -> Space:
    return Space(
        id=f"space-{key}",
        name=name,
        confidence=0.95,
        outline=outline,
        holes=holes,
        base=base,
        height=measured(HEIGHT),
        area=area,
        volume=area * HEIGHT,
    )


def box(x0: float, y0: float, x1: float, y1: float) -> Ring:
    return ring((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def slab(key: str, top: float, use: str = "FLOOR", holes: tuple[Ring, ...] = ()) -> Slab:
    return Slab(
        id=f"slab-{key}",
        name=f"Slab {key}",
        confidence=0.9,
        colour=(0.4, 0.38, 0.35),
        outline=box(-0.15, -0.15, 10.15, 8.15),
        holes=holes,
        top=measured(top),
        thickness=assumed(0.2),
        use=use,
    )


def outer_walls(
    prefix: str, base: float, openings: dict[str, tuple[Opening, ...]], inner: tuple[Join, ...]
) -> tuple[Wall, ...]:
    corners = ((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0))
    sides = ("south", "east", "north", "west")
    return tuple(
        wall(
            f"{prefix}-{side}",
            corners[k],
            corners[(k + 1) % 4],
            0.3,
            base,
            joins=(
                corner(f"{prefix}-{sides[k - 1]}", "start", "end"),
                corner(f"{prefix}-{sides[(k + 1) % 4]}", "end", "start"),
                *(join for join in inner if join.wall.endswith("-" + side)),
            ),
            openings=openings.get(side, ()),
            external=True,
            thickness_as=assumed if side == "north" else measured,
        )
        for k, side in enumerate(sides)
    )


def ground_floor() -> Storey:
    outside = {
        "south": (door("g1", 1.0, 1.0, state="closed", hinge_side="end", swing_side="left"), window("g1", 6.8, 2.2)),
        "east": (window("g2", 3.0),),
        "north": (window("g3", 1.5), window("g4", 7.0)),
        "west": (door("g5", 5.5, 1.5, state="unknown"),),
    }
    middle = wall(
        "g-middle",
        (6.0, 0.0),
        (6.0, 8.0),
        0.12,
        0.0,
        joins=(corner("g-south", "start", "path"), corner("g-north", "end", "path")),
        openings=(
            door("g2", 1.2, state="open", angle=1.4, hinge_side="start", swing_side="right"),
            door("g3", 5.5, 1.6, state="ajar", angle=0.5, swing_side="left", operation="DOUBLE_DOOR_SINGLE_SWING"),
        ),
    )
    cross = wall(
        "g-cross",
        (0.0, 4.0),
        (6.0, 4.0),
        0.12,
        0.0,
        joins=(corner("g-west", "start", "path"), corner("g-middle", "end", "path")),
        openings=(opening("g9", 3.5, 1.2, 0.0, 2.2, None), door("g4", 1.0, state="ajar", angle=0.6)),
    )
    return Storey(
        id="storey-0",
        name="Ground floor",
        elevation=measured(0.0),
        height=measured(HEIGHT),
        walls=(*outer_walls("g", 0.0, outside, ()), middle, cross),
        spaces=(
            space("g1", "Hall", box(0.15, 0.15, 5.94, 3.94), 0.0, 5.79 * 3.79),
            space("g2", "Küche", box(0.15, 4.06, 5.94, 7.85), 0.0, 5.79 * 3.79),
            space("g3", "Living room", box(6.06, 0.15, 9.85, 7.85), 0.0, 3.79 * 7.7),
        ),
        slabs=(slab("g", 0.0, "BASESLAB"),),
        coverings=(
            Covering(
                id="covering-g",
                name="Ceiling",
                confidence=0.6,
                outline=box(0.15, 0.15, 9.85, 7.85),
                top=measured(HEIGHT + 0.02),
                thickness=assumed(0.02),
            ),
        ),
        columns=(
            Column(
                id="column-1",
                name="Column 1",
                confidence=0.9,
                outline=box(7.8, 4.0, 8.1, 4.3),
                base=0.0,
                height=measured(HEIGHT),
            ),
        ),
        stairs=(
            Stair(
                id="stair-1",
                name="Stair 1",
                confidence=0.5,
                outline=box(8.6, 5.0, 9.6, 7.8),
                base=0.0,
                height=measured(2.8),
                risers=16,
                width=measured(1.0),
            ),
        ),
    )


def upper_floor() -> Storey:
    """Three inner walls that meet in one point, and a space with a hole."""
    base = 2.8
    spokes = {"u-s": (5.0, 0.0), "u-ne": (10.0, 6.0), "u-nw": (0.0, 6.0)}
    hosts = {"u-s": "u-south", "u-ne": "u-east", "u-nw": "u-west"}
    inner = tuple(
        wall(
            key,
            (5.0, 3.5),
            end,
            0.15,
            base,
            joins=(
                *(corner(other, "start", "start") for other in spokes if other != key),
                corner(hosts[key], "end", "path"),
            ),
            openings=(door(key, 1.2, state="open", angle=1.57, hinge_side="end", swing_side="left"),),
        )
        for key, end in spokes.items()
    )
    gap = 0.1
    return Storey(
        id="storey-1",
        name="Upper floor",
        elevation=measured(base),
        walls=(
            *outer_walls("u", base, {"south": (window("u1", 1.0),), "north": (window("u2", 4.0, 2.0),)}, ()),
            *inner,
        ),
        spaces=(
            space("u1", "Room 1", ring((0.15, 0.15), (5 - gap, 0.15), (5 - gap, 3.4), (0.15, 5.8)), base, 22.0),
            space("u2", "Room 2", ring((5 + gap, 0.15), (9.85, 0.15), (9.85, 5.8), (5 + gap, 3.4)), base, 22.0),
            space(
                "u3",
                "Attic & store",
                ring((5.0, 3.65), (9.85, 6.1), (9.85, 7.85), (0.15, 7.85), (0.15, 6.1)),
                base,
                27.0,
                holes=(tuple(reversed(box(4.5, 6.0, 5.5, 7.0))),),
            ),
        ),
        slabs=(slab("u", base, holes=(tuple(reversed(box(8.6, 5.0, 9.6, 7.8))),)), slab("roof", 5.6, "ROOF")),
    )


def building() -> Building:
    return Building(
        id="building-1",
        name="Test house",
        frame=Frame(shift=(500_000.0, 5_400_000.0, 300.0), yaw=YAW, crs="EPSG:25832"),
        scans=(
            ScanSource(id="s1", name="Scan 1", file="a.e57", points=1_000_000, position=(*turned(3.0, 2.0), 1.5)),
            ScanSource(id="s2", name="Scan 2", file="b.e57", points=900_000, position=(*turned(8.0, 2.0), 1.5)),
            ScanSource(id="s3", name="Scan 3", file="c.e57", points=900_000, position=(*turned(2.0, 2.0), 4.3)),
        ),
        storeys=(ground_floor(), upper_floor()),
        notes=("The roof was not scanned.",),
    )


def special_storey() -> Storey:
    """A storey of what is seldom: walls curved, gabled, leaning, with a niche; a beam, a roof plane, a flight."""
    niche = opening("n", 1.0, 1.0, 0.5, 1.0, None).model_copy(update={"depth": measured(0.1), "side": "left"})
    straight = {"thickness": measured(0.2), "base": 0.0, "confidence": 0.9, "height": measured(2.5)}
    arched = door("c", 1.07, 1.0, state="closed", hinge_side="start", swing_side="left")
    arched = arched.model_copy(update={"height": measured(2.1)})
    curved = Wall(
        id="wall-curved", name="Curved", start=turned(2, 0), end=turned(0, 0), bulge=1.0, openings=(arched,), **straight
    )
    gable = Wall(
        id="wall-gable",
        name="Gable",
        start=turned(0, 5),
        end=turned(4, 5),
        profile=((0.0, 2.0), (2.0, 4.0), (4.0, 2.0)),
        **straight | {"height": measured(4.0)},
    )
    leaning = Wall(id="wall-leaning", name="Leaning", start=turned(0, 8), end=turned(4, 8), lean=0.1, **straight)
    holed = Wall(id="wall-niche", name="Niche", start=turned(0, 11), end=turned(4, 11), openings=(niche,), **straight)
    flight = Flight(start=turned(6, 0), end=turned(8, 0), base=0.0, height=2.7, width=measured(1.0), risers=16)
    common = {"confidence": 0.9, "base": 0.0}
    return Storey(
        id="storey-s",
        name="Special",
        elevation=measured(0.0),
        walls=(curved, gable, leaning, holed),
        beams=(
            Beam(id="beam-1", name="Beam", outline=box(6, 3, 10, 3.2), height=measured(0.3), **common | {"base": 2.2}),
        ),
        roofs=(
            RoofPlane(
                id="roof-1",
                name="Roof",
                confidence=0.9,
                outline=tuple((*turned(x, y), z) for x, y, z in ((6, 5, 2), (10, 5, 2), (10, 8, 4), (6, 8, 4))),
                thickness=measured(0.2),
            ),
        ),
        stairs=(
            Stair(
                id="stair-1",
                name="Stair",
                outline=box(6, -0.5, 8, 0.5),
                height=measured(2.7),
                flights=(flight,),
                **common,
            ),
        ),
    )
