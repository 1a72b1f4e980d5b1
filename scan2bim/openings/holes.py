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
    shape = rows + 2 * pad, part.stop - part.start + 2 * pad
    first = np.array([start[0], start[1], base]), direction, step, part.start - pad, -pad
    seen_from = panorama.position.astype(np.float32), panorama.ranges
    nothing: NDArray[np.bool_] = np.asarray(_unseen(*first, shape, *seen_from))
    if not nothing.any():
        return np.zeros((rows, part.stop - part.start), np.bool_)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened(nothing.astype(np.uint8), SPECK), connectivity=4)
    left, top, width, height = stats[:, :4].T
    inner = (left > 0) & (top > 0) & (left + width < nothing.shape[1]) & (top + height < nothing.shape[0])
    inner[0] = False
    return inner[labels][pad:-pad, pad:-pad] if count > 1 else np.zeros((rows, part.stop - part.start), np.bool_)


@nb.njit(cache=True, nogil=True)
def _unseen(start, direction, step, left, bottom, shape, position, ranges):  # pyright: ignore
    """Whether each square (r, c) of a grid of ``step`` metres lies in a block of CELLS x CELLS cells in which nothing
    was seen. ``start`` (3,) of the wall; ``left``, ``bottom`` the first square's place along and up from there.
    """
    out = np.zeros(shape, np.bool_)
    for c in range(shape[1]):
        along = (c + left + 0.5) * step
        dx = np.float32(start[0] + along * direction[0]) - position[0]
        dy = np.float32(start[1] + along * direction[1]) - position[1]
        for r in range(shape[0]):
            dz = np.float32(start[2] + (r + bottom + 0.5) * step) - position[2]
            out[r, c] = _in_empty_block(*cube_cell(dx, dy, dz, ranges.shape[1]), ranges)
    return out


@nb.njit(cache=True, nogil=True)
def _in_empty_block(f, a, b, ranges):  # pyright: ignore
    """Whether a cell of a panorama lies in a block of CELLS x CELLS cells in which nothing was seen."""
    if ranges[f, a, b] != 0.0:
        return False
    edge = ranges.shape[1]
    for u in range(max(a - CELLS + 1, 0), min(a, edge - CELLS) + 1):
        for v in range(max(b - CELLS + 1, 0), min(b, edge - CELLS) + 1):
            seen = False
            for p in range(u, u + CELLS):
                for q in range(v, v + CELLS):
                    seen |= ranges[f, p, q] != 0.0
            if not seen:
                return True
    return False
