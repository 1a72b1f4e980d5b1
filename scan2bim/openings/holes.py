"""Where a station's pulses went through a wall and never came back, in scans that do not record such pulses.

Scanners turn evenly: what they saw nothing of, though they saw all round it, is where nothing answered, as the sky
behind a window. Below a tripod, and beyond what was scanned at all, they saw nothing either; but that has no end.
"""

from __future__ import annotations

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.geometry.raster import opened

AROUND = 0.5
"""Metres round a wall in which a hole must end: the floor and ceiling before it are seen there."""
SPECK = 3
"""Squares of the grid, 15 cm, that a hole must hold along and up, as windows do."""
CELLS = 3
"""Cells of the panorama that it must hold along and up: single pulses are lost anywhere, and more at a slant."""


def holes(
    panorama: Panorama,
    start: NDArray[np.float64],
    direction: NDArray[np.float64],
    base: float,
    part: slice,
    rows: int,
    step: float,
) -> NDArray[np.bool_]:
    """Squares (``rows``, columns of ``part``) of a wall's grid of ``step`` metres, which begins at ``start`` (2,) at
    height ``base``, in which a station saw nothing, though it saw all round them.
    """
    pad = round(AROUND / step)
    up, along = np.mgrid[-pad : rows + pad, part.start - pad : part.stop + pad]
    xy = start + (along.ravel()[:, None] + 0.5) * step * direction
    points = np.column_stack([xy, base + (up.ravel() + 0.5) * step]).astype(np.float32)
    nothing = _unseen(points, panorama.position.astype(np.float32), panorama.ranges).reshape(up.shape)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened(nothing.astype(np.uint8), SPECK), connectivity=4)
    left, top, width, height = stats[:, :4].T
    inner = (left > 0) & (top > 0) & (left + width < nothing.shape[1]) & (top + height < nothing.shape[0])
    inner[0] = False
    return inner[labels][pad:-pad, pad:-pad] if count > 1 else np.zeros((rows, part.stop - part.start), np.bool_)


@nb.njit(cache=True, nogil=True)
def _unseen(points, position, ranges):  # pyright: ignore
    """Whether each of ``points`` (n, 3) lies in a block of CELLS x CELLS cells in which nothing was seen."""
    out = np.zeros(points.shape[0], np.bool_)
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        f, a, b = cube_cell(dx, dy, points[i, 2] - position[2], edge)
        if ranges[f, a, b] != 0.0:
            continue
        for u in range(max(a - CELLS + 1, 0), min(a, edge - CELLS) + 1):
            for v in range(max(b - CELLS + 1, 0), min(b, edge - CELLS) + 1):
                out[i] |= not ranges[f, u : u + CELLS, v : v + CELLS].any()
    return out
