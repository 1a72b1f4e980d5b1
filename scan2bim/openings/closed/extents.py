"""How far a closed door reaches: each side and the head where leaf and wall part best, by all pixels of both faces.

Candidates are told by lines, and of two lines of which one belongs to furniture or a shadow the count of their pieces
says little. Here a place is judged by what lies between it and the leaf's middle (leaf or wall, by depth, by colour,
and by whether the line across, the head or the sides, goes on there) and by the line itself, on both faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.medians import median
from scan2bim.openings.closed.contrast import BLOCK, PROUD, SIGNIFICANT, STRIP
from scan2bim.openings.closed.rectangles import FOOT, LINTEL, NARROWEST, Face, Rectangle
from scan2bim.openings.orthoimage import PIXEL

REACH = 0.4
"""Metres on both sides of a line within which the door's own is looked for."""
CORE = 0.25
"""Share of a rectangle's width and height beside its lines that is not asked what the leaf is like."""
FLANK, BESIDE = 0.3, 0.1
"""Width, metres, of the wall round a rectangle that tells what the wall is like, and how far off that begins."""
OFF, SKIN = 0.03, 0.012
"""Distance from the face's fitted plane, metres, at which the wall round a rectangle lies at most (a wide leaf may draw
that plane to itself); and from the wall's own depth there, within which a pixel is the wall's.
"""
DEPTH_SIGMA, COLOUR_SIGMA = 0.003, 0.03
"""Least deviation of depth (metres) and colour (of 1) of a pixel from its surface."""
FARTHEST = 4.0
"""Half squares of deviations beyond which a pixel is of neither: trims, handles and things before the wall."""
FEWEST = 100
"""Pixels that tell what a surface is like."""
TRIM, STANDS_OUT = 0.16, 0.01
"""Metres: what is wider and taller than the first and stands out by the second is no trim, but hides what is behind."""
MIXED = 2
"""Pixels beside such a thing whose ranges are mixed of it and of what is behind."""
HIDDEN = 0.3
"""Share of a piece of a line beside which such a thing stands from which on it says nothing."""
LEG, OVER = 6, (0.15, 0.6)
"""Pieces below a corner by which it is told; and distances beyond it, metres, at which a line should have ended."""
ROUNDS = 2
SIDES = np.array([2.39, 1.25, 0.73, 1.87, 1.21, 0.2, 1.19, 0.11, -0.54, 1.42])
HEADS = np.array([2.51, 1.33, 2.03, 1.12, 0.96, 0.72, 0.5, 0.91, -1.18, 0.31])
"""Weights of the features of ``_features`` for sides and for heads, fitted by tests/benchmarks/fit_extents.py on
simulated scenes.
"""
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """A face round a rectangle. ``depth`` and ``colour`` (r, c): how much rather pixels are leaf than wall, -1 to 1, 0
    where unknown. ``upright`` (p, c, 32) and ``level`` (q, r, 32): how much the pieces of lines change, each of 16
    contrasts rising and falling, 0-1; ``upright_seen`` (p, c) and ``level_seen`` (q, r) where that is known.
    """

    depth: F32
    colour: F32
    upright: F32
    level: F32
    upright_seen: Mask
    level_seen: Mask


@dataclass(frozen=True, slots=True, eq=False)
class _Strips:
    """What one face shows by place (n,) across a side or head: leaf by depth, leaf by colour, and whether the line
    across goes on there, -1 to 1; share of discontinuities on the line there, on its continuation beyond the corner,
    and at the corner; share of it that was seen.
    """

    depth: F32
    colour: F32
    across: F32
    line: F32
    beyond: F32
    corner: F32
    seen: F32


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What the faces (``parts``) show round a rectangle, ``box`` in their own places, which begin ``shift`` metres from
    the wall's start.
    """

    parts: list[_Part]
    box: Rectangle
    shift: float


def fitted(faces: Sequence[Face], box: Rectangle, low: float, high: float) -> Rectangle:
    """A closed door's rectangle with its sides and head where they fit best; others' end at ``low`` and begin at
    ``high``, metres along the wall.
    """
    around = surroundings(faces, box)
    parts, here, shift = around.parts, around.box, around.shift
    if not parts:
        return box
    for _ in range(ROUNDS):
        left = best(*side_features(parts, here, -1, low - shift), SIDES, here.left)
        right = best(*side_features(parts, here, 1, high - shift), SIDES, here.right)
        if right - left >= NARROWEST:
            here = Rectangle(left, right, here.top, here.whole)
        if not here.whole:
            here = Rectangle(here.left, here.right, best(*head_features(parts, here), HEADS, here.top))
    return Rectangle(here.left + shift, here.right + shift, here.top, here.whole)


def surroundings(faces: Sequence[Face], box: Rectangle) -> Surroundings:
    """What the faces show round a rectangle; none of them if nothing tells leaf and wall apart."""
    first = max(_pieces(box.left - 3 * REACH), 0) * BLOCK
    last, shift = _pieces(box.right + 3 * REACH) * BLOCK, first * PIXEL
    here = Rectangle(box.left - shift, box.right - shift, box.top, box.whole)
    return Surroundings([part for face in faces if (part := _part(face, here, first, last)) is not None], here, shift)


def best(places: I64, features: F32, weights: NDArray[np.float64], now: float) -> float:
    """The place, metres, whose weighted features add up to most; ``now`` where there is none."""
    return float(places[int(np.argmax(features @ weights))]) * PIXEL if len(places) else now


def _part(face: Face, box: Rectangle, first: int, last: int) -> _Part | None:
    """What a face tells of the leaf in a rectangle, whose places count from the column ``first``; None if too little of
    leaf or wall was seen.
    """
    image = face.image
    depth, rgb = image.depth[:, first:last], image.rgb[:, first:last]
    known = image.known[:, first:last]
    seen = known & (depth < PROUD)
    inset = CORE * box.width
    core = _window(depth, box.left + inset, box.right - inset, FOOT, (1 - CORE) * box.top)
    reach = REACH + FLANK
    ring = _window(depth, box.left - reach, box.right + reach, FOOT, box.top + reach)
    wall = seen & (np.abs(depth) < OFF)
    wall[_window(depth, box.left - BESIDE, box.right + BESIDE, 0.0, box.top + BESIDE)] = False
    leaf, wall = seen[core], wall[ring]
    if wall.any():
        wall &= np.abs(depth[ring] - np.float32(median(depth[ring][wall]))) < SKIN
    if leaf.sum() < FEWEST or wall.sum() < FEWEST:
        return None
    highest = max(float(median(depth[core][leaf])), float(median(depth[ring][wall])))
    clutter = _thick(known & (depth - highest > STANDS_OUT))
    told = [
        np.where(seen & ~clutter, _rather_leaf(values, values[core][leaf], values[ring][wall], least), 0)
        for values, least in ((depth[..., None], DEPTH_SIGMA), (rgb, COLOUR_SIGMA))
    ]
    upright, level = face.upright, face.level
    lines = slice(first // BLOCK, -(-min(last, image.depth.shape[1]) // BLOCK))
    return _Part(
        told[0].astype(np.float32),
        told[1].astype(np.float32),
        _change(upright.step[:, first:last], upright.ridge[:, first:last], clutter),
        _change(level.step[lines], level.ridge[lines], clutter.T),
        np.isfinite(upright.step[:, first:last, -1]),
        np.isfinite(level.step[lines, :, -1]),
    )


def _window(depth: F32, left: float, right: float, bottom: float, top: float) -> tuple[slice, slice]:
    rows, cols = depth.shape
    a, b = (min(max(round(v / PIXEL), 0), rows) for v in (bottom, top))
    c, d = (min(max(round(v / PIXEL), 0), cols) for v in (left, right))
    return slice(a, b), slice(c, d)


def _rather_leaf(values: F32, leaf: F32, wall: F32, least: float) -> F32:
    """How much rather pixels (r, c, k) are like the leaf's (n, k) than the wall's (m, k), -1 to 1."""
    middles = [_medians(part) for part in (leaf, wall)]
    spreads = [_medians(np.abs(part - m)) for part, m in zip((leaf, wall), middles, strict=True)]
    sigma = np.maximum(1.4826 * np.maximum(*spreads), least)
    return np.asarray(_rather_first(values, middles[0], middles[1], sigma))


def _medians(values: F32) -> F32:
    """Of each column (k,) of values (n, k)."""
    return np.array([median(column) for column in np.ascontiguousarray(values.T)], np.float32)


@nb.njit(cache=True, nogil=True)
def _rather_first(values, first, second, sigma):  # pyright: ignore
    """How much rather values (r, c, k) are like the ``first`` (k,) than the ``second``, -1 to 1; ``sigma`` (k,)."""
    rows, cols, count = values.shape
    out = np.empty((rows, cols), np.float32)
    far, half, size = np.float32(FARTHEST), np.float32(2), np.float32(count)
    for r in range(rows):
        for c in range(cols):
            one = other = np.float32(0)
            for k in range(count):
                one += ((values[r, c, k] - first[k]) / sigma[k]) ** 2
                other += ((values[r, c, k] - second[k]) / sigma[k]) ** 2
            out[r, c] = (min(other / size / half, far) - min(one / size / half, far)) / far
    return out


def _thick(mask: Mask) -> Mask:
    """What of a mask (r, c) is wider and taller than a trim."""
    size = round(TRIM / PIXEL)
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((size, size), np.uint8)) > 0


def _change(step: F32, ridge: F32, clutter: Mask) -> F32:
    """How much pieces of lines (p, c, 32) change, 0-1; not what stands before the wall (r, c), r along the lines."""
    values = np.nan_to_num(np.concatenate([step, ridge], 2) / np.float32(SIGNIFICANT))
    pieces = values.shape[0]
    padded = np.pad(clutter[: pieces * BLOCK], ((0, max(pieces * BLOCK - clutter.shape[0], 0)), (0, 0)))
    share = padded.reshape(pieces, BLOCK, -1).mean(1).astype(np.float32)
    values[cv2.dilate(share, np.ones((1, 2 * (STRIP + MIXED) + 1), np.uint8)) > HIDDEN] = 0
    both = np.clip(np.concatenate([values, -values], 2), 0, 1)
    out = both.copy()
    np.maximum(out[:, 1:], both[:, :-1], out=out[:, 1:])  # a scan blurs edges
    np.maximum(out[:, :-1], both[:, 1:], out=out[:, :-1])
    return out


def _pieces(place: float) -> int:
    return round(place / PIXEL / BLOCK)


def side_features(parts: Sequence[_Part], box: Rectangle, outward: int, limit: float) -> tuple[I64, F32]:
    """Places (n,), pixels, at which a rectangle's left (``outward`` -1) or right side may be, none beyond ``limit``,
    and their features (n, 10).
    """
    foot, top = _pieces(FOOT), max(_pieces(box.top - 0.04), 1)
    rows = slice(foot * BLOCK, top * BLOCK)
    strips = [
        _Strips(
            part.depth[rows].mean(0),
            part.colour[rows].mean(0),
            _along(part.level, part.level_seen, box.top, box.left, box.right, part.depth.shape[1]),
            _share(part.upright, foot, top),
            _share(part.upright, _pieces(box.top + OVER[0]), min(_pieces(box.top + OVER[1]), len(part.upright) - 1)),
            _share(part.upright, top - LEG, top),
            part.upright_seen[foot:top].mean(0, dtype=np.float32),
        )
        for part in parts
    ]
    side = box.left if outward < 0 else box.right
    return _features(strips, side, outward, (box.left + box.right) / 2, limit)


def head_features(parts: Sequence[_Part], box: Rectangle) -> tuple[I64, F32]:
    """The same of its head."""
    first, last = max(_pieces(box.left + 0.05), 0), max(_pieces(box.right - 0.05), 1)
    cols = slice(first * BLOCK, last * BLOCK)
    strips: list[_Strips] = []
    for part in parts:
        legs = [
            _along(part.upright, part.upright_seen, at, FOOT, box.top, part.depth.shape[0])
            for at in (box.left, box.right)
        ]
        strips.append(
            _Strips(
                part.depth[:, cols].mean(1),
                part.colour[:, cols].mean(1),
                np.asarray(np.mean(legs, 0), np.float32),
                _share(part.level, first, last),
                np.maximum(_share(part.level, first - 5, first - 1), _share(part.level, last + 1, last + 5)),
                np.minimum(_share(part.level, first, first + 3), _share(part.level, last - 3, last)),
                part.level_seen[first:last].mean(0, dtype=np.float32),
            )
        )
    height = len(strips[0].depth) * PIXEL - LINTEL
    return _features(strips, box.top, 1, box.top - REACH, min(height, box.top + REACH))


def _share(change: F32, first: int, last: int) -> F32:
    """The greatest share, of one kind, that lines (c,) change between two pieces."""
    part = change[max(first, 0) : max(last, 0)]
    return part.mean(0).max(1) if len(part) else np.zeros(change.shape[1], np.float32)


def _along(change: F32, seen: Mask, place: float, low: float, high: float, size: int) -> F32:
    """For each pixel (size,) along a line at ``place``, from -1 to 1, whether it changes there as it does between
    ``low`` and ``high``, 0 where that was not seen.
    """
    at = round(place / PIXEL)
    near = slice(max(at - 2, 0), at + 3)
    if not change[:, near].size:
        return np.zeros(size, np.float32)
    both, known = change[:, near].max(1), np.asarray(seen[:, near].any(1))
    first, last = max(_pieces(low + 0.1), 0), max(_pieces(high - 0.1), 1)
    kind = int(np.argmax(both[first:last].sum(0))) if last > first else 0
    share = float(both[first:last, kind].sum()) / max(int(known[first:last].sum()), 1)
    told = np.where(known, 2 * both[:, kind] - 1, 0) * max(2 * share - 1, 0)
    out = np.repeat(told, BLOCK)[:size].astype(np.float32)
    return np.pad(out, (0, size - len(out)))


def _features(strips: Sequence[_Strips], side: float, outward: int, middle: float, limit: float) -> tuple[I64, F32]:
    """Places near a side, from the ``middle`` outwards, and what speaks for each.

    Pixels, in tens, from the middle to there that are leaf by depth, by colour, and by the line across, less those that
    are wall; share of discontinuities on the clearer face, on the other; of what goes on beyond the corner (against);
    at the corner; of what was seen of the line; decimetres from the candidate's own side (against); and how much
    clearer the line is than what goes on beyond the corner.
    """
    size, at = len(strips[0].depth), round(side / PIXEL)
    start, stop = (min(max(round(place / PIXEL), 0), size - 1) for place in (middle, limit))
    places = np.arange(start, stop + outward, outward)  # a side at p parts pixels p - 1 and p
    near = np.abs(places - at) <= round(REACH / PIXEL)
    if len(places) < 2 or not near.any():
        return places[:0], np.zeros((0, len(SIDES)), np.float32)
    inner = places if outward > 0 else places - 1

    def gained(values: Sequence[F32]) -> F32:
        return (np.append(0, np.cumsum(np.sum(values, 0)[inner])[:-1]) / 10).astype(np.float32)

    lines = np.array([s.line[places] for s in strips])
    features = np.stack(
        [
            gained([s.depth for s in strips]),
            gained([s.colour for s in strips]),
            gained([s.across for s in strips]),
            lines.max(0),
            lines.sum(0) - lines.max(0),
            np.max([s.beyond[places] for s in strips], 0),
            np.max([s.corner[places] for s in strips], 0),
            np.max([s.line[places] / np.maximum(s.seen[places], 0.2) for s in strips], 0),
            np.abs(places - at) * PIXEL * 10,
            np.max([np.maximum(s.line - s.beyond, 0)[places] for s in strips], 0),
        ],
        1,
    )
    return places[near], features[near].astype(np.float32)
