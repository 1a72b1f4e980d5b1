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
SHADOW = 0.15
"""Distance outwards from a rectangle, metres, at which the wall shows again: a trim hides a strip of it."""
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

    left, right, head: share of each side that is a discontinuity; ``outline`` their mean. seen: share of the rectangle
    with data. recess: metres by which its inside lies behind the wall beside it (negative: before it), nan where
    unseen. rough: metres, median deviation of the inside from its own depth. colour: difference of inside and beside,
    0-1. trim: metres by which a strip round it stands out. beyond: share of its sides' lines that go on above the head.
    foot: share of discontinuities in the lowest 40 cm of its sides. handle: height over the base, metres, None where
    none was seen, and handle_side of the leaf. through: share that stations looked through. dominant: share of its most
    frequent depth. whole: share of its columns that have one depth and colour. lintel, flank: share of wall, seen in
    its plane, above the head and beside.
    """

    left: float
    right: float
    head: float
    seen: float
    recess: float
    rough: float
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

    @property
    def outline(self) -> float:
        """Mean share of sides and head."""
        return (self.left + self.right + self.head) / 3

    @property
    def weakest(self) -> float:
        """Share of the weakest of sides and head."""
        return min(self.left, self.right, self.head)


def face_evidence(face: Face, box: Rectangle) -> FaceEvidence:
    """What one face says of a rectangle."""
    image = face.image
    inside = _window(image.depth, image.known, box.left + INSET, box.right - INSET, FOOT, box.top - INSET)
    flanks = (
        _window(image.depth, image.known, box.left - FLANK[1], box.left - FLANK[0], FOOT, box.top),
        _window(image.depth, image.known, box.right + FLANK[0], box.right + FLANK[1], FOOT, box.top),
    )
    beside = np.concatenate(flanks)
    level = float(np.median(inside)) if len(inside) > 50 else float("nan")
    wall = _wall_level(*flanks)
    left, right, head = _outline(face, box)
    height, at = _handle(face, box, level)
    return FaceEvidence(
        left,
        right,
        head,
        _share(image.known, box),
        wall - level,
        float(np.median(np.abs(inside - level))) if len(inside) > 50 else float("nan"),
        _colour_step(face, box),
        _trim(face, box, wall),
        _beyond(face, box),
        _foot(face, box),
        height,
        at,
        _through(face, box),
        float(np.mean(np.abs(inside - level) < 0.008)) if len(inside) > 50 else 0.0,
        _whole(face, box, level),
        _lintel(face, box, wall),
        float(np.mean(np.abs(beside - wall) < SKIN)) if len(beside) > 50 else 0.0,
    )


def _wall_level(left: F32, right: F32) -> float:
    """Depth of the wall beside a rectangle: that of both flanks where they agree and no furniture stands there, else
    the most of them that lies near the wall's plane, else that plane itself.
    """
    levels = [float(np.median(flank)) for flank in (left, right) if len(flank) > 50]
    if len(levels) == 2 and abs(levels[0] - levels[1]) < SKIN / 2 and max(map(abs, levels)) < STEP:
        return (levels[0] + levels[1]) / 2
    beside = np.concatenate([left, right])
    near = beside[np.abs(beside) < SKIN]
    return float(np.median(near)) if len(near) > 50 else 0.0


def _lintel(face: Face, box: Rectangle, wall: float) -> float:
    """Share of the strip above the head that is wall: seen, and in its plane."""
    rows = _pixels(box.top + LINTEL[0], box.top + LINTEL[1], face.image.depth.shape[0])
    cols = _pixels(box.left + INSET, box.right - INSET, face.image.depth.shape[1])
    if rows.stop - rows.start < 4 or cols.stop <= cols.start:
        return 0.0
    return float((face.image.known[rows, cols] & (np.abs(face.image.depth[rows, cols] - wall) < SKIN)).mean())


def _pixels(low: float, high: float, size: int) -> slice:
    return slice(min(max(round(low / PIXEL), 0), size), min(max(round(high / PIXEL), 0), size))


def _window(
    values: F32, known: NDArray[np.bool_], left: float, right: float, bottom: float, top: float, step: int = 2
) -> F32:
    """Known values (k, ...) in a rectangle, every ``step``-th row and column."""
    rows, cols = _pixels(bottom, top, known.shape[0]), _pixels(left, right, known.shape[1])
    return values[rows, cols][::step, ::step][known[rows, cols][::step, ::step]]


def _share(mask: NDArray[np.bool_], box: Rectangle) -> float:
    part = mask[_pixels(0.0, box.top, mask.shape[0]), _pixels(box.left, box.right, mask.shape[1])]
    return float(part[::2, ::2].mean()) if part.size else 0.0


def _piece(place: float) -> int:
    return round(place / PIXEL / BLOCK)


def _supported(support: Support, places: Sequence[float], first: int, last: int) -> F32:
    """Share (n,) of discontinuities on lines at several places, metres, between two pieces."""
    return support.at(places, PIXEL, first, last)


def _outline(face: Face, box: Rectangle) -> tuple[float, float, float]:
    """Share of discontinuities on left side, right side and head; each may be off by a few pixels."""
    top = _piece(box.top - 0.04)
    sides = [place + d for place in (box.left, box.right) for d in SLACK]
    left, right = _supported(face.sides, sides, _piece(FOOT), top).reshape(2, -1).max(1)
    heads = [box.top + d for d in SLACK]
    head = _supported(face.heads, heads, _piece(box.left + 0.05), _piece(box.right - 0.05)).max()
    return float(left), float(right), float(head)


def _beyond(face: Face, box: Rectangle) -> float:
    """Share of discontinuities on the sides' lines between 15 and 60 cm above the head."""
    first, last = _piece(box.top + 0.15), min(_piece(box.top + 0.6), face.sides.pieces - 1)
    if last - first < 2:
        return 0.0
    return float(_supported(face.sides, (box.left, box.right), first, last).max())


def _foot(face: Face, box: Rectangle) -> float:
    """Share of discontinuities in the lowest 40 cm of the sides, of the lesser."""
    sides = [place + d for place in (box.left, box.right) for d in SLACK]
    return float(_supported(face.sides, sides, 0, _piece(0.4)).reshape(2, -1).max(1).min())


def _colour_step(face: Face, box: Rectangle) -> float:
    image = face.image
    inside = _window(image.rgb, image.known, box.left + INSET, box.right - INSET, FOOT, box.top - INSET, 4)
    beside = np.concatenate(
        [
            _window(image.rgb, image.known, box.left - FLANK[1], box.left - FLANK[0], FOOT, box.top, 4),
            _window(image.rgb, image.known, box.right + FLANK[0], box.right + FLANK[1], FOOT, box.top, 4),
        ]
    )
    if len(inside) < 20 or len(beside) < 20:
        return 0.0
    return float(np.abs(np.median(inside, 0) - np.median(beside, 0)).max())


def _trim(face: Face, box: Rectangle, wall: float) -> float:
    """Least metres by which strips at left, right and head stand out from the wall."""
    around = (
        face.profiles.columns(box.left - SHADOW, box.left + TRIM, FOOT, box.top - TRIM),
        face.profiles.columns(box.right - TRIM, box.right + SHADOW, FOOT, box.top - TRIM),
        face.profiles.rows(box.left + TRIM, box.right - TRIM, box.top - TRIM, box.top + SHADOW),
    )
    return min(_stands_out(means[:, 3] - wall) for means in around)


def _stands_out(depth: F32) -> float:
    """Metres by which the highest strip of three pixels stands out, 0 where it does not end on both sides."""
    known = depth[np.isfinite(depth)]
    if len(known) < TRIM / PIXEL:
        return 0.0
    strip = np.convolve(known, np.ones(3) / 3, mode="valid")
    at = int(np.argmax(strip))
    ends = max(known[: at + 1].min(), known[at + 2 :].min())
    return float(max(strip[at] - max(ends, 0.0), 0.0))


def _whole(face: Face, box: Rectangle, level: float) -> float:
    """Share of the columns inside a rectangle that have the leaf's depth and colour."""
    means = face.profiles.columns(box.left + TRIM, box.right - TRIM, FOOT, box.top - TRIM)
    means = means[np.isfinite(means[:, 3])]
    if len(means) < TRIM / PIXEL or not np.isfinite(level):
        return 0.0
    alike = np.abs(means[:, 3] - np.clip(level, -DEEPEST, DEEPEST)) < ALIKE_DEPTH
    alike &= np.abs(means[:, :3] - np.median(means[:, :3], 0)).max(1) < ALIKE_COLOUR
    return float(alike.mean())


def _through(face: Face, box: Rectangle) -> float:
    rows = slice(round(0.3 / COARSE), max(round((box.top - 0.1) / COARSE), round(0.3 / COARSE) + 1))
    cols = slice(max(round((box.left + 0.1) / COARSE), 0), max(round((box.right - 0.1) / COARSE), 1))
    through, on = face.image.through[rows, cols], face.image.on[rows, cols]
    return float(((through > 0) & (through >= on)).mean()) if through.size else 0.0


def _handle(face: Face, box: Rectangle, level: float) -> tuple[float | None, str | None]:
    """Height and side of a small thing that stands out from the leaf near one of its edges."""
    if not np.isfinite(level):
        return None, None
    image = face.image
    rows = _pixels(*HANDLE_BAND, image.depth.shape[0])
    found: list[tuple[int, float, str]] = []
    for side, low, high in (
        ("start", box.left + 0.02, box.left + HANDLE_REACH),
        ("end", box.right - HANDLE_REACH, box.right - 0.02),
    ):
        cols = _pixels(low, high, image.depth.shape[1])
        out = image.depth[rows, cols] - level
        blob = (out > HANDLE_OUT[0]) & (out < HANDLE_OUT[1]) & (image.count[rows, cols] > 0)
        at = np.flatnonzero(blob.any(1))
        if blob.sum() >= 4 and len(at) and at[-1] - at[0] < 22 and blob.mean() < 0.2:
            height = HANDLE_BAND[0] + (float(np.average(np.arange(blob.shape[0]), weights=blob.sum(1))) + 0.5) * PIXEL
            found.append((int(blob.sum()), height, side))
    if not found:
        return None, None
    _, height, side = max(found)
    return round(height, 3), side


def evidence_of(faces: Sequence[Face], box: Rectangle) -> list[FaceEvidence]:
    """What each face says."""
    return [face_evidence(face, box) for face in faces]
