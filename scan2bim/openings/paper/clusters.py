"""Adaptive k-means: clusters whose number the data choose, and how well each member fits its own."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

MOST = 8
"""Clusters that are tried at most: a wall with its door, trims, pictures and furniture shows fewer colours."""
UNIFORM = 0.04
"""Deviation (of 1) in every component below which all values are one cluster."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """``label`` (n,) of each value, ``silhouette`` (n,) from -1 to 1 of how well it fits its cluster."""

    label: I64
    silhouette: F64

    @property
    def count(self) -> int:
        """Number of clusters."""
        return int(self.label.max()) + 1 if len(self.label) else 0

    @property
    def dominant(self) -> float:
        """Share of the largest cluster."""
        return float(np.bincount(self.label).max() / len(self.label)) if len(self.label) else 0.0


def adaptive_k_means(values: F64) -> Clusters:
    """Clusters of ``values`` (n, d): of all numbers of clusters the one with the best mean silhouette."""
    if len(values) < 3 or (values.std(0) < UNIFORM).all():
        return Clusters(np.zeros(len(values), np.int64), np.ones(len(values)))
    distance = np.linalg.norm(values[:, None] - values[None], axis=2)
    best: Clusters | None = None
    for k in range(2, min(MOST, len(values) - 1) + 1):
        label = _k_means(values, k)
        found = Clusters(label, silhouettes(distance, label))
        if best is None or found.silhouette.mean() > best.silhouette.mean() + 0.01:
            best = found
    assert best is not None
    return best


def _k_means(values: F64, k: int) -> I64:
    """Labels (n,), the same from run to run."""
    cv2.setRNGSeed(k)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 1e-4)
    start = np.zeros((len(values), 1), np.int32)
    _, label, _ = cv2.kmeans(values.astype(np.float32), k, start, criteria, 3, cv2.KMEANS_PP_CENTERS)
    _, dense = np.unique(label.ravel(), return_inverse=True)
    return dense.astype(np.int64)


def silhouettes(distance: F64, label: I64) -> F64:
    """How similar each member (n,) is to its own cluster, compared with the nearest other; ``distance`` (n, n)."""
    members = label[:, None] == np.arange(label.max() + 1)[None]
    size = members.sum(0)
    total = distance @ members
    own = total[np.arange(len(label)), label] / np.maximum(size[label] - 1, 1)
    others = np.where(members, np.inf, total / np.maximum(size, 1))
    nearest = others.min(1)
    alone = size[label] < 2
    return np.where(alone | ~np.isfinite(nearest), 0.0, (nearest - own) / np.maximum(np.maximum(nearest, own), 1e-12))
