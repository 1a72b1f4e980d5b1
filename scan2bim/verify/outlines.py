"""Where the scans show the sides of openings: points on the faces of a wall and inside its body, along the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE
from scan2bim.geometry.windows import windows
from scan2bim.verify.compare import Owned
from scan2bim.verify.patches import Gap

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]
U32 = NDArray[np.uint32]

BIN = 0.004
"""Width of a bin along the wall, metres: its middle is to be told to 3 mm from two sides."""
DEEP = 0.004
"""Depth of a bin across the wall, metres."""
BESIDE = 0.6
"""Metres beside a drawn opening within which its sides are looked for: more is another opening."""
AROUND = 0.2
"""Metres before the wall's drawn faces within which its built ones are looked for."""
MIDDLE = (0.15, 0.90)
"""Shares of an opening's height between which points tell its sides: below are thresholds and what stands on the floor,
above a head that was built lower."""
ON = 0.012
"""Half-width of a wall's face, metres: four times the noise of single points."""
ABSENT = 0.2
"""What a bin without wall speaks for an opening, of what one of wall speaks against it: furniture may hide it."""
INSIDE = 0.03
"""Share of the points inside the wall that may lie outside of where an opening begins: mixed pixels at its edges."""
LEAST = 20
"""Points inside the wall that a side is told by."""
PIER = 0.12
"""Metres of wall at which an opening ends even if another lies behind it: an open leaf crosses a face over less."""
BREAK = 0.05
"""Metres without wall at which a wall ends."""
DENSE = 0.4
"""Of the median density of points on a face near an opening, from which on a bin shows wall. Inside a drawn opening
each face that was seen must show it, for an open leaf crosses one; beside it one will do, for furniture hides some."""
SMOOTH = 3
"""Bins that the density is smoothed over."""
FEW = 2
"""Points inside the wall of a bin that speaks for an opening."""
LINING = 0.08
"""Metres by which a detected opening may be wider than the built one on a side, and twice as much where no
reveal was seen: the frame of another opening may be next to it."""
EDGE = 7
"""Bins over which points inside the wall and on its faces are compared: wider than a reveal with its noise."""
STRIP = 0.15
"""Metres beside a side in which these are counted."""
REVEAL = 0.05
"""Metres across the wall that points in one bin reach over on a reveal: frames and leaves are thinner."""
FLUSH = 0.012
"""Metres inwards of where a wall begins up to which a reveal is its own: farther in it is that of a frame."""
LINED = 0.06
"""Metres outwards of it, or around where a side was detected, in which a reveal is looked for: linings may be flush
with the wall."""
NARROWEST = 0.3
"""Width, metres, of the narrowest opening: what is left between wall that seems to go on from both sides is a gap in a
leaf flush with it.
"""
PEAK = 6
"""Bins in which the first crowd of points inside a wall is looked for where they begin."""


@dataclass(frozen=True, slots=True)
class Side:
    """Where a side of an opening lies, metres inwards of the drawn one: between the last of the wall and the first of
    what is inside the wall; trims keep them apart. built: over how many metres from the drawn side inwards wall goes
    on. hollow: whether points were seen inside the wall outwards of the drawn side. detected: whether a detected
    opening alone tells it.
    """

    wall: float
    inside: float
    built: float
    hollow: bool
    reveal: float | None = None
    detected: bool = False

    @property
    def place(self) -> float:
        """Where the side lies: its reveal tells best."""
        return self.wall if self.reveal is None else self.reveal


@dataclass(frozen=True, slots=True)
class Outline:
    """Both sides of an opening as built, start and end along the wall, and how much speaks for it, in bins."""

    start: Side
    end: Side
    weight: float


class Profiles:
    """Counts the points near each gap by their places along and across its wall; a sink of ``compare_points``."""

    def __init__(self, gaps: Sequence[Gap]) -> None:
        self.gaps = tuple(gaps)
        half = np.ceil(np.array([g.width / 2 + BESIDE for g in gaps]) / BIN) * BIN
        self._half = half
        low, high = np.array([g.low - AROUND for g in gaps]), np.array([g.high + AROUND for g in gaps])
        self._shape = np.rint(np.column_stack([2 * half / BIN, np.ceil((high - low) / DEEP)])).astype(np.int64)
        self._start = np.concatenate([[0], np.cumsum(self._shape.prod(axis=1))]).astype(np.int64)
        self._counts = np.zeros(int(self._start[-1]), np.uint32)
        rows = [
            (*g.middle, *g.along, h, a, g.height * (MIDDLE[0] - 0.5), g.height * (MIDDLE[1] - 0.5))
            for g, h, a in zip(gaps, half, low, strict=True)
        ]
        self._places = np.array(rows, np.float64).reshape(-1, 9)
        reach = np.column_stack([half + np.maximum(np.abs(low), np.abs(high))] * 2)
        plan = np.array([g.middle[:2] for g in gaps], np.float64).reshape(-1, 2)
        self._box = np.concatenate([plan - reach, plan + reach], axis=1)

    def __call__(self, owned: Owned) -> None:
        """Take a run's points."""
        low = owned.corner[:2]
        near = (self._box[:, :2] < low + TILE).all(axis=1) & (self._box[:, 2:] > low).all(axis=1)
        rows = np.flatnonzero(near)
        if len(rows):
            raw = owned.records.view(np.uint8).reshape(-1, POINT.itemsize)
            _count(
                raw, owned.owner, owned.corner, self._places[rows], self._shape[rows], self._start[rows], self._counts
            )

    def half(self, number: int) -> float:
        """Metres along the wall on each side of a gap's middle that are counted, whole bins."""
        return float(self._half[number])

    def image(self, number: int) -> U32:
        """(n, m) counts of a gap's points along and across its wall."""
        first, last = self._start[number], self._start[number + 1]
        return self._counts[first:last].reshape(tuple(self._shape[number]))


@nb.njit(cache=True, nogil=True)
def _count(raw, owner, corner, places, shape, start, counts):  # pyright: ignore
    """Add a run's points (n, 12) uint8 to the images of the gaps ``places`` (g, 9)."""
    step = TILE / STEPS
    for i in range(raw.shape[0]):
        if owner[i] == -3:
            continue
        x = ((np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8) + 0.5) * step + corner[0]
        y = ((np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8) + 0.5) * step + corner[1]
        z = ((np.int64(raw[i, 4]) | np.int64(raw[i, 5]) << 8) + 0.5) * step + corner[2]
        for g in range(places.shape[0]):
            up = z - places[g, 2]
            if up < places[g, 7] or up > places[g, 8]:
                continue
            dx = x - places[g, 0]
            dy = y - places[g, 1]
            a = int(np.floor((dx * places[g, 3] + dy * places[g, 4] + places[g, 5]) / BIN))
            b = int(np.floor((dy * places[g, 3] - dx * places[g, 4] - places[g, 6]) / DEEP))
            if a >= 0 and b >= 0 and a < shape[g, 0] and b < shape[g, 1]:
                counts[start[g] + a * shape[g, 1] + b] += 1


def find_outline(
    profiles: Profiles,
    number: int,
    faces: tuple[F64, F64],
    seeds: Sequence[float],
    detected: tuple[float, float] | None,
) -> Outline | None:
    """The opening round one of the ``seeds`` (metres along the wall from the drawn middle) that most speaks for, None
    where the scans do not show its sides. faces: offset and slope (2,) along the wall of the lower and the upper face
    as built, metres across it from the drawn middle. detected: metres by which the sides of a detected opening lie
    inwards of the drawn start and end: they stand for a side beside which no wall was seen, if the other was.
    """
    gap, half = profiles.gaps[number], profiles.half(number)
    on, inside, depth = _counts(profiles, number, faces)
    seen = (on > 0).sum(axis=1) * BIN >= STRIP
    if not seen.any():
        return None
    dense = np.array([DENSE * np.median(face[face > 0]) for face in on[seen]])
    smooth = windows(on[seen].astype(np.float64), SMOOTH).mean(axis=-1)
    walls = smooth >= dense[:, None]
    # A frame or a closed leaf may go on flush with a face, but then there is more inside the wall, which is solid.
    hollow = _hollow(on[seen].sum(axis=0), inside)
    solid, wall = walls.all(axis=0) & ~hollow, walls.any(axis=0) & ~hollow
    bins = Bins(wall, solid, inside, depth)
    sides = [_sides(bins, round((seed + half) / BIN), gap.width) for seed in seeds]
    found = [Outline(start, end, weight) for start, end, weight in sides if start and end]
    if not found and detected is not None:
        told = (_told(bins.reversed(), gap.width, detected[0]), _told(bins, gap.width, detected[1]))
        found = [Outline(start or told[0], end or told[1], weight) for start, end, weight in sides if start or end]
    found = [outline for outline in found if outline.start.place + outline.end.place < gap.width - NARROWEST]
    return max(found, key=lambda o: o.weight, default=None)


def _hollow(on: F64, inside: F64) -> Mask:
    """Bins (n,) of stretches with more points inside the wall than on its faces, longer than a reveal alone makes."""
    least = np.maximum(windows(on, EDGE).sum(axis=-1), FEW)
    more = np.asarray(windows(inside, EDGE).sum(axis=-1) >= least)
    kept = np.asarray(windows(more, 2 * EDGE - 1).all(axis=-1))
    return np.asarray(windows(kept, EDGE).any(axis=-1))


def _told(bins: Bins, width: float, inwards: float) -> Side:
    """A side as a detected opening tells it, which takes a lining for a part of the opening, or leaves a frame out; the
    reveal near it tells better.
    """
    drawn = len(bins.wall) / 2 + width / 2 / BIN
    about, reach = round(drawn - inwards / BIN), round(LINED / BIN)
    seen = _reveal(bins, about - reach, about + reach)
    place = inwards if seen is None else (drawn - seen) * BIN
    hollow = inwards < -(2 * LINING if seen is None else LINING)
    return Side(place, place, place, hollow, None if seen is None else place, detected=seen is None)


def find_extent(profiles: Profiles, number: int, faces: tuple[F64, F64]) -> tuple[float, float] | None:
    """How far from the drawn sides inwards, metres, points inside the wall begin and end along it, without a break;
    None where there are few. ``faces`` as in ``find_outline``.
    """
    _, inside, _ = _counts(profiles, number, faces)
    full = np.flatnonzero(inside > 0)
    middle = int(np.searchsorted(full, len(inside) // 2))
    if not 0 < middle < len(full):
        return None
    gaps = np.flatnonzero(np.diff(full) > BREAK / BIN)
    left, right = gaps[gaps < middle - 1], gaps[gaps >= middle]
    own = full[(int(left[-1]) + 1 if len(left) else 0) : (int(right[0]) + 1 if len(right) else len(full))]
    mass = np.cumsum(inside[own])
    if mass[-1] < 2 * LEAST:
        return None
    first, last = own[np.searchsorted(mass, np.array([INSIDE, 1 - INSIDE]) * mass[-1])].tolist()
    low, high = _crowd(inside, first, first + PEAK), _crowd(inside, max(last + 1 - PEAK, 0), last + 1)
    width, half_bins = profiles.gaps[number].width, len(inside) / 2
    return (low - half_bins) * BIN + width / 2, width / 2 - (high - half_bins) * BIN


def _counts(profiles: Profiles, number: int, faces: tuple[F64, F64]) -> tuple[F64, F64, F64]:
    """Points on both faces (2, n) and inside the wall (n,) in bins along it, and over how many metres across the wall
    those inside it reach, there and in the bins beside it (n,).
    """
    gap, image = profiles.gaps[number], profiles.image(number)
    along = (np.arange(image.shape[0]) + 0.5) * BIN - profiles.half(number)
    across = (np.arange(image.shape[1]) + 0.5) * DEEP + gap.low - AROUND
    low, high = (face[0] + face[1] * along for face in faces)
    on = np.array([(image * (np.abs(across - place[:, None]) < ON)).sum(axis=1) for place in (low, high)])
    within = (across > (low + ON)[:, None]) & (across < (high - ON)[:, None])
    filled = windows((image > 0) & within, 3, axis=0).any(axis=-1)
    return on.astype(np.float64), (image * within).sum(axis=1).astype(np.float64), filled.sum(axis=1) * DEEP


@dataclass(frozen=True, slots=True, eq=False)
class Bins:
    """Bins along a wall: wall (n,) on a face that was seen, solid (n,) on all of them, inside (n,) points inside it,
    depth (n,) metres that these reach over across it.
    """

    wall: Mask
    solid: Mask
    inside: F64
    depth: F64

    def reversed(self) -> Bins:
        """From the other end."""
        return Bins(self.wall[::-1], self.solid[::-1], self.inside[::-1], self.depth[::-1])


def _sides(bins: Bins, seed: int, width: float) -> tuple[Side | None, Side | None, float]:
    """Start and end, None where no wall was seen, of the stretch of bins round a seed that most speaks for, and how
    much.
    """
    if not 0 < seed < len(bins.wall) or bins.wall[seed]:
        return None, None, 0.0
    speaks = np.where(bins.wall, -1.0, np.where(bins.inside >= FEW, 1.0, ABSENT))
    (to_left, left), (to_right, right) = (_most(np.cumsum(part)) for part in (speaks[:seed][::-1], speaks[seed:]))
    start = _side(bins.reversed(), len(bins.wall) - seed + to_left, width)
    end = _side(bins, seed + to_right, width)
    return start, end, left + right


def _most(sums: F64) -> tuple[int, float]:
    """How many bins from the seed on add up to most, before a pier takes off as much, and their sum."""
    ended = np.flatnonzero(np.maximum.accumulate(sums) - sums > PIER / BIN)
    sums = sums[: int(ended[0])] if len(ended) else sums
    best = int(np.argmax(sums))
    return best + 1, float(sums[best])


def _side(bins: Bins, place: int, width: float) -> Side | None:
    """The side at the end of an opening: ``place`` is the first bin of the wall behind it. None without such wall."""
    strip, inside = round(STRIP / BIN), bins.inside
    if bins.wall[place : place + strip].sum() < strip // 2:
        return None
    drawn = len(inside) / 2 + width / 2 / BIN
    reveal = place + round(ON / BIN)  # near the faces a reveal's points lie on them, too
    mass = np.cumsum(inside[max(place - strip, 0) : reveal][::-1])
    begin = int(np.searchsorted(mass, INSIDE * mass[-1])) if len(mass) and mass[-1] >= LEAST else reveal - place
    built = _unbroken(bins.solid[: round(drawn)][::-1]) * BIN
    built = built if built < width - NARROWEST else 0.0  # a leaf flush with the wall on both faces tells no side
    hollow = float(inside[round(drawn + ON / BIN) : reveal].sum()) >= LEAST
    seen = _reveal(bins, place - round(FLUSH / BIN), place + round(LINED / BIN))
    told = None if seen is None else (drawn - seen) * BIN
    return Side((drawn - place) * BIN, (drawn - reveal + begin) * BIN, built, hollow, told)


def _reveal(bins: Bins, first: int, last: int) -> float | None:
    """Where the outermost reveal in some bins lies, in bins, None where none was seen."""
    first = max(first, 0)
    deep = np.flatnonzero(bins.depth[first:last] >= REVEAL)
    return None if not len(deep) else _crowd(bins.inside, max(first + int(deep[-1]) - 3, 0), first + int(deep[-1]) + 1)


def _crowd(inside: F64, first: int, last: int) -> float:
    """Where, in bins, the most points (n,) of some bins crowd."""
    peak = first + int(np.argmax(inside[first:last]))
    near = np.arange(max(peak - 1, 0), min(peak + 2, len(inside)))
    return float((near + 0.5) @ inside[near] / inside[near].sum())


def _unbroken(wall: Mask) -> int:
    """Bins over which wall goes on from the first; a break ends it."""
    bins = np.flatnonzero(wall)
    gaps = np.diff(bins, prepend=-1, append=len(wall) + round(BREAK / BIN) + 1)
    broken = int(np.argmax(gaps > BREAK / BIN))
    return int(bins[broken - 1]) + 1 if broken else 0
