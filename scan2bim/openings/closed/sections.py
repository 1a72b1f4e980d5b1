"""Sections across the sides and the head of a closed door: what a face shows by distance from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.medians import median
from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.rectangles import FOOT, Face, Rectangle
from scan2bim.openings.orthoimage import PIXEL

REACH = 0.28
"""Distance from a rectangle's side, metres, within which its edge is looked for: a trim's width, a frame's, and wall
beside them.
"""
BEFORE = 0.05
"""Distance before the wall, metres, from which on a point is a thing that stands there, no trim."""
TALL_ENOUGH = 20
"""Measured pixels that a column (row) needs to be asked."""
EVEN = 0.5
"""Share of the places across an edge, of the most that are seen at any height, that must be seen at a height: what
furniture hides in part would set one height's light against another's.
"""
BESIDE, OFF = 0.16, 0.03
"""Distance outwards, metres, from which on the wall shows beside a trim; and how far from its fitted plane it may lie
there: a wide door's leaf may have drawn that plane to itself.
"""
F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """Outwards from a side, where it was seen: distance ``t`` (n,) metres, ``values`` (n, 4) medians of red, green,
    blue and depth, and ``means`` of the same, in which a hairline shows; ``noise`` (4,) of neighbours' means.
    """

    t: F64
    values: F64
    means: F64
    noise: F64


def upright_section(face: Face, box: Rectangle, side: float, outward: int) -> Section:
    """Across a side: medians of columns between foot and head."""
    image = face.image
    rows = slice(round(FOOT / PIXEL), max(round((box.top - 0.15) / PIXEL), round(FOOT / PIXEL) + 1))
    t, cols = _places(side, outward, image.depth.shape[1])
    return _section(t, image.rgb[rows, cols], image.depth[rows, cols], image.count[rows, cols] > 0)


def level_section(face: Face, box: Rectangle) -> Section:
    """Across the head: medians of rows between the sides."""
    image = face.image
    width = image.depth.shape[1]
    cols = slice(min(max(round((box.left + 0.12) / PIXEL), 0), width), max(round((box.right - 0.12) / PIXEL), 0))
    t, rows = _places(box.top, 1, image.depth.shape[0])
    rgb, depth, known = image.rgb[rows, cols], image.depth[rows, cols], image.count[rows, cols] > 0
    return _section(t, rgb.transpose(1, 0, 2), depth.T, known.T)


def _places(side: float, outward: int, size: int) -> tuple[F64, NDArray[np.int64]]:
    """Distances outwards from a side, ascending, and the pixels there."""
    steps = np.arange(-round(REACH / PIXEL), round(REACH / PIXEL) + 1)
    pixels = round(side / PIXEL) + outward * steps
    inside = (pixels >= 0) & (pixels < size)
    t = ((pixels.astype(np.float64) + 0.5) * PIXEL - side) * outward
    return t[inside], pixels[inside]


def _section(t: F64, rgb: NDArray[np.float32], depth: NDArray[np.float32], measured: NDArray[np.bool_]) -> Section:
    """From pixels (k, n, ...) of n columns."""
    measured = measured & (depth < BEFORE)
    across = np.zeros(len(measured))
    if measured.size:
        across = cv2.blur(measured.mean(1)[None], (2 * BLOCK, 1), borderType=cv2.BORDER_REFLECT)[0]
    measured &= (across >= EVEN * across.max(initial=0.0))[:, None]
    out, means = _middles(rgb, depth, measured)
    known = np.isfinite(means[:, 3])
    steps = np.abs(np.diff(means[known], axis=0))
    noise = np.array([median(s) for s in np.ascontiguousarray(steps.T)]) if len(steps) else np.zeros(4)
    return Section(t[known], out[known], means[known], noise)


@nb.njit(cache=True, nogil=True)
def _middles(rgb, depth, measured):  # pyright: ignore
    """Medians and means (n, 4) of red, green, blue and depth of n columns' measured pixels, nan of too few."""
    rows, cols = measured.shape
    middle, mean = np.full((cols, 4), np.nan), np.full((cols, 4), np.nan)
    values = np.empty((4, rows))
    for c in range(cols):
        used = 0
        for r in range(rows):
            if measured[r, c]:
                for k in range(3):
                    values[k, used] = rgb[r, c, k]
                values[3, used] = depth[r, c]
                used += 1
        if used >= TALL_ENOUGH:
            for k in range(4):
                total = 0.0
                for i in range(used):
                    total += values[k, i]
                mean[c, k] = total / used
                middle[c, k] = median(values[k, :used])
    return middle, mean


def wall_beside(sections: Sequence[Section]) -> float:
    """Depth of the wall beside a rectangle, metres, from all its sides."""
    depths = np.concatenate([p.values[p.t > BESIDE, 3] for p in sections])
    near = depths[np.abs(depths) < OFF]
    return float(np.median(near)) if len(near) >= 3 else 0.0
