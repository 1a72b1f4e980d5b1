"""What experiments vary by their seed: colours, doors, windows, and the scanner's light and errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scan2bim.simulate.appearance import Camera
from scan2bim.simulate.effects import Glass
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import DoorSpec, Rgb, WallSpec, WindowSpec

Rng = np.random.Generator

EYE = 1.55
"""Height of a scanner on its tripod above the floor, metres."""
WALL_COLOURS: tuple[Rgb, ...] = (
    (226, 224, 218),
    (214, 208, 192),
    (196, 206, 190),
    (202, 210, 218),
    (222, 206, 186),
    (184, 178, 170),
)
DOOR_COLOURS: tuple[Rgb, ...] = (
    (146, 100, 62),
    (188, 148, 104),
    (96, 66, 48),
    (238, 238, 234),
    (128, 136, 142),
    (58, 84, 118),
    (120, 44, 40),
)
FLOOR_COLOURS: tuple[Rgb, ...] = ((150, 148, 146), (178, 138, 94), (120, 112, 108), (168, 172, 176))
NEARLY = (8, 20)
"""By how much of 255 each channel of a leaf of nearly the wall's colour differs from the wall's, at most and least."""
GAP = 0.003
"""Between leaf and lining, metres: as doors are hung."""
SHALLOWEST = 0.004
"""Metres behind the wall's face that a leaf hangs at least, however thin the wall, if it is not flush with it."""


def one_of(choices: tuple[Rgb, ...], rng: Rng) -> Rgb:
    """One of the colours, a little off."""
    return shifted(choices[int(rng.integers(len(choices)))], float(rng.normal(0.0, 4.0)))


def shifted(colour: Rgb, by: float) -> Rgb:
    """All channels lighter or darker."""
    r, g, b = (int(np.clip(round(c + by), 0, 255)) for c in colour)
    return r, g, b


def nearly(colour: Rgb, rng: Rng) -> Rgb:
    """A colour that is hardly another one."""
    low, high = NEARLY
    sign = -1.0 if min(colour) > 128 else 1.0
    return shifted(colour, sign * float(rng.uniform(low, high)))


def dress(door: DoorSpec, wall_colour: Rgb, thickness: float, rng: Rng, hard: bool = False) -> DoorSpec:
    """A door as one of many that are seen: colour, finish, casing, how deep its leaf hangs, hinge.

    hard: the leaf is flush with the wall's face on the swing side, of nearly the wall's colour, without casing.
    """
    hinge = "start" if rng.random() < 0.5 else "end"
    if hard:
        return replace(
            door, recess=0.0, casing=0.0, colour=nearly(wall_colour, rng), finish="paint", hinge=hinge, gap=GAP
        )
    deepest = max(thickness - door.leaf_thickness - 0.03, SHALLOWEST)
    kind = rng.random()
    recess = 0.0 if kind < 0.25 else float(rng.uniform(SHALLOWEST, min(0.05, deepest)))
    if kind > 0.8:
        recess = float(rng.uniform(min(0.05, deepest), deepest))
    leaf = nearly(wall_colour, rng) if rng.random() < 0.2 else one_of(DOOR_COLOURS, rng)
    finish = "wood" if leaf[0] > leaf[2] + 30 else "paint"
    casing = float(rng.uniform(0.04, 0.09)) if rng.random() < 0.55 else 0.0
    trim = leaf if rng.random() < 0.5 else one_of(DOOR_COLOURS, rng)
    return replace(
        door, recess=recess, casing=casing, casing_colour=trim, colour=leaf, finish=finish, hinge=hinge, gap=GAP
    )


def spread(wall: WallSpec, widths: list[float], rng: Rng, margin: float = 0.4, between: float = 0.5) -> list[float]:
    """Where openings of these widths start along a wall so that none is too near to another; ValueError if too long."""
    free = wall.length - 2 * margin - sum(widths) - between * (len(widths) - 1)
    if free < 0.0:
        raise ValueError(f"{wall.name} is {wall.length:.2f} m long, too short for openings of {widths}")
    gaps = np.sort(rng.uniform(0.0, free, len(widths)))
    before = np.concatenate([[0.0], np.cumsum(widths)[:-1]]) + between * np.arange(len(widths))
    return [float(x) for x in margin + gaps + before]


def window(name: str, rng: Rng) -> WindowSpec:
    """A window of usual size."""
    width, sill = float(rng.uniform(0.9, 2.2)), float(rng.uniform(0.75, 1.05))
    height = float(rng.uniform(1.15, 1.55))
    return WindowSpec(name, 0.0, sill, width, height, mullions=int(width > 1.4), pane=True)


def scanner(step: float, rng: Rng) -> ScannerSpec:
    """A terrestrial scanner with a camera, as good as one of a hundred; ``step`` between rays in degrees."""
    return ScannerSpec(
        step=math.radians(step),
        noise=float(rng.uniform(0.0015, 0.003)),
        registration=0.001,
        registration_turn=math.radians(0.003),
        growth=1.0,
        mixed=0.2,
        dropout=0.002,
        glass=Glass(returned=0.25, mirrored=0.02),
        camera=Camera(exposure=0.05, tint=0.015, lighting=0.06, drift=0.025, noise=4.0),
    )
