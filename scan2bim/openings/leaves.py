"""Leaves of open doors: thin upright planes that hang on a jamb.

A leaf is looked for at both jambs, on both sides of the wall, at every angle: as long as the opening is wide, upright
along all of its length, not going on behind its end nor above the opening's head, as a wall would.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.shapes import WallShape

STEP = 0.05
"""Steps along a leaf, metres: a surfel's width."""
TALL = 0.20
"""Heights, metres, in which a step must be filled to be upright."""
BAND = 0.035
"""Half of a leaf's thickness (40 mm) and the noise of its points, metres."""
LOWEST, HIGHEST = 0.3, 1.9
"""Heights over the floor, metres, between which a leaf is looked for: over thresholds and below every head."""
UPRIGHT = 0.4
"""Share of the heights that a step must fill."""
LEAST = 0.55
"""Share of a leaf's length that must be upright: furniture hides the rest."""
WIDEST = 1.3
"""Length, metres, of the longest single leaf; wider openings have two, each half as wide."""
ANGLES = np.radians(np.arange(12, 172, 2))
"""Angles from closed that are tried: less than 12 degrees cannot be told from closed, more than 170 from the wall."""
AJAR = np.radians(30)
"""Angle below which a door is called ajar: nobody passes without moving it."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Leaf:
    """A leaf hung at the ``hinge`` jamb (start: nearer to the wall's start), swung to the ``side`` of the axis by
    ``angle`` radians from closed; ``share`` of its length was seen.
    """

    hinge: Literal["start", "end"]
    side: Literal["left", "right"]
    angle: float
    share: float


def find_leaf(wall: WallShape, offset: float, width: float, head: float, points: F64) -> Leaf | None:
    """The leaf of an opening from ``offset`` to ``offset + width`` along the wall with its head ``head`` over the base.

    ``points`` (n, 3) local positions of surfels near the opening. None if no leaf was seen.
    """
    along, across, up = _in_wall(wall, points)
    body = (up > LOWEST) & (up < min(HIGHEST, head - 0.05))
    above = (up > head + 0.1) & (up < wall.top - wall.base - 0.1)
    length = width if width <= WIDEST else width / 2
    if length > WIDEST:
        return None
    best: Leaf | None = None
    for hinge, place, inward in (("start", offset, 1.0), ("end", offset + width, -1.0)):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            for depth in (0.0, 0.5, 1.0):
                u, v = (along - place) * inward, (across - sign * depth * wall.thickness / 2) * sign
                share, angle = _best_angle(u[body], v[body], up[body], u[above], v[above], length)
                if share >= LEAST and (best is None or share > best.share + 0.02):
                    best = Leaf(hinge, side, angle, share)  # pyright: ignore[reportArgumentType]
    return best


def _in_wall(wall: WallShape, points: F64) -> tuple[F64, F64, F64]:
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    offset = points[:, :2] - start
    return offset @ direction, offset @ np.array([-direction[1], direction[0]]), points[:, 2] - wall.base


def _best_angle(u: F64, v: F64, up: F64, u_above: F64, v_above: F64, length: float) -> tuple[float, float]:
    """Largest share of a leaf's ``length`` that is upright, and its angle; u runs from the hinge to the other jamb, v
    to the side that the leaf swings to.
    """
    best = (0.0, 0.0)
    if not len(u):
        return best
    steps = max(int(length / STEP) - 2, 4)
    heights = max(int((up.max() - LOWEST) / TALL) + 1, 4)
    for angle in ANGLES:
        along, off = u * np.cos(angle) + v * np.sin(angle), np.abs(v * np.cos(angle) - u * np.sin(angle))
        on = (off < BAND) & (along > 2 * STEP)
        filled = _filled(along[on], up[on], steps, heights)
        if filled <= max(best[0], LEAST):
            continue
        beyond = (off < BAND) & (along > length + 0.08) & (along < length + 0.33)
        goes_on = len(np.unique(np.floor(along[beyond] / STEP))) >= 3
        over = np.abs(v_above * np.cos(angle) - u_above * np.sin(angle)) < BAND
        along_over = (u_above * np.cos(angle) + v_above * np.sin(angle))[over]
        covered = len(np.unique(np.floor(along_over[(along_over > 0.1) & (along_over < length)] / STEP))) / steps
        if not goes_on and covered < 0.3:
            best = (filled, float(angle))
    return best


def _filled(along: F64, up: F64, steps: int, heights: int) -> float:
    """Share of the steps from the hinge outwards that are upright."""
    step, height = np.floor(along / STEP).astype(int) - 2, np.floor((up - LOWEST) / TALL).astype(int)
    ok = (step >= 0) & (step < steps) & (height >= 0) & (height < heights)
    grid = np.zeros((steps, heights), bool)
    grid[step[ok], height[ok]] = True
    return float((grid.mean(1) >= UPRIGHT).mean())
