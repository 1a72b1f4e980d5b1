"""From the evidence of both faces to a probability that a rectangle is a closed door."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.evidence import FaceEvidence
from scan2bim.openings.closed.rectangles import Rectangle

SINGLE, DOUBLE = (0.66, 1.30), (1.25, 2.25)
"""Widths, metres, between the outlines of usual doors, of one and of two leaves, trims included."""
HEIGHT = (1.92, 2.45)
"""Usual heights of door heads, metres, trims included."""
FLUSH = 0.008
"""Metres behind the wall from which on a leaf is not flush with it for certain: thrice noise and unevenness."""
UNSEEN = 0.1
"""Share of the other face that is seen, up to which it tells nothing."""
COMPLETE = 0.7
"""Share from which on what speaks for a door is nearly all there."""
SUREST = 0.99
"""Probability beyond which nothing is told: the weights are fitted on little more than a hundred doors."""
BIAS = -16.94
WEIGHTS = np.array(
    [
        1.3,
        -0.57,
        1.14,
        -0.84,
        1.02,
        -1.98,
        -1.9,
        -2.74,
        5.38,
        0.05,
        1.14,
        0.64,
        2.21,
        -2.48,
        -0.93,
        0.86,
        -2.58,
        4.69,
        3.55,
        0.98,
        0.98,
        -1.0,
        1.76,
        4.64,
        2.32,
        0.76,
        -1.96,
        -1.08,
        1.4,
    ]
)
"""Weights of the features in their order, fitted by tests/benchmarks/fit_doors.py on simulated scenes; the last with
the others as they stood, on 28 scenes, five halls among them (0.8 to 2.1 without one of their buildings).
"""
SCALE, SHIFT = 1.7, 0.4
"""Slope and shift of the logarithm of the odds that make them those of the rectangle that is kept of many; fitted there
on 19 scenes of 10 buildings, four of which gave no weights: halves of them err by 0.054 by the other half's."""


@dataclass(frozen=True, slots=True)
class Features:
    """What the model weighs; each about 0 to 1, more speaks for a door unless it says otherwise.

    outline, weakest: share of discontinuities on the outline and on its weakest side, of the face where it is
    clearer. agree: the same where sides and head are one change. shown: share of the outline that was seen. other:
    outline of the other face, 0 where unseen. alone: how much of the other face was not seen. blank: how much of
    the other face was seen and shows no outline (against). before: 1 for each 20 mm that the inside stands before
    the wall (against). recess: 1 for 8 mm or more behind it. deep: 1 for 50 mm. tint: 1 for a change of colour by a
    twentieth. colour: 1 for one by a tenth. trim: 1 for 10 mm or more. beyond: sides that go on above the head
    (against). foot: sides seen down to the floor. handle: 1 where seen. through: share looked through (against).
    dominant: share of the most frequent depth. whole: share of columns of one depth and colour. lintel, flank: wall
    above the head and beside. oversize: decimetres beyond usual widths and heights (against). double: 1 beyond the
    width of a single leaf. solid: the least of agree, whole, flank, dominant and lintel. lone: 1 where the other
    face was not seen; lone_agree, lone_recess: agree and recess there. onward: share of
    the head's line that goes on beyond a side (against). complete: 1 where all speaks for a door but how deep it is and
    of what colour, as a flush one of the wall's colour is known by its outline alone. Of what is as high as the room
    the sides stand for the head, the wall beside for that above, its height is no oversize, and it is not complete.
    """

    outline: float
    weakest: float
    agree: float
    shown: float
    other: float
    alone: float
    blank: float
    before: float
    recess: float
    deep: float
    tint: float
    colour: float
    trim: float
    beyond: float
    foot: float
    handle: float
    through: float
    dominant: float
    whole: float
    lintel: float
    flank: float
    oversize: float
    double: float
    solid: float
    lone: float
    lone_agree: float
    lone_recess: float
    onward: float
    complete: float

    def vector(self) -> NDArray[np.float64]:
        """In the order of the fields."""
        return np.array(_all_of(self), np.float64)


_all_of = attrgetter(*(field.name for field in fields(Features)))


def features_of(evidence: Sequence[FaceEvidence], box: Rectangle) -> Features:
    """The features of a rectangle; ``evidence`` of one or both faces."""
    ranked = sorted(evidence, key=lambda e: (e.loose, -e.support))
    best, other = ranked[0], ranked[1] if len(ranked) > 1 else None
    recess = [e.recess for e in ranked if np.isfinite(e.recess) and e.outline > 0.4]
    behind = max((max(0.0, r) for r in recess), default=0.0)
    lone = float(other is None or other.seen < UNSEEN)
    solid = min(best.agree, best.whole, best.flank, best.dominant, best.flank if box.whole else best.lintel)
    blank = other.seen * (1 - other.outline) if other else 0.0
    before = min(max((max(0.0, -r) for r in recess), default=0.0), 0.06) / 0.02
    return Features(
        best.outline,
        best.weakest,
        best.agree,
        best.shown,
        other.outline if other else 0.0,
        1.0 - other.seen if other else 1.0,
        blank,
        before,
        min(behind, FLUSH) / FLUSH,
        min(behind, 0.05) / 0.05,
        min(max(e.colour for e in ranked), 0.05) / 0.05,
        min(max(e.colour for e in ranked), 0.2) / 0.1,
        min(max(e.trim for e in ranked), 0.01) / 0.01,
        best.beyond,
        best.foot,
        float(any(e.handle is not None for e in ranked)),
        max(e.through for e in ranked),
        best.dominant,
        best.whole,
        max(e.flank if box.whole else e.lintel for e in ranked),
        max(e.flank for e in ranked),
        _oversize(box),
        float(box.width > SINGLE[1]),
        solid,
        lone,
        lone * best.agree,
        lone * min(behind, FLUSH) / FLUSH,
        best.onward,
        0.0 if box.whole else _complete(best, solid, max(blank, before, _oversize(box))),
    )


def _complete(best: FaceEvidence, solid: float, against: float) -> float:
    """How near to 1 all are that a door of the wall's own depth and colour shows: an outline that is one change, from
    the floor to its corners, round a leaf, with wall about it.
    """
    least = min(solid, best.weakest, best.foot, 1 - best.beyond, 1 - against)
    return max(least - COMPLETE, 0.0) / (1 - COMPLETE)


def _oversize(box: Rectangle) -> float:
    low, high = SINGLE if box.width <= SINGLE[1] else DOUBLE
    wide = max(low - box.width, box.width - high, 0.0)
    tall = 0.0 if box.whole else max(HEIGHT[0] - box.top, box.top - HEIGHT[1], 0.0)
    return (wide + tall) / 0.1


def probability(features: Features) -> float:
    """That a rectangle with these features is a closed door, 0-1, by which those that overlap are ranked."""
    return float(1 / (1 + np.exp(-(BIAS + np.nan_to_num(features.vector()) @ WEIGHTS))))


def confidence(probability: float) -> float:
    """The same of the one that is kept, 0-1: beside the door that it is most rectangles are none."""
    odds = np.log(probability / (1 - probability)) if 0 < probability < 1 else np.sign(probability - 0.5) * np.inf
    return min(float(1 / (1 + np.exp(-(SHIFT + SCALE * odds)))), SUREST)
