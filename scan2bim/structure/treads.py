"""Treads: level pieces of surface that one could stand on, each a riser above the last.

Furniture has two or three such heights, a stair many; it makes no difference whether it is straight or winds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.graphs import connected_parts


class Risers(NamedTuple):
    """Heights, metres, that a riser can have, with the noise of seeing it."""

    least: float
    most: float


USUAL = Risers(0.13, 0.23)
"""Risers of stairs that one walks."""
STEEP = Risers(0.23, 0.32)
"""Those of ladder-like stairs, to lofts and cellars."""
SAME_TREAD = 0.065
"""Metres, half of the least riser, by which the heights of pieces of one tread differ at most."""
FIRST_TREAD, LAST_TREAD = 1.5, 2.5
"""Risers from the floor to the first tread and from the last one to the floor above at most, of steep stairs: shelves
lead nowhere.
"""
LEVEL = 0.03
"""Difference of height, metres, between neighbouring pixels of one tread."""
NEAR = 2
"""Pixels: what lies level within 10 cm is the same tread."""
NEXT = 4
"""Pixels: the next tread begins within 20 cm; of a tread over one's eyes only the front is seen."""
SMALLEST_TREAD = 0.015
"""Area seen, square metres, of the smallest tread: the edge of one."""
LARGEST_TREAD = 3.0
"""Area, square metres, of the largest: a landing."""
EVEN, MOST_EVEN = 0.03, 0.7
"""Metres by which a tread may lie off an even climb, and the share of them that do not: things have any height."""
FEWEST_TREADS = 5
"""Treads that make a stair: sofas and cupboards have fewer heights."""
MOST_HIDDEN = 10
"""Upper treads of a straight flight that may have been hidden from below: it is drawn on to the floor above; and treads
of any stair between those seen below and above."""
FEWEST_SEEN = 3
"""Treads of a part of a stair, where those between it and another part were hidden."""
MOST_GOING = 0.35
"""Depth, metres, of the deepest tread where one was hidden."""
LEAST_RISE = 0.9
"""Rise, metres, from which steps are a stair."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


def _pairs(row: I64, col: I64, shape: tuple[int, ...], near: int) -> I64:
    """Numbers (p, 2) of pixels that lie within ``near`` pixels of each other, each pair once."""
    number = np.full((shape[0] + 2 * near, shape[1] + 2 * near), -1, np.int64)
    number[row + near, col + near] = np.arange(len(row))
    found: list[I64] = []
    for dr in range(near + 1):
        for dc in range(-near, near + 1):
            if dr > 0 or dc > 0:
                other = number[row + near + dr, col + near + dc]
                at = np.flatnonzero(other >= 0)
                found.append(np.stack([at, other[at]], 1))
    return np.concatenate(found)


@dataclass(frozen=True, slots=True, eq=False)
class Treads:
    """Pixels at ``xy`` (n, 2) and heights ``z`` (n,), each of a ``tread`` (n,), and pairs of treads ``steps`` (s, 2),
    the lower first, that are one of the ``risers`` apart.
    """

    xy: F64
    z: F64
    tread: I64
    steps: I64
    risers: Risers

    @property
    def count(self) -> I64:
        """Pixels of each tread (t,)."""
        return np.maximum(np.bincount(self.tread), 1)

    @property
    def height(self) -> F64:
        """Mean height (t,) of each."""
        return np.bincount(self.tread, weights=self.z) / self.count


def treads_of(pixel: I64, xy: F64, z: F64, shape: tuple[int, ...], risers: Risers) -> Treads:
    """Treads among ``pixel`` (n, 2) of a plan, rows and columns, that one could stand on."""
    row, col = pixel.T
    pairs = _pairs(row, col, shape, NEAR)
    rise = z[pairs[:, 1]] - z[pairs[:, 0]]
    tread = connected_parts(len(z), pairs[np.abs(rise) < LEVEL])
    size = np.bincount(tread)
    height = np.bincount(tread, weights=z) / np.maximum(size, 1)
    fits = (size * PLAN**2 > SMALLEST_TREAD) & (size * PLAN**2 < LARGEST_TREAD)
    steps = np.flatnonzero(fits[tread])
    couples = tread[steps[_pairs(row[steps], col[steps], shape, NEXT)]]
    step = np.abs(height[couples[:, 1]] - height[couples[:, 0]])
    couples = couples[(step > risers.least) & (step < risers.most)]
    count = max(len(size), 1)
    couples = np.stack(np.divmod(np.unique(couples.min(1) * count + couples.max(1)), count), 1)
    up = height[couples[:, 1]] > height[couples[:, 0]]
    return Treads(xy, z, tread, np.where(up[:, None], couples, couples[:, ::-1]), risers)


def chains_of(treads: Treads, floor: float) -> list[I64]:
    """Groups of tread numbers that follow each other, of enough different heights above the ``floor`` (z)."""
    if not len(treads.steps):
        return []
    height = treads.height - floor
    group = connected_parts(len(height), treads.steps)
    runs = [np.flatnonzero(group == number) for number in np.unique(group[treads.steps[:, 0]])]
    runs = _over_gaps([run for run in runs if _levels(height[run]) >= FEWEST_SEEN], treads, height)
    return [run for run in runs if _levels(height[run]) >= FEWEST_TREADS and np.ptp(height[run]) > LEAST_RISE]


def leads_up(chain: I64, treads: Treads, floor: float, above: float | None) -> bool:
    """Whether a chain climbs evenly from the ``floor`` to the one ``above`` (z)."""
    if above is None:
        return False
    height = treads.height[chain]
    riser = _riser(height)
    number = np.rint((height - height.min()) / riser)
    riser, first = (float(v) for v in np.polyfit(number, height, 1))
    even = float((np.abs(height - first - number * riser) < EVEN).mean())
    reaches = first - floor < FIRST_TREAD * riser and above - float(height.max()) < LAST_TREAD * riser
    return reaches and even > MOST_EVEN


def _levels(height: F64) -> int:
    """Number of different heights of treads."""
    return 1 + int((np.diff(np.sort(height)) > SAME_TREAD).sum())


def _over_gaps(runs: list[I64], treads: Treads, height: F64) -> list[I64]:
    """Runs of tread numbers, those joined of which one goes on above the other with hidden treads between."""
    runs = sorted(runs, key=lambda run: float(height[run].min()))
    order = np.argsort(treads.tread, kind="stable")
    ends = np.searchsorted(treads.tread[order], np.arange(len(height) + 1))

    def within(first: int, second: int, reach: float) -> bool:
        lower, upper = (treads.xy[order[ends[number] : ends[number + 1]]] for number in (first, second))
        apart = np.maximum(lower.min(0) - upper.max(0), upper.min(0) - lower.max(0))
        if max(apart) >= reach:
            return False
        return float(np.linalg.norm(lower[:, None] - upper[None], axis=2).min()) < reach

    for lower, run in enumerate(runs):
        stair = _from_floor(height[run], treads.risers)
        for upper in range(lower + 1, len(runs)) if stair else ():
            if _goes_on(run, stair or (0.0, 0.0), runs[upper], height, within):
                runs[lower], runs[upper] = run[:0], np.concatenate([run, runs[upper]])
                break
    return [run for run in runs if len(run)]


def _from_floor(height: F64, risers: Risers) -> tuple[float, float] | None:
    """Riser and height, metres, of the first of a run's treads if it starts at the floor: those that most pairs of
    treads tell, for something else may stand beside them.
    """
    number = np.rint((height - height.min()) / _riser(height))
    apart = number[:, None] - number
    riser = float(np.median((height[:, None] - height)[apart > 0] / apart[apart > 0]))
    first = float(np.median(height - number * riser))
    even = float((np.abs(height - first - number * riser) < EVEN).mean())
    rises = risers.least < riser < risers.most and even > MOST_EVEN
    return (riser, first) if rises and first <= FIRST_TREAD * riser else None


def _goes_on(
    lower: I64, stair: tuple[float, float], upper: I64, height: F64, within: Callable[[int, int, float], bool]
) -> bool:
    """Whether an ``upper`` run of treads continues a ``lower`` one, of a ``stair``'s riser and first height: whole
    numbers of risers higher, no farther off than the treads between reach.
    """
    riser, first = stair
    number, over = (np.rint((height[run] - first) / riser) for run in (lower, upper))
    off = [np.median(np.abs(height[run] - first - n * riser)) for run, n in ((lower, number), (upper, over))]
    if max(off) >= LEVEL:
        return False
    between = over[None] - number[:, None]
    follows = (between > 0) & (over > number.max()) & (between < MOST_HIDDEN)
    return any(within(int(lower[a]), int(upper[b]), float(between[a, b]) * MOST_GOING) for a, b in np.argwhere(follows))


def _riser(height: F64) -> float:
    """Median step, metres, between different heights of treads."""
    steps = np.diff(np.sort(height))
    return float(np.median(steps[steps > SAME_TREAD]))
