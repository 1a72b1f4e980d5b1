"""Mean colour and depth of columns and rows of an orthoimage over any stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
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
    """Of one face's image, whose measured pixels they are the means of."""

    image: Orthoimage

    def columns(self, left: float, right: float, bottom: float, top: float) -> F32:
        """Means (n, 4) of the columns between two places along the wall, over the rows between two heights, metres."""
        rows, cols = self.image.depth.shape
        return _columns(*self._values, *_span(bottom, top, rows), *_span(left, right, cols))

    def rows(self, left: float, right: float, bottom: float, top: float) -> F32:
        """Means (n, 4) of the rows between two heights, over the columns between two places along the wall, metres."""
        rows, cols = self.image.depth.shape
        count, rgb, depth = self._values
        return _columns(count.T, rgb.transpose(1, 0, 2), depth.T, *_span(left, right, cols), *_span(bottom, top, rows))

    @property
    def _values(self) -> tuple[NDArray[np.uint16], F32, F32]:
        return self.image.count, self.image.rgb, self.image.depth


@nb.njit(cache=True, nogil=True)
def _columns(count, rgb, depth, low, high, first, last):  # pyright: ignore
    """Means (n, 4) of red, green, blue and depth of the columns ``first`` to ``last``, from row ``low`` to ``high``;
    nan where too few pixels were measured.
    """
    sums = np.zeros((last - first, 5))
    for r in range(low, high):
        for c in range(first, last):
            if count[r, c] > 0:
                k = c - first
                sums[k, 0] += rgb[r, c, 0]
                sums[k, 1] += rgb[r, c, 1]
                sums[k, 2] += rgb[r, c, 2]
                sums[k, 3] += min(max(depth[r, c], np.float32(-DEEPEST)), np.float32(DEEPEST))
                sums[k, 4] += 1.0
    means = np.full((last - first, 4), np.nan, np.float32)
    for k in range(last - first):
        if sums[k, 4] >= LEAST:
            means[k] = sums[k, :4] / sums[k, 4]
    return means


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    first = min(max(round(low / PIXEL), 0), size)
    return first, max(min(round(high / PIXEL), size), first)
