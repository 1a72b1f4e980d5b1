"""Which predicted opening is which true one: rectangles in nearly the same plane, paired so that they overlap most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scan2bim.truth.values import OpeningTruth

F64 = NDArray[np.float64]

PLANE = 0.25
"""Metres between the middles of the two walls: where one face was scanned, a wall's thickness is a guess."""
ANGLE = math.radians(20.0)
"""Between the two walls."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """A predicted rectangle seen in the plane of a true one, square metres, and where it lies there.

    hit: the area of both; predicted, true: of each. x0, x1: of its jambs along the true one from the true start; z0,
    z1: heights; off: distance of the planes; all metres. same_way: whether both run in the same direction.
    """

    hit: float
    predicted: float
    true: float
    x0: float
    x1: float
    z0: float
    z1: float
    off: float
    same_way: bool

    @property
    def iou(self) -> float:
        """Intersection over union."""
        whole = self.predicted + self.true - self.hit
        return self.hit / whole if whole > 0.0 else 0.0


def overlap(true: OpeningTruth, predicted: OpeningTruth) -> Overlap | None:
    """How a predicted opening covers a true one; None where their walls are not the same."""
    t, p = np.array(true.corners), np.array(predicted.corners)
    along, own = t[1, :2] - t[0, :2], p[1, :2] - p[0, :2]
    width, own_width = float(np.linalg.norm(along)), float(np.linalg.norm(own))
    if width < 1e-6 or own_width < 1e-6:
        return None
    along, own = along / width, own / own_width
    cosine = float(along @ own)
    off = float((p[:, :2].mean(axis=0) - t[:, :2].mean(axis=0)) @ np.array([-along[1], along[0]]))
    if abs(off) > PLANE or abs(cosine) < math.cos(ANGLE):
        return None
    ends = (p[:2, :2] - t[0, :2]) @ along
    x0, x1, z0, z1 = float(ends.min()), float(ends.max()), float(p[0, 2]), float(p[2, 2])
    wide = max(0.0, min(x1, width) - max(x0, 0.0))
    tall = max(0.0, min(z1, float(t[2, 2])) - max(z0, float(t[0, 2])))
    areas = own_width * (z1 - z0), width * float(t[2, 2] - t[0, 2])
    return Overlap(wide * tall, *areas, x0, x1, z0, z1, off, cosine > 0)


@dataclass(frozen=True, slots=True)
class Pair:
    """Numbers of a true and a predicted opening that are the same, and how they overlap."""

    true: int
    predicted: int
    overlap: Overlap


def pair(true: Sequence[OpeningTruth], predicted: Sequence[OpeningTruth], least: float) -> list[Pair]:
    """One-to-one pairs with an IoU of at least ``least``, chosen so that the sum of all IoUs is greatest."""
    if not true or not predicted:
        return []
    found: dict[tuple[int, int], Overlap] = {}
    iou = np.zeros((len(true), len(predicted)))
    for i, one in enumerate(true):
        for j, other in enumerate(predicted):
            shared = overlap(one, other)
            if shared is not None and shared.iou >= least:
                found[i, j] = shared
                iou[i, j] = shared.iou
    rows, columns = linear_sum_assignment(-iou)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [Pair(i, j, found[i, j]) for i, j in pairs if (i, j) in found]
