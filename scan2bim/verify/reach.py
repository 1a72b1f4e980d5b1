"""Which elements of a model the scans can say anything of: large models are mostly drawn beyond what was scanned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import TILE, TileIndex
from scan2bim.verify.assign import REACH
from scan2bim.verify.faces import Plane
from scan2bim.verify.visibility import FARTHEST

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


def within_reach(
    planes: Sequence[Plane], elements: int, matrix: F64, scan_folders: Sequence[Path], stations: F64
) -> Mask:
    """Which elements (e,) lie in tiles with points or within sight of a station (s, 3), nan where unknown; those
    without planes do. ``matrix`` (4, 4) takes the planes to the scans' local frame.
    """
    low, high = _boxes(planes, elements, matrix)
    near = _has_points(low - REACH, high + REACH, scan_folders)
    for station in stations[np.isfinite(stations).all(axis=1)]:
        away = np.maximum(np.maximum(low - station, station - high), 0.0)
        near |= (away**2).sum(axis=1) < FARTHEST**2
    return near | ~np.isfinite(low).all(axis=1)


def _boxes(planes: Sequence[Plane], elements: int, matrix: F64) -> tuple[F64, F64]:
    """Lower and upper corners (e, 3) of the elements, infinite without planes."""
    low, high = np.full((elements, 3), np.inf), np.full((elements, 3), -np.inf)
    for plane in planes:
        corners = plane.corners.reshape(-1, 3)
        low[plane.element] = np.minimum(low[plane.element], corners.min(axis=0))
        high[plane.element] = np.maximum(high[plane.element], corners.max(axis=0))
    found = np.isfinite(low).all(axis=1)
    middle, half = (low[found] + high[found]) / 2, (high[found] - low[found]) / 2
    middle = middle @ matrix[:3, :3].T + matrix[:3, 3]
    half = half @ np.abs(matrix[:3, :3]).T
    low[found], high[found] = middle - half, middle + half
    return low, high


def _has_points(low: F64, high: F64, scan_folders: Sequence[Path]) -> Mask:
    """Which boxes (e, 3) meet a tile that points lie in."""
    tiles = np.unique(np.concatenate([TileIndex.load(f).runs["tile"] for f in scan_folders]), axis=0).astype(np.int64)
    first = tiles.min(axis=0)
    shape = tiles.max(axis=0) - first + 1
    sums = np.zeros(shape + 1, np.int64)
    sums[tuple((tiles - first + 1).T)] = 1
    for axis in range(3):
        sums = sums.cumsum(axis=axis)
    known: Mask = np.asarray(np.isfinite(low).all(axis=1), bool)
    ends = [np.floor(np.where(known[:, None], place, 0.0) / TILE).astype(np.int64) - first for place in (low, high)]
    a, b = np.clip(ends[0], 0, shape), np.clip(ends[1] + 1, 0, shape)
    inside = np.zeros(len(low), np.int64)
    for corner in product((0, 1), repeat=3):
        place = np.where(np.array(corner, bool), b, a)
        inside += (-1) ** (3 - sum(corner)) * sums[place[:, 0], place[:, 1], place[:, 2]]
    return known & (inside > 0)
