"""Mean colour and depth of columns and rows of an orthoimage over any stretch."""

from __future__ import annotations

import numba as nb
import numpy as np

DEEPEST = 0.03
"""Metres to which depths are cut, so that a reveal or a handle does not outweigh a column."""
LEAST = 12
"""Measured pixels that a mean is made of, at least."""


@nb.njit(cache=True, nogil=True)
def columns(count, rgb, depth, low, high, first, last):  # pyright: ignore
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
    return _means(sums)


@nb.njit(cache=True, nogil=True)
def rows(count, rgb, depth, low, high, first, last):  # pyright: ignore
    """As ``columns``, of the rows ``low`` to ``high`` from column ``first`` to ``last``."""
    sums = np.zeros((high - low, 5))
    for r in range(low, high):
        red = green = blue = deep = found = 0.0
        for c in range(first, last):
            if count[r, c] > 0:
                red += rgb[r, c, 0]
                green += rgb[r, c, 1]
                blue += rgb[r, c, 2]
                deep += min(max(depth[r, c], np.float32(-DEEPEST)), np.float32(DEEPEST))
                found += 1.0
        k = r - low
        sums[k, 0], sums[k, 1], sums[k, 2], sums[k, 3], sums[k, 4] = red, green, blue, deep, found
    return _means(sums)


@nb.njit(cache=True, nogil=True)
def _means(sums):  # pyright: ignore
    """Means (n, 4) from sums (n, 5)."""
    means = np.full((len(sums), 4), np.nan, np.float32)
    for k in range(len(sums)):
        if sums[k, 4] >= LEAST:
            for j in range(4):
                means[k, j] = sums[k, j] / sums[k, 4]
    return means
