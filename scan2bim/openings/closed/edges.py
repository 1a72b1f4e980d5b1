"""Where a closed door's opening ends: the jambs and the head behind the outline that one sees.

What shows on a face is one of three things. A *step* from the wall to the frame or the leaf stands at the opening's
edge itself. A *trim* lies on the wall and laps over the edge: by little where the leaf comes right behind it, and over
a part of the lining where that shows between trim and leaf. A hairline *gap* round a leaf of the wall's own colour is
the leaf's edge, and the frame between it and the opening's edge cannot be told from the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.medians import median
from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.rectangles import FOOT, Face, Rectangle
from scan2bim.openings.orthoimage import PIXEL

REACH = 0.28
"""Distance from a rectangle's side, metres, within which its edge is looked for: a trim's width, a frame's, and wall
beside them.
"""
FARTHEST, INWARDS, NEAR = 0.10, 0.07, 0.03
"""Distance outwards from a rectangle's side, metres, up to which a change is its edge and not the next thing's, and
inwards, where things stand before the leaf; and both ways a hairline, as which chance shows more often.
"""
BEFORE = 0.05
"""Distance before the wall, metres, from which on a point is a thing that stands there, no trim."""
LEAST_PLACES = 12
"""Places across an edge that must have been seen."""
TALL_ENOUGH = 20
"""Measured pixels that a column (row) needs to be asked."""
EVEN = 0.5
"""Share of the places across an edge, of the most that are seen at any height, that must be seen at a height: what
furniture hides in part would set one height's light against another's.
"""
WIDEST_GAP = 0.035
"""Metres across an edge that may be unseen between what is outside and what is inside."""
STANDS_OUT = 0.004
"""Metres by which a trim stands out from the wall at least."""
BESIDE, OFF = 0.16, 0.03
"""Distance outwards, metres, from which on the wall shows beside a trim; and how far from its fitted plane it may lie
there: a wide door's leaf may have drawn that plane to itself.
"""
TRIM_WIDTH = (0.02, 0.15)
"""Widths of trims, metres."""
LINING = (0.015, 0.05)
"""Widths, metres, of the strip of lining that shows between trim and leaf."""
FLUSH = 0.02
"""Distance from the wall, metres, up to which a leaf right inside a trim may have a gap that shows its edge."""
AGREE = 0.02
"""Metres to which the edges of both faces agree, if both are the opening's."""
LAP = 0.025
"""Metres by which a trim laps over a lining that shows behind it: usual linings are 22 to 30 mm thick."""
FRAME = 0.03
"""Metres from a leaf's hairline gap to the opening's edge, behind a frame that cannot be told from the wall."""
DEPTH_STEP, COLOUR_STEP = 0.003, 0.03
"""Least change of depth (metres) and colour (of 1) that is an edge, if it exceeds four times the columns' noise."""
SIGMAS = {"reveal": 0.003, "step": 0.006, "trim": 0.010, "lined": 0.010, "gap": 0.015}
"""How far from the truth, metres, an edge of each kind is."""
F64 = NDArray[np.float64]
Kind = Literal["reveal", "step", "trim", "lined", "gap"]


@dataclass(frozen=True, slots=True)
class Edge:
    """A side or head of an opening at ``place`` metres, with its sigma, and what showed it; ``deeper`` whether what is
    inside lies deeper than what is outside.
    """

    place: float
    sigma: float
    kind: Kind
    deeper: bool

    @property
    def is_trim(self) -> bool:
        """Whether a trim showed it."""
        return self.kind in ("trim", "lined")


@dataclass(frozen=True, slots=True, eq=False)
class _Profile:
    """Outwards from a side: distance ``t`` (n,) metres, ``values`` (n, 4) medians of red, green, blue and depth, nan
    where not seen, and ``means`` of the same, in which a hairline shows; ``noise`` (4,) of neighbours' means.
    """

    t: F64
    values: F64
    means: F64
    noise: F64


def edges_of(faces: Sequence[Face], box: Rectangle) -> list[Edge | None]:
    """The edges of the opening behind a rectangle, left, right and at the head, as far as the faces show them."""
    found = [_of_face(face, box) for face in faces]
    return [_best([edges[k] for edges in found]) for k in range(3)]


def moved(box: Rectangle, edges: Sequence[Edge | None]) -> Rectangle:
    """A rectangle with its sides and head moved to the edges that were found."""
    left, right, head = (edge.place if edge else 0.0 for edge in edges)
    return Rectangle(box.left - left, box.right + right, box.top + head)


def _of_face(face: Face, box: Rectangle) -> list[Edge | None]:
    """The edges left, right and at the head on one face. A lining that shows on one side is there on all, and where
    there is a trim, a step that goes not deeper is its outer edge or none of the door's.
    """
    profiles = (_upright(face, box, box.left, -1), _upright(face, box, box.right, 1), _level(face, box))
    wall = _wall(profiles)
    edges = [_edge(profile, wall) for profile in profiles]
    kinds = {e.kind for e in edges if e is not None}
    if "lined" in kinds:
        edges = [replace(e, place=e.place + LAP, kind="lined") if e and e.kind == "trim" else e for e in edges]
    if kinds & {"trim", "lined"}:
        edges = [e if e and e.deeper else None for e in edges]
    return edges


def _best(found: Sequence[Edge | None]) -> Edge | None:
    """The edge that is known best, by depth rather than by colour; of two of one kind their mean, or where they do not
    agree the one that is nearer to the rectangle's side.
    """
    seen = [e for e in found if e is not None]
    if not seen:
        return None
    edges = [e for e in seen if e.deeper] or seen
    sure = min(e.sigma for e in edges)
    best = sorted((e for e in edges if e.sigma == sure), key=lambda e: abs(e.place))
    if abs(best[-1].place - best[0].place) > AGREE:
        best = best[:1]
    return replace(best[0], place=float(np.mean([e.place for e in best])))


def _upright(face: Face, box: Rectangle, side: float, outward: int) -> _Profile:
    """Across a side: medians of columns between foot and head."""
    image = face.image
    rows = slice(round(FOOT / PIXEL), max(round((box.top - 0.15) / PIXEL), round(FOOT / PIXEL) + 1))
    t, cols = _places(side, outward, image.depth.shape[1])
    return _profile(t, image.rgb[rows, cols], image.depth[rows, cols], image.count[rows, cols] > 0)


def _level(face: Face, box: Rectangle) -> _Profile:
    """Across the head: medians of rows between the sides."""
    image = face.image
    width = image.depth.shape[1]
    cols = slice(min(max(round((box.left + 0.12) / PIXEL), 0), width), max(round((box.right - 0.12) / PIXEL), 0))
    t, rows = _places(box.top, 1, image.depth.shape[0])
    rgb, depth, known = image.rgb[rows, cols], image.depth[rows, cols], image.count[rows, cols] > 0
    return _profile(t, rgb.transpose(1, 0, 2), depth.T, known.T)


def _places(side: float, outward: int, size: int) -> tuple[F64, NDArray[np.int64]]:
    """Distances outwards from a side, ascending, and the pixels there."""
    steps = np.arange(-round(REACH / PIXEL), round(REACH / PIXEL) + 1)
    pixels = round(side / PIXEL) + outward * steps
    inside = (pixels >= 0) & (pixels < size)
    t = ((pixels.astype(np.float64) + 0.5) * PIXEL - side) * outward
    return t[inside], pixels[inside]


def _profile(t: F64, rgb: NDArray[np.float32], depth: NDArray[np.float32], measured: NDArray[np.bool_]) -> _Profile:
    """From pixels (k, n, ...) of n columns."""
    measured = measured & (depth < BEFORE)
    across = np.zeros(len(measured))
    if measured.size:
        across = cv2.blur(measured.mean(1)[None], (2 * BLOCK, 1), borderType=cv2.BORDER_REFLECT)[0]
    measured &= (across >= EVEN * across.max(initial=0.0))[:, None]
    out, means = _middles(rgb, depth, measured)
    steps = np.abs(np.diff(means, axis=0))
    noise = np.array([median(s[np.isfinite(s)]) if np.isfinite(s).any() else 0.0 for s in steps.T])
    return _Profile(t, out, means, noise)


@nb.njit(cache=True, nogil=True)
def _middles(rgb, depth, measured):  # pyright: ignore
    """Medians and means (n, 4) of red, green, blue and depth of n columns' measured pixels, nan of too few."""
    rows, cols = measured.shape
    middle, mean = np.full((cols, 4), np.nan), np.full((cols, 4), np.nan)
    values = np.empty((4, rows))
    for c in range(cols):
        used = 0
        for r in range(rows):
            if measured[r, c]:
                for k in range(3):
                    values[k, used] = rgb[r, c, k]
                values[3, used] = depth[r, c]
                used += 1
        if used >= TALL_ENOUGH:
            for k in range(4):
                total = 0.0
                for i in range(used):
                    total += values[k, i]
                mean[c, k] = total / used
                middle[c, k] = median(values[k, :used])
    return middle, mean


def _wall(profiles: Sequence[_Profile]) -> float:
    """Depth of the wall beside a rectangle, metres, from all its sides."""
    depths = np.concatenate([p.values[p.t > BESIDE, 3] for p in profiles])
    near = depths[np.abs(depths) < OFF]
    return float(np.median(near)) if len(near) >= 3 else 0.0


def _edge(profile: _Profile, wall: float) -> Edge | None:
    """The opening's edge as one face shows it, ``place`` outwards from the side; ``wall`` is the depth beside it."""
    known = np.isfinite(profile.values[:, 3])
    if known.sum() < LEAST_PLACES:
        return None
    seen = _Profile(profile.t[known], profile.values[known], profile.means[known], profile.noise)
    return _trim(seen, wall) or _outermost_step(seen, wall)


def _trim(profile: _Profile, wall: float) -> Edge | None:
    """The edge that a strip standing out from the wall laps over."""
    t, depth = profile.t, profile.values[:, 3]
    for first, last in _runs(depth - wall > STANDS_OUT):
        width = t[last] - t[first] + PIXEL
        ends = last < len(t) - 1 or t[last] < REACH - TRIM_WIDTH[0]  # before the wall goes on, or in its corner
        if not (TRIM_WIDTH[0] <= width <= TRIM_WIDTH[1]) or first < 2 or not ends:
            continue
        top = float(np.median(depth[first : last + 1]))
        inner = max(_crossing(t, depth, first - 1, (top + depth[first - 2]) / 2), float(t[first]) - PIXEL)
        if inner > FARTHEST:
            return None
        lined = _lining(profile, depth - wall, first, inner)
        kind: Kind = "lined" if lined else "trim"
        return Edge(inner + LAP * lined, SIGMAS[kind], kind, True)
    return None


def _lining(profile: _Profile, depth: F64, first: int, inner: float) -> bool:
    """Whether a strip of lining shows inside the trim that begins at ``first``, its inner edge at ``inner``, and then a
    gap or something deeper.
    """
    strip = 0
    while first - 2 - strip >= 0 and abs(depth[first - 2 - strip]) < STANDS_OUT:
        strip += 1
    if LINING[0] <= strip * PIXEL <= LINING[1]:
        return True
    if abs(depth[first - 2]) > FLUSH:
        return False
    gap = _hairline(profile, first - 2, first - 5)
    return gap is not None and inner - gap > LINING[0]


def _hairline(profile: _Profile, start: int, stop: int) -> float | None:
    """Where the first of the places from ``start`` down to ``stop`` is that is a gap: darker or deeper than both its
    neighbours.
    """
    means, least = profile.means, _least(profile)
    for i in range(start, max(stop, 1), -1):
        line = means[i] - np.maximum(means[i - 1], means[i + 1])
        lower = means[i] - np.minimum(means[i - 1], means[i + 1])
        if (line < -least).any() and (lower[:3] < 0).all():
            return float(profile.t[i])
    return None


def _least(profile: _Profile) -> F64:
    """Least change of colour and depth that is none of chance."""
    return np.maximum(np.array([COLOUR_STEP] * 3 + [DEPTH_STEP]), 4 * profile.noise)


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last place of each run of a mask."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edge[::2], edge[1::2], strict=True)]


def _crossing(t: F64, values: F64, at: int, level: float) -> float:
    """Where the values pass a level between ``at`` and the next place, or half way."""
    a, b = values[at], values[at + 1]
    share = (level - a) / (b - a) if abs(b - a) > 1e-9 else 0.5
    return float(t[at] + np.clip(share, 0.0, 1.0) * (t[at + 1] - t[at]))


def _outermost_step(profile: _Profile, wall: float) -> Edge | None:
    """The outermost place where depth or colour changes for good from the wall, else the outermost hairline."""
    t, values, least = profile.t, profile.values, _least(profile)
    a, b, c = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))  # of three
    for i in range(len(t) - 4, 3, -1):
        if not -INWARDS < t[i] < FARTHEST:
            continue
        outer, inner = middle[i + 1], middle[i - 3]
        change = np.abs(outer - inner) / least
        if change.max() > 1 and (abs(outer[3] - wall) < OFF or abs(t[i]) < NEAR):
            k = int(np.argmax(change))
            near = range(max(i - 3, 0), min(i + 3, len(t) - 1))
            at = max(near, key=lambda j: abs(values[j + 1, k] - values[j, k]))
            if t[at + 1] - t[at] > WIDEST_GAP:
                continue  # something hides where it is
            place = _crossing(t, values[:, k], at, (outer[k] + inner[k]) / 2)
            return Edge(place, SIGMAS["step"], "step", bool(outer[3] - inner[3] > DEPTH_STEP))
        if abs(t[i]) < NEAR and _hairline(profile, i, i - 1) is not None:
            return Edge(float(t[i]) + FRAME, SIGMAS["gap"], "gap", False)
    return None
