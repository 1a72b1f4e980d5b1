"""Several lines where one was grown: a wall, and leaves or panels a few centimetres off its face that turned it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TURNED = 0.07
"""Radians (4 degrees) up to which a face may be meant to be parallel or square to the main direction."""
EVEN = 0.006
"""Distance from a line, metres, of columns that lie on it: twice a scanner's noise."""
STEP = 0.024
"""Metres from end to end that a face must be turned by to hold a wall and a leaf: less is noise."""
LONG_ENOUGH = 1.0
"""Length, metres, from which on a face can hold a wall and a leaf."""
RATHER = 1.3
"""Times as many columns must lie on parallel lines as on an oblique one to be these."""
NARROW, CLEARLY = 0.75, 1.1
"""As many suffice where the lines are together that much narrower than what the face is turned by from end to end: of
an oblique one they would hold no more than this share.
"""
MOST = 3
"""Parallel lines looked for: those of an oblique face that long hold less of it."""
F64 = NDArray[np.float64]


def parallel_lines(offset: F64, normal: F64, length: float, main: float) -> tuple[F64, F64, F64] | None:
    """Where two or three lines along the ``main`` directions hold far more of a turned face's columns than its own line
    does: their normal (2,), the columns' distances (n,) along it from the face's centre, and those of the lines (k,),
    the fullest first. ``offset`` (n, 2) of the columns from the centre, ``normal`` and ``length`` the face's.
    """
    off = turn_to(normal, main)
    if length < LONG_ENOUGH or abs(off) > TURNED or abs(off) * length <= STEP:
        return None
    square = turned(normal, -off)
    across, own = offset @ square, np.abs(offset @ normal) < EVEN
    lines: list[float] = []
    left = np.ones(len(across), bool)
    while len(lines) < MOST and left.any():
        lines.append(_fullest(across[left]))
        left &= np.abs(across - lines[-1]) >= EVEN
        narrow = 2 * EVEN * len(lines) <= NARROW * abs(off) * length
        if (~left).sum() >= (CLEARLY if narrow else RATHER) * own.sum():
            return square, across, np.array(lines)
    return None


def _fullest(across: F64) -> float:
    """Middle of the window of two EVEN that most distances (n,) lie in."""
    low = np.sort(across)
    count = np.searchsorted(low, low + 2 * EVEN, side="right") - np.arange(len(low))
    return float(low[np.argmax(count)]) + EVEN


def turn_to(normal: F64, main: float) -> float:
    """Angle, radians, from the nearest of the directions along and square to ``main`` to a normal."""
    return float(mod_quarter(np.array([np.arctan2(normal[1], normal[0]) - main]))[0])


def turned(normal: F64, angle: float) -> F64:
    """(2,) turned counter-clockwise by radians."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([cosine * normal[0] - sine * normal[1], sine * normal[0] + cosine * normal[1]])


def mod_quarter(angle: F64) -> F64:
    """Angle to the nearest multiple of a right angle, -pi/4 to pi/4."""
    return np.mod(angle + np.pi / 4, np.pi / 2) - np.pi / 4
