"""Fitting probabilities to right and wrong examples, and telling how well they are calibrated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.evaluate.reliability import Reliability, reliability

F64 = NDArray[np.float64]


def fitted(rows: F64, right: NDArray[np.bool_], ridge: float, weight: F64 | float = 1.0) -> F64:
    """Weights (k,) of a logistic regression on features (n, k), the first of them 1, by Newton's method.

    ``ridge`` weighs the squares of the weights, ``weight`` the examples (n,).
    """
    weights = np.zeros(rows.shape[1])
    penalty = np.diag([0.0, *[ridge] * (rows.shape[1] - 1)])
    for _ in range(50):
        chance = 1 / (1 + np.exp(-rows @ weights))
        slope = rows.T @ (weight * (right - chance)) - penalty @ weights
        bend = (rows * (weight * chance * (1 - chance))[:, None]).T @ rows + penalty
        weights = weights + np.linalg.solve(bend, slope)
    return weights


def judged(rows: F64, right: NDArray[np.bool_], weights: F64, least: float, most: float) -> Reliability | None:
    """The reliability of what ``weights`` say."""
    chance = np.clip(1 / (1 + np.exp(-rows @ weights)), least, most)
    return reliability(chance.tolist(), right.tolist())


def tell(name: str, found: Reliability | None) -> None:
    """Print the reliability table and the expected calibration error."""
    if found is None:
        print(f"{name}: nothing")
        return
    share = sum(b.right * b.count for b in found.bins) / found.count
    print(f"{name}: {found.count}, {share:.3f} of them right")
    for b in found.bins:
        print(f"  said {b.low:.1f}-{b.high:.1f}: {b.count:4d}, mean {b.confidence:.3f}, right {b.right:.3f}")
    print(f"  expected calibration error {found.expected_calibration_error:.3f}")


def newest(work: Path, stage: str, name: str) -> Path:
    """A stage's file in a work folder, of its last run."""
    return max((work / "stages" / stage).glob(f"*/{name}"), key=lambda p: p.stat().st_mtime)
