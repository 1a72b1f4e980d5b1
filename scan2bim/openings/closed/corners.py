"""Rectangles told by their heads: furniture hides the sides of doors, seldom what is above it.

A line of the wall that is a discontinuity from one place to another, and at both of these the top of an upright line,
is a head from corner to corner, however little of the sides was seen below.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.lines import Support

LONGEST_GAP = 3
"""Pieces of a head, 30 cm, that something may hide in a row."""
LEAST_LINE = 0.6
"""Share of a head's pieces that must be discontinuities."""
LEG = 3
"""Pieces below a corner, 30 cm, in which its upright line is looked for."""
REACH = 12
"""Pixels from the end of a head's pieces within which its corner lies: a piece and a line's width."""
CORNERS = 2
"""Upright lines that are tried at an end: a trim has two."""
LEAST_LEG = 0.65
"""Share of the pieces below a corner, of those seen, that must be discontinuities."""
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]


def rectangles_below(heads: Support, uprights: Sequence[Support], rows: tuple[int, int], width: tuple[int, int]) -> F32:
    """Left, right and top, pixels, and how well it is seen, (n, 4), the best first, of the rectangles of a face's
    ``heads`` between two ``rows`` whose corners are ends of the ``uprights`` of any face; ``width`` least and greatest.
    """
    runs = _runs(heads.rising, heads.falling, heads.seen, rows[0], min(rows[1], heads.places), width[0], width[1])
    legs = [_legs(u.rising, u.falling, u.seen, rows[0], rows[1]) for u in uprights]
    if not len(runs) or not legs:
        return np.zeros((0, 4), np.float32)
    found = _middles(_joined(runs, np.max(legs, axis=0), rows[0], width[0], width[1]))
    return found[np.argsort(-found[:, 3], kind="stable")]


def _middles(found: F32) -> F32:
    """Of rectangles (n, 4) that differ by their tops alone, row by row, the middle ones: a scan blurs a head's line."""
    ordered = found[np.lexsort(found.T[[2, 3, 1, 0]])]
    if not len(ordered):
        return ordered
    step = np.diff(ordered, axis=0)
    apart = (step[:, [0, 1, 3]] != 0).any(1) | (step[:, 2] > 1)
    first = np.concatenate([[0], np.flatnonzero(apart) + 1])
    return ordered[(first + np.append(first[1:], len(ordered)) - 1) // 2]


@nb.njit(cache=True, nogil=True)
def _runs(rising, falling, seen, low, high, narrowest, widest):  # pyright: ignore
    """Row, first and past the last piece, and share of discontinuities (n, 4) of stretches of level lines that are one
    change all along, but for what is hidden.
    """
    out = [(0.0, 0.0, 0.0, 0.0) for _ in range(0)]
    pieces = seen.shape[0] - 1
    for row in range(low, high):
        for k in range(2 * rising.shape[0]):
            total = rising[k // 2] if k % 2 else falling[k // 2]
            first, last, here, gap = -1, -1, 0, 0
            for b in range(pieces + 1):
                known = b < pieces and seen[b + 1, row] > seen[b, row]
                change = known and total[b + 1, row] > total[b, row]
                if change:
                    first = b if first < 0 else first
                    last, here, gap = b + 1, here + 1, 0
                    continue
                gap += 1
                if first >= 0 and (known or gap > LONGEST_GAP or b == pieces):
                    length = (last - first) * BLOCK
                    if narrowest - BLOCK <= length <= widest + BLOCK and here >= LEAST_LINE * (last - first):
                        out.append((float(row), float(first), float(last), here / (last - first)))
                    first = -1
    found = np.zeros((len(out), 4), np.float32)
    for i in range(len(out)):
        found[i] = out[i]
    return found


@nb.njit(cache=True, nogil=True)
def _legs(rising, falling, seen, low, high):  # pyright: ignore
    """For each row and place (high - low, c) the best share of discontinuities of one kind just below, 0 where it is
    small; what was seen of it counts.
    """
    places, pieces = seen.shape[1], seen.shape[0] - 1
    out = np.zeros((high - low, places), np.float32)
    for row in range(low, high):
        last = min((row - 5) // BLOCK, pieces)
        first = max(last - LEG, 0)
        for c in range(places):
            known = seen[last, c] - seen[first, c]
            if known == 0:
                continue
            most = 0
            for k in range(rising.shape[0]):
                most = max(most, rising[k, last, c] - rising[k, first, c], falling[k, last, c] - falling[k, first, c])
            if most >= LEAST_LEG * known:
                out[row - low, c] = most / LEG
    return out


@nb.njit(cache=True, nogil=True)
def _joined(runs, legs, low, narrowest, widest):  # pyright: ignore
    """Left, right, top and worth (n, 4) of the heads ``runs`` with the best upright lines at their ends."""
    out = [(0.0, 0.0, 0.0, 0.0) for _ in range(0)]
    for i in range(len(runs)):
        row = int(runs[i, 0])
        starts = _best_near(legs[row - low], int(runs[i, 1]) * BLOCK)
        ends = _best_near(legs[row - low], int(runs[i, 2]) * BLOCK)
        for left in starts:
            for right in ends:
                if left >= 0 and right >= 0 and narrowest <= right - left <= widest:
                    worth = runs[i, 3] + legs[row - low, left] + legs[row - low, right]
                    out.append((float(left), float(right), float(row), float(worth)))
    found = np.zeros((len(out), 4), np.float32)
    for i in range(len(out)):
        found[i] = out[i]
    return found


@nb.njit(cache=True, nogil=True)
def _best_near(line, place):  # pyright: ignore
    """The places (CORNERS,) of the greatest values of a row within REACH of one, -1 where there are fewer: the middles
    of runs of equal values.
    """
    out = np.full(CORNERS, -1)
    low, high = max(place - REACH, 0), min(place + REACH + 1, len(line))
    taken = np.zeros(len(line), np.bool_)
    for k in range(CORNERS):
        best, at = np.float32(0), -1
        for c in range(low, high):
            if not taken[c] and line[c] > best:
                best, at = line[c], c
        if at < 0:
            break
        end = at
        while end + 1 < high and line[end + 1] == best and not taken[end + 1]:
            end += 1
        out[k] = (at + end) // 2
        taken[max(at - 2, 0) : end + 3] = True
    return out
