"""The paper's measures of a found door (section VI): overlap of the two rectangles' areas."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict

from scan2bim.evaluate.matching import Overlap

BETAS = tuple(float(beta) for beta in np.round(np.geomspace(1 / 3, 3, 13), 4))
"""Weights of recall against precision, from 1/3 to 3, 1 in the middle."""


class AreaMeasures(BaseModel):
    """Of one found opening, or means over several: equations (1), (2), (4) and (5); areas in square metres."""

    model_config = ConfigDict(frozen=True)

    precision: float
    recall: float
    absolute_error: float
    relative_error: float


def area_measures(found: Overlap) -> AreaMeasures:
    """With tp the area of both, fp the found area outside the true one, and fn the true area that was not found."""
    tp, fp, fn = found.hit, found.predicted - found.hit, found.true - found.hit
    return AreaMeasures(
        precision=tp / (tp + fp),
        recall=tp / (tp + fn),
        absolute_error=fp + fn,
        relative_error=(fp + fn) / (fp + tp),
    )


def mean_measures(all_of: Sequence[AreaMeasures]) -> AreaMeasures | None:
    """Means over the found openings, as in the last row of Table I; None where none was found."""
    if not all_of:
        return None
    return AreaMeasures(
        precision=float(np.mean([one.precision for one in all_of])),
        recall=float(np.mean([one.recall for one in all_of])),
        absolute_error=float(np.mean([one.absolute_error for one in all_of])),
        relative_error=float(np.mean([one.relative_error for one in all_of])),
    )


def f_beta(precision: float, recall: float, beta: float) -> float:
    """Equation (3)."""
    below = beta**2 * precision + recall
    return (1 + beta**2) * precision * recall / below if below > 0.0 else 0.0


def f_curve(all_of: Sequence[AreaMeasures]) -> tuple[float, ...]:
    """The mean F-measure of the found openings for each of ``BETAS``; empty where none was found."""
    if not all_of:
        return ()
    return tuple(float(np.mean([f_beta(one.precision, one.recall, beta) for one in all_of])) for beta in BETAS)
