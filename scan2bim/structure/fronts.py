"""Window fronts: glazing that fills a wall from side to side, so that of the wall itself only a lintel is seen.

The pane and its frame stand back in the wall like any window's, but as no wall face is seen beside them they would be
taken for the wall's face. What tells is where the ceiling ends: at the lintel, a hand or two before the glass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.raster import closed
from scan2bim.structure.faces import DEEPEST_RECESS, GAP, OBLIQUE, PARALLEL, Face, Lines
from scan2bim.structure.free_space import seen_beyond
from scan2bim.structure.plan import SAME_LEVEL, Plan, without_ceiling
from scan2bim.structure.strips import ceiling_on, strip_of

SHORTEST = 0.6
"""Length, metres, of the shortest front looked for."""
BRIDGE = 13
"""Pixels: gaps of less than 65 cm in a lintel are curtains and mullions."""
LOOKED_THROUGH = 0.25
"""Share of a front's area that stations must have looked through: more than noise, less than curtains leave."""
IN_LINE = 0.08
"""Distance, metres, within which the end of the ceiling continues a wall's face: as well as a raster of 5 cm tells."""
CLEAR = 0.005
"""Steps, metres, of the noise of the faces in whose line lintels lie: those that differ by less are equally clear."""
BEYOND = DEEPEST_RECESS + 0.15
"""How far behind a gap, metres, it is asked whether the ceiling goes on there."""
BEFORE = (0.1, 0.5)
"""Where before a gap, metres, the height of the room's ceiling is taken."""
APART = 1.5
"""Gap, metres, between two seen stretches of one lintel."""
FLANK, STANDS_OUT = 2.5, 0.15
"""Metres that a window is wide at most which stands beside a pier, and by which another wall stands before the pier's
line where it ends that.
"""
F64 = NDArray[np.float64]


def window_fronts(
    plan: Plan, edges: Sequence[Face], faces: Sequence[Face], panoramas: Sequence[Panorama]
) -> tuple[list[Face], list[Face]]:
    """Lintels of window fronts, and ``faces`` without the glazing behind them.

    ``edges`` are lines where the ceiling proper ends, strips that hang lower left out. A lintel is in line with the
    wall's face that it continues.
    """
    lines = Lines.of(faces)
    runs = [_in_line(run, lines) for edge in edges for run in _under_strips(edge, plan)]
    lintels: list[Face] = []
    longest = Lines.of(sorted(runs, key=lambda r: -r.length))
    for seed in sorted(runs, key=lambda r: (round(r.rms / CLEAR), -r.length)):
        for run in (_with_rest(seed, longest, lines), seed):  # of a stretch drawn on too far the seed stays
            if not any(_beside(run, other) for other in lintels) and _looked_through(run, plan, panoramas):
                lintels.append(run)
    glazing = [[f for f in faces if _stands_back(f, lintel)] for lintel in lintels]
    kept = [f for f in faces if not any(f is g for behind in glazing for g in behind)]
    return [_over(lintel, behind) for lintel, behind in zip(lintels, glazing, strict=True)], kept


def _with_rest(run: Face, runs: Lines, faces: Lines) -> Face:
    """A stretch drawn on over others in its line: what hides a part of a ceiling's end does not end the lintel, however
    long it is, if one face, the glazing, goes on behind it.
    """
    for other in runs.continuing(run, IN_LINE):
        ends = other.ends() - run.centre
        along = np.sort(ends @ run.direction)
        apart = max(along[0] - run.high, run.low - along[1])
        if other.normal @ run.normal < PARALLEL or np.abs(ends @ run.normal).max() > IN_LINE:
            continue
        between = (run.high, along[0]) if along[0] > run.high else (along[1], run.low)
        if apart < APART or any(_spans(f, run, *between) for f in faces.behind(run)):
            run = replace(run, low=min(run.low, float(along[0])), high=max(run.high, float(along[1])))
    return run


def _spans(face: Face, run: Face, low: float, high: float) -> bool:
    """Whether a face goes on beyond both ends of a stretch of another one's line."""
    along = (face.ends() - run.centre) @ run.direction
    return bool(along.min() < low and along.max() > high)


def _over(lintel: Face, glazing: Sequence[Face]) -> Face:
    """A lintel as long as the glazing behind it."""
    along = [float(t) for g in glazing for t in (g.ends() - lintel.centre) @ lintel.direction]
    return replace(lintel, low=min([lintel.low, *along]), high=max([lintel.high, *along]))


def without_strips(plan: Plan, before: Sequence[Face] | None = None) -> Plan:
    """The plan without the ceiling's strips that hang lower: all, or those right behind the faces ``before``."""
    strip = plan.soffit > 0
    if before is not None:
        near = np.zeros(strip.shape, bool)
        for face in before:
            pixel = _behind(face, plan)
            near[pixel[..., 1], pixel[..., 0]] = True
        strip &= near
    return without_ceiling(plan, strip)


def without_soffits(plan: Plan, gaps: Sequence[Face]) -> Plan:
    """The plan without the ceiling that hangs lower behind the ``gaps`` of wall faces than before them, and ends within
    the depth of a wall: soffits of lintels, which are not a room's ceiling however wide the opening.
    """
    hidden = np.zeros(plan.floor.shape, bool)
    for gap in gaps:
        behind, before = ceiling_on(plan, gap, -BEYOND, 0.0), ceiling_on(plan, gap, *BEFORE)
        if np.isfinite(before).any():
            depth = np.arange(len(behind))[::-1, None] * PLAN
            ends = ~np.isfinite(np.where(depth >= DEEPEST_RECESS, behind, np.nan)).any(0)
            lower = (behind < np.nanmedian(before) - SAME_LEVEL) & ends
            pixel = strip_of(plan, gap, -BEYOND, 0.0)[lower]
            hidden[pixel[:, 1], pixel[:, 0]] = True
    return without_ceiling(plan, hidden)


def flanks(face: Face, faces: Sequence[Face]) -> list[Face]:
    """The stretches of a face's line beyond its ends, as far as a window goes beside a pier, or to the next of the
    ``faces`` that stands before the line.
    """
    low, high = face.low - FLANK, face.high + FLANK
    for other in faces:
        ends = other.ends() - face.centre
        before, along = ends @ face.normal, ends @ face.direction
        if abs(other.normal @ face.normal) < OBLIQUE and before.max() > STANDS_OUT and before.min() < STANDS_OUT:
            middle = float(along.mean())
            low = max(low, middle) if middle < face.low + STANDS_OUT else low
            high = min(high, middle) if middle > face.high - STANDS_OUT else high
    stretches = (low, face.low), (face.high, high)
    return [replace(face, low=a, high=b) for a, b in stretches if b - a > SHORTEST]


def _under_strips(edge: Face, plan: Plan) -> list[Face]:
    """Stretches of an edge behind which a strip of ceiling hangs lower."""
    pixel = _behind(edge, plan)
    hangs = plan.soffit[pixel[..., 1], pixel[..., 0]].any(0).astype(np.uint8)
    hangs = closed(np.pad(hangs, BRIDGE)[None], BRIDGE, rows=1)[0]
    ends = edge.low + (np.flatnonzero(np.diff(hangs)) + 1 - BRIDGE) * PLAN
    runs = list(pairwise(ends))[::2]
    return [replace(edge, low=a, high=b, lintel=True, sided=True) for a, b in runs if b - a >= SHORTEST]


def _beside(run: Face, other: Face) -> bool:
    """Whether two stretches are of one lintel."""
    ends = run.ends() - other.centre
    along = np.sort(ends @ other.direction)
    near = run.normal @ other.normal > PARALLEL and np.abs(ends @ other.normal).max() < DEEPEST_RECESS / 2
    return bool(near and min(along[1], other.high) > max(along[0], other.low))


def _stands_back(face: Face, edge: Face) -> bool:
    """Whether a face lies behind an edge, in the depth of a wall, on more than half of its own length."""
    if face.normal @ edge.normal < PARALLEL:
        return False
    ends = face.ends() - edge.centre
    behind, along = -(ends @ edge.normal), np.sort(ends @ edge.direction)
    overlap = min(along[1], edge.high) - max(along[0], edge.low)
    return bool(behind.min() > IN_LINE and behind.max() < DEEPEST_RECESS and overlap > 0.5 * face.length)


def _behind(face: Face, plan: Plan) -> NDArray[np.int64]:
    """Pixels (depth, along, 2) behind a face, to the depth of a wall, every 5 cm."""
    return strip_of(plan, face, -DEEPEST_RECESS, 0.0)


def _looked_through(front: Face, plan: Plan, panoramas: Sequence[Panorama]) -> bool:
    """Whether stations before it looked through enough of a front; never without stations."""
    told, through = seen_beyond(front, plan, panoramas, DEEPEST_RECESS)
    return bool(told.any() and through[told].mean() > LOOKED_THROUGH)


def _in_line(edge: Face, faces: Lines) -> Face:
    """The edge on the line of the wall face that it continues, if there is one: of several the tallest in all, since
    where the ceiling ends is seen too roughly to tell them apart.
    """
    best: Face | None = None
    ends = edge.ends()
    for face in faces.continued(edge, IN_LINE):
        offset = ends - face.centre
        along = np.sort(offset @ face.direction)
        gap = max(along[0] - face.high, face.low - along[1])
        off = float(np.abs(offset @ face.normal).max())
        follows = face.normal @ edge.normal > PARALLEL and gap < GAP and off < IN_LINE
        if follows and (best is None or face.tall > best.tall):
            best = face
    if best is None:
        return edge
    low, high = np.sort((edge.ends() - best.centre) @ best.direction).tolist()
    return replace(edge, centre=best.centre, normal=best.normal, low=low, high=high, rms=best.rms, sided=True)
