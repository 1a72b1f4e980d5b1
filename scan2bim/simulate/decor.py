"""What hangs on walls and stands about in offices and halls. Each function gives the boxes of one piece, metres."""

from __future__ import annotations

import math

import numpy as np

from scan2bim.simulate.furniture import DARK, part
from scan2bim.simulate.scene import Box, Point2, Rgb, WallSpec, wall_directions

STEEL: Rgb = (176, 178, 180)
BOARD: Rgb = (236, 238, 238)
LEAVES: Rgb = (64, 104, 52)
SKIN: Rgb = (206, 160, 134)


def mounted(
    name: str,
    wall: WallSpec,
    side: float,
    at: Point2,
    size: tuple[float, float, float],
    colour: Rgb,
    finish: str = "plain",
    off: float = 0.0,
) -> Box:
    """A box on a wall's left (``side`` 1) or right (-1) face.

    at: x of its middle along the wall, z of its underside; size: width, depth, height; off: its distance from the face.
    """
    along, left = wall_directions(wall)
    out = side * (wall.thickness / 2 + off + size[1] / 2)
    x, y = (wall.start[i] + along[i] * at[0] + left[i] * out for i in (0, 1))
    return Box(name, (float(x), float(y)), size, at[1], math.atan2(along[1], along[0]), colour, finish)


def picture(name: str, wall: WallSpec, side: float, x: float, width: float, height: float) -> list[Box]:
    """A framed picture with its middle at eye level."""
    z = 1.55 - height / 2
    frame = mounted(name, wall, side, (x, z), (width, 0.02, height), DARK)
    inner = (width - 0.06, 0.004, height - 0.06)
    return [frame, mounted(name, wall, side, (x, z + 0.03), inner, BOARD, "print", off=0.02)]


def poster(name: str, wall: WallSpec, side: float, x: float, width: float, height: float) -> list[Box]:
    """A poster or sign: paper on the wall."""
    return [mounted(name, wall, side, (x, 1.5 - height / 2), (width, 0.003, height), BOARD, "print")]


def whiteboard(name: str, wall: WallSpec, side: float, x: float, width: float) -> list[Box]:
    """A glossy board with a frame and a tray."""
    board = mounted(name, wall, side, (x, 0.9), (width, 0.02, 1.1), BOARD, "metal")
    return [board, mounted(name, wall, side, (x, 0.87), (width, 0.08, 0.03), STEEL)]


def radiator(name: str, wall: WallSpec, side: float, x: float, width: float) -> list[Box]:
    """A plate radiator with ribs."""
    body = mounted(name, wall, side, (x, 0.12), (width, 0.06, 0.6), BOARD, off=0.04)
    ribs = np.arange(-width / 2 + 0.05, width / 2, 0.1)
    return [
        body,
        *(mounted(name, wall, side, (x + r, 0.15), (0.03, 0.02, 0.54), BOARD, off=0.1) for r in map(float, ribs)),
    ]


def electrical_cabinet(name: str, wall: WallSpec, side: float, x: float, width: float, full: bool) -> list[Box]:
    """A steel cabinet with a door leaf and a handle: on the floor and as high as a door, or at breast height."""
    z, height, depth = (0.0, 2.05, 0.04) if full else (0.85, 0.9, 0.16)
    body = mounted(name, wall, side, (x, z), (width, depth, height), STEEL, "metal")
    leaf = (width - 0.03, 0.012, height - 0.03)
    door = mounted(name, wall, side, (x, z + 0.015), leaf, (190, 192, 194), off=depth)
    handle = mounted(name, wall, side, (x + 0.4 * width, z + 0.5 * height), (0.03, 0.03, 0.12), DARK, off=depth)
    return [body, door, handle]


def cabinet(name: str, wall: WallSpec, side: float, x: float, width: float, height: float, colour: Rgb) -> list[Box]:
    """A cupboard with two doors against the wall."""
    body = mounted(name, wall, side, (x, 0.0), (width, 0.42, height), colour, "wood", off=0.02)
    leaf = (width / 2 - 0.004, 0.018, height - 0.06)
    return [
        body,
        *(mounted(name, wall, side, (x + s * width / 4, 0.05), leaf, colour, "wood", off=0.44) for s in (-1, 1)),
    ]


def curtain(name: str, wall: WallSpec, side: float, x: float, width: float, low: float, high: float) -> list[Box]:
    """A hanging in upright folds, 8 cm before the wall."""
    fold = 0.06
    count = max(int(width / fold), 1)
    places = [x - width / 2 + fold * (i + 0.5) for i in range(count)]
    colour = (150, 138, 120)
    return [
        mounted(name, wall, side, (p, low), (fold, 0.012, high - low), colour, "cloth", off=0.08 + 0.03 * (i % 2))
        for i, p in enumerate(places)
    ]


def person(name: str, centre: Point2, yaw: float, height: float, colour: Rgb) -> list[Box]:
    """Somebody standing: legs, trunk, arms, head."""
    scale = height / 1.75
    body = [
        ((-0.1, 0.0, 0.0), (0.14, 0.18, 0.85), (52, 54, 66)),
        ((0.1, 0.0, 0.0), (0.14, 0.18, 0.85), (52, 54, 66)),
        ((0.0, 0.0, 0.85), (0.38, 0.22, 0.6), colour),
        ((-0.24, 0.0, 0.75), (0.09, 0.12, 0.65), colour),
        ((0.24, 0.0, 0.75), (0.09, 0.12, 0.65), colour),
        ((0.0, 0.0, 1.5), (0.17, 0.2, 0.25), SKIN),
    ]
    return [part(name, centre, yaw, _times(at, scale), _times(size, scale), rgb) for at, size, rgb in body]


def plant(name: str, centre: Point2, height: float, seed: int) -> list[Box]:
    """A pot with a stem and a crown of turned blocks of leaves."""
    rng = np.random.default_rng(seed)
    crown = [
        Box(
            name,
            (centre[0] + float(rng.uniform(-0.2, 0.2)), centre[1] + float(rng.uniform(-0.2, 0.2))),
            (0.25, 0.2, 0.22),
            base=float(rng.uniform(0.45, max(height - 0.22, 0.5))),
            yaw=float(rng.uniform(0, math.pi)),
            colour=LEAVES,
        )
        for _ in range(8)
    ]
    pot = part(name, centre, 0.0, (0.0, 0.0, 0.0), (0.34, 0.34, 0.36), (120, 96, 84))
    return [pot, part(name, centre, 0.0, (0.0, 0.0, 0.36), (0.04, 0.04, height - 0.5), DARK), *crown]


def bench(name: str, centre: Point2, yaw: float, length: float) -> list[Box]:
    """A seat on two blocks."""
    seat = part(name, centre, yaw, (0.0, 0.0, 0.42), (length, 0.42, 0.06), (150, 110, 74), "wood")
    feet = [part(name, centre, yaw, (s * 0.4 * length, 0.0, 0.0), (0.08, 0.38, 0.42), STEEL) for s in (-1, 1)]
    return [seat, *feet]


def screen(name: str, centre: Point2, yaw: float, width: float, height: float) -> list[Box]:
    """A partition on feet, as for notices."""
    board = part(name, centre, yaw, (0.0, 0.0, 0.12), (width, 0.04, height - 0.12), (96, 116, 140), "cloth")
    feet = [part(name, centre, yaw, (s * 0.45 * width, 0.0, 0.0), (0.05, 0.4, 0.12), STEEL) for s in (-1, 1)]
    return [board, *feet]


def machine(name: str, centre: Point2, yaw: float) -> list[Box]:
    """A vending machine."""
    body = part(name, centre, yaw, (0.0, 0.0, 0.0), (0.9, 0.75, 1.83), (46, 60, 92), "metal")
    return [body, part(name, centre, yaw, (-0.12, -0.385, 0.6), (0.58, 0.02, 1.1), BOARD, "print")]


def _times(vector: tuple[float, float, float], scale: float) -> tuple[float, float, float]:
    return vector[0] * scale, vector[1] * scale, vector[2] * scale
