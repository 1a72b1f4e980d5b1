"""What each face of a wall says of a rectangle: a door leaf in its frame, or something that hangs or stands there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.lines import Support
from scan2bim.openings.closed.profiles import DEEPEST
from scan2bim.openings.closed.rectangles import FOOT, Face, Rectangle
from scan2bim.openings.closed.windows import (
    blob,
    colour_step,
    known_values,
    level,
    share_alike,
    share_known,
    share_level,
    share_near,
    stands_out,
    wall_level,
    window,
)
from scan2bim.openings.orthoimage import COARSE, PIXEL

INSET = 0.05
"""Metres inside a rectangle's sides that are not asked of the leaf: trims and frames."""
FLANK = (0.10, 0.35)
"""Distance from a rectangle's sides, metres, between which the wall beside it is asked: beyond trims."""
LINTEL = (0.10, 0.35)
"""Distance above a rectangle's head, metres, between which wall is looked for: beyond trims."""
SKIN = 0.012
"""Distance from the wall's plane, metres, within which a point is the wall's own: plaster's unevenness and noise."""
STEP = 0.03
"""Distance from the wall's fitted plane, metres, at which its flanks may lie together."""
TRIM = 0.10
"""Width, metres, of trims and frames."""
SLACK = (-0.02, -0.01, 0.0, 0.01, 0.02)
"""Metres by which a side may be off its line."""
LOOSE = tuple(0.02 * k for k in range(-4, 5))
"""The same on the other face: there a trim's outer edge may show, and here the leaf's."""
SHADOW = 0.15
"""Distance outwards from a rectangle, metres, at which the wall shows again: a trim hides a strip of it."""
SAME_DEPTH = 0.008
"""Difference, metres, from a leaf's most frequent depth up to which a pixel has it."""
FEW_COLOURS = 20
"""Pixels that a colour is told by."""
ALIKE_DEPTH, ALIKE_COLOUR = 0.006, 0.08
"""Difference of depth (metres) and colour (of 1) up to which two columns belong to one leaf."""
HANDLE_BAND = (0.85, 1.25)
"""Heights, metres, of handles: trade 0.85 (disabled access) to 1.15, and the lever's own extent."""
HANDLE_REACH = 0.25
"""Distance, metres, from the leaf's edge in which the handle and its lever are."""
HANDLE_OUT = (0.02, 0.10)
"""Metres by which handles stand out from the leaf."""
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class FaceEvidence:
    """Of one face.

    left, right, head: share of each side that is a discontinuity; ``outline`` their mean. agree: the same where all
    three are one change of one kind (darker inside, deeper inside, a dark line, ...). shown: share of the three that
    was seen. seen: share of the rectangle
    with data. recess: metres by which its inside lies behind the wall beside it (negative: before it), nan where
    unseen. colour: difference of inside and beside,
    0-1. trim: metres by which a strip round it stands out. beyond: share of its sides' lines that go on above the head.
    foot: share of discontinuities in the lowest 40 cm of its sides. handle: height over the base, metres, None where
    none was seen, and handle_side of the leaf. through: share that stations looked through. dominant: share of its most
    frequent depth. whole: share of its columns that have one depth and colour. lintel, flank: share of wall, seen in
    its plane, above the head and beside. onward: share of the head's line that goes on beyond one of the sides. loose:
    whether the outline may lie at another place than on the other face.
    """

    left: float
    right: float
    head: float
    agree: float
    shown: float
    seen: float
    recess: float
    colour: float
    trim: float
    beyond: float
    foot: float
    handle: float | None
    handle_side: str | None
    through: float
    dominant: float
    whole: float
    lintel: float
    flank: float
    onward: float
    loose: bool

    @property
    def outline(self) -> float:
        """Mean share of sides and head."""
        return (self.left + self.right + self.head) / 3

    @property
    def support(self) -> float:
        """How clear the outline is, by which faces are ranked."""
        return self.outline + 0.5 * self.weakest

    @property
    def weakest(self) -> float:
        """Share of the weakest of sides and head."""
        return min(self.left, self.right, self.head)


def face_evidence(face: Face, box: Rectangle, slack: Sequence[float]) -> FaceEvidence:
    """What one face says of a rectangle whose sides may be off by ``slack``."""
    image = face.image
    depth, known, size = image.depth, image.known, image.depth.shape
    inner = window(size, box.left + INSET, box.right - INSET, FOOT, box.top - INSET)
    left_flank = window(size, box.left - FLANK[1], box.left - FLANK[0], FOOT, box.top)
    right_flank = window(size, box.right + FLANK[0], box.right + FLANK[1], FOOT, box.top)
    inside = known_values(depth, known, inner, 2)
    flanks = known_values(depth, known, left_flank, 2), known_values(depth, known, right_flank, 2)
    leaf, wall = float(level(inside)), float(wall_level(*flanks, SKIN, STEP))
    outline = _outline(face, box, slack)
    height, at = _handle(face, box, leaf)
    return FaceEvidence(
        *outline,
        float(share_known(known, window(size, box.left, box.right, 0.0, box.top), 2)),
        wall - leaf,
        float(colour_step(image.rgb, known, inner, left_flank, right_flank, 4, FEW_COLOURS)),
        _trim(face, box, wall),
        _beyond(face, box),
        _foot(face, box),
        height,
        at,
        _through(face, box),
        float(share_near(inside, leaf, SAME_DEPTH)),
        _whole(face, box, leaf),
        _lintel(face, box, wall),
        float(share_near(np.concatenate(flanks), wall, SKIN)),
        _onward(face, box),
        slack is LOOSE,
    )


def _lintel(face: Face, box: Rectangle, wall: float) -> float:
    """Share of the strip above the head that is wall: seen, and in its plane."""
    image = face.image
    part = window(image.depth.shape, box.left + INSET, box.right - INSET, box.top + LINTEL[0], box.top + LINTEL[1])
    return float(share_level(image.depth, image.known, part, wall, SKIN)) if part[1] - part[0] >= 4 else 0.0


def _piece(place: float) -> int:
    return round(place / PIXEL / BLOCK)


def _supported(support: Support, places: Sequence[float], first: int, last: int) -> F32:
    """Share (n,) of discontinuities on lines at several places, metres, between two pieces."""
    return support.at(places, PIXEL, first, last)


def _outline(face: Face, box: Rectangle, slack: Sequence[float]) -> tuple[float, float, float, float, float]:
    """Share of discontinuities on left side, right side and head, each off by ``slack`` at most; of those that agree
    on all three; and share of the three that was seen.
    """
    top = _piece(box.top - 0.04)
    sides = np.array([place + d for place in (box.left, box.right) for d in slack])
    upright, shown = _shares(face.sides, sides, _piece(FOOT), top)
    left, right = upright.reshape(2, 8, 2, -1).max(3).transpose(2, 0, 1)
    heads = np.array([box.top + d for d in slack])
    level, above = _shares(face.heads, heads, _piece(box.left + 0.05), _piece(box.right - 0.05))
    head = level.max(2)
    agree = np.concatenate(
        [
            left[:, :4] + right[::-1, :4] + head[::-1, :4],
            left[:, 4:] + right[:, 4:] + head[:, 4:],
        ]
    )
    seen = (*shown.reshape(2, -1).max(1), above.max())
    return float(left.max()), float(right.max()), float(head.max()), float(agree.max()) / 3, float(np.mean(seen))


def _shares(support: Support, places: NDArray[np.float64], first: int, last: int) -> tuple[F32, F32]:
    """As ``Support.shares`` of lines at places (n,), metres, between two pieces."""
    at = np.rint(places / PIXEL).astype(np.int64)
    return support.shares(at, np.full(len(at), first), np.full(len(at), last))


def _beyond(face: Face, box: Rectangle) -> float:
    """Share of discontinuities on the sides' lines between 15 and 60 cm above the head."""
    first, last = _piece(box.top + 0.15), min(_piece(box.top + 0.6), face.sides.pieces - 1)
    if last - first < 2:
        return 0.0
    return float(_supported(face.sides, (box.left, box.right), first, last).max())


def _onward(face: Face, box: Rectangle) -> float:
    """Share of discontinuities on the head's line from 10 to 50 cm beyond a side, of the greater."""
    heads = [box.top + d for d in SLACK]
    low, high = box.left / PIXEL / BLOCK, box.right / PIXEL / BLOCK
    beyond = ((max(round(low - 5), 0), round(low - 1)), (round(high + 1), min(round(high + 5), face.heads.pieces)))
    shares = [float(face.heads.at(heads, PIXEL, *ends).max()) for ends in beyond if ends[1] - ends[0] >= 2]
    return max(shares, default=0.0)


def _foot(face: Face, box: Rectangle) -> float:
    """Share of discontinuities in the lowest 40 cm of the sides, of the lesser."""
    sides = [place + d for place in (box.left, box.right) for d in SLACK]
    return float(_supported(face.sides, sides, 0, _piece(0.4)).reshape(2, -1).max(1).min())


def _trim(face: Face, box: Rectangle, wall: float) -> float:
    """Least metres by which strips at left, right and head stand out from the wall."""
    around = (
        face.profiles.columns(box.left - SHADOW, box.left + TRIM, FOOT, box.top - TRIM),
        face.profiles.columns(box.right - TRIM, box.right + SHADOW, FOOT, box.top - TRIM),
        face.profiles.rows(box.left + TRIM, box.right - TRIM, box.top - TRIM, box.top + SHADOW),
    )
    return float(min(stands_out(means, wall, TRIM / PIXEL) for means in around))


def _whole(face: Face, box: Rectangle, leaf: float) -> float:
    """Share of the columns inside a rectangle that have the leaf's depth and colour."""
    means = face.profiles.columns(box.left + TRIM, box.right - TRIM, FOOT, box.top - TRIM)
    deep = np.clip(leaf, -DEEPEST, DEEPEST)
    return float(share_alike(means, deep, ALIKE_DEPTH, ALIKE_COLOUR, TRIM / PIXEL)) if np.isfinite(leaf) else 0.0


def _through(face: Face, box: Rectangle) -> float:
    rows = slice(round(0.3 / COARSE), max(round((box.top - 0.1) / COARSE), round(0.3 / COARSE) + 1))
    cols = slice(max(round((box.left + 0.1) / COARSE), 0), max(round((box.right - 0.1) / COARSE), 1))
    through, on = face.image.through[rows, cols], face.image.on[rows, cols]
    return float(((through > 0) & (through >= on)).mean()) if through.size else 0.0


def _handle(face: Face, box: Rectangle, leaf: float) -> tuple[float | None, str | None]:
    """Height and side of a small thing that stands out from the leaf near one of its edges."""
    if not np.isfinite(leaf):
        return None, None
    image = face.image
    found: list[tuple[int, float, str]] = []
    for side, low, high in (
        ("start", box.left + 0.02, box.left + HANDLE_REACH),
        ("end", box.right - HANDLE_REACH, box.right - 0.02),
    ):
        part = window(image.depth.shape, low, high, *HANDLE_BAND)
        size, share, lowest, highest, middle = blob(image.depth, image.count, part, leaf, *HANDLE_OUT)
        if size >= 4 and highest - lowest < 22 and share < 0.2:
            found.append((int(size), float(HANDLE_BAND[0] + (middle + 0.5) * PIXEL), side))
    if not found:
        return None, None
    _, height, side = max(found)
    return round(height, 3), side


def evidence_of(faces: Sequence[Face], box: Rectangle) -> list[FaceEvidence]:
    """What each face says; of two the one that shows the outline less need not show it at the same place."""
    found = [face_evidence(face, box, SLACK) for face in faces]
    if len(faces) == 2:
        k = int(found[0].support > found[1].support)
        found[k] = face_evidence(faces[k], box, LOOSE)
    return found
