"""Where the trims round an open door begin, all sides and both faces together.

A trim is the same round a door. One side of one face may show the edge of the leaf that stands open, a switch or a
cupboard instead of it; what most sides agree on is the trim.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.rectangles import Rectangle
from scan2bim.openings.near_points import WallPoints

BIN = 0.004
"""Width, metres, of the bins outwards from a side in which depths are put together."""
FIRST, REACH = -0.07, 0.24
"""Distances outwards from what was seen of an opening, metres, between which trims and the wall beside them are looked
for.
"""
LAPS, SETBACK, FARTHEST = 0.05, 0.04, 0.13
"""Farthest, metres, that a trim laps over the opening's side, that it stands back from it, and from a leaf that stands
before a jamb.
"""
LEAF = 0.03
"""Least thickness, metres, of a leaf."""
STANDS_OUT, BEFORE, BEHIND = 0.004, 0.04, 0.012
"""Metres by which a trim stands out from the wall: more than unevenness, and no more than trims do; and depth behind
the wall's face from which on a point is of a reveal.
"""
CROWD, NEXT = 2.0, 0.02
"""Times as many points as on the trim's front that lie on its inner edge, if that was seen, within so many metres."""
TRIM_WIDTH = (0.02, 0.15)
"""Widths of trims, metres."""
GAP = 0.0121
"""Metres between what was seen inside a trim's edge and its front, so that the edge is known: three bins."""
WALL = 0.13
"""Distance outwards, metres, from which on the wall's own face tells its depth."""
FOOT, ENDS = 0.15, 0.12
"""Distances, metres, from the floor and from the other sides within which points say nothing of a side."""
FEWEST = 4
"""Points that make a bin's median."""
AGREE = 0.006
"""Metres to which the sides of one door agree."""
SIDES, SHARE = 2, 0.5
"""Sides that must agree, and the share of all that show a trim."""
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def trim_setbacks(points: WallPoints, box: Rectangle, half: float, hidden: int | None = None) -> list[float] | None:
    """How far outwards from the left, right and upper side of a clear ``box`` the trims begin, metres; None where none
    are seen. ``points`` near the wall, of which ``half`` the thickness is given. Before the ``hidden`` side a leaf may
    stand, from which the trims of both faces are farther off.
    """
    near = points.inside(box.left - REACH, box.right + REACH, 0.0, box.top + REACH)
    shown = {(side, sign): _begins(near, box, side, sign, half) for side in range(3) for sign in (1, -1)}
    found = [(side, begin) for (side, _), begin in shown.items() if begin is not None and begin < SETBACK]
    if not found:
        return None
    begins = np.array([begin for _, begin in found])
    apart = np.abs(begins[:, None] - begins) < AGREE
    agreeing = apart[int(np.argmax(apart.sum(1)))]
    sides = {side for (side, _), agrees in zip(found, agreeing, strict=True) if agrees}
    if len(sides) < SIDES or agreeing.mean() < SHARE:
        return None
    setbacks = [float(np.median(begins[agreeing]))] * 3
    behind = [] if hidden is None else [shown[hidden, sign] for sign in (1, -1)]
    if hidden is not None and all(begin is not None and begin > setbacks[0] + LEAF for begin in behind):
        setbacks[hidden] = min(begin for begin in behind if begin is not None)
    return setbacks


def _begins(points: WallPoints, box: Rectangle, side: int, sign: int, half: float) -> float | None:
    """Where the trim begins outwards from the left (0), right or upper side on the face left (1) or right (-1) of the
    wall's axis, None where none shows.
    """
    outwards, here = _beside(points, box, side)
    depth = points.across * sign - half
    near = here & (outwards > FIRST) & (outwards < REACH) & (depth > -BEHIND) & (depth < BEFORE)
    depths, count = _medians(outwards[near], depth[near])
    t = FIRST + BIN * (np.arange(len(depths)) + 0.5)
    wall = depths[t > WALL]
    wall = wall[np.isfinite(wall)]
    known = np.flatnonzero(np.isfinite(depths))
    if not len(wall) or not len(known):
        return None
    stands_out = depths[known] - np.median(wall) > STANDS_OUT
    edges = np.flatnonzero(np.diff(stands_out.astype(np.int8), prepend=0, append=0))
    for first, last in edges.reshape(-1, 2):
        if last == len(known) or first == 0 or t[known[first]] - t[known[first - 1]] > GAP:
            continue  # the wall must show beside it, and what is right inside
        start, end = t[known[first]] - BIN / 2, t[known[last - 1]] + BIN / 2
        if TRIM_WIDTH[0] < end - start < TRIM_WIDTH[1] and -LAPS < start < FARTHEST:
            crowd = count[known[first] : known[last - 1] + 1]
            peak = int(np.argmax(crowd[: round(NEXT / BIN)]))
            return float(t[known[first] + peak] if crowd[peak] > CROWD * np.median(crowd) else start)
    return None


def _beside(points: WallPoints, box: Rectangle, side: int) -> tuple[F32, NDArray[np.bool_]]:
    """Distances (n,) outwards from a side, and which points are asked about it."""
    if side == 2:
        return points.up - box.top, (points.along > box.left + ENDS) & (points.along < box.right - ENDS)
    outwards = box.left - points.along if side == 0 else points.along - box.right
    return outwards, (points.up > FOOT) & (points.up < box.top - ENDS)


def _medians(t: F32, values: F32) -> tuple[F64, NDArray[np.int64]]:
    """Medians (b,) of values (n,) in bins of places t, nan of too few, and how many (b,) there are."""
    count = round((REACH - FIRST) / BIN)
    bins = np.clip(((t - FIRST) / BIN).astype(np.int64), 0, count - 1)
    order = np.lexsort((values, bins))
    ordered = values[order].astype(np.float64)
    starts = np.searchsorted(bins[order], np.arange(count + 1))
    size = np.diff(starts)
    middle = np.minimum(starts[:-1] + size // 2, max(len(ordered) - 1, 0))
    return np.where(size >= FEWEST, ordered[middle], np.nan) if len(ordered) else np.full(count, np.nan), size
