"""Plan columns of a storey: what stands upright, gathered from surfels that lie one above the other."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN, TALL, Surfels
from scan2bim.structure.storeys import Layers

SKIRT = 0.15
"""Height above the floor, metres, below which nothing is taken for a wall: skirting boards, cables, thresholds."""
FLUSH = 0.07
"""Distance from the ceiling, metres, within which points belong to it."""
NOISE = 0.03
"""Height over a soffit, metres, from which on what was seen is not the soffit itself."""
REACHING = 3
"""Heights of 10 cm within HIGH of the ceiling that a column fills at least to reach it."""
HIGH = 0.45
"""Height below the ceiling, metres, that furniture seldom reaches: what stands there is most likely a wall."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


def pixels_at(xy: F64, origin: F64) -> NDArray[np.int64]:
    """Column and row (..., 2) of points (..., 2 or 3) on a raster of PLAN metres whose lower left corner lies there."""
    pixel = np.empty((*xy.shape[:-1], 2), np.int64)
    for k in range(2):  # one after the other: three times as fast as both at once
        pixel[..., k] = np.floor((xy[..., k] - origin[k]) / PLAN + 1e-6)
    return pixel


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Pixels of PLAN metres: ``origin`` (2,) lower left corner, ``roof`` (rows, columns) height of the nearest ceiling,
    ``floor`` height, metres.
    """

    origin: F64
    roof: NDArray[np.float64]
    floor: float

    def pixel_of(self, xy: F64) -> NDArray[np.int64]:
        """Column and row (..., 2) of points (..., 2 or 3); may lie outside."""
        return pixels_at(xy, self.origin)

    def contains(self, pixel: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether pixels (n, 2) lie in the raster."""
        col, row = pixel[:, 0], pixel[:, 1]
        return (col >= 0) & (row >= 0) & (col < self.roof.shape[1]) & (row < self.roof.shape[0])


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Vertical surfaces in plan: (m,) columns with two or more surfels one above the other.

    ``pixel`` (m, 2) int64; ``xy`` (m, 2) float64 mean position; ``bins`` (m,) how many 10 cm heights are occupied;
    ``high`` (m,) how many of those within HIGH of the ceiling; ``low`` (m,) how many below 1 m; ``gap`` (m,) metres
    from the highest of them up to the ceiling; ``view`` (m, 2) float64 mean unit direction in plan from the surface to
    the stations that saw it, zero where no station is known; ``points`` (m,) number of scan points; ``station`` (m,) of
    one of its surfels; ``rgb`` (m, 3) mean colour.
    """

    pixel: NDArray[np.int64]
    xy: F64
    bins: NDArray[np.int64]
    high: NDArray[np.int64]
    low: NDArray[np.int64]
    gap: F64
    view: F64
    points: NDArray[np.int64]
    station: NDArray[np.uint16]
    rgb: F64

    def __len__(self) -> int:
        return len(self.bins)

    def pick(self, keep: NDArray[np.bool_]) -> Columns:
        """Those of a mask (m,)."""
        return Columns(*(getattr(self, f.name)[keep] for f in fields(self)))

    def joined(self, other: Columns) -> Columns:
        """These and then the others."""
        return Columns(*(np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)))


def over_soffits(surfels: Surfels, layers: Layers, grid: Grid, soffit: F64, ceiling: F64, columns: Columns) -> Columns:
    """Columns of which those reach the ceiling zone that go on over a strip that hangs lower at the ceiling's rim: the
    wall over and under a window. ``soffit`` (rows, columns) is the height of the highest such strip near, ``ceiling``
    that of the nearest ceiling without them.
    """
    z = surfels.xyz[layers.order, 2].astype(np.float64)
    at = np.flatnonzero(z > grid.floor + SKIRT)
    pixel = grid.pixel_of(surfels.xyz[layers.order[at], :2].astype(np.float64))
    inside = grid.contains(pixel)
    at, pixel = at[inside], pixel[inside]
    col, row = pixel.T
    over = (z[at] > soffit[row, col] + NOISE) & (z[at] < ceiling[row, col] - FLUSH)
    found = np.zeros(grid.roof.shape, np.bool_)
    found[row[over], col[over]] = True
    both = found[columns.pixel[:, 1], columns.pixel[:, 0]]
    return replace(columns, high=np.where(both, np.maximum(columns.high, REACHING), columns.high))


def gather_columns(surfels: Surfels, layers: Layers, grid: Grid, stations: F64) -> Columns:
    """Columns of the surfels between skirting and ceiling that have another close above or below.

    ``stations`` (s, 3) local positions by station number, nan where unknown.
    """
    z = surfels.xyz[layers.order, 2].astype(np.float64)
    at = np.flatnonzero((z > grid.floor + SKIRT) & ((layers.above < 2.5 * TALL) | (layers.below < 2.5 * TALL)))
    p = grid.pixel_of(surfels.xyz[layers.order[at], :2].astype(np.float64))
    inside = grid.contains(p)
    at, p = at[inside], p[inside]
    below = z[at] < grid.roof[p[:, 1], p[:, 0]] - FLUSH
    at, p = at[below], p[below]
    new = np.ones(len(at), bool)
    new[1:] = (p[1:] != p[:-1]).any(1)
    first = np.flatnonzero(new)
    if len(first) == 0:
        none, pairs = np.zeros(0, np.int64), np.zeros((0, 2))
        return Columns(
            pairs.astype(np.int64),
            pairs,
            none,
            none,
            none,
            pairs[:, 0],
            pairs,
            none,
            none.astype(np.uint16),
            np.zeros((0, 3)),
        )
    index = layers.order[at]
    bins = np.diff(np.append(first, len(at)))
    xyz = surfels.xyz[index].astype(np.float64)
    weight = np.minimum(surfels.count[index].astype(np.float64), 8.0)
    total = np.add.reduceat(weight, first)
    xy = np.stack([np.add.reduceat(weight * xyz[:, k], first) / total for k in range(2)], 1)
    view = _views(xyz, surfels.station[index], stations)
    mean_view = np.stack([np.add.reduceat(view[:, k], first) / bins for k in range(2)], 1)
    high = np.add.reduceat((xyz[:, 2] > grid.roof[p[:, 1], p[:, 0]] - HIGH).astype(np.int64), first)
    low = np.add.reduceat((xyz[:, 2] < grid.floor + 1.0).astype(np.int64), first)
    gap = grid.roof[p[first, 1], p[first, 0]] - np.maximum.reduceat(xyz[:, 2], first)
    points = np.add.reduceat(surfels.count[index].astype(np.int64), first)
    rgb = np.add.reduceat(surfels.rgb[index].astype(np.float64), first) / bins[:, None]
    return Columns(p[first], xy, bins, high, low, gap, mean_view, points, surfels.station[index][first], rgb)


def _views(xyz: F64, station: NDArray[np.uint16], stations: F64) -> F64:
    """Unit direction in plan from each surfel to the station that saw it, zero where unknown; (n, 2)."""
    view = np.zeros((len(xyz), 2))
    known = station < len(stations)
    view[known] = stations[station[known], :2] - xyz[known, :2]
    view[~np.isfinite(view)] = 0.0
    length = np.linalg.norm(view, axis=1, keepdims=True)
    return np.divide(view, length, out=np.zeros_like(view), where=length > 1e-6)
