"""What each face of a wall says of a rectangle: a door leaf in its frame, or something that hangs or stands there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.lines import best_share, kinds
from scan2bim.openings.closed.profiles import DEEPEST, columns, rows
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
ABOVE = 1.0
"""Metres above the ceiling at which nothing is seen any more."""
SKIN = 0.012
"""Distance from the wall's plane, metres, within which a point is the wall's own: plaster's unevenness and noise."""
STEP = 0.03
"""Distance from the wall's fitted plane, metres, at which its flanks may lie together."""
TRIM = 0.10
"""Width, metres, of trims and frames."""
SLACK = np.array([-0.02, -0.01, 0.0, 0.01, 0.02])
"""Metres by which a side may be off its line."""
LOOSE = 0.02 * np.arange(-4, 5)
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
I16 = NDArray[np.int16]


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


@dataclass(frozen=True, slots=True)
class _Surface:
    """Evidence of a face with ``trim`` and ``whole`` as clear as they can be, and depths by which they are found: of
    the ``wall`` beside the rectangle and of the ``leaf`` in it.
    """

    evidence: FaceEvidence
    wall: float
    leaf: float


def face_evidence(face: Face, box: Rectangle) -> FaceEvidence:
    """What one face says of a rectangle."""
    return _with_strips(face, box, _surface_of(face, box))


def _surface_of(face: Face, box: Rectangle) -> _Surface:
    """What one face says of a rectangle, but for its strips, which take as long as the rest."""
    image = face.image
    rasters = image.rgb, image.depth, image.known, image.count, image.through, image.on
    told = _told(_lines(face), rasters, box.left, box.right, _asked(box), SLACK)
    left, right, head, agree, shown = _judged_outline(told[:5], box)
    seen, wall, leaf, colour, beyond, foot, height, at = told[5:13]
    through, dominant, lintel, flank, onward = told[13:]
    at = None if np.isnan(height) else "end" if at else "start"
    height = None if at is None else round(height, 3)
    outline, inside = (left, right, head, agree, shown), (seen, wall - leaf, colour)
    about, rest = (np.inf, beyond, foot, height, at), (through, dominant, 1.0, lintel, flank, onward)
    return _Surface(FaceEvidence(*outline, *inside, *about, *rest, False), wall, leaf)


def _with_strips(face: Face, box: Rectangle, surface: _Surface) -> FaceEvidence:
    """The evidence of a face with ``trim`` and ``whole`` as they are."""
    rasters = face.image.count, face.solid, face.image.rgb, face.image.depth
    trim, whole = _strips(*rasters, box.left, box.right, _asked(box), surface.wall, surface.leaf)
    return replace(surface.evidence, trim=trim, whole=whole)


def _asked(box: Rectangle) -> float:
    """Height, metres, up to which the faces are asked of a rectangle: where the ceiling is its head, beyond it, so that
    nothing is taken for one.
    """
    return box.top + ABOVE * box.whole


def _judged_outline(told: tuple[float, ...], box: Rectangle) -> tuple[float, float, float, float, float]:
    """Left, right, head, agree and shown; where the ceiling is the head, it counts as much as the two sides do."""
    left, right, head, agree, shown = told
    return (
        (left, right, (left + right) / 2, 1.5 * agree, 1.5 * shown) if box.whole else (left, right, head, agree, shown)
    )


def _lines(face: Face) -> tuple[I16, I16, I16, I16, I16, I16]:
    """The cumulated discontinuities of a face's upright and level lines."""
    sides, heads = face.sides, face.heads
    return sides.rising, sides.falling, sides.seen, heads.rising, heads.falling, heads.seen


@nb.njit(cache=True, nogil=True)
def _told(lines, rasters, left, right, top, slack):  # pyright: ignore
    """The numbers of a face's evidence, from its lines and rasters: one call for each candidate."""
    rising, falling, seen, over, under, known_heads = lines
    rgb, depth, known, count, through, on = rasters
    outline = _outline(rising, falling, seen, over, under, known_heads, left, right, top, slack)
    share, wall, leaf, colour, dominant, lintel, flank = _surface(depth, known, rgb, left, right, top)
    beyond, foot, onward = _around(rising, falling, seen, over, under, known_heads, left, right, top, slack)
    height, at = _handle(depth, count, left, right, top, leaf)
    looked = _through(through, on, left, right, top)
    inside = share, np.float64(wall), np.float64(leaf), np.float64(colour)
    return (*outline, *inside, beyond, foot, height, at, looked, dominant, lintel, flank, onward)


@nb.njit(cache=True, nogil=True)
def _piece(place):  # pyright: ignore
    return int(np.rint(place / PIXEL / BLOCK))


@nb.njit(cache=True, nogil=True)
def _pixels_of(place, slack):  # pyright: ignore
    """The pixels of places near one."""
    return np.rint((place + slack) / PIXEL).astype(np.int64)


@nb.njit(cache=True, nogil=True)
def _outline(rising, falling, seen, rising_heads, falling_heads, seen_heads, left, right, top, slack):  # pyright: ignore
    """Share of discontinuities on left side, right side and head, each off by ``slack`` at most; of those that agree
    on all three; and share of the three that was seen.
    """
    foot, upper = _piece(FOOT), _piece(top - 0.04)
    start, shown_start = kinds(rising, falling, seen, _pixels_of(left, slack), foot, upper)
    end, shown_end = kinds(rising, falling, seen, _pixels_of(right, slack), foot, upper)
    first, last = _piece(left + 0.05), _piece(right - 0.05)
    head, shown = kinds(rising_heads, falling_heads, seen_heads, _pixels_of(top, slack), first, last)
    agree = np.float32(0)
    for k in range(8):
        for up in range(2):
            other = 1 - up if k < 4 else up
            agree = max(agree, start[up, k] + end[other, k] + head[other, k])
    shown = (shown_start + shown_end + shown) / np.float32(3)
    return (
        np.float64(start.max()),
        np.float64(end.max()),
        np.float64(head.max()),
        np.float64(agree) / 3,
        np.float64(shown),
    )


@nb.njit(cache=True, nogil=True)
def _surface(depth, known, rgb, left, right, top):  # pyright: ignore
    """Share of the rectangle that is known; depth of the wall beside it and of its inside; difference of their colours;
    share of the inside that has its depth; share of wall above the head and beside.
    """
    inner = window(depth.shape, left + INSET, right - INSET, FOOT, top - INSET)
    start = window(depth.shape, left - FLANK[1], left - FLANK[0], FOOT, top)
    end = window(depth.shape, right + FLANK[0], right + FLANK[1], FOOT, top)
    inside = known_values(depth, known, inner, 2)
    beside, behind = known_values(depth, known, start, 2), known_values(depth, known, end, 2)
    above = window(depth.shape, left + INSET, right - INSET, top + LINTEL[0], top + LINTEL[1])
    leaf, wall = level(inside), wall_level(beside, behind, known_values(depth, known, above, 2), SKIN, STEP)
    return (
        share_known(known, window(depth.shape, left, right, 0.0, top), 2),
        wall,
        leaf,
        colour_step(rgb, known, inner, start, end, 4, FEW_COLOURS),
        share_near(inside, leaf, SAME_DEPTH),
        share_level(depth, known, above, wall, SKIN) if above[1] - above[0] >= 4 else 0.0,
        share_near(np.concatenate((beside, behind)), wall, SKIN),
    )


@nb.njit(cache=True, nogil=True)
def _around(rising, falling, seen, rising_heads, falling_heads, seen_heads, left, right, top, slack):  # pyright: ignore
    """Share of discontinuities on the sides' lines between 15 and 60 cm above the head; in their lowest 40 cm, of the
    lesser; and on the head's line from 10 to 50 cm beyond a side, of the greater.
    """
    first, last = _piece(top + 0.15), min(_piece(top + 0.6), seen.shape[0] - 2)
    none = np.zeros(1)
    beyond = np.float32(0)
    if last - first >= 2:
        for side in (left, right):
            beyond = max(beyond, best_share(rising, falling, seen, _pixels_of(side, none), first, last))
    foot = min(
        best_share(rising, falling, seen, _pixels_of(left, slack), 0, _piece(0.4)),
        best_share(rising, falling, seen, _pixels_of(right, slack), 0, _piece(0.4)),
    )
    low, high = left / PIXEL / BLOCK, right / PIXEL / BLOCK
    onward = np.float32(0)
    for first, last in (
        (max(int(np.rint(low - 5)), 0), int(np.rint(low - 1))),
        (int(np.rint(high + 1)), min(int(np.rint(high + 5)), seen_heads.shape[0] - 1)),
    ):
        if last - first >= 2:
            heads = _pixels_of(top, slack)
            onward = max(onward, best_share(rising_heads, falling_heads, seen_heads, heads, first, last))
    return np.float64(beyond), np.float64(foot), np.float64(onward)


@nb.njit(cache=True, nogil=True)
def _strips(count, solid, rgb, depth, left, right, top, wall, leaf):  # pyright: ignore
    """Least metres by which strips at left, right and head stand out from the wall; and share of the columns inside
    that have the leaf's depth and colour, panes left out.
    """
    size = depth.shape
    start = columns(count, rgb, depth, *window(size, left - SHADOW, left + TRIM, FOOT, top - TRIM))
    end = columns(count, rgb, depth, *window(size, right - TRIM, right + SHADOW, FOOT, top - TRIM))
    head = rows(count, rgb, depth, *window(size, left + TRIM, right - TRIM, top - TRIM, top + SHADOW))
    few = TRIM / PIXEL
    trim = min(stands_out(start, wall, few), stands_out(end, wall, few), stands_out(head, wall, few))
    if not np.isfinite(leaf):
        return trim, 0.0
    inside = columns(solid, rgb, depth, *window(size, left + TRIM, right - TRIM, FOOT, top - TRIM))
    deep = min(max(leaf, -DEEPEST), DEEPEST)
    return trim, share_alike(inside, deep, ALIKE_DEPTH, ALIKE_COLOUR, few)


@nb.njit(cache=True, nogil=True)
def _through(through, on, left, right, top):  # pyright: ignore
    """Share of the inside, above 0.3 m, that stations looked through."""
    low, first = int(np.rint(0.3 / COARSE)), max(int(np.rint((left + 0.1) / COARSE)), 0)
    high = min(max(int(np.rint((top - 0.1) / COARSE)), low + 1), on.shape[0])
    last = min(max(int(np.rint((right - 0.1) / COARSE)), 1), on.shape[1])
    found = 0
    for r in range(low, high):
        for c in range(first, last):
            found += through[r, c] > 0 and through[r, c] >= on[r, c]
    return found / max((high - low) * (last - first), 1) if high > low and last > first else 0.0


@nb.njit(cache=True, nogil=True)
def _handle(depth, count, left, right, top, leaf):  # pyright: ignore
    """Height, nan where there is none, and side (1 at the right) of a small thing that stands out from the leaf near
    one of its edges.
    """
    most, height, at = 0, np.nan, 0
    if np.isfinite(leaf):
        for side, low, high in ((0, left + 0.02, left + HANDLE_REACH), (1, right - HANDLE_REACH, right - 0.02)):
            part = window(depth.shape, low, high, *HANDLE_BAND)
            size, share, lowest, highest, middle = blob(depth, count, part, leaf, *HANDLE_OUT)
            here = HANDLE_BAND[0] + (middle + 0.5) * PIXEL
            if (
                size >= 4
                and highest - lowest < 22
                and share < 0.2
                and (size > most or (size == most and here > height))
            ):
                most, height, at = size, here, side
    return height, at


def evidence_of(
    faces: Sequence[Face], box: Rectangle, promising: Callable[[Sequence[FaceEvidence]], bool] | None = None
) -> list[FaceEvidence]:
    """What each face says; of two the one that shows the outline less need not show it at the same place. Where that
    is not ``promising`` with the clearest trim and the most even leaf that there can be, these are left so.
    """
    surfaces = [_surface_of(face, box) for face in faces]
    if len(faces) == 2:
        k = int(surfaces[0].evidence.support > surfaces[1].evidence.support)
        told = _outline(*_lines(faces[k]), box.left, box.right, _asked(box), LOOSE)
        left, right, head, agree, shown = _judged_outline(told, box)
        loose = {"left": left, "right": right, "head": head, "agree": agree, "shown": shown, "loose": True}
        surfaces[k] = replace(surfaces[k], evidence=replace(surfaces[k].evidence, **loose))
    found = [surface.evidence for surface in surfaces]
    if promising is not None and not promising(found):
        return found
    return [_with_strips(face, box, surface) for face, surface in zip(faces, surfaces, strict=True)]
