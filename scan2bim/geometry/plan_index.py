"""Points by plan cells of 1 m, so that those near a line or a place are found without looking at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CELL = 1.0
"""Edge of a cell, metres: a wall's length takes few, and few points lie in those besides the wall's own."""
RADIX = 1 << 16
"""Cells below which their numbers fit in 16 bits."""
I64 = NDArray[np.int64]


class PlanIndex:
    """Index of points (n, 2 or more) by their first two coordinates, metres."""

    def __init__(self, points: NDArray[np.float32] | NDArray[np.float64]) -> None:
        cell = np.floor(points[:, :2] / CELL).astype(np.int64)
        self._low = cell.min(0) if len(cell) else np.zeros(2, np.int64)
        self._rows = int(cell[:, 1].max() - self._low[1] + 1) if len(cell) else 1
        keys = self._keys(cell)
        if keys.max(initial=0) < RADIX:
            keys = keys.astype(np.uint16)  # which numpy sorts digit by digit
        self._order = np.argsort(keys, kind="stable")
        keys = keys[self._order]
        first = np.flatnonzero(np.append(True, keys[1:] != keys[:-1])) if len(keys) else np.zeros(0, np.int64)
        self._cells, self._first = keys[first].astype(np.int64), np.append(first, len(keys))

    def _keys(self, cell: I64) -> I64:
        return (cell[:, 0] - self._low[0]) * self._rows + (cell[:, 1] - self._low[1])

    def along(self, line: NDArray[np.float64], reach: float, ordered: bool = True) -> I64:
        """Numbers of the points within ``reach`` metres of a line (2, 2), and some more; ascending if ``ordered``."""
        length = float(np.linalg.norm(line[1] - line[0]))
        steps = np.linspace(0.0, 1.0, int(length / (CELL / 2)) + 2)
        path = line[0] + steps[:, None] * (line[1] - line[0])
        span = np.arange(-int(np.ceil(reach / CELL + 0.5)), int(np.ceil(reach / CELL + 0.5)) + 1)
        around = np.stack(np.meshgrid(span, span), -1).reshape(-1, 2)
        cells = np.unique((np.floor(path / CELL).astype(np.int64)[:, None] + around).reshape(-1, 2), axis=0)
        inside = (cells[:, 1] >= self._low[1]) & (cells[:, 1] < self._low[1] + self._rows)
        rows = self._points(self._keys(cells[inside]))
        return np.sort(rows) if ordered else rows

    def near(self, place: NDArray[np.float64], reach: float) -> I64:
        """Numbers of the points within ``reach`` metres of a place (2,) along both axes, and some more."""
        return self.along(np.array([place, place]), reach)

    def _points(self, keys: I64) -> I64:
        """Numbers of the points in cells, cell by cell."""
        at = np.minimum(np.searchsorted(self._cells, keys), max(len(self._cells) - 1, 0))
        at = at[self._cells[at] == keys] if len(self._cells) else at[:0]
        parts = [self._order[self._first[k] : self._first[k + 1]] for k in at.tolist()]
        return np.concatenate(parts) if parts else np.zeros(0, np.int64)
