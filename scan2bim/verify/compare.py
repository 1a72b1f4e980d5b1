"""All points against all faces, tile by tile: what each cell of the model measures, and what no element explains."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE, TileIndex, tile_runs
from scan2bim.verify.assign import NV, add_moments, assign, face_arrays, make_bins, voxel_normals
from scan2bim.verify.faces import FaceTable

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """What the points say of a model. count (c,) points of each cell, mean (c,) and square (c,) their mean deviation
    and mean square, metres, nan without points; points and unexplained: how many in all, how many no element explains.
    """

    count: NDArray[np.int64]
    mean: F64
    square: F64
    points: int
    unexplained: int


@dataclass(frozen=True, slots=True, eq=False)
class Owned:
    """Points of a run with their owners: xyz (n, 3) float64 local metres, records (n,) of dtype POINT, owner (n,) int32
    as in ``assign``.
    """

    corner: F64
    records: NDArray[np.void]
    owner: I32

    def xyz(self, which: NDArray[np.bool_]) -> F64:
        """(k, 3) local metres of some."""
        picked = self.records[which]
        steps = np.column_stack([picked["x"], picked["y"], picked["z"]]).astype(np.float64)
        return (steps + 0.5) * (TILE / STEPS) + self.corner


Sink = Callable[[Owned], None]


def compare_points(
    table: FaceTable,
    scan_folders: Sequence[Path],
    stations: F64,
    ignored: NDArray[np.bool_],
    sinks: Sequence[Sink],
    progress: Callable[[float], None],
) -> Measured:
    """Stream all tiles of all scans past the faces. stations (s, 3) positions, nan where unknown; ignored (s,) bool
    those whose points are not to count; each sink gets every run of points with its owners.
    """
    bins = make_bins(table)
    sums = np.zeros((len(table.cell_face), 3))
    faces = face_arrays(table)
    slots = np.full(NV**3, -1, np.int32)
    points = unexplained = 0
    for tile, runs, share in _tiles(scan_folders):
        normals = _normals(runs(), slots)
        corner = tile.astype(np.float64) * TILE
        near = bins.of_tile(tile)
        for run in runs():
            owner = np.empty(len(run), np.int32)
            raw = run.view(np.uint8).reshape(-1, POINT.itemsize)
            assign(raw, corner, (slots, normals), stations, ignored, near, faces, sums, owner)
            points += len(run)
            unexplained += int((owner == -2).sum())
            for sink in sinks:
                sink(Owned(corner, run, owner))
        slots.fill(-1)
        progress(share)
    with np.errstate(invalid="ignore", divide="ignore"):
        sums[:, 1:] /= sums[:, :1]
    return Measured(sums[:, 0].astype(np.int64), sums[:, 1], sums[:, 2], points, unexplained)


Runs = Callable[[], Iterator[NDArray[np.void]]]


def _tiles(scan_folders: Sequence[Path]) -> Iterator[tuple[I32, Runs, float]]:
    """Each tile, a function that gives its points run by run, and the share of points done after it."""
    indices = [TileIndex.load(f) for f in scan_folders]
    tiles, counts = _tile_counts(indices)
    owners = [{tuple(t) for t in index.runs["tile"].tolist()} for index in indices]
    done = np.cumsum(counts) / max(int(counts.sum()), 1)
    for tile, share in zip(tiles, done, strict=True):

        def runs(tile: I32 = tile) -> Iterator[NDArray[np.void]]:
            key = tuple(tile.tolist())
            for index, own in zip(indices, owners, strict=True):
                if key in own:
                    yield from tile_runs(index, tile)

        yield tile, runs, float(share)


def _tile_counts(indices: Sequence[TileIndex]) -> tuple[I32, NDArray[np.int64]]:
    every = np.concatenate([index.runs for index in indices])
    tiles, place = np.unique(every["tile"], axis=0, return_inverse=True)
    return tiles, np.bincount(place.ravel(), weights=every["count"], minlength=len(tiles)).astype(np.int64)


def _normals(runs: Iterator[NDArray[np.void]], slots: I32) -> NDArray[np.float32]:
    """Normals of the tile's voxels by slot; ``slots`` is filled with the voxels' slots."""
    sums, used = np.zeros((4096, 10)), 0
    for run in runs:
        sums, used = add_moments(run.view(np.uint8).reshape(-1, POINT.itemsize), slots, sums, used)
    return voxel_normals(sums, used)
