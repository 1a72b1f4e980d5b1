"""Storeys from horizontal surfaces: where something flat lies with room to stand above it.

Weighted by area, not by points, so that a storey seen through a stair only counts by its floor and a scanner's own
surroundings do not drown the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN, Surfels

BIN = 0.01
"""Height bins of the level histogram, metres: finer than the elevation accuracy asked for (3 cm)."""
STEP_UP = 1.6
"""Floors nearer to each other than this (metres) are steps, podiums or furniture of one storey: nobody stands between
them.
"""
HEADROOM = 1.5
"""Clear height above a floor, metres: less is furniture or a void."""
SPLIT = 0.03
"""Metres up to which two surfels one above the other are one level surface: its noise."""
TALLEST = 9.0
"""Clear height, metres, above which a ceiling is not that of the floor below (then it is open air or another building).
"""
SMALLEST = 3.0
"""Floor area, square metres, below which a level is a landing or a large table, not a storey."""

EYE = 0.8, 2.4
"""Height of a scanner over the floor that its tripod stands on, metres: least and greatest."""
UNSEEN_SLAB = 0.2
"""Thickness assumed, metres, of a slab of which the underside alone was seen: 10 to 35 cm are usual."""
FEWEST_EYES = 2
"""Stations that must stand over a ceiling for a storey whose floor was not seen."""

OTHER_HEIGHT, OTHER_AREA = 1.2, 0.3
"""Metres over a storey's floor, and share of the largest floor's area, from which a level surface that is no storey's
floor is told: lower ones are podiums, smaller ones landings and furniture.
"""

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class StoreyLevels:
    """Heights of one storey, local metres: its main ``floor`` (with sigma; None where it was not seen but told from the
    ceiling below and the stations that stand over it) and ``ceiling`` (None if unseen), and ``top``, below which its
    walls end: the next storey's floor, or as high as was scanned. ``area`` square metres of floor seen.
    """

    floor: float
    sigma: float | None
    ceiling: float | None
    top: float
    area: float


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """Surfels sorted into plan columns of 5 cm, bottom up. ``order`` sorts surfels; ``above`` and ``below`` (n,) are
    the free heights to the next surfel in the column, in that order, inf where there is none; ``side`` (n,) int8 is 1
    where the station stood above the surfel, -1 where below, 0 where that is unknown.
    """

    order: I64
    above: F64
    below: F64
    side: NDArray[np.int8]

    def between(self, surfels: Surfels, low: float, high: float) -> Layers:
        """Those of surfels whose height is in between; free heights stay those among all."""
        z = surfels.xyz[self.order, 2]
        return self.pick(np.flatnonzero((z > low) & (z < high)))

    def pick(self, at: I64) -> Layers:
        """Those at places in the order; free heights stay those among all."""
        return Layers(self.order[at], self.above[at], self.below[at], self.side[at])


def layers_of(surfels: Surfels, stations: F64 | None = None) -> Layers:
    """Sort surfels into plan columns and measure the free height above and below each. ``stations`` (s, 3) positions,
    nan where unknown.
    """
    if len(surfels) == 0:
        return Layers(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0, np.int8))
    z = surfels.xyz[:, 2]
    column = _plan_columns(surfels)
    order = np.argsort(column << 32 | _rank(z), kind="stable")
    gap = np.diff(z[order].astype(np.float64))
    gap[np.diff(column[order]) != 0] = np.inf
    side = np.zeros(len(z), np.int8)
    if stations is not None:
        station = surfels.station[order]
        known = station < len(stations)
        side[known] = np.nan_to_num(np.sign(stations[station[known], 2] - z[order][known]))
    return Layers(order, np.append(gap, np.inf), np.insert(gap, 0, np.inf), side)


def _plan_columns(surfels: Surfels) -> I64:
    """Number of each surfel's plan column (n,), below 2^31, rising along x and then y."""
    x, y = (np.floor(surfels.xyz[:, k].astype(np.float64) / PLAN).astype(np.int64) for k in range(2))
    x -= x.min()
    y -= y.min()
    across = int(y.max()) + 1
    if across * (int(x.max()) + 1) < 1 << 31:
        return x * across + y
    return np.unique(np.stack([x, y], 1), axis=0, return_inverse=True)[1].ravel().astype(np.int64)


def _rank(values: NDArray[np.float32]) -> I64:
    """Whole numbers from 0 to 2^32 in the order of the values."""
    bits = values.view(np.int32).astype(np.int64)
    return np.where(bits < 0, -(bits & 0x7FFFFFFF), bits) + (1 << 31)


def find_storeys(surfels: Surfels, layers: Layers, stations: F64) -> tuple[StoreyLevels, ...]:
    """Storeys from the lowest to the highest; empty if no floor was seen. ``stations`` (s, 3) positions, nan where
    unknown.
    """
    z = surfels.xyz[layers.order, 2].astype(np.float64)
    open_above, hanging = standing_and_hanging(layers)
    roofed = open_above & (layers.above < TALLEST)
    standing = roofed if _area(roofed) > 0.2 * _area(open_above) else open_above
    highest = float(np.percentile(z, 99.9))
    floors = [(floor, area) for floor, area in _peaks(z[standing]) if highest - floor > HEADROOM]
    storeys = _storeys(z, standing, hanging, floors)
    unseen = [(floor, 0.0) for floor in _unseen_floors(storeys, stations)]
    return _storeys(z, standing, hanging, [*floors, *unseen]) if unseen else storeys


def _storeys(
    z: F64, standing: NDArray[np.bool_], hanging: NDArray[np.bool_], floors: Sequence[tuple[float, float]]
) -> tuple[StoreyLevels, ...]:
    return tuple(
        _levels(z, standing, hanging, floor, area, [f for f, _ in floors if f > floor])
        for floor, area in sorted(floors)
    )


def _unseen_floors(storeys: Sequence[StoreyLevels], stations: F64) -> list[float]:
    """Heights of floors that no scan shows, as under insulation or goods: where stations stand over a ceiling, with no
    floor between.
    """
    eyes = stations[np.isfinite(stations[:, 2]), 2]
    out: list[float] = []
    for number, storey in enumerate(storeys):
        above = storeys[number + 1].floor if number + 1 < len(storeys) else np.inf
        if storey.ceiling is None:
            continue
        floor = storey.ceiling + UNSEEN_SLAB
        standing = (eyes > floor + EYE[0]) & (eyes < floor + EYE[1])
        if floor + STEP_UP < above and np.count_nonzero(standing) >= FEWEST_EYES:
            out.append(floor)
    return out


def other_floors(surfels: Surfels, layers: Layers, storeys: Sequence[StoreyLevels]) -> list[tuple[float, float]]:
    """(height, area) of large level surfaces to stand on that are no storey's floor, being nearer than STEP_UP to one:
    floors of the other half of a house of half storeys.
    """
    z = surfels.xyz[layers.order, 2].astype(np.float64)[standing_and_hanging(layers)[0]]
    floors = np.array([storey.floor for storey in storeys])
    over = z[:, None] - floors
    apart = ~((over > -OTHER_HEIGHT / 2) & (over < OTHER_HEIGHT)).any(1) & (z > floors[0] - STEP_UP)
    least = OTHER_AREA * max(storey.area for storey in storeys)
    return sorted((height, area) for height, area in _peaks(z[apart]) if area > max(SMALLEST, least))


def standing_and_hanging(layers: Layers) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which surfels (in layer order) can be stood on and which hang overhead.

    A ceiling was seen from below, a floor from above. Where stations are not known, what has clear height both above it
    and below it, with something under that, hangs: of a floor between two storeys that were both scanned, the underside
    would have been seen close below. A surface on the border of two voxels comes as two surfels, of which the upper one
    hangs over what the lower one hangs over.
    """
    below = np.where(layers.below < SPLIT, np.roll(layers.below, 1), layers.below)
    hanging = (below > HEADROOM) & np.isfinite(below) & (layers.side <= 0)
    return (layers.above > HEADROOM) & ~(hanging & (below < TALLEST)) & (layers.side >= 0), hanging


def _area(mask: NDArray[np.bool_]) -> float:
    return float(mask.sum()) * PLAN * PLAN


def _peaks(z: F64) -> list[tuple[float, float]]:
    """(height, area) of floor levels: the largest first, then those far enough from all before."""
    if len(z) == 0:
        return []
    low = z.min() - 0.1
    counts = np.bincount(((z - low) / BIN).astype(np.int64), minlength=8).astype(np.float64)
    area = np.convolve(counts, np.ones(7), mode="same") * PLAN * PLAN
    found: list[tuple[float, float]] = []
    largest = float(area.max())
    while True:
        best = int(np.argmax(area))
        if area[best] < max(SMALLEST, 0.06 * largest) and found:
            return found
        height = low + (best + 0.5) * BIN
        found.append((_refine(z, height), float(area[best])))
        near = int(STEP_UP / BIN)
        area[max(0, best - near) : best + near + 1] = 0.0
        if area.max() <= 0:
            return found


def _refine(z: F64, height: float) -> float:
    near = z[np.abs(z - height) < 0.04]
    return float(np.median(near)) if len(near) else height


def _levels(
    z: F64, standing: NDArray[np.bool_], hanging: NDArray[np.bool_], floor: float, area: float, higher: list[float]
) -> StoreyLevels:
    on_floor = z[standing & (np.abs(z - floor) < 0.04)]
    limit = min(higher, default=np.inf)
    under = z[hanging & (z > floor + HEADROOM) & (z < min(limit, floor + TALLEST))]
    ceiling = None
    if len(under) * PLAN * PLAN > max(1.0, 0.05 * area):
        counts = np.bincount(((under - floor) / 0.02).astype(np.int64))
        smooth = np.convolve(counts, np.ones(3), mode="same")
        ceiling = _refine(under, floor + (int(np.argmax(smooth)) + 0.5) * 0.02)
    top = limit if np.isfinite(limit) else float(np.percentile(under, 99.5)) + 0.1 if len(under) else float(z.max())
    sigma = max(0.001, float(1.4826 * np.median(np.abs(on_floor - np.median(on_floor))))) if area > 0 else None
    return StoreyLevels(floor, sigma, ceiling, top, area)
