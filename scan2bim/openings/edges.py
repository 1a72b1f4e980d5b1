"""Sides of an opening to millimetres: where the points on the wall's face end and those behind it begin.

A reveal, the surface of the opening inside the wall, shows as points behind the face that crowd at one place over some
depth. Where it was not seen, the edge lies where the face ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

REACH = 0.16
"""How far from the rough edge, metres, the edge is looked for: a frame's width and two pixels."""
BIN = 0.004
"""Width, metres, of the bins of the histograms across an edge: a scan's noise and registration."""
BINS = round(2 * REACH / BIN)
STRAY = 0.02
"""Share of the points that may lie on the wrong side of an edge: mixed pixels, handles, catches."""
CROWD = 0.012
"""Width, metres, in which a reveal's points lie."""
DEEP = 0.02
"""Depth, metres, over which a reveal must be seen: half of a frame's."""
FEWEST = 6
"""Points that make a reveal."""
GAP = 0.03
"""Metres between the face's last point and the first behind it, up to which the first behind it is the edge."""
MARGIN = 0.1
"""Distance, metres, from an opening's other sides, in which points say nothing about this one."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Edge:
    """A side at ``place``, metres, with its standard deviation ``sigma``; ``reveal`` points on its reveal, 0 if none
    was seen; ``wall`` whether the wall's face was seen to end here.
    """

    place: float
    sigma: float
    reveal: int
    wall: bool


def find_edge(place: F64, depth: F64, on_face: NDArray[np.bool_], rough: float, inward: float) -> Edge:
    """The edge near ``rough`` among points at ``place`` (n,) across it, ``depth`` behind the wall's face, ``on_face``
    or not; ``inward`` is 1 where the opening lies towards greater places, else -1.
    """
    inside = (place - rough) * inward
    near = np.abs(inside) < REACH
    inside, depth, on_face = inside[near], depth[near], on_face[near]
    bins = np.minimum(((inside + REACH) / BIN).astype(np.int64), BINS - 1)
    face = np.bincount(bins[on_face], minlength=BINS)
    behind = np.bincount(bins[~on_face], minlength=BINS)
    if face.sum() < FEWEST and behind.sum() < FEWEST:
        return Edge(rough, REACH / 3, 0, False)
    low, high = _gap(face, behind)
    low, high = low - REACH, high - REACH
    first = ~on_face & (inside > high - BIN) & (inside < high + CROWD)
    seen = face.sum() >= FEWEST
    if not seen and high < GAP - REACH:
        return Edge(rough, REACH / 3, 0, False)
    reveal = int(first.sum()) >= FEWEST and float(np.ptp(np.percentile(depth[first], [10, 90]))) > DEEP
    if reveal or (high - low < GAP and first.any()):
        at = float(np.median(inside[first])) if reveal else high
        return Edge(rough + inward * at, 0.003 if reveal else 0.006, int(first.sum()) if reveal else 0, bool(seen))
    at = min(max(0.0, low), high) if seen else high
    return Edge(rough + inward * at, max(0.01, (high - low) / 4), 0, bool(seen))


def _gap(face: NDArray[np.int64], behind: NDArray[np.int64]) -> tuple[float, float]:
    """Where face points end and points behind begin, metres from the first bin: fewest are on the wrong side."""
    wrong = np.zeros(BINS + 1)
    if face.sum() >= FEWEST:
        wrong[:-1] += face[::-1].cumsum()[::-1] / face.sum()
    if behind.sum() >= FEWEST:
        wrong[1:] += behind.cumsum() / behind.sum()
    best = np.flatnonzero(wrong <= wrong.min() + STRAY)
    if face.sum() < FEWEST:
        return float(best[-1] * BIN), float(best[-1] * BIN)
    if behind.sum() < FEWEST:
        return float(best[0] * BIN), float(best[0] * BIN)
    return float(best[0] * BIN), float(best[-1] * BIN)
