"""Leaves of open doors: thin upright planes that hang on a jamb.

A leaf is looked for at both jambs, on both sides of the wall, at every angle: as long as the opening is wide, upright
along all of its length, not going on behind its end nor above the opening's head, as a wall would.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.shapes import WallShape

STEP = 0.05
"""Steps along a leaf, metres: a surfel's width."""
COARSE = 0.1
"""The same where it is only asked whether a leaf goes on upwards: scans are thinner there."""
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
BEYOND = 0.35
"""Distance beyond a leaf's end, metres, over which it must not go on, upright as it is: furniture may stand there."""
FEWEST = 20
"""Surfels by which a leaf's direction is fitted."""
WORST_TURN = np.radians(12)
"""Angle, radians, by which that may differ from the line through the jamb."""
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
    z = points[:, 2] - wall.base
    along, across, up = _in_wall(wall, points[(z > LOWEST) & (z < wall.top - wall.base)])
    body = (up > LOWEST) & (up < min(HIGHEST, head - 0.05))
    above = (up > head + 0.1) & (up < wall.top - wall.base - 0.1)
    length = _length(width)
    if length > WIDEST:
        return None
    at_jambs = np.hypot(np.minimum(np.abs(along - offset), np.abs(along - offset - width)), across)
    rows = np.flatnonzero((at_jambs < length + BEYOND + wall.thickness / 2) & (body | above))
    along, across, up, body, above = along[rows], across[rows], up[rows], body[rows], above[rows]
    best: Leaf | None = None
    for hinge, place, inward in (("start", offset, 1.0), ("end", offset + width, -1.0)):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            for depth in (0.0, 0.5, 1.0):
                u, v = (along - place) * inward, (across - sign * depth * wall.thickness / 2) * sign
                near = (u * u + v * v < (length + BEYOND) ** 2) & (v > -BAND)
                low, high = near & body, near & above
                share, angle = _best_angle(u[low], v[low], up[low], u[high], v[high], length)
                if share >= LEAST and (best is None or share > best.share + 0.02):
                    turned = _turned(u[low], v[low], angle, length)
                    best = Leaf(hinge, side, turned, share)  # pyright: ignore[reportArgumentType]
    return best


def reach_up(wall: WallShape, offset: float, width: float, top: float, leaf: Leaf, points: F64) -> float:
    """Share of a leaf's upright area between HIGHEST and ``top`` (metres over the base) in which something stands, 0-1.

    ``points`` (n, 3) local positions of surfels near the opening. What stands lower than a tall opening is furniture.
    """
    along, across, up = _in_wall(wall, points)
    length = _length(width)
    place, inward = (offset, 1.0) if leaf.hinge == "start" else (offset + width, -1.0)
    u, v = (along - place) * inward, across * (1.0 if leaf.side == "left" else -1.0)
    out = u * np.cos(leaf.angle) + v * np.sin(leaf.angle)
    off = np.abs(v * np.cos(leaf.angle) - u * np.sin(leaf.angle))
    on = (off < BAND + wall.thickness / 2) & (out > 0.0) & (out < length) & (up > HIGHEST) & (up < top)
    cells = np.unique(np.floor(np.column_stack([out[on] / COARSE, up[on] / COARSE])), axis=0)
    return len(cells) / max(length * (top - HIGHEST) / COARSE**2, 1.0)


def _length(width: float) -> float:
    """Metres, of a leaf in an opening so wide: of two leaves in a wide one."""
    return width if width <= WIDEST else width / 2


def _turned(u: F64, v: F64, angle: float, length: float) -> float:
    """The leaf's own direction, by its points: its hinge stands off the jamb, so that the line from there is askew."""
    at, found = np.zeros(2), angle
    for _ in range(3):
        along = (u - at[0]) * np.cos(found) + (v - at[1]) * np.sin(found)
        off = (v - at[1]) * np.cos(found) - (u - at[0]) * np.sin(found)
        reach = (0.1, length) if not at.any() else (0.1 - length / 2, length / 2)
        near = (np.abs(off) < BAND) & (along > reach[0]) & (along < reach[1])
        if near.sum() < FEWEST:
            break
        at = np.array([u[near].mean(), v[near].mean()])
        slope = float(np.polyfit(along[near], off[near], 1)[0])
        found += float(np.arctan(slope))
    return found if abs(found - angle) < WORST_TURN else angle


def _in_wall(wall: WallShape, points: F64) -> tuple[F64, F64, F64]:
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    offset = points[:, :2] - start
    return offset @ direction, offset @ np.array([-direction[1], direction[0]]), points[:, 2] - wall.base


@nb.njit(cache=True, nogil=True)
def _by_angle(u, v):  # pyright: ignore
    """For each of ANGLES where its points begin in ``rows``: first (a + 1,), rows (m,). They are those within BAND of
    the ray at that angle from 2 STEP on, and some more.
    """
    count, gap = ANGLES.shape[0], ANGLES[1] - ANGLES[0]
    low, high = np.zeros(u.shape[0], np.int64), np.full(u.shape[0], -1, np.int64)
    first = np.zeros(count + 1, np.int64)
    for i in range(u.shape[0]):
        reach = np.hypot(u[i], v[i])
        if reach < 1.9 * STEP:
            continue
        towards, half = np.arctan2(v[i], u[i]), np.arcsin(min(BAND / reach, 1.0))
        if towards < -np.pi / 2:
            towards += 2 * np.pi
        low[i] = max(int(np.floor((towards - half - ANGLES[0]) / gap)), 0)
        high[i] = min(int(np.ceil((towards + half - ANGLES[0]) / gap)), count - 1)
        for a in range(low[i], high[i] + 1):
            first[a + 1] += 1
    first = np.cumsum(first)
    at = first[:-1].copy()
    rows = np.empty(first[-1], np.int64)
    for i in range(u.shape[0]):
        for a in range(low[i], high[i] + 1):
            rows[at[a]] = i
            at[a] += 1
    return first, rows


@nb.njit(cache=True, nogil=True)
def _upright(filled):  # pyright: ignore
    """Over how many steps (s, h) enough heights are filled."""
    count = 0
    for step in range(filled.shape[0]):
        count += filled[step].sum() >= UPRIGHT * filled.shape[1]
    return count


@nb.njit(cache=True, nogil=True)
def _best_angle(u, v, up, u_above, v_above, length):  # pyright: ignore
    """Largest share of a leaf's ``length`` that is upright, and its angle; u runs from the hinge to the other jamb, v
    to the side that the leaf swings to.
    """
    steps = max(int(length / STEP) - 2, 4)
    heights = int((HIGHEST - LOWEST) / TALL) + 1
    tallest = 0
    for i in range(u.shape[0]):
        tallest = max(tallest, int((up[i] - LOWEST) / TALL) + 1)
    heights = max(min(heights, tallest), 4)
    best = 0.0
    best_angle = 0.0
    filled = np.zeros((steps, heights), np.bool_)
    beyond = np.zeros((6, heights), np.bool_)
    above = np.zeros(steps + 2, np.bool_)
    first, rows = _by_angle(u, v)
    for number in range(ANGLES.shape[0]):
        angle = ANGLES[number]
        c, s = np.cos(angle), np.sin(angle)
        filled[:] = False
        beyond[:] = False
        for k in range(first[number], first[number + 1]):
            i = rows[k]
            if abs(v[i] * c - u[i] * s) < BAND:
                along = u[i] * c + v[i] * s
                step = int(np.floor(along / STEP)) - 2
                height = int((up[i] - LOWEST) / TALL)
                if 0 <= step < steps and height < heights:
                    filled[step, height] = True
                if length + 0.08 < along < length + 0.33 and height < heights:
                    beyond[int((along - length - 0.08) / STEP), height] = True
        share = _upright(filled) / steps
        if share <= max(best, LEAST) or _upright(beyond) >= 3:
            continue
        above[:] = False
        for i in range(u_above.shape[0]):
            along = u_above[i] * c + v_above[i] * s
            if abs(v_above[i] * c - u_above[i] * s) < BAND and 0.1 < along < length:
                above[min(int(along / STEP) - 2, steps + 1)] = True
        if above.sum() < 0.3 * steps:
            best = share
            best_angle = angle
    return best, best_angle
