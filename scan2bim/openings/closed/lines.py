"""Lines of an orthoimage with the share of their pieces that are discontinuities, for any stretch of them."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import SIGNIFICANT, Contrast

LEAST_SEEN = 0.15
"""Share of a line that must be seen to tell anything of it: furniture hides most of some doors' sides."""
I64 = NDArray[np.int64]
I16 = NDArray[np.int16]
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """Cumulative numbers, over the pieces of each line, of those that rise and fall significantly, (8, b + 1, c): step
    and ridge of red, green, blue and depth; and of those seen, (b + 1, c).
    """

    rising: I16
    falling: I16
    seen: I16

    @property
    def pieces(self) -> int:
        """Pieces of a line."""
        return self.seen.shape[0] - 1

    @property
    def places(self) -> int:
        """Places across, pixels."""
        return self.seen.shape[1]

    def share(self, place: I64, first: I64, last: I64) -> tuple[F32, F32]:
        """Best share of significant pieces among those seen, and share of pieces seen, of lines at ``place`` (n,)
        between the pieces ``first`` and ``last`` (n,): 0 where nothing was seen.
        """
        return _share(self.rising, self.falling, self.seen, place, first, last)


@nb.njit(cache=True, nogil=True)
def _share(rising, falling, seen, place, first, last):  # pyright: ignore
    """What ``Support.share`` gives; ``first`` and ``last`` are (n,), or (1,) where they are the same for all."""
    pieces, places = seen.shape[0] - 1, seen.shape[1]
    share, part = np.zeros(len(place), np.float32), np.zeros(len(place), np.float32)
    for i in range(len(place)):
        c = place[i]
        if c < 0 or c >= places:
            continue
        a = min(max(first[i if len(first) > 1 else 0], 0), pieces)
        b = min(max(last[i if len(last) > 1 else 0], 0), pieces)
        length = max(b - a, 1)
        here = seen[b, c] - seen[a, c]
        part[i] = here / length
        if here > LEAST_SEEN * length:
            found = 0
            for k in range(rising.shape[0]):
                found = max(found, rising[k, b, c] - rising[k, a, c], falling[k, b, c] - falling[k, a, c])
            share[i] = min(found / max(here, 1), 1.0)
    return share, part


@nb.njit(cache=True, nogil=True)
def best_share(rising, falling, seen, place, first, last):  # pyright: ignore
    """The best of ``Support.share`` of lines at ``place`` (n,) between two pieces."""
    share, _ = _share(rising, falling, seen, place, np.array([first]), np.array([last]))
    return share.max()


@nb.njit(cache=True, nogil=True)
def kinds(rising, falling, seen, place, first, last):  # pyright: ignore
    """Best shares (2, 8) of the pieces between two of them that rise and that fall, for each of the eight contrasts of
    a ``Support``, of lines at ``place`` (n,); and the greatest share of pieces seen.
    """
    pieces, places = seen.shape[0] - 1, seen.shape[1]
    a, b = min(max(first, 0), pieces), min(max(last, 0), pieces)
    length = max(b - a, 1)
    share, part = np.zeros((2, rising.shape[0]), np.float32), np.float32(0)
    for c in place:
        if c < 0 or c >= places:
            continue
        here = np.int64(seen[b, c]) - seen[a, c]
        part = max(part, np.float32(here / length))
        if here > LEAST_SEEN * length:
            total = np.float32(max(here, 1))
            for k in range(rising.shape[0]):
                up = np.float32(np.int64(rising[k, b, c]) - rising[k, a, c]) / total
                down = np.float32(np.int64(falling[k, b, c]) - falling[k, a, c]) / total
                share[0, k] = max(share[0, k], min(up, np.float32(1)))
                share[1, k] = max(share[1, k], min(down, np.float32(1)))
    return share, part


def support_of(contrast: Contrast) -> Support:
    """Cumulated from the contrast of a face."""
    return Support(*_cumulated(contrast.step, contrast.ridge))


@nb.njit(cache=True, nogil=True)
def _cumulated(step, ridge):  # pyright: ignore
    """Rising, falling and seen pieces of a ``Support``; a line may be off by a pixel: a scan blurs edges."""
    pieces, places, channels = step.shape
    rising = np.zeros((2 * channels, pieces + 1, places), np.int16)
    falling = np.zeros((2 * channels, pieces + 1, places), np.int16)
    seen = np.zeros((pieces + 1, places), np.int16)
    up, down = np.empty(places + 2, np.int16), np.empty(places + 2, np.int16)  # one more on both sides
    up[0], down[0], up[-1], down[-1] = 0, 0, 0, 0
    for b in range(pieces):
        for c in range(places):
            seen[b + 1, c] = seen[b, c] + (not np.isnan(step[b, c, channels - 1]))
        for k in range(2 * channels):
            values = step[b, :, k] if k < channels else ridge[b, :, k - channels]
            for c in range(places):
                up[c + 1], down[c + 1] = values[c] > SIGNIFICANT, values[c] < -SIGNIFICANT
            for c in range(places):
                known = seen[b + 1, c] - seen[b, c]
                rising[k, b + 1, c] = rising[k, b, c] + (known & (up[c] | up[c + 1] | up[c + 2]))
                falling[k, b + 1, c] = falling[k, b, c] + (known & (down[c] | down[c + 1] | down[c + 2]))
    return rising, falling, seen


def find_lines(support: Support, contrast: Contrast, first: int, last: int, least: float, apart: int) -> I64:
    """Places of lines with at least the share ``least`` of significant pieces between two pieces, the best within
    ``apart`` pixels of each other.
    """
    places = np.arange(support.places)
    share, seen = support.share(places, np.full(len(places), first), np.full(len(places), last))
    strength = _strength(contrast.step[first:last], contrast.ridge[first:last]) / max(last - first, 1)
    score = np.where((share >= least) & (seen > LEAST_SEEN), share + 0.1 * strength, 0)
    return middles(np.flatnonzero((score > 0) & (score >= largest_near(score[None], apart)[0])))


def largest_near(values: NDArray[np.floating], reach: int) -> NDArray[np.floating]:
    """The largest of values (r, c), none negative, within ``reach`` columns."""
    padded = np.pad(values, ((0, 0), (reach, reach)))
    return np.maximum.reduce([padded[:, k : k + values.shape[1]] for k in range(2 * reach + 1)])


@nb.njit(cache=True, nogil=True)
def _strength(step, ridge):  # pyright: ignore
    """The greatest sum of known contrasts, of all kinds, along each line (c,)."""
    pieces, places, channels = step.shape
    most, total = np.zeros(places, np.float32), np.zeros((places, 2 * channels), np.float32)
    for b in range(pieces):
        for c in range(places):
            for k in range(channels):
                if not np.isnan(step[b, c, k]):
                    total[c, k] += step[b, c, k]
                if not np.isnan(ridge[b, c, k]):
                    total[c, channels + k] += ridge[b, c, k]
    for c in range(places):
        for k in range(2 * channels):
            most[c] = max(most[c], abs(total[c, k]))
    return most


def middles(places: I64) -> I64:
    """Of each run of neighbouring places (n,) the middle one."""
    if not len(places):
        return places
    first = np.append(True, np.diff(places) > 1)
    last = np.append(first[1:], True)
    return (places[first] + places[last]) // 2
