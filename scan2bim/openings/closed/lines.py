"""Lines of an orthoimage with the share of their pieces that are discontinuities, for any stretch of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import BLOCK, SIGNIFICANT, Contrast

NEIGHBOURS = 1
"""Pixels by which a line may be off: a scan's step blurs an edge."""
I64 = NDArray[np.int64]
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """Cumulative numbers, over the pieces of each line, of those that rise and fall significantly, (8, b + 1, c): step
    and ridge of red, green, blue and depth; and of those seen, (b + 1, c).
    """

    rising: F32
    falling: F32
    seen: F32

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
        first, last = np.clip(first, 0, self.pieces), np.clip(last, 0, self.pieces)
        at = np.clip(place, 0, self.places - 1)
        seen = self.seen[last, at] - self.seen[first, at]
        up = self.rising[:, last, at] - self.rising[:, first, at]
        down = self.falling[:, last, at] - self.falling[:, first, at]
        found = np.maximum(up, down).max(0)
        inside = (place >= 0) & (place < self.places)
        length = np.maximum(last - first, 1)
        share = np.where(inside & (seen > 0.25 * length), np.minimum(found / np.maximum(seen, 1), 1), 0)
        return share.astype(np.float32), np.where(inside, seen / length, 0).astype(np.float32)


def support_of(contrast: Contrast) -> Support:
    """Cumulated from the contrast of a face."""
    values = np.concatenate([contrast.step, contrast.ridge], 2)
    seen = np.isfinite(contrast.step[..., -1])
    with np.errstate(invalid="ignore"):
        rising = _spread((values > SIGNIFICANT).transpose(2, 0, 1)) & seen
        falling = _spread((values < -SIGNIFICANT).transpose(2, 0, 1)) & seen
    return Support(_cumulated(rising), _cumulated(falling), _cumulated(seen[None])[0])


def _spread(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    out = mask.copy()
    for shift in range(1, NEIGHBOURS + 1):
        out[..., shift:] |= mask[..., :-shift]
        out[..., :-shift] |= mask[..., shift:]
    return out


def _cumulated(mask: NDArray[np.bool_]) -> F32:
    out = np.zeros((mask.shape[0], mask.shape[1] + 1, mask.shape[2]), np.float32)
    np.cumsum(mask, axis=1, out=out[:, 1:])
    return out


def find_lines(support: Support, contrast: Contrast, first: int, last: int, least: float, apart: int) -> I64:
    """Places of lines with at least the share ``least`` of significant pieces between two pieces, the best within
    ``apart`` pixels of each other.
    """
    places = np.arange(support.places)
    share, seen = support.share(places, np.full(len(places), first), np.full(len(places), last))
    values = np.concatenate([contrast.step, contrast.ridge], 2)[first:last]
    with np.errstate(invalid="ignore"):
        strength = np.abs(np.nansum(values, 0)).max(1) / max(last - first, 1)
    score = np.where((share >= least) & (seen > 0.3), share + 0.1 * strength, 0)
    padded = np.pad(score, apart)
    window = np.lib.stride_tricks.sliding_window_view(padded, 2 * apart + 1).max(1)
    return middles(np.flatnonzero((score > 0) & (score >= window)))


def middles(places: I64) -> I64:
    """Of each run of neighbouring places (n,) the middle one."""
    if not len(places):
        return places
    first = np.append(True, np.diff(places) > 1)
    last = np.append(first[1:], True)
    return (places[first] + places[last]) // 2


def pieces_of(low: float, high: float, pixel: float) -> tuple[int, int]:
    """The pieces that lie between two places, metres."""
    return int(np.ceil(low / (BLOCK * pixel) - 1e-6)), int(np.floor(high / (BLOCK * pixel) + 1e-6))
