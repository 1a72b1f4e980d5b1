"""Furniture as boxes. Each function gives the parts of one piece, standing at ``centre`` in plan, turned by ``yaw``.

At yaw 0 a piece looks along -y: its back is at +y. Metres, of usual sizes.
"""

from __future__ import annotations

import math

from scan2bim.simulate.scene import WOOD, Box, Point2, Point3, Rgb

TEXTILE: Rgb = (88, 104, 128)
LINEN: Rgb = (214, 208, 196)
DARK: Rgb = (70, 58, 50)
PAPER: Rgb = (176, 72, 60)


def part(name: str, centre: Point2, yaw: float, at: Point3, size: Point3, colour: Rgb, finish: str = "plain") -> Box:
    """A box whose own centre lies at ``at`` (x, y of its centre, z of its underside) in the piece's own axes."""
    c, s = math.cos(yaw), math.sin(yaw)
    place = (centre[0] + c * at[0] - s * at[1], centre[1] + s * at[0] + c * at[1])
    return Box(name, place, size, base=at[2], yaw=yaw, colour=colour, finish=finish)


def wardrobe(name: str, centre: Point2, yaw: float = 0.0, width: float = 1.6, colour: Rgb = LINEN) -> tuple[Box, ...]:
    """A closed wardrobe, 2.1 m high, with two doors proud of its front: the piece most like a door in a wall."""
    half = width / 2
    doors = [((-1) ** i * half / 2, -0.3) for i in range(2)]
    body = part(name, centre, yaw, (0.0, 0.0, 0.0), (width, 0.58, 2.1), colour)
    return (body, *(part(name, centre, yaw, (x, y, 0.06), (half - 0.01, 0.02, 2.0), colour) for x, y in doors))


def table(name: str, centre: Point2, yaw: float = 0.0, length: float = 1.5, depth: float = 0.8) -> tuple[Box, ...]:
    """A table with four legs, 0.74 m high."""
    x, y = length / 2 - 0.05, depth / 2 - 0.05
    legs = [(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]
    top = part(name, centre, yaw, (0.0, 0.0, 0.71), (length, depth, 0.03), WOOD)
    return (top, *(part(name, centre, yaw, (a, b, 0.0), (0.06, 0.06, 0.71), WOOD) for a, b in legs))


def sofa(name: str, centre: Point2, yaw: float = 0.0, length: float = 2.0) -> tuple[Box, ...]:
    """A sofa: seat, back and arms."""
    arm = length / 2 - 0.09
    return (
        part(name, centre, yaw, (0.0, -0.08, 0.0), (length - 0.36, 0.72, 0.42), TEXTILE),
        part(name, centre, yaw, (0.0, 0.34, 0.0), (length, 0.18, 0.82), TEXTILE),
        *(part(name, centre, yaw, (side * arm, -0.09, 0.0), (0.18, 0.7, 0.6), TEXTILE) for side in (-1, 1)),
    )


def shelves(name: str, centre: Point2, yaw: float = 0.0, width: float = 0.9, height: float = 1.9) -> tuple[Box, ...]:
    """An open bookcase with five boards and some books."""
    levels = [i * (height - 0.03) / 4 for i in range(5)]
    sides = [part(name, centre, yaw, (s * (width / 2 - 0.01), 0.0, 0.0), (0.02, 0.3, height), WOOD) for s in (-1, 1)]
    boards = [part(name, centre, yaw, (0.0, 0.0, z), (width - 0.04, 0.3, 0.03), WOOD) for z in levels]
    books = [part(name, centre, yaw, (-0.1, 0.03, z + 0.03), (width - 0.3, 0.2, 0.24), PAPER) for z in levels[:4]]
    return (*sides, *boards, *books)


def bed(name: str, centre: Point2, yaw: float = 0.0, width: float = 1.6) -> tuple[Box, ...]:
    """A double bed, its head at +y."""
    return (
        part(name, centre, yaw, (0.0, 0.0, 0.0), (width, 2.0, 0.3), DARK),
        part(name, centre, yaw, (0.0, 0.0, 0.3), (width - 0.06, 1.96, 0.2), LINEN),
        part(name, centre, yaw, (0.0, 1.03, 0.0), (width, 0.06, 1.0), DARK),
    )


def kitchen_row(name: str, centre: Point2, yaw: float = 0.0, length: float = 2.4) -> tuple[Box, ...]:
    """Floor cupboards under a worktop, and wall cupboards."""
    return (
        part(name, centre, yaw, (0.0, 0.0, 0.1), (length, 0.58, 0.77), LINEN),
        part(name, centre, yaw, (0.0, 0.0, 0.87), (length, 0.6, 0.04), DARK),
        part(name, centre, yaw, (0.0, 0.12, 1.45), (length, 0.34, 0.7), LINEN),
    )


def stair(
    name: str, start: Point2, yaw: float, width: float, rise: float, risers: int, going: float
) -> tuple[Box, ...]:
    """A straight flight of ``risers`` solid steps from ``start`` (middle of the lowest edge) upwards along ``yaw``."""
    step = rise / risers
    treads = range(risers - 1)
    return tuple(
        part(name, start, yaw, ((i + 0.5) * going, 0.0, 0.0), (going, width, (i + 1) * step), (168, 150, 128))
        for i in treads
    )
