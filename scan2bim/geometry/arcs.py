"""Circular arcs in plan, given by chord and bulge as in drawings; a bulge of 0 is a straight line.

The bulge is the tangent of a quarter of the arc's angle, positive where the arc turns left. Metres, radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc from the origin to (chord, 0): x runs along the chord, y to the left of it."""

    chord: float
    bulge: float = 0.0

    @property
    def angle(self) -> float:
        """By how much it turns left from start to end, radians."""
        return 4.0 * math.atan(self.bulge)

    @property
    def length(self) -> float:
        """Metres along the arc."""
        half = self.angle / 2
        return self.chord if half == 0.0 else self.chord * half / math.sin(half)

    @property
    def curvature(self) -> float:
        """Radians a metre, positive to the left; 0 of a straight line or of one without length."""
        return self.angle / self.length if self.length else 0.0

    def direction(self, along: float) -> float:
        """Direction of travel, radians from the chord, ``along`` metres from the start."""
        return self.curvature * along - self.angle / 2

    def place(self, along: Floats, left: Floats) -> Floats:
        """(..., 2): the points ``along`` metres along the arc and ``left`` metres to the left of it."""
        if self.curvature == 0.0:
            return np.stack(np.broadcast_arrays(along, left), axis=-1)
        k, start = self.curvature, -self.angle / 2
        turned = start + k * along
        x = (np.sin(turned) - math.sin(start)) / k - left * np.sin(turned)
        y = (math.cos(start) - np.cos(turned)) / k + left * np.cos(turned)
        return np.stack([x, y], axis=-1)

    def locate(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """How far along the arc (or its continuation) and to the left of it places x, y lie, metres: as ``place``."""
        if self.curvature == 0.0:
            return x, y
        k, start = self.curvature, -self.angle / 2
        u, v = x + math.sin(start) / k, math.cos(start) / k - y
        turned = np.mod(np.arctan2(u * k, v * k) - start + np.pi - self.angle / 2, math.tau) - np.pi + self.angle / 2
        return turned / k, 1.0 / k - math.copysign(1.0, k) * np.hypot(u, v)

    def nearest(self, x: float, y: float) -> float:
        """How far along the arc (or its continuation) the point nearest to x, y lies, metres."""
        if self.curvature == 0.0:
            return x
        k, start = self.curvature, -self.angle / 2
        centre_x, centre_y = -math.sin(start) / k, math.cos(start) / k
        turned = math.atan2((x - centre_x) * k, (centre_y - y) * k)
        return (turned - start) / k
