"""A wall as its centre line, straight or an arc."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import LineString

from scan2bim.geometry.arcs import Arc

F64 = NDArray[np.float64]
STEP = 0.1
"""Radians between the corners of an arc drawn as a line: 4 mm off one of 3 m."""


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A wall's centre line (2,) ``start`` to ``end``; ``left`` and ``right`` spaces beside it; ``measured`` tells
    whether both faces were seen; ``bulge`` is the tangent of a quarter of its arc's angle, positive to the left;
    ``sigma`` the standard deviation (metres) of the thickness that rays tell of a wall of which one face was seen.
    """

    start: F64
    end: F64
    thickness: float
    measured: bool
    left: frozenset[int]
    right: frozenset[int]
    bulge: float = 0.0
    sigma: float | None = None

    @property
    def chord(self) -> float:
        """Metres from start to end."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def arc(self) -> Arc:
        """The line in the frame of its chord."""
        return Arc(self.chord, self.bulge)

    @property
    def length(self) -> float:
        """Metres, along the arc."""
        return self.arc.length if self.bulge else self.chord

    @property
    def direction(self) -> F64:
        """Unit vector from start to end."""
        return (self.end - self.start) / max(self.chord, 1e-9)

    @property
    def inset(self) -> F64:
        """From the axis to the border of the one space beside it; zero for a wall between two spaces."""
        return self.normal * (self.thickness / 2 * (bool(self.left) - bool(self.right)))

    @property
    def normal(self) -> F64:
        """Unit vector to the left of the chord."""
        d = self.direction
        return np.array([-d[1], d[0]])

    @property
    def line(self) -> LineString:
        """In plan."""
        return LineString(self.points())

    def points(self, left: float = 0.0) -> F64:
        """Corners (n, 2) of the line, or of one ``left`` metres to the left of it."""
        if not self.bulge:
            return np.array([self.start, self.end]) + left * self.normal
        along = np.linspace(0.0, self.length, 2 + int(abs(self.arc.angle) / STEP))
        flat = self.arc.place(along, np.full(len(along), left))
        return self.start + flat[:, :1] * self.direction + flat[:, 1:] * self.normal

    def local(self, xy: F64) -> tuple[F64, F64]:
        """How far along the line and to the left of it places (n, 2) lie, metres."""
        offset = xy - self.start
        return self.arc.locate(offset @ self.direction, offset @ self.normal)


@dataclass(frozen=True, slots=True)
class AxisJoin:
    """End ``at`` of wall ``one`` lies on ``other_at`` of wall ``other``."""

    one: int
    at: str
    other: int
    other_at: str
