"""Contrast of colour and depth across upright and level lines of an orthoimage, in units of the face's own noise.

A line across which all of a door's height changes by little stands out from noise that is larger than the change, if
the means of strips on both sides are compared; the paper's pixel gradients (section V.B) need clear edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.medians import median
from scan2bim.openings.orthoimage import Orthoimage

STRIP = 3
"""Width, pixels, of the strips on both sides of a line that are compared: trims and frames are 25 mm and wider."""
BLOCK = 10
"""Length, pixels, of a line's pieces."""
FLOORS = (0.005, 0.005, 0.005, 0.0012)
"""Least noise of a piece's contrast in red, green, blue (of 1) and depth (metres): below it no wall is even."""
LEAST, SPARSE = 3, 0.15
"""Measured pixels that a strip's piece must have, and share of what the face's pieces usually have: fewer lie between
the slats of furniture, among ranges that are mixed of both.
"""
PROUD = 0.04
"""Metres before the wall's plane up to which a pixel is its own: trims stand out less, mixed ranges and things more."""
ENOUGH = 5_000
"""Steps by which noise is told to 1 %: a face has ten times as many."""
SIGNIFICANT = 3.0
"""Contrast, in noise, above which a piece of a line is a discontinuity."""
LARGEST = 8.0
"""Contrast, in noise, to which larger ones are cut, so that one strong piece does not speak for a whole line."""
CHANNELS = 4
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """``step`` (b, c, 4): for each piece b of BLOCK pixels along a line and place c across, how much red, green, blue
    and depth change from the lower to the higher side; ``ridge`` (b, c, 4) how much a strip at c differs from both
    sides; in noise, nan where not seen. ``noise`` (4,) of a piece's step.
    """

    step: F32
    ridge: F32
    noise: NDArray[np.float64]


def contrasts(image: Orthoimage) -> tuple[Contrast, Contrast]:
    """Across upright lines, b counting upwards and c along the wall, and across level lines, b counting along it."""
    upright, level = _blocks(image.count, image.rgb, image.depth)
    return _contrast(upright), _contrast(level)


def _contrast(sums: F32) -> Contrast:
    """For lines along the first axis, from the sums of their pieces."""
    step, ridge, known = _steps(sums, max(LEAST, SPARSE * STRIP * _usual(sums)))
    noise = np.array(FLOORS)
    if known.shape[1]:
        some = np.ascontiguousarray(known[:, :: max(1, known.shape[1] // ENOUGH)])
        usual = np.array([median(sizes) for sizes in some], np.float32)  # robust: most lie within one surface
        noise = np.maximum(noise, 1.4826 * usual)
    _scale(step, ridge, noise.astype(np.float32))
    return Contrast(step, ridge, noise)


@nb.njit(cache=True, nogil=True)
def _usual(sums):  # pyright: ignore
    """Measured pixels of a column's piece where any was measured, the median; 0 where none was."""
    pieces = np.zeros(BLOCK + 1, np.int64)
    for b in range(sums.shape[0]):
        for c in range(sums.shape[1]):
            pieces[int(sums[b, c, 4])] += 1
    below = np.cumsum(pieces[1:])
    if below[-1] == 0:
        return 0.0
    low, high = np.searchsorted(below, (below[-1] + 1) // 2), np.searchsorted(below, below[-1] // 2 + 1)
    return (low + high) / 2 + 1


@nb.njit(cache=True, nogil=True)
def _blocks(count, rgb, depth):  # pyright: ignore
    """Sums (b, c, 5) of colour, depth and 1 over each BLOCK pixels of a column, and (b, r, 5) of a row, of what was
    measured of the wall or is set in it, not of what stands before it; the last piece may be shorter.
    """
    rows, cols = depth.shape
    upright = np.zeros((max((rows + BLOCK - 1) // BLOCK, 1), cols, 5), np.float32)
    level = np.zeros((max((cols + BLOCK - 1) // BLOCK, 1), rows, 5), np.float32)
    proud = np.float32(PROUD)
    for r in range(rows):
        for j in range(level.shape[0]):
            red, green, blue, deep, n = np.float32(0), np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for c in range(j * BLOCK, min((j + 1) * BLOCK, cols)):
                if count[r, c] > 0 and depth[r, c] < proud:
                    red += rgb[r, c, 0]
                    green += rgb[r, c, 1]
                    blue += rgb[r, c, 2]
                    deep += depth[r, c]
                    n += np.float32(1)
                    sums = upright[r // BLOCK, c]
                    sums[0] += rgb[r, c, 0]
                    sums[1] += rgb[r, c, 1]
                    sums[2] += rgb[r, c, 2]
                    sums[3] += depth[r, c]
                    sums[4] += np.float32(1)
            sums = level[j, r]
            sums[0], sums[1], sums[2], sums[3], sums[4] = red, green, blue, deep, n
    return upright, level


@nb.njit(cache=True, nogil=True)
def _steps(sums, least):  # pyright: ignore
    """From the sums of pieces: steps and ridges (b, c, 4), nan where a strip has less than ``least`` measured pixels,
    and the sizes of the known steps (4, n) in any order.
    """
    pieces, places = sums.shape[:2]
    step = np.full((pieces, places, CHANNELS), np.nan, np.float32)
    ridge = np.full((pieces, places, CHANNELS), np.nan, np.float32)
    sizes = np.empty((CHANNELS, pieces * places), np.float32)
    total = np.zeros((places + 1, 5))
    used = 0
    for b in range(pieces):
        for c in range(places):
            for k in range(5):
                total[c + 1, k] = total[c, k] + sums[b, c, k]
        for c in range(places):
            low, lower = max(c - STRIP, 0), max(c - 1 - STRIP, 0)
            before, after = max(c - 1, 0), min(c + 1, places)
            high, higher = min(c + STRIP, places), min(c + 1 + STRIP, places)
            left, right = total[c, 4] - total[low, 4], total[high, 4] - total[c, 4]
            if left >= least and right >= least:
                for k in range(CHANNELS):
                    change = (total[high, k] - total[c, k]) / right - (total[c, k] - total[low, k]) / left
                    step[b, c, k] = change
                    sizes[k, used] = abs(change)
                used += 1
            here, left = total[after, 4] - total[before, 4], total[before, 4] - total[lower, 4]
            right = total[higher, 4] - total[after, 4]
            if here >= LEAST and left >= least and right >= least:
                for k in range(CHANNELS):
                    sides = (total[higher, k] - total[after, k]) / right + (total[before, k] - total[lower, k]) / left
                    ridge[b, c, k] = (total[after, k] - total[before, k]) / here - sides / 2
    return step, ridge, np.ascontiguousarray(sizes[:, :used])


@nb.njit(cache=True, nogil=True)
def _scale(step, ridge, noise):  # pyright: ignore
    """In units of the noise (4,), cut to LARGEST; in place."""
    most = np.float32(LARGEST)
    for values in (step.reshape(-1, CHANNELS), ridge.reshape(-1, CHANNELS)):
        for i in range(values.shape[0]):
            for k in range(CHANNELS):
                value = values[i, k] / noise[k]
                value = most if value > most else value
                values[i, k] = -most if value < -most else value
