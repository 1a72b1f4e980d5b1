"""Whether confidences are probabilities: of the elements said to be 80 % sure, 80 % should be right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict

BINS = 10


class Bin(BaseModel):
    """Elements whose confidence lies between low and high: how many, their mean confidence, the share that is right."""

    model_config = ConfigDict(frozen=True)

    low: float
    high: float
    count: int
    confidence: float
    right: float


class Reliability(BaseModel):
    """Bins that hold something, and the mean gap between confidence and share, weighted by number."""

    model_config = ConfigDict(frozen=True)

    count: int
    expected_calibration_error: float
    bins: tuple[Bin, ...]


def reliability(confidences: Sequence[float], right: Sequence[bool]) -> Reliability | None:
    """Of elements with these confidences, of which those were right; None where there is none."""
    if not confidences:
        return None
    sure, hit = np.array(confidences), np.array(right, dtype=np.float64)
    place = np.minimum((sure * BINS).astype(np.int64), BINS - 1)
    bins = tuple(
        Bin(
            low=k / BINS,
            high=(k + 1) / BINS,
            count=int((place == k).sum()),
            confidence=float(sure[place == k].mean()),
            right=float(hit[place == k].mean()),
        )
        for k in np.unique(place).tolist()
    )
    return _of(bins)


def pooled(parts: Iterable[Reliability | None]) -> Reliability | None:
    """Of all elements of several; None where there is none."""
    known = [b for part in parts if part is not None for b in part.bins]
    bins: list[Bin] = []
    for low, high in sorted({(b.low, b.high) for b in known}):
        mine = [b for b in known if b.low == low]
        counts = [b.count for b in mine]
        sure = float(np.average([b.confidence for b in mine], weights=counts))
        right = float(np.average([b.right for b in mine], weights=counts))
        bins.append(Bin(low=low, high=high, count=sum(counts), confidence=sure, right=right))
    return _of(tuple(bins)) if bins else None


def _of(bins: tuple[Bin, ...]) -> Reliability:
    count = sum(b.count for b in bins)
    gap = sum(b.count * abs(b.confidence - b.right) for b in bins) / count
    return Reliability(count=count, expected_calibration_error=gap, bins=bins)
