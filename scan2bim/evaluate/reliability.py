"""Whether confidences are probabilities: of the elements said to be 80 % sure, 80 % should be right."""

from __future__ import annotations

from collections.abc import Sequence

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
    gap = sum(b.count * abs(b.confidence - b.right) for b in bins) / len(sure)
    return Reliability(count=len(sure), expected_calibration_error=gap, bins=bins)
