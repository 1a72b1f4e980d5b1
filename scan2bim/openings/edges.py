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
STRAY = 0.02
"""Share of the points that may lie on the wrong side of an edge: mixed pixels, handles, catches. Twice FEWEST at most
where a part of the edge is hidden, since then its reveal may be few points, too."""
CROWD = 0.012
"""Width, metres, in which a reveal's points lie."""
DEEP = 0.02
"""Depth, metres, over which a reveal must be seen before the frame that stands in it: half of a frame's."""
FRAME = (0.015, 0.055)
"""Distance, metres, inwards from an edge in which the frame's depth shows: next to a reveal, and no glass yet."""
FRAME_NOISE = 0.01
"""Metres by which points of a frame may lie before it."""
REVEAL_SHARE = 0.2
"""Share of the crowd at an edge that must lie on a reveal and not on the frame: a frame that something hides up to
there ends in a crowd, too, with ranges mixed of both before it."""
FEWEST = 6
"""Points that make a reveal."""
SAMPLED = 0.06
"""Width, metres, of the strip of the face beside an edge whose widest gap is the spacing of its points."""
GAP = 0.03
"""Metres between the face's last point and the first behind it, up to which the edge lies where the face ends: seen at
a slant the wall hides what is behind it. In a wider gap something else hides the edge."""
FAINT = 0.05
"""Share of the points behind the face that must lie on it for the face to be seen: fringes of a curtain are fewer."""
MARGIN = 0.1
"""Distance, metres, from an opening's other sides, in which points say nothing about this one."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Edge:
    """A side at ``place``, metres, with its standard deviation ``sigma``; ``reveal`` points on its reveal, 0 if none
    was seen; ``wall`` whether the wall's face was seen to end here. ``hidden`` metres, outwards from ``inner``, in
    which the side lies unseen; 0 where it was seen.
    """

    place: float
    sigma: float
    reveal: int
    wall: bool
    inner: float = np.nan
    hidden: float = 0.0


def find_edge(
    place: F64,
    depth: F64,
    on_face: NDArray[np.bool_],
    rough: float,
    inward: float,
    farther: float = 0.0,
    next_one: float = np.inf,
) -> Edge:
    """The edge near ``rough`` among points at ``place`` (n,) across it, ``depth`` behind the wall's face, ``on_face``
    or not; ``inward`` is 1 where the opening lies towards greater places, else -1. Up to ``farther`` metres outwards
    from there nothing was seen of the wall. From ``next_one`` metres outwards on, points are those of another opening.
    """
    inside = (place - rough) * inward
    out = min(max(REACH, farther + GAP), next_one)
    near = (inside > -out) & (inside < REACH)
    inside, depth, on_face = inside[near], depth[near], on_face[near]
    count = round((out + REACH) / BIN)
    bins = np.minimum(((inside + out) / BIN).astype(np.int64), count - 1)
    face = np.bincount(bins[on_face], minlength=count)
    behind = np.bincount(bins[~on_face], minlength=count)
    seen = bool(face.sum() >= max(FEWEST, FAINT * behind.sum()))
    if not seen:
        face = np.zeros_like(face)
        if behind.sum() < FEWEST:
            return Edge(rough, REACH / 3, 0, False, rough, farther)
    low, high = _gap(face, behind, min(STRAY, 2 * FEWEST / max(behind.sum(), 1)) if farther > 0 else STRAY)
    low, high = low - out, high - out
    if farther > 0 and behind.sum() < FEWEST:
        high = max(low, 0.0)
    first = ~on_face & (inside > high - BIN) & (inside < high + CROWD)
    if not seen and high < GAP - out:
        return Edge(rough, REACH / 3, 0, False, rough, farther)
    before = _before_frame(depth[first], depth[~on_face & (inside > high + FRAME[0]) & (inside < high + FRAME[1])])
    reveal = before.size > 0 and float(np.ptp(np.percentile(before, [10, 90]))) > DEEP
    if reveal or (high - low < GAP and first.any() and seen):
        face_end = low + min(_spacing(inside[on_face], low), high - low) / 2
        at = float(np.median(inside[first])) if before.size else face_end
        return Edge(rough + inward * at, 0.003 if reveal else 0.006, int(first.sum()) if reveal else 0, seen)
    at = min(max(0.0, low), high) if seen else high
    hidden = high - low if seen else high + farther
    return Edge(rough + inward * at, max(0.01, hidden / 4), 0, seen, rough + inward * high, max(hidden, 0.0))


def _spacing(face: F64, end: float) -> float:
    """Widest gap, metres, between the points of a face, at places (n,), in the strip in which they end."""
    at = np.sort(face[(face > end - SAMPLED) & (face <= end)])
    return float(np.diff(at).max()) if len(at) > 1 else SAMPLED


def _before_frame(crowd: F64, beyond: F64) -> F64:
    """Of points at an edge, at depths ``crowd`` (n,) behind the face, those on a reveal (m,): they lie before the frame
    that stands in it, at depths ``beyond`` (k,). None if they are too few.
    """
    front = float(np.percentile(beyond, 10)) - FRAME_NOISE if len(beyond) >= FEWEST else np.inf
    before = crowd[crowd < front]
    return before if len(before) >= max(FEWEST, REVEAL_SHARE * len(crowd)) else before[:0]


def _gap(face: NDArray[np.int64], behind: NDArray[np.int64], stray: float) -> tuple[float, float]:
    """Where face points end and points behind begin, metres from the first bin: fewest are on the wrong side."""
    wrong = np.zeros(len(face) + 1)
    if face.sum() >= FEWEST:
        wrong[:-1] += face[::-1].cumsum()[::-1] / face.sum()
    if behind.sum() >= FEWEST:
        wrong[1:] += behind.cumsum() / behind.sum()
    best = np.flatnonzero(wrong <= wrong.min() + stray)
    if face.sum() < FEWEST:
        return float(best[-1] * BIN), float(best[-1] * BIN)
    if behind.sum() < FEWEST:
        return float(best[0] * BIN), float(best[0] * BIN)
    return float(best[0] * BIN), float(best[-1] * BIN)
