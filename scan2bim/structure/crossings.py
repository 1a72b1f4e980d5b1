"""How thick a wall is of which scans saw one face: rays that leave through its openings tell where its other face lies.

A ray that passes through a window aslant crosses the plane of its jamb some way behind the wall's face. In the wall it
ends there, on the reveal; beyond the outer face nothing stops it. So the depth at which rays begin to go on is the
wall's thickness, though nobody stood outside. Sills and heads tell less: boards and boxes stand out of the wall there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama
from scan2bim.structure.axes import Axis

PIXEL = 0.025
"""Pixels of a wall's face, metres."""
DEEP, BIN = 0.8, 0.005
"""Depth behind the face up to which crossings are counted, and their bins, metres."""
ON_FACE = 0.025
"""Distance, metres, within which a ray that ends near the face's plane ends on it."""
THROUGH = 0.04
"""Depth, metres, from which on a ray entered an opening or a recess."""
SHORT, LONG = 0.03, 0.05
"""Metres before and behind the crossing between which a ray ends on the reveal: less is a frame, more is outside."""
SLOPE = 0.15
"""Least share of a ray's way that leads into the wall."""
ASLANT = 0.1
"""Least metres along the wall for each metre into it with which a ray crosses a jamb."""
BEFORE = 0.3
"""Least distance, metres, of stations before the face."""
NARROWEST, FULL = 0.3, 0.7
"""Least width and height of an opening, metres, and share of the rectangle round it that it fills."""
LOWEST_SILL = 0.5
"""Height, metres, of the lowest sill: of what begins lower, things may hide the rest."""
BESIDE = 0.1
"""Metres beside a jamb within which the wall's face goes on along half of its height."""
NEAR_JAMB, ON_JAMB = 0.08, 0.01
"""Distance, metres, of a jamb from the edge in pixels, and of the ends of rays on it from its plane."""
SLANTED = 0.5
"""Share of the way from a cell's middle to its edge at which its nearest range was seen: that of its most slanting
pulse, of few pulses in each cell or many."""
COARSE = 0.025
"""Depth, metres, by which that, and where the jamb is, may blur a crossing."""
PLACED = 0.004
"""Standard deviation, metres, of where a jamb is."""
FRAME, CROWD = 0.03, 0.3
"""Distance, metres, between a jamb and a frame's side, and the share of rays on either that the other has at least."""
FEWEST = 15
"""Rays that must end on reveals, and that must go on, to know a thickness from both sides."""
NEAR_BOUND = 0.1
"""Metres before and behind the bounds of a thickness within which rays tell how many would have crossed between."""
MOST = 0.9
"""Share of the most jambs that agree, that still agree."""
CLOSEST = 0.03
"""Metres between these bounds from which on fewer make a jamb no surer: where it is, and what stands before it, tell no
more.
"""
SHARP = 0.15
"""Metres between the least and the greatest thickness that a jamb allows, up to which it tells one."""
SEVERAL, SEVERAL_OF = 2, 0.3
"""Jambs that tell a thickness at least, and as a share of those that tell the most frequent one."""
STRAY = 0.04
"""Share of rays that a pane mirrors or that meet something else: they contradict any thickness."""
MOST_WRONG = 0.2
"""Share of rays that may contradict every thickness: more do where the edges of what is solid are not openings'."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Crossings:
    """Rays (k,) by the depth, in bins of BIN metres, at which they cross a jamb: those that ``ended`` there, by the
    least depth that their cells allow, and those that ``passed``, by the greatest.
    """

    ended: F64
    passed: F64

    def bounds(self) -> tuple[float, float]:
        """Least and greatest thickness (metres; 0 and inf where nothing bounds it) that fewest rays contradict."""
        if self.ended.sum() + self.passed.sum() < FEWEST:
            return 0.0, np.inf
        wrong = np.append(0.0, np.cumsum(self.passed)) + np.append(np.cumsum(self.ended[::-1])[::-1], 0.0)
        if wrong.min() > MOST_WRONG * (self.ended.sum() + self.passed.sum()):
            return 0.0, np.inf
        slack = max(2.0, 3.0 * wrong.min() ** 0.5, STRAY * min(self.ended.sum(), self.passed.sum()))
        fit = np.flatnonzero(wrong <= wrong.min() + slack)
        best = int(np.argmin(wrong))
        first = max((k for k in range(best) if k not in fit), default=-1) + 1
        last = min((k for k in range(best, len(wrong)) if k not in fit), default=len(wrong)) - 1
        low = first * BIN if self.ended.sum() >= FEWEST else 0.0
        return low, last * BIN if self.passed[last:].sum() >= FEWEST else np.inf

    def likely(self) -> float:
        """Thickness (metres) between the bounds: nearer the one beside which rays cross the jamb at more depths, for
        on the other side they would have been missed less likely.
        """
        low, high = self.bounds()
        first, last, beside = round(low / BIN), round(high / BIN), round(NEAR_BOUND / BIN)
        ended = np.count_nonzero(self.ended[max(first - beside, 0) : first])
        passed = np.count_nonzero(self.passed[last : last + beside])
        return low + (high - low) * passed / max(ended + passed, 1)


def agreed(jambs: Sequence[Crossings]) -> tuple[float, float, float]:
    """Least, likely and greatest thickness (metres; 0 and inf where nothing bounds it) that nearly as many of some
    jambs allow as any; nothing is agreed where no more than half of them do.

    A frame hides the reveal behind it, and then rays tell its outer side for the wall's: so of thicknesses that several
    jambs tell each, the greatest counts, and those that tell less contradict it no more.
    """
    told = [jamb for jamb in jambs if jamb.bounds() != (0.0, np.inf)]
    allowed = np.array([jamb.bounds() for jamb in told]).reshape(-1, 2)
    ends = np.unique(allowed)
    if len(ends) < 2:
        return 0.0, np.inf, np.inf
    voters = (allowed[:, 0] <= ends[:-1, None]) & (allowed[:, 1] >= ends[1:, None])
    votes = voters.sum(1)
    sharp = (voters & (allowed[:, 0] > 0) & (allowed[:, 1] < allowed[:, 0] + SHARP)).sum(1)
    several = np.flatnonzero(sharp >= max(SEVERAL, SEVERAL_OF * sharp.max()))
    best, framed = int(np.argmax(votes)), 0
    if len(several):
        best = int(several[-1])
        while best > 0 and votes[best - 1] >= votes[best]:
            best -= 1
        framed = int((allowed[:, 1] <= ends[best]).sum())
    if 2 * (votes[best] + framed) <= len(allowed):
        return 0.0, np.inf, np.inf
    few = np.flatnonzero(votes < MOST * votes[best])
    low = float(ends[few[few < best].max(initial=-1) + 1])
    high = float(ends[few[few > best].min(initial=len(votes))])
    near = (allowed[:, 0] > 0) & np.isfinite(allowed[:, 1]) & (allowed[:, 0] < high) & (allowed[:, 1] > low)
    if not near.any():
        return low, low, high
    weights = 1 / np.maximum(np.diff(allowed[near]).ravel(), CLOSEST) ** 2
    likely = [jamb.likely() for jamb, here in zip(told, near, strict=True) if here]
    return low, float(np.average(likely, weights=weights)), high


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """Rays (n,) through a wall's face: where they pass it, metres ``along`` it and ``height`` above its base; metres
    along the wall and upwards for each metre into it (``slope``, ``rise``); the depth at which they ``end``; how far
    ``away`` before the face their station stands; by how much their slope may be another within half of their
    panorama's cell.
    """

    along: F64
    height: F64
    slope: F64
    rise: F64
    end: F64
    away: F64
    blur: F64


@dataclass(frozen=True, slots=True, eq=False)
class _Opening:
    """Metres along the wall and above its base, of an opening, and at which of its sides, left and right, the wall's
    face goes on.
    """

    sides: tuple[float, float]
    base: float
    top: float
    solid: tuple[bool, bool]


@dataclass(frozen=True, slots=True)
class SeenThrough:
    """Of a wall's openings the ``jambs`` that rays crossed, and whether any of them has a ``sill``, as windows have."""

    jambs: tuple[Crossings, ...]
    sill: bool


def seen_through(axis: Axis, base: float, top: float, panoramas: Sequence[Panorama]) -> SeenThrough:
    """Rays of stations before it through the openings of a straight wall of which one face was seen, between the
    heights ``base`` and ``top`` (z).
    """
    outward = -axis.normal if axis.left else axis.normal
    start = axis.start + axis.inset
    near = [p for p in panoramas if float((p.position[:2] - start) @ outward) < -BEFORE]
    shape = max(1, int(axis.length / PIXEL)), max(1, int((top - base) / PIXEL))
    on_face, through = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    sizes = np.array([axis.length, base, top])
    seen = [np.zeros((0, 7), np.float32)]
    for panorama in near:
        frame = np.append(panorama.cube(np.array([start, axis.direction, outward])), sizes)
        seen.append(_look(panorama.ranges, panorama.cube(panorama.position[None])[0], frame, on_face, through))
    rays = Rays(*np.concatenate(seen).T.astype(np.float64))
    openings = _openings(on_face, through)
    sides = [(opening, side) for opening in openings for side in (0, 1) if opening.solid[side]]
    found = [_at_jamb(rays, opening, side) for opening, side in sides]
    sill = any(all(opening.solid) and opening.base > LOWEST_SILL for opening in openings)
    return SeenThrough(tuple(jamb for jamb in found if jamb is not None), sill)


def _openings(on_face: F32, through: F32) -> list[_Opening]:
    """Rectangles of the face through which rays go."""
    crowd, solid = _crowd(through), _crowd(on_face)
    passed, on = crowd >= np.maximum(solid, 1.0), solid > crowd
    count, _, boxes, _ = cv2.connectedComponentsWithStats(passed.astype(np.uint8), connectivity=4)
    found: list[_Opening] = []
    beside = round(BESIDE / PIXEL)
    for low, left, high, wide, area in boxes[1:count].tolist():
        if min(high, wide) * PIXEL < NARROWEST or area < FULL * high * wide:
            continue
        rows = slice(low, low + high)
        at = on[max(left - beside, 0) : left, rows], on[left + wide : left + wide + beside, rows]
        goes_on = tuple(bool(len(part) == beside and part.any(0).mean() > 0.5) for part in at)
        sides = left * PIXEL, (left + wide) * PIXEL
        found.append(_Opening(sides, low * PIXEL, (low + high) * PIXEL, (goes_on[0], goes_on[1])))
    return found


def _at_jamb(rays: Rays, opening: _Opening, side: int) -> Crossings | None:
    """Rays by the depth at which they cross the plane of an opening's left (0) or right (1) jamb; None where none
    tells where that is.
    """
    sign, (left, right) = 2 * side - 1, opening.sides
    slope = rays.slope + sign * SLANTED * rays.blur
    along = rays.along + rays.away * (slope - rays.slope)
    end = (rays.end + rays.away) * np.sqrt((1 + rays.slope**2) / (1 + slope**2)) - rays.away
    toward = (sign * slope > ASLANT) & (along > left - PIXEL) & (along < right + PIXEL) & (end > THROUGH)
    jamb = _plane((along + slope * end)[toward & (end < DEEP)], opening.sides[side], sign)
    if jamb is None:
        return None
    depth = (jamb - along) / np.where(toward, slope, sign)
    blurred = (SLANTED * rays.blur * (depth + rays.away) + PLACED) / np.abs(slope)
    height = rays.height + rays.rise * depth
    toward &= (depth > 0) & (height > opening.base + PIXEL) & (height < opening.top - PIXEL) & (blurred < COARSE)
    toward &= (rays.height > opening.base) & (rays.height < opening.top)
    ended = toward & (np.abs(end - depth) < SHORT + blurred)
    passed = toward & (end > depth + LONG + blurred)
    return Crossings(_by_depth((depth - blurred)[ended]), _by_depth((depth + blurred)[passed]))


def _plane(ends: F64, edge: float, sign: int) -> float | None:
    """Where rays end on a jamb, of the ends (n,) along the wall of those towards it (``sign``), near an opening's
    ``edge``: of the planes on which many end the outermost, since frames stand within; None if few do.
    """
    near = np.sort(sign * ends[np.abs(ends - edge) < NEAR_JAMB])
    crowd = np.searchsorted(near, near + 2 * ON_JAMB) - np.arange(len(near))
    planes: list[float] = []
    most = int(crowd.max(initial=0))
    while crowd.max(initial=0) >= max(FEWEST, CROWD * most):
        first = int(np.argmax(crowd))
        planes.append(float(np.median(near[first : first + crowd[first]])))
        crowd[np.abs(near + ON_JAMB - planes[-1]) < FRAME] = 0
    return sign * max(planes) if planes else None


def _by_depth(depths: F64) -> F64:
    """Number of depths (n,) in each bin; the first has those before it."""
    bins = np.maximum(np.floor(depths / BIN), 0).astype(np.int64)
    return np.bincount(bins[bins < round(DEEP / BIN)], minlength=round(DEEP / BIN)).astype(np.float64)


def _crowd(rays: F32) -> F32:
    """Rays in the 3 x 3 pixels round each."""
    return cv2.boxFilter(rays, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).astype(np.float32)


@nb.njit(cache=True, nogil=True)
def _look(ranges, position, frame, on_face, through):  # pyright: ignore
    """Count, by pixels of the face, rays that end on it and rays that go on through its plane; the latter as rows of
    ``Rays``, (n, 7) float32.

    Of the cube's six faces the upper and the lower one look too steeply.
    """
    edge = ranges.shape[1]
    px, py = position[0] - frame[0], position[1] - frame[1]
    pa, pd, pz = px * frame[2] + py * frame[3], px * frame[4] + py * frame[5], position[2] - frame[7]
    rays = np.empty((1024, 7), np.float32)
    count = 0
    for face in range(4):
        for row in range(edge):
            u = (2 * row + 1) / edge - 1
            x, y = (1.0 - 2.0 * (face % 2), u) if face < 2 else (u, 1.0 - 2.0 * (face % 2))
            into, beside = x * frame[4] + y * frame[5], x * frame[2] + y * frame[3]
            if into <= 0.0:
                continue
            slope = beside / into
            along = pa - pd * slope
            i = int(np.floor(along / PIXEL))
            if not 0 <= i < on_face.shape[0]:
                continue
            for col in range(edge):
                reach = ranges[face, row, col]
                v = (2 * col + 1) / edge - 1
                length = np.sqrt(1 + u * u + v * v)
                end = pd + reach * into / length
                if reach <= 0.0 or into < SLOPE * length or end < -ON_FACE:
                    continue
                height = pz - pd * v / into
                j = int(np.floor(height / PIXEL))
                if not 0 <= j < on_face.shape[1]:
                    continue
                if end < ON_FACE:
                    on_face[i, j] += 1
                elif end > THROUGH:
                    through[i, j] += 1
                    if count == len(rays):
                        rays = np.concatenate((rays, np.empty_like(rays)))
                    blur = (1 + slope * slope) / ((1 + u * u) * edge)
                    rays[count] = (along, height, slope, v / into, end, -pd, blur)
                    count += 1
    return rays[:count]
