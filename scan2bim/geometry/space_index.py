"""Points in space by cubes, so that those near a place are found without looking at all. SciPy has trees for this; to
load it takes longer than most searches do.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

EDGE = 0.2
"""Edge of a cube, metres: as far as is looked for neighbours in most cases."""
MOST = 1 << 23
"""Cubes, 4 bytes each; where the points spread farther, they are larger."""
F64 = NDArray[np.float64]


class SpaceIndex:
    """Index of points (n, 2) or (n, 3), metres."""

    def __init__(self, points: F64) -> None:
        own = np.zeros((len(points), 3))
        own[:, : points.shape[1]] = points
        self._low = own.min(axis=0) if len(own) else np.zeros(3)
        extent = own.max(axis=0) - self._low if len(own) else np.zeros(3)
        self._edge = EDGE
        while np.prod(np.floor(extent / self._edge) + 1) > MOST:
            self._edge *= 1.25
        self._shape = np.floor(extent / self._edge).astype(np.int64) + 1
        cell = np.ravel_multi_index(tuple(np.floor((own - self._low) / self._edge).astype(np.int64).T), self._shape)
        self._order = np.argsort(cell, kind="stable")
        self._points = own[self._order]
        self._first = np.zeros(int(self._shape.prod()) + 1, np.int32)
        np.cumsum(np.bincount(cell, minlength=len(self._first) - 1), out=self._first[1:])

    def nearest(self, places: NDArray[np.floating[Any]], count: int, reach: float) -> NDArray[np.int64]:
        """Numbers (k, count) of the points nearer than ``reach`` metres to each of some places (k, 2) or (k, 3), the
        nearest first, -1 where there are fewer.
        """
        asked = np.zeros((len(places), 3))
        asked[:, : places.shape[1]] = places
        found = _nearest(self._points, self._first, self._low, self._shape, self._edge, asked, count, reach)
        return np.append(self._order, -1)[found]


@nb.njit(cache=True, nogil=True)
def _nearest(points, first, low, shape, edge, places, count, reach):  # pyright: ignore
    """Rows (k, count) of the points (n, 3), sorted by cube, that are nearest to ``places`` (k, 3), -1 for none."""
    out = np.full((len(places), count), -1, np.int64)
    away = np.empty(count)
    start, end = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in range(len(places)):
        x, y, z = places[i, 0], places[i, 1], places[i, 2]
        for k in range(3):
            start[k] = max(int(np.floor((places[i, k] - reach - low[k]) / edge)), 0)
            end[k] = min(int(np.floor((places[i, k] + reach - low[k]) / edge)), shape[k] - 1)
        if end[2] < start[2]:
            continue
        used = 0
        for a in range(start[0], end[0] + 1):
            for b in range(start[1], end[1] + 1):
                column = (a * shape[1] + b) * shape[2]
                for j in range(first[column + start[2]], first[column + end[2] + 1]):
                    dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
                    square = dx * dx + dy * dy + dz * dz
                    if square >= reach * reach or (used == count and square >= away[used - 1]):
                        continue
                    used = min(used + 1, count)
                    k = used - 1
                    while k > 0 and away[k - 1] > square:
                        away[k], out[i, k] = away[k - 1], out[i, k - 1]
                        k -= 1
                    away[k], out[i, k] = square, j
    return out
