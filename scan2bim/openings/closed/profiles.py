"""Mean colour and depth of columns and rows of an orthoimage over any stretch, from cumulative sums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.orthoimage import PIXEL, Orthoimage

DEEPEST = 0.03
"""Metres to which depths are cut, so that a reveal or a handle does not outweigh a column."""
LEAST = 12
"""Measured pixels that a mean is made of, at least."""
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Profiles:
    """Sums over measured pixels of red, green, blue, depth and 1, cumulated upwards, (r + 1, c, 5), and along the wall,
    (r, c + 1, 5), float64.
    """

    upwards: NDArray[np.float64]
    along: NDArray[np.float64]

    def columns(self, left: float, right: float, bottom: float, top: float) -> F32:
        """Means (n, 4) of the columns between two places along the wall, over the rows between two heights, metres."""
        rows, cols = self.upwards.shape[0] - 1, self.upwards.shape[1]
        a, b = _span(bottom, top, rows)
        first, last = _span(left, right, cols)
        return _means(self.upwards[b, first:last] - self.upwards[a, first:last])

    def rows(self, left: float, right: float, bottom: float, top: float) -> F32:
        """Means (n, 4) of the rows between two heights, over the columns between two places along the wall, metres."""
        rows, cols = self.along.shape[0], self.along.shape[1] - 1
        a, b = _span(left, right, cols)
        first, last = _span(bottom, top, rows)
        return _means(self.along[first:last, b] - self.along[first:last, a])


def profiles_of(image: Orthoimage) -> Profiles:
    """Of one face."""
    measured = (image.count > 0)[..., None]
    depth = np.clip(image.depth, -DEEPEST, DEEPEST)
    values = np.concatenate([image.rgb, depth[..., None], np.ones_like(depth)[..., None]], 2) * measured
    rows, cols = image.depth.shape
    upwards, along = np.zeros((rows + 1, cols, 5)), np.zeros((rows, cols + 1, 5))
    np.cumsum(values, 0, out=upwards[1:])
    np.cumsum(values, 1, out=along[:, 1:])
    return Profiles(upwards, along)


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    first = min(max(round(low / PIXEL), 0), size)
    return first, max(min(round(high / PIXEL), size), first)


def _means(sums: NDArray[np.float64]) -> F32:
    count = sums[:, 4:]
    return np.where(count >= LEAST, sums[:, :4] / np.maximum(count, 1), np.nan).astype(np.float32)
