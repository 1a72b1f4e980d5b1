"""Rectangles standing on the floor whose sides and head are discontinuities on a face of the wall.

The paper's candidates (section V.B: all rectangles of two upright and two level lines, of a door's size, with the lower
side on the floor), from both faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.contrast import BLOCK, Contrast, contrasts
from scan2bim.openings.closed.corners import rectangles_below
from scan2bim.openings.closed.lines import Support, find_lines, largest_near, support_of
from scan2bim.openings.orthoimage import COARSE, PIXEL, Orthoimage

F32 = NDArray[np.float32]
NARROWEST, WIDEST = 0.55, 2.6
"""Widths of doors with their trims, metres (trade: single 0.5 to 1.5, double to 2.5)."""
LOWEST, HIGHEST = 1.75, 2.75
"""Heights of heads with their trims, metres."""
LINTEL = 0.08
"""Height, metres, of the wall that must be left above a head: otherwise it is the ceiling's line. That is the head of
doors as high as the room, which are told by their sides alone.
"""
LEG = 1.8
"""Height, metres, up to which an upright line is looked at before its head is known."""
FOOT = 0.1
"""Height, metres, below which skirtings and thresholds hide a line."""
LEAST_SIDE, LEAST_HEAD = 0.4, 0.45
"""Share of a side's, a head's seen pieces that must be discontinuities. The paper asks for 70 %; others judge here."""
APART = 2
"""Lines of one kind are at least so many pixels apart."""
MOST_LINES = 60, 8
"""Upright lines of a wall that are combined, the best, and for each metre of a long wall: more is a pattern."""
SAME = 0.85
"""Overlap (intersection over union) from which two rectangles are the same thing."""
MOST_DISTINCT = 30, 5
"""Different rectangles of a wall that are looked at closely, and for each metre of a long wall."""
MOST_RECTANGLES = 300, 100
"""Rectangles of a wall that are told apart, the best supported, and for each metre of a long wall."""
MOST_BELOW = 16, 3
"""Rectangles of a wall that are told by their heads, and for each metre of a long wall."""
SOME_SEEN = 0.25
"""Share of one of the sides that must be seen."""
UPPER = 6
"""Pieces below a head, on which alone a side is told as well: furniture hides what is below."""
LEAST_UPPER = 0.65
"""Share of those pieces that must be discontinuities: few are easily so by chance."""
LEGS = ((FOOT, LEG, LEAST_SIDE), (1.3, LEG, LEAST_UPPER), (1.7, 2.0, LEAST_UPPER), (1.9, 2.2, LEAST_UPPER))
"""Heights, metres, between which upright lines are looked for, the whole and above furniture; and the least share."""
CROWN = 3
"""Pieces below the ceiling, of which LEAST_UPPER must be discontinuities on both sides of a door as high as the room:
those of a lower one end below.
"""
UNSURE = 2.0
"""Pieces that are added to those seen of a side, so that a few that were seen count less than many."""


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A face with its contrasts, their support across upright and level lines, and where it has points and the wall was
    looked through from neither side (r, c): panes return some pulses, too.
    """

    image: Orthoimage
    upright: Contrast
    level: Contrast
    sides: Support
    heads: Support
    solid: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Left and right along the wall, top over its base, metres; ``whole`` if that is the wall's upper edge."""

    left: float
    right: float
    top: float
    whole: bool = False

    @property
    def width(self) -> float:
        """Metres."""
        return self.right - self.left

    def overlap(self, other: Rectangle) -> float:
        """Intersection over union."""
        inner = max(0.0, min(self.right, other.right) - max(self.left, other.left)) * min(self.top, other.top)
        return inner / (self.width * self.top + other.width * other.top - inner)


def contrasted(images: Sequence[Orthoimage]) -> list[Face]:
    """The contrasts and their support of a wall's faces."""
    if not images:
        return []
    rows, cols = images[0].count.shape
    step = round(COARSE / PIXEL)
    looked = np.any([(image.through > 0) & (image.through >= image.on) for image in images], axis=0)
    clear = ~looked.repeat(step, 0).repeat(step, 1)[:rows, :cols]
    return [_face(image, (image.count > 0) & clear) for image in images]


def _face(image: Orthoimage, solid: NDArray[np.bool_]) -> Face:
    upright, level = contrasts(image)
    return Face(image, upright, level, support_of(upright), support_of(level), solid)


def rectangles_on(faces: Sequence[Face]) -> tuple[list[Rectangle], list[Rectangle]]:
    """Candidates of a wall, best supported first: those with a head, and those as high as the wall."""
    places = _upright_lines(faces)
    if len(places) < 2:
        return [], []
    left, right = (places[k] for k in np.triu_indices(len(places), 1))
    width = (right - left) * PIXEL
    fits = (width >= NARROWEST) & (width <= WIDEST)
    left, right = left[fits], right[fits]
    if not len(left):
        return [], []
    tall = _tall_rectangles(faces, left, right)
    left, right, top, head = _with_heads(faces, left, right)
    score = np.max([_sides(face, left, right, top) for face in faces], axis=0)
    score = np.where(score > 0, score + head, 0)
    return _best(faces, score, left, right, top), tall


def _best(
    faces: Sequence[Face],
    score: NDArray[np.floating],
    left: NDArray[np.int64],
    right: NDArray[np.int64],
    top: NDArray[np.int64],
    *,
    whole: bool = False,
) -> list[Rectangle]:
    """The rectangles with the best scores above 0; sides and tops (n,) in pixels."""
    order = np.argsort(-score, kind="stable")[: _most(MOST_RECTANGLES, faces)]
    sides = np.stack([left, right, top], 1)[order[score[order] > 0]].astype(np.float64) * PIXEL
    return [Rectangle(a, b, c, whole) for a, b, c in sides.tolist()]


def _tall_rectangles(faces: Sequence[Face], left: NDArray[np.int64], right: NDArray[np.int64]) -> list[Rectangle]:
    """Rectangles as high as the wall: their sides are discontinuities up to the ceiling on one face."""
    height = faces[0].heads.places
    if not LOWEST <= height * PIXEL <= HIGHEST:
        return []
    top = np.full(len(left), height)
    last = (top - 5) // BLOCK
    score = np.zeros(len(left), np.float32)
    for face in faces:
        crowned = np.ones(len(left), bool)
        for place in (left, right):
            share, known = face.sides.share(place, last - CROWN, last)
            crowned &= (share >= LEAST_UPPER) & (known > 0.5)
        score = np.maximum(score, np.where(crowned, _sides(face, left, right, top), 0))
    return _best(faces, score, left, right, top, whole=True)


def _sides(face: Face, left: NDArray[np.int64], right: NDArray[np.int64], top: NDArray[np.int64]) -> F32:
    """How well a face supports pairs of sides up to their heads, 0 where it does not: shares of the pieces that it
    shows, less sure where it shows few.
    """
    last = (top - 5) // BLOCK
    first = np.full(len(left), round(FOOT / PIXEL / BLOCK))
    support: list[F32] = []
    seen: list[F32] = []
    for place in (left, right):
        whole, known = face.sides.share(place, first, last)
        upper, near = face.sides.share(place, last - UPPER, last)
        whole = np.where(whole >= LEAST_SIDE, whole, 0) * known / (known + UNSURE / (last - first))
        upper = np.where(upper >= LEAST_UPPER, upper, 0) * near / (near + UNSURE / UPPER) * UPPER / (last - first)
        support.append(np.maximum(whole, upper))
        seen.append(known)
    told = (np.minimum(*support) > 0) & (np.maximum(*seen) > SOME_SEEN)
    return np.where(told, support[0] + support[1], 0).astype(np.float32)


def _most(limits: tuple[int, int], faces: Sequence[Face]) -> int:
    """The greater of a number and a number a metre of the wall's length."""
    return max(limits[0], round(limits[1] * faces[0].image.depth.shape[1] * PIXEL))


def _upright_lines(faces: Sequence[Face]) -> NDArray[np.int64]:
    """Places of the upright lines of all faces, pixels."""
    if not faces:
        return np.zeros(0, np.int64)
    found: list[NDArray[np.int64]] = []
    legs = [(round(low / PIXEL / BLOCK), round(high / PIXEL / BLOCK), least) for low, high, least in LEGS]
    for face in faces:
        for first, last, least in legs:
            if face.sides.pieces >= last:
                found.append(find_lines(face.sides, face.upright, first, last, least, APART))
    places = np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)
    most = _most(MOST_LINES, faces)
    if len(places) <= most:
        return places
    best = np.zeros(len(places), np.float32)
    for face in faces:
        for first, last, _ in legs:
            share, seen = face.sides.share(places, np.full(len(places), first), np.full(len(places), last))
            best = np.maximum(best, share * seen / (seen + UNSURE / (last - first)))
    return np.sort(places[np.argsort(-best, kind="stable")[:most]])


def _with_heads(
    faces: Sequence[Face], left: NDArray[np.int64], right: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Each pair of sides with each of its head lines: left, right, top, support of the head."""
    rows = np.arange(round(LOWEST / PIXEL), min(round(HIGHEST / PIXEL), faces[0].heads.places - round(LINTEL / PIXEL)))
    if not len(rows):
        none = np.zeros(0, np.int64)
        return none, none, none, np.zeros(0, np.float32)
    pair, row = (g.ravel() for g in np.meshgrid(np.arange(len(left)), rows, indexing="ij"))
    share = np.zeros(len(pair), np.float32)
    for face in faces:
        first, last = (left[pair] + 3 + BLOCK - 1) // BLOCK, (right[pair] - 3) // BLOCK
        here, seen = face.heads.share(row, first, last)
        share = np.maximum(share, np.where(seen > 0.3, here, 0))
    grid = share.reshape(len(left), len(rows))
    window = largest_near(grid, APART)
    middle = (grid >= LEAST_HEAD) & (grid >= window) & (np.pad(grid, ((0, 0), (1, 0)))[:, :-1] < grid)
    i, j = np.nonzero(middle)
    return left[i], right[i], rows[j], grid[i, j]


def candidates(faces: Sequence[Face]) -> list[Rectangle]:
    """The rectangles of a wall without those that are nearly the same as a better one: those whose sides were seen,
    and those whose heads were, from corner to corner.
    """
    if not faces:
        return []
    out: list[Rectangle] = []
    for found in rectangles_on(faces):
        out += [found[k] for k in _different(found, _most(MOST_DISTINCT, faces))]
    every = [*out, *_below_heads(faces)]
    return out + [every[k] for k in _different(every, len(out) + _most(MOST_BELOW, faces)) if k >= len(out)]


def _below_heads(faces: Sequence[Face]) -> list[Rectangle]:
    """Rectangles told by their heads, the best first."""
    width = round(NARROWEST / PIXEL), round(WIDEST / PIXEL)
    rows = round(LOWEST / PIXEL), min(round(HIGHEST / PIXEL), faces[0].heads.places - round(LINTEL / PIXEL))
    if rows[1] <= rows[0]:
        return []
    uprights = [face.sides for face in faces]
    found = np.concatenate([rectangles_below(face.heads, uprights, rows, width) for face in faces])
    best = found[np.argsort(-found[:, 3], kind="stable")[: _most(MOST_RECTANGLES, faces)]]
    return [Rectangle(left * PIXEL, right * PIXEL, top * PIXEL) for left, right, top, _ in best.tolist()]


def _different(found: Sequence[Rectangle], most: int) -> list[int]:
    """Numbers of the first ``most`` that are not the same as an earlier one."""
    sides = np.array([(box.left, box.right, box.top) for box in found], np.float64).reshape(-1, 3)
    return _distinct(sides, most).tolist()


@nb.njit(cache=True, nogil=True)
def _distinct(sides, most):  # pyright: ignore
    """Numbers of the first ``most`` rectangles (n, 3), by left, right and top, that overlap no earlier one by SAME."""
    kept = np.empty(most, np.int64)
    used = 0
    for i in range(sides.shape[0]):
        if used == most:
            break
        left, right, top = sides[i]
        apart = True
        for k in kept[:used]:
            wide = max(0.0, min(right, sides[k, 1]) - max(left, sides[k, 0]))
            inner = wide * min(top, sides[k, 2])
            either = (right - left) * top + (sides[k, 1] - sides[k, 0]) * sides[k, 2] - inner
            if inner / either >= SAME:
                apart = False
                break
        if apart:
            kept[used] = i
            used += 1
    return kept[:used]
