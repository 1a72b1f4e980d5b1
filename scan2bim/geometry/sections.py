"""Round and rectangular sections fitted to points on their outline, as of columns in plan."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

CORNERS = 24
"""Of the outline of a round section."""
SNAP = np.radians(4.0)
"""Angle within which a rectangle is turned into the building's main direction: a side of half a metre tells no more."""
ON_SIDE = 0.03
"""Distance, metres, within which points belong to a side."""
HALF_STEP = 0.0125
"""Metres by which a side goes on past the last point on it: that is the mean of what was seen in 5 cm, on average of
half of them.
"""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A section in plan: ``centre`` (2,), ``size`` across its own axes (metres; a circle's diameter twice), ``angle``
    (radians) of its first axis. ``rms`` metres of its points; ``sides`` of four (of a circle: of twelve sectors) on
    which there are points.
    """

    centre: F64
    size: tuple[float, float]
    angle: float
    round: bool
    rms: float
    sides: int

    @property
    def axes(self) -> F64:
        """Unit vectors along its sides, (2, 2), one a row."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, s], [-s, c]])

    @property
    def outline(self) -> F64:
        """Its corners counter-clockwise, (k, 2); those of a round one lie on the circle."""
        if self.round:
            turn = self.angle + np.arange(CORNERS) * 2 * np.pi / CORNERS
            return self.centre + self.size[0] / 2 * np.stack([np.cos(turn), np.sin(turn)], 1)
        half = np.array(self.size) / 2
        return self.centre + (np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half) @ self.axes

    def distance(self, xy: F64) -> F64:
        """Of points (n, 2) from the outline, (n,) metres, always positive."""
        if self.round:
            return np.abs(np.linalg.norm(xy - self.centre, axis=1) - self.size[0] / 2)
        q = np.abs((xy - self.centre) @ self.axes.T) - np.array(self.size) / 2
        return np.where((q < 0).all(1), -q.max(1), np.linalg.norm(np.maximum(q, 0.0), axis=1))

    def outward(self, xy: F64) -> F64:
        """Unit normals (n, 2) of the outline at points (n, 2) on it."""
        off = xy - self.centre
        if self.round:
            return off / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-9)
        local = off @ self.axes.T
        q = np.abs(local) - np.array(self.size) / 2
        first = q[:, 0] > q[:, 1]
        normal = np.where(first[:, None], [[1.0, 0.0]], [[0.0, 1.0]]) * np.where(local < 0, -1.0, 1.0)
        return normal @ self.axes

    def coverage(self, xy: F64, step: float) -> float:
        """Share of the outline, in steps of ``step`` metres, near which there are points (n, 2)."""
        corners = self.outline
        sides = np.roll(corners, -1, 0) - corners
        lengths = np.linalg.norm(sides, axis=1)
        places = [
            c + s * t
            for c, s, n in zip(corners, sides, lengths, strict=True)
            for t in _middles(max(1, round(n / step)))
        ]
        apart = np.linalg.norm(np.array(places)[:, None] - xy[None], axis=2)
        return float((apart.min(1) < step).mean())


def _middles(count: int) -> list[float]:
    return [(k + 0.5) / count for k in range(count)]


def fit_circle(xy: F64, weight: F64) -> Section:
    """Circle through points (n, 2), n > 2, weighted (n,), robustly."""
    centre, radius, own = xy.mean(0), 0.0, weight
    for _ in range(5):
        middle = np.average(xy, axis=0, weights=own)
        off = xy - middle
        rows = np.column_stack([2 * off, np.ones(len(xy))]) * np.sqrt(own)[:, None]
        solution = np.linalg.lstsq(rows, (off**2).sum(1) * np.sqrt(own), rcond=None)[0]
        centre = middle + solution[:2]
        radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-9)))
        own = _robust(weight, np.linalg.norm(xy - centre, axis=1) - radius)
    residual = np.linalg.norm(xy - centre, axis=1) - radius
    turn = np.arctan2(*(xy - centre)[np.abs(residual) < ON_SIDE].T[::-1])
    sectors = len(np.unique(np.floor(turn / (np.pi / 6))))
    return Section(centre, (2 * radius, 2 * radius), 0.0, True, _rms(residual, weight), sectors)


def fit_rectangle(xy: F64, weight: F64, main: float) -> Section:
    """Rectangle round points (n, 2) on its sides, weighted (n,); turned into the direction ``main`` (radians) if it is
    nearly so.
    """
    angle = _best_angle(xy, weight, np.radians(np.arange(0.0, 90.0, 3.0)))
    angle = _best_angle(xy, weight, angle + np.radians(np.arange(-3.0, 3.01, 0.5)))
    off = float(np.mod(angle - main + np.pi / 4, np.pi / 2) - np.pi / 4)
    return _rectangle(xy, weight, angle - off if abs(off) < SNAP else angle)


def _rectangle(xy: F64, weight: F64, angle: float) -> Section:
    """The rectangle of a given direction."""
    sides, seen, rms = _sides(xy, weight, angle)
    sides[~seen] += np.where(np.arange(4) < 2, -HALF_STEP, HALF_STEP)[~seen]
    c, s = np.cos(angle), np.sin(angle)
    centre = np.array([[c, -s], [s, c]]) @ ((sides[:2] + sides[2:]) / 2)
    across = sides[2:] - sides[:2]
    both = int(seen.sum()) if (seen[0] or seen[2]) and (seen[1] or seen[3]) else 1
    return Section(centre, (float(across[0]), float(across[1])), angle, False, float(rms), both)


@nb.njit(cache=True, nogil=True)
def _best_angle(xy, weight, angles):  # pyright: ignore
    """Of some directions (m,) the one whose rectangle fits best."""
    best, least = angles[0], np.inf
    for angle in angles:
        rms = _sides(xy, weight, angle)[2]
        if rms < least:
            best, least = angle, rms
    return best


@nb.njit(cache=True, nogil=True)
def _sides(xy, weight, angle):  # pyright: ignore
    """The sides (4,) of a rectangle of a given direction, low and then high across both axes, each at the median of the
    points that are nearest to it, those without any where the others end; which of them were seen (4,); and the
    weighted residual.
    """
    c, s = np.cos(angle), np.sin(angle)
    n = len(xy)
    local = np.empty((2, n))
    for i in range(n):
        local[0, i] = xy[i, 0] * c + xy[i, 1] * s
        local[1, i] = xy[i, 1] * c - xy[i, 0] * s
    sides = np.array([local[0].min(), local[1].min(), local[0].max(), local[1].max()])
    seen = np.zeros(4, np.bool_)
    nearest, residual = np.empty(n, np.int64), np.empty(n)
    for _ in range(3):
        _to_sides(local, sides, nearest, residual)
        before = sides.copy()
        for k in range(4):
            on = np.flatnonzero((nearest == k) & (residual < ON_SIDE))
            seen[k] = False
            if len(on):
                along = local[1 - k % 2][on]
                size = before[2 + (k - 1) % 2] - before[(k - 1) % 2]
                seen[k] = len(on) >= 2 and along.max() - along.min() > 0.4 * size
                sides[k] = np.median(local[k % 2][on])
    _to_sides(local, sides, nearest, residual)
    near, total, weights = 0, 0.0, 0.0
    for i in range(n):
        if residual[i] < ON_SIDE:
            near += 1
            total += weight[i] * residual[i] ** 2
            weights += weight[i]
    return sides, seen, (np.sqrt(total / weights) if near else ON_SIDE) + ON_SIDE * (1 - near / n)


@nb.njit(cache=True, nogil=True)
def _to_sides(local, sides, nearest, residual):  # pyright: ignore
    """The nearest side of each point (2, n) and the distance to it."""
    for i in range(local.shape[1]):
        residual[i] = np.inf
        for k in range(4):
            gap = abs(local[k % 2, i] - sides[k])
            if gap < residual[i]:
                nearest[i], residual[i] = k, gap


def _robust(weight: F64, residual: F64) -> F64:
    scale = max(1.4826 * float(np.median(np.abs(residual))), 0.001)
    return weight / (1 + (residual / (2 * scale)) ** 2) ** 2


def _rms(residual: F64, weight: F64) -> float:
    near = np.abs(residual) < ON_SIDE
    share = near.mean()
    rms = float(np.sqrt(np.average(residual[near] ** 2, weights=weight[near]))) if near.any() else ON_SIDE
    return rms + ON_SIDE * float(1 - share)
