"""Open plans: spaces that run into each other are told apart where the floor changes along a straight line.

Kitchens, halls and living rooms without a wall between them mostly differ in what was laid: it lies a few millimetres
higher, or has another tint. Where all of the floor on one side of a line differs so from all of it on the other, and
it changes at that line, a virtual border lies there. A rug differs from what lies round it, but not up to the walls;
light and exposure change brightness, and change slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon

from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.structure.columns import Grid
from scan2bim.structure.portals import parts_of
from scan2bim.structure.storeys import Layers

BAND = 0.05
"""Metres above and below the storey's level within which what lies is its floor: thresholds, uneven floors."""
CLEAR = 0.3
"""Metres above the floor in which nothing lies: else it is the lower edge of something that stands there."""
RAISED = 0.004
"""Metres by which one floor lies higher than the other at least: four times a scanner's noise once averaged."""
TINTED = 0.35
"""Least difference of tint (natural logarithm of a ratio of two colours): lamps, white balance, and woods among each
other differ by less.
"""
DARK = 25
"""Colour values below which a tint is noise."""
EVEN = 0.25
"""Largest spread (standard deviation) of each floor, of the difference between both."""
SMALLEST_PART = 6.0
"""Square metres of the smallest part: less are wet zones of bathrooms, entrances and mats, no rooms of their own."""
NARROWEST = 1.3
"""Width, metres, of the narrowest part: less are skirtings, hearths and strips before windows."""
PURE = 0.85
"""Share of the floor seen on each side that must be of its own kind."""
LEAST_SEEN = 1.0
"""Square metres of floor that must have been seen on each side."""
SHARP = 3
"""Pixels within which the floor changes across a border."""
SIDE = 5
"""Pixels: 25 cm on each side of a border over which the floor's mean is taken."""
LEAST_SHARP = 0.6
"""Metres of a border on which the change itself must have been seen: counters and tables hide the rest."""
HIGHEST = 5
"""Lines tried in each direction: those along which most change was seen."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Flooring:
    """What the floor of a storey is like: ``features`` (3, rows, columns) float32 on ``grid``, nan where it was not
    seen: its height, metres, and two tints, red against blue and green against both.
    """

    grid: Grid
    features: F32


def flooring_of(grid: Grid, surfels: Surfels, layers: Layers) -> Flooring:
    """The floor's height and tints from the surfels of a storey's ``layers``, means over 15 cm."""
    z = surfels.xyz[layers.order, 2].astype(np.float64)
    on = np.flatnonzero((np.abs(z - grid.floor) < BAND) & (layers.above > CLEAR))
    pixel = grid.pixel_of(surfels.xyz[layers.order[on], :2].astype(np.float64))
    inside = grid.contains(pixel)
    on, pixel = on[inside], pixel[inside]
    rgb = np.maximum(surfels.rgb[layers.order[on]].astype(np.float32), 1.0)
    red, green, blue = np.log(rgb).T
    tints = np.where((rgb.max(1) > DARK)[:, None], np.stack([red - blue, green - (red + blue) / 2], 1), np.nan)
    found = np.full((3, *grid.roof.shape), np.nan, np.float32)
    found[0, pixel[:, 1], pixel[:, 0]] = z[on]
    found[1:, pixel[:, 1], pixel[:, 0]] = tints.T
    return Flooring(grid, np.stack([_mean(found[k]) for k in range(3)]))


def _mean(raster: F32) -> F32:
    """Mean of what is known round each known pixel, 15 cm square."""
    known = np.isfinite(raster)
    total = cv2.boxFilter(np.where(known, raster, np.float32(0)), -1, (3, 3), normalize=False)
    count = cv2.boxFilter(known.astype(np.float32), -1, (3, 3), normalize=False)
    return np.where(known, total / np.maximum(count, 1), np.float32(np.nan))


def split_at_floors(polygon: Polygon, flooring: Flooring) -> tuple[list[Polygon], list[LineString]]:
    """Parts of a space with floors of their own, and the cuts between them."""
    if polygon.area < 2 * SMALLEST_PART:
        return [polygon], []
    xy, features = _floor_in(polygon, flooring)
    for feature, least in zip(features, (RAISED, TINTED, TINTED), strict=True):
        known = np.isfinite(feature)
        kind = _two_kinds(feature[known], least)
        if kind is None:
            continue
        best = _best_cut(polygon, xy[known], feature[known], kind)
        if best is not None:
            cut, parts = best
            split = [split_at_floors(part, flooring) for part in parts]
            return [p for pieces, _ in split for p in pieces], [cut, *(c for _, more in split for c in more)]
    return [polygon], []


def _floor_in(polygon: Polygon, flooring: Flooring) -> tuple[F64, F64]:
    """Middles (n, 2) of the pixels of floor seen in a space, and its features (3, n) there."""
    grid = flooring.grid
    low, high = np.array(polygon.bounds).reshape(2, 2)
    (c0, r0), (c1, r1) = np.clip(grid.pixel_of(np.array([low, high])), 0, np.array(grid.roof.shape[::-1]) - 1)
    part = flooring.features[:, r0 : r1 + 1, c0 : c1 + 1]
    row, col = np.nonzero(np.isfinite(part[0]))
    xy = grid.origin + (np.stack([col + c0, row + r0], 1) + 0.5) * PLAN
    inside = shapely.contains_xy(polygon, xy[:, 0], xy[:, 1])
    return xy[inside], part[:, row[inside], col[inside]].astype(np.float64)


def _two_kinds(value: F64, least: float) -> NDArray[np.bool_] | None:
    """Which of the floor's values (n,) are of the higher of two clearly different kinds; None if there are no two."""
    if len(value) < 2 * LEAST_SEEN / PLAN**2:
        return None
    low, high = np.percentile(value, [5, 95])
    if high - low < least:
        return None
    for _ in range(10):
        upper = value > (low + high) / 2
        if upper.all() or not upper.any():
            return None
        low, high = float(np.median(value[~upper])), float(np.median(value[upper]))
    upper = value > (low + high) / 2
    apart = high - low
    spread = [1.4826 * float(np.median(np.abs(value[k] - m))) for k, m in ((~upper, low), (upper, high))]
    seen = min(upper.sum(), (~upper).sum()) * PLAN**2
    return upper if apart > least and max(spread) < EVEN * apart and seen > LEAST_SEEN else None


def _best_cut(
    polygon: Polygon, xy: F64, value: F64, upper: NDArray[np.bool_]
) -> tuple[LineString, list[Polygon]] | None:
    """The cut along or across a space's longest side that parts its floor best into two kinds, and both parts; None if
    there is none.
    """
    apart = float(np.median(value[upper]) - np.median(value[~upper]))
    found: list[tuple[float, LineString, list[Polygon]]] = []
    for direction in _directions(polygon):
        normal = np.array([-direction[1], direction[0]])
        for offset in _changes(xy @ normal, xy @ direction, value, upper, apart):
            middle = offset * normal
            line = LineString([middle - 1e3 * direction, middle + 1e3 * direction])
            for piece in shapely.get_parts(line.intersection(polygon)):
                parts = parts_of(polygon, piece) if isinstance(piece, LineString) and piece.length > NARROWEST else []
                pure = _purity(parts, xy, upper)
                if pure > PURE:
                    found.append((pure, piece, parts))
    return max(found, key=lambda f: f[0])[1:] if found else None


def _directions(polygon: Polygon) -> tuple[F64, F64]:
    """Along and across the longest side of a space, unit vectors."""
    xy = shapely.get_coordinates(polygon.exterior)
    side = max((b - a for a, b in pairwise(xy)), key=lambda v: float(np.linalg.norm(v)))
    along = side / np.linalg.norm(side)
    return along, np.array([-along[1], along[0]])


def _changes(off: F64, along: F64, value: F64, upper: NDArray[np.bool_], apart: float) -> list[float]:
    """Offsets at which the floor changes from one kind to the other over enough of a line, those with most first."""
    base = np.array([off.min(), along.min()])
    s, t = (np.floor((v - b) / PLAN).astype(np.int64) for v, b in zip((off, along), base, strict=True))
    raster = np.full((int(s.max()) + 1 + 2 * (SIDE + SHARP), int(t.max()) + 1), np.nan)
    raster[s + SIDE + SHARP, t] = value
    kind = np.full(raster.shape, np.nan)
    kind[s + SIDE + SHARP, t] = upper
    found: list[tuple[float, float]] = []
    rows = np.arange(SIDE + SHARP, len(raster) - SIDE - SHARP)
    length = np.array([_sharp_length(raster, kind, int(row), apart) for row in rows]) * PLAN
    while len(found) < HIGHEST and length.max(initial=0.0) > LEAST_SHARP:
        best = int(np.argmax(length))
        found.append((float(length[best]), float(base[0] + (rows[best] - SIDE - SHARP) * PLAN)))
        length[max(0, best - SIDE) : best + SIDE + 1] = 0.0
    return [offset for _, offset in found]


def _sharp_length(raster: F64, kind: F64, row: int, apart: float) -> int:
    """Pixels along the lower edge of a row at which the floor changes from one kind to the other as much as both
    differ.
    """
    near = SHARP // 2
    before, behind = raster[row - near - SIDE : row - near], raster[row + near : row + near + SIDE]
    sides = [np.isfinite(part).sum(0) for part in (before, behind)]
    told = (sides[0] >= 2) & (sides[1] >= 2)
    if told.sum() * PLAN < LEAST_SHARP:
        return 0
    step = np.nanmean(behind[:, told], 0) - np.nanmean(before[:, told], 0)
    flips = np.nanmean(kind[row + near : row + near + SIDE, told], 0) - np.nanmean(
        kind[row - near - SIDE : row - near, told], 0
    )
    return int(max((step > 0.6 * apart)[flips > 0.8].sum(), (step < -0.6 * apart)[flips < -0.8].sum()))


def _purity(parts: Sequence[Polygon], xy: F64, upper: NDArray[np.bool_]) -> float:
    """The lesser share of the floor in two parts that is of the part's own kind; 0 if a part is too small for one."""
    if len(parts) != 2 or min(p.area for p in parts) < SMALLEST_PART:
        return 0.0
    if any(p.buffer(-NARROWEST / 2).is_empty for p in parts):
        return 0.0
    inside = [shapely.contains_xy(p, xy[:, 0], xy[:, 1]) for p in parts]
    if min(i.sum() for i in inside) * PLAN**2 < LEAST_SEEN:
        return 0.0
    share = [float(upper[i].mean()) for i in inside]
    return max(min(share[0], 1 - share[1]), min(1 - share[0], share[1]))
