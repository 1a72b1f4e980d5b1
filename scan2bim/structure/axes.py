"""A wall as its centre line."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A wall's centre line (2,) ``start`` to ``end``; ``left`` and ``right`` spaces beside it; ``measured`` tells
    whether both faces were seen.
    """

    start: F64
    end: F64
    thickness: float
    measured: bool
    left: frozenset[int]
    right: frozenset[int]

    @property
    def length(self) -> float:
        """Metres."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def direction(self) -> F64:
        """Unit vector from start to end."""
        return (self.end - self.start) / max(self.length, 1e-9)

    @property
    def inset(self) -> F64:
        """From the axis to the border of the one space beside it; zero for a wall between two spaces."""
        return self.normal * (self.thickness / 2 * (bool(self.left) - bool(self.right)))

    @property
    def normal(self) -> F64:
        """Unit vector to the left."""
        d = self.direction
        return np.array([-d[1], d[0]])


@dataclass(frozen=True, slots=True)
class AxisJoin:
    """End ``at`` of wall ``one`` lies on ``other_at`` of wall ``other``."""

    one: int
    at: str
    other: int
    other_at: str
