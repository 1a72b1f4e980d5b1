"""Leaves of doors as high as the room: no lintel tells them from walls, and they reach the ceiling as walls do.

A closed one stands back in its wall: the wall goes on across it. An open one is a thin plate, as long as a gap in a
wall at whose jamb it hangs, its other end free: it is no wall.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.columns import Columns
from scan2bim.structure.fits import Face
from scan2bim.structure.steps import turn_to

NARROWEST, WIDEST = 0.5, 2.6
"""Widths of doors, metres (trade: single 0.5 to 1.5, double to 2.5)."""
DEEPEST = 0.25
"""Depth, metres, up to which a leaf stands behind the face of its wall: deeper are niches and bays."""
THIN = (0.02, 0.08)
"""Distance, metres, between both faces of a leaf: inner ones have 35 to 45 mm, outer ones up to 70."""
OPPOSITE = -0.99
"""Cosine below which two faces look opposite ways (8 degrees): short ones are that uncertain."""
JAMB = 0.4
"""Distance, metres, from a leaf's end within which its wall's face begins, or in a corner begins again behind the wall
that stands there: trims and linings lie between.
"""
PART = 0.25
"""Gap, metres, that parts the leaves of two doors in one line."""
OVER = 0.6
"""Share of a leaf on which its other face must have been seen."""
LITTLE = 0.15
"""Share of a leaf, at most, before which something stands in the wall's face up to the ceiling."""
SHORTEST, LONGEST = 0.45, 1.35
"""Lengths of single leaves, metres."""
HINGE, BEHIND = 0.2, 0.35
"""Distance, metres, from a leaf's end within which the jamb is at which it hangs; and behind the only face that was
seen of its wall, if it opens to the other side.
"""
ON_LINE, OFF_LINE = 0.04, 0.12
"""Distances, metres, from a wall's line within which what stands there is its own face; and within which it ends a gap
in the wall, or goes on behind a leaf.
"""
FREE = (0.06, 0.2)
"""Distances, metres, beyond a leaf's free end between which nothing stands in its line."""
SHORTER, LONGER = 0.2, 0.25
"""Metres by which a gap may be narrower and wider than its leaf: faces end half a step past what was seen, and a leaf
laps over its gap or hangs in a lining.
"""
IN_LINE = 0.035
"""Distance, metres, from a leaf's line within which what stands beyond its free end goes on in it."""
SKEW, CLEAR = 0.03, 0.12
"""Radians from the building's main directions (1.7, 7 degrees) from which on a plate beside a gap is a leaf, whether or
not its other face was seen; and though a part of it alone was.
"""
NARROWEST_LEAF, PLANE = 0.6, 0.004
"""Metres: the least length of such a plate, and the residual of its points: things that stand about are less even."""
F64 = NDArray[np.float64]


def is_closed_leaf(wall: Face, back: Face, faces: Sequence[Face], columns: Columns) -> bool:
    """Whether what stands ``back`` behind a wall's face are closed leaves: as wide as doors, the wall's face or that of
    the next wall right beside both ends of each; and thin, as their other faces show, or else the smaller part of the
    wall.
    """
    depth = -((back.ends() - wall.centre) @ wall.normal)
    if depth.max() > DEEPEST:
        return False
    own, behind = _tall_along(wall, wall, columns), _tall_along(back, wall, columns)
    stretches = _stretches(behind)
    width = np.array([high - low for low, high in stretches])
    if not len(width) or (width < NARROWEST).any() or (width > WIDEST).any():
        return False
    offset = columns.xy[columns.high >= 3] - wall.centre
    jambs = offset[np.abs(offset @ wall.normal) < min(OFF_LINE, depth.min() / 2)] @ wall.direction
    for low, high in stretches:
        if not _has((low - JAMB, low + PLAN), jambs) or not _has((high - PLAN, high + JAMB), jambs):
            return False
        if covered_length(own[(own > low + PLAN) & (own < high - PLAN)], PLAN) > LITTLE * (high - low):
            return False
    thin = all(_is_thin(back, low, high, wall, faces) for low, high in stretches)
    return thin or covered_length(own, PLAN) > float(width.sum())


def _tall_along(face: Face, wall: Face, columns: Columns) -> F64:
    """Where along a wall's face, metres, a face's columns (n,) stand that reach the ceiling zone."""
    at = face.columns[columns.high[face.columns] >= 3]
    return (columns.xy[at] - wall.centre) @ wall.direction


def _has(span: tuple[float, float], places: F64) -> bool:
    """Whether a place (n,) lies within a span."""
    return bool(((places > span[0]) & (places < span[1])).any())


def _stretches(along: F64) -> list[tuple[float, float]]:
    """From where to where places (n,) along a line go on without a gap."""
    places = np.sort(along)
    parts = np.split(places, np.flatnonzero(np.diff(places) > PART) + 1)
    return [(float(p[0]) - PLAN / 2, float(p[-1]) + PLAN / 2) for p in parts if len(p)]


def _is_thin(back: Face, low: float, high: float, wall: Face, faces: Sequence[Face]) -> bool:
    """Whether the other face of a leaf, from ``low`` to ``high`` along the wall, was seen right behind it."""
    for other in faces:
        if other.normal @ back.normal > OPPOSITE:
            continue
        thickness = -float((other.centre - back.centre) @ back.normal)
        ends = np.sort((other.ends() - wall.centre) @ wall.direction)
        if THIN[0] < thickness < THIN[1] and min(high, ends[1]) - max(low, ends[0]) > OVER * (high - low):
            return True
    return False


def without_open_leaves(faces: Sequence[Face], columns: Columns, main: float) -> list[Face]:
    """The faces without those of open leaves; ``main`` direction of the walls, radians."""
    short = [f for f in faces if SHORTEST < f.length < LONGEST]
    leaves = [f for f in short if _is_open_leaf(f, faces, columns, main)]
    return [f for f in faces if not any(f is leaf or _is_part(f, leaf) for leaf in leaves)]


def _is_open_leaf(leaf: Face, faces: Sequence[Face], columns: Columns, main: float) -> bool:
    """Whether a short face is that of a leaf: thin or askew, free at one end, and hung at the jamb of a gap."""
    backs = [f for f in faces if _is_back(leaf, f)]
    skew = abs(turn_to(leaf.normal, main))
    if not backs and (skew < SKEW or leaf.length < NARROWEST_LEAF or leaf.rms > PLANE):
        return False
    own = np.concatenate([leaf.columns, *(f.columns for f in backs)])
    others = columns.xy[np.setdiff1d(np.flatnonzero(columns.high >= 3), own)]
    walls = [f for f in faces if f is not leaf and not any(f is b for b in backs)]
    lengths = [leaf.length, *(f.length for f in backs)]
    for hinge, free in (leaf.ends(), leaf.ends()[::-1]):
        if _is_free(hinge, free, others) and any(
            _hangs_in_gap(hinge, lengths, w, columns, others, whole=skew < CLEAR) for w in walls
        ):
            return True
    return False


def _is_back(leaf: Face, other: Face) -> bool:
    """Whether a face is a leaf's other one."""
    thickness = -float((other.centre - leaf.centre) @ leaf.normal)
    along = np.sort((other.ends() - leaf.centre) @ leaf.direction)
    shared = min(leaf.high, along[1]) - max(leaf.low, along[0])
    opposite = other.normal @ leaf.normal < OPPOSITE and other.length < LONGEST
    return bool(opposite and THIN[0] < thickness < THIN[1] and shared > OVER * min(leaf.length, other.length))


def _is_part(face: Face, leaf: Face) -> bool:
    """Whether a face lies in a leaf."""
    offset = face.ends() - leaf.centre
    along = offset @ leaf.direction
    return bool(
        (np.abs(offset @ leaf.normal) < THIN[1]).all()
        and along.min() > leaf.low - SHORTER
        and along.max() < leaf.high + SHORTER
    )


def _is_free(hinge: F64, free: F64, others: F64) -> bool:
    """Whether nothing stands in a leaf's line beyond its free end."""
    direction = (free - hinge) / np.linalg.norm(free - hinge)
    offset = others - free
    along, across = offset @ direction, offset @ np.array([-direction[1], direction[0]])
    return not ((along > FREE[0]) & (along < FREE[1]) & (np.abs(across) < IN_LINE)).any()


def _hangs_in_gap(
    hinge: F64, lengths: Sequence[float], wall: Face, columns: Columns, others: F64, *, whole: bool
) -> bool:
    """Whether a leaf's hinge is at an end of a gap in a wall's face, up to where that goes on or meets the next wall,
    which is as wide as one of the leaf's faces is long, or twice as wide where two leaves hang in it; or wider if not
    the ``whole`` leaf was seen.
    """
    at, off = (hinge - wall.centre) @ wall.direction, (hinge - wall.centre) @ wall.normal
    if not -BEHIND < off < HINGE or not wall.low - HINGE < at < wall.high + HINGE:
        return False
    offset = others - wall.centre
    along, across = offset @ wall.direction, np.abs(offset @ wall.normal)
    for low, high in _stretches(_tall_along(wall, wall, columns)):
        for jamb, outward in ((low, -1.0), (high, 1.0)):
            reach = (at - jamb) * outward
            if not -HINGE < reach < WIDEST + HINGE:
                continue
            ahead = (along - jamb) * outward
            solid = ((ahead > 2 * PLAN) & (ahead < PART) & (across < ON_LINE)).any()
            gap = float(ahead[(ahead > PART) & (across < OFF_LINE)].min(initial=np.inf))
            at_end = min(abs(reach), abs(reach - gap)) < HINGE
            if not solid and at_end and _fits(gap, lengths, whole=whole):
                return True
    return False


def _fits(gap: float, lengths: Sequence[float], *, whole: bool) -> bool:
    """Whether one leaf or two as long as one of ``lengths`` close a gap, or longer ones if less than the ``whole`` was
    seen.
    """
    longer = LONGER if whole else WIDEST
    return gap < WIDEST and any(-SHORTER < gap / n - length < longer for n in (1, 2) for length in lengths)
