"""Lines of the discontinuity image by lateral histograms, and the rectangles that they make (section V.B)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.config import OpeningSettings
from scan2bim.openings.closed.lines import middles
from scan2bim.openings.orthoimage import PIXEL

NEAR = 1
"""Pixels by which white pixels may lie beside a line and still support it."""
MOST_LINES = 60
"""Upright and level lines each that are combined, the strongest."""
Mask = NDArray[np.bool_]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Rectangles:
    """Sides of n rectangles that stand on the floor, pixels: ``left``, ``right`` and ``top``, (n,) each."""

    left: I64
    right: I64
    top: I64

    def __len__(self) -> int:
        return len(self.left)

    def pick(self, keep: Mask) -> Rectangles:
        """Those of a mask (n,)."""
        return Rectangles(self.left[keep], self.right[keep], self.top[keep])


def lines_of(white: Mask, settings: OpeningSettings) -> tuple[I64, I64]:
    """Columns of upright lines and rows of level ones in J'_CD."""
    thick = _thick(white, 1)
    low = round(settings.paper_least_height / PIXEL)
    upright = _peaks(thick[: low + 1].sum(0), settings.paper_outline * 0.5 * low)
    thick = _thick(white, 0)
    level = _peaks(thick.sum(1), settings.paper_outline * settings.paper_least_width / PIXEL)
    return upright, level


def rectangles_of(upright: I64, level: I64, settings: OpeningSettings) -> Rectangles:
    """All rectangles of two upright lines and a level one within the limits of size that stand on the floor."""
    i, j = np.triu_indices(len(upright), 1)
    width = (upright[j] - upright[i]) * PIXEL
    fits = (width >= settings.paper_least_width) & (width <= settings.paper_most_width)
    left, right = upright[i][fits], upright[j][fits]
    height = level * PIXEL
    top = level[(height >= settings.paper_least_height) & (height <= settings.paper_most_height)]
    pair, head = (g.ravel() for g in np.meshgrid(np.arange(len(left)), top, indexing="ij"))
    return Rectangles(left[pair], right[pair], head)


def support_of(white: Mask, found: Rectangles) -> NDArray[np.float64]:
    """Share (n, 3) of left side, right side and head that white pixels support."""
    up = _cumulated(_thick(white, 1), 0)
    along = _cumulated(_thick(white, 0), 1)
    left, right, top = found.left, found.right, found.top
    return np.stack(
        [
            up[top, left] / np.maximum(top, 1),
            up[top, right] / np.maximum(top, 1),
            (along[top, right] - along[top, left]) / np.maximum(right - left, 1),
        ],
        1,
    )


def share_of(mask: Mask, found: Rectangles) -> NDArray[np.float64]:
    """Share (n,) of each rectangle's area that a mask (r, c) marks."""
    area = _cumulated(_cumulated(mask, 0), 1)
    inner = area[found.top, found.right] - area[found.top, found.left]
    return inner / np.maximum(found.top * (found.right - found.left), 1)


def outermost(found: Rectangles) -> Mask:
    """Which rectangles (n,) lie in no other one."""
    within = (found.left[:, None] >= found.left[None]) & (found.right[:, None] <= found.right[None])
    within &= found.top[:, None] <= found.top[None]
    np.fill_diagonal(within, val=False)
    return np.asarray(~within.any(1), np.bool_)


def _thick(white: Mask, axis: int) -> Mask:
    out = white.copy()
    for shift in range(1, NEAR + 1):
        out |= np.roll(white, shift, axis) | np.roll(white, -shift, axis)
    return out


def _peaks(histogram: NDArray[np.integer], least: float) -> I64:
    """Local maxima of a lateral histogram that are long enough, the strongest MOST_LINES, in order."""
    padded = np.pad(histogram, 2)
    window = np.lib.stride_tricks.sliding_window_view(padded, 5).max(1)
    at = middles(np.flatnonzero((histogram >= least) & (histogram >= window)))
    return np.sort(at[np.argsort(-histogram[at], kind="stable")[:MOST_LINES]])


def _cumulated(values: NDArray[np.bool_] | NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    pad = [(0, 0), (0, 0)]
    pad[axis] = (1, 0)
    return np.cumsum(np.pad(values.astype(np.float64), pad), axis)
