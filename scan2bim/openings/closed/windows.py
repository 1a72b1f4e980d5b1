"""What rectangles of an orthoimage hold: known values, medians and shares, in compiled loops: there are thousands."""

from __future__ import annotations

import numba as nb
import numpy as np

from scan2bim.geometry.medians import median
from scan2bim.openings.orthoimage import PIXEL

FEWEST = 50
"""Known values by which a level is told."""


@nb.njit(cache=True, nogil=True)
def window(shape, left, right, bottom, top):  # pyright: ignore
    """The pixels of a rectangle in metres, as far as they are in an image of a shape: first and past the last row,
    first and past the last column.
    """
    low, high = _pixel(bottom, shape[0]), _pixel(top, shape[0])
    return low, high, _pixel(left, shape[1]), _pixel(right, shape[1])


@nb.njit(cache=True, nogil=True)
def _pixel(place, size):  # pyright: ignore
    return min(max(int(np.rint(place / PIXEL)), 0), size)


@nb.njit(cache=True, nogil=True)
def known_values(values, known, part, step):  # pyright: ignore
    """Known values (k,) of (r, c) in a window, every ``step``-th row and column."""
    low, high, first, last = part
    out = np.empty(max((high - low + step - 1) // step, 0) * max((last - first + step - 1) // step, 0), np.float32)
    used = 0
    for r in range(low, high, step):
        for c in range(first, last, step):
            if known[r, c]:
                out[used] = values[r, c]
                used += 1
    return out[:used]


@nb.njit(cache=True, nogil=True)
def level(values):  # pyright: ignore
    """The median of values (k,), nan of too few."""
    return median(values) if len(values) > FEWEST else np.nan


@nb.njit(cache=True, nogil=True)
def share_near(values, place, reach):  # pyright: ignore
    """Share of values (k,) within ``reach`` of a place, 0 of too few."""
    if len(values) <= FEWEST:
        return 0.0
    near = 0
    for value in values:
        near += abs(value - place) < reach
    return near / len(values)


@nb.njit(cache=True, nogil=True)
def wall_level(left, right, above, skin, step):  # pyright: ignore
    """Depth of the wall round a rectangle: that of two of its flanks and of what is above its head that agree, where no
    furniture stands, else the most of the flanks that lies near the wall's plane, else that plane itself.
    """
    for a, b in ((left, right), (left, above), (right, above)):
        if len(a) > FEWEST and len(b) > FEWEST:
            one, other = np.median(a), np.median(b)
            if abs(one - other) < skin / 2 and max(abs(one), abs(other)) < step:
                return (one + other) / 2
    near = np.empty(len(left) + len(right), np.float32)
    used = 0
    for flank in (left, right):
        for value in flank:
            if abs(value) < skin:
                near[used] = value
                used += 1
    return np.median(near[:used]) if used > FEWEST else 0.0


@nb.njit(cache=True, nogil=True)
def colour_step(rgb, known, inside, left, right, step, fewest):  # pyright: ignore
    """Largest difference, over the channels, of the median in a window and in two beside it, 0 of too few values."""
    most = 0.0
    for k in range(3):
        values = rgb[:, :, k]
        inner = known_values(values, known, inside, step)
        beside = np.concatenate((known_values(values, known, left, step), known_values(values, known, right, step)))
        if len(inner) < fewest or len(beside) < fewest:
            return 0.0
        most = max(most, abs(median(inner) - median(beside)))
    return most


@nb.njit(cache=True, nogil=True)
def share_known(known, part, step):  # pyright: ignore
    """Share of known pixels of a window, every ``step``-th row and column."""
    low, high, first, last = part
    total = 0
    found = 0
    for r in range(low, high, step):
        for c in range(first, last, step):
            total += 1
            found += known[r, c]
    return found / max(total, 1)


@nb.njit(cache=True, nogil=True)
def share_level(depth, known, part, place, reach):  # pyright: ignore
    """Share of a window's pixels that are known to lie within ``reach`` of a depth."""
    low, high, first, last = part
    found = 0
    for r in range(low, high):
        for c in range(first, last):
            found += known[r, c] and abs(depth[r, c] - place) < reach
    return found / max((high - low) * (last - first), 1)


@nb.njit(cache=True, nogil=True)
def stands_out(means, wall, fewest):  # pyright: ignore
    """Metres by which the highest strip of three of the depths (n, 4) stands out from the wall, 0 where it does not end
    on both sides.
    """
    depth = np.empty(len(means), np.float32)
    used = 0
    for k in range(len(means)):
        if not np.isnan(means[k, 3]):
            depth[used] = means[k, 3] - np.float32(wall)
            used += 1
    if used < max(fewest, 3):
        return 0.0
    at = 0
    best = -np.inf
    for k in range(used - 2):
        strip = (np.float64(depth[k]) + depth[k + 1] + depth[k + 2]) / 3
        if strip > best:
            at, best = k, strip
    ends = max(depth[: at + 1].min(), depth[at + 2 : used].min())
    return max(best - max(ends, 0.0), 0.0)


@nb.njit(cache=True, nogil=True)
def share_alike(means, place, reach, colour, fewest):  # pyright: ignore
    """Share of columns with means (n, 4) that have a depth, within ``reach``, and the columns' colour."""
    rows = np.flatnonzero(~np.isnan(means[:, 3]))
    if len(rows) < fewest:
        return 0.0
    usual = np.empty(3)
    for k in range(3):
        usual[k] = median(means[rows, k])
    alike = 0
    for row in rows:
        same = abs(means[row, 3] - place) < reach
        for k in range(3):
            same &= abs(means[row, k] - usual[k]) < colour
        alike += same
    return alike / len(rows)


@nb.njit(cache=True, nogil=True)
def blob(depth, count, part, place, least, most):  # pyright: ignore
    """Measured pixels of a window between two distances before a depth: how many, their share, first and last row from
    the window's, and mean row.
    """
    low, high, first, last = part
    found = 0
    lowest, highest, total = -1, -1, 0.0
    for r in range(low, high):
        here = 0
        for c in range(first, last):
            out = depth[r, c] - place
            here += count[r, c] > 0 and least < out < most
        if here:
            lowest = lowest if lowest >= 0 else r - low
            highest = r - low
            total += here * (r - low)
            found += here
    return found, found / max((high - low) * (last - first), 1), lowest, highest, total / max(found, 1)
