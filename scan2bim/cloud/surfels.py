"""Surface elements: the points of all scans merged in voxels of 5 x 5 x 10 cm, a tile at a time.

A surfel keeps the *mean* position of its points and their number. Sums of positions are additive, so a plane fitted to
surfels by their counts is the plane fitted to the points, but there are as many surfels as there is surface in the
building, not as there are points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE, TileIndex, tile_runs
from scan2bim.config import SurfelSettings

PLAN = 0.05
"""Edge of a voxel in plan, metres: half of the thinnest common partition, several points wide at 10 m."""
TALL = 0.10
"""Height of a voxel, metres: walls are tall, so more points share a voxel where a scan is sparse."""
NX, NZ = round(TILE / PLAN), round(TILE / TALL)
BLOCK = 1 << 19
"""Surfels read at a time."""
SURFEL = np.dtype(
    [("xyz", "<f4", (3,)), ("count", "<u4"), ("rgb", "u1", (3,)), ("grey", "u1"), ("station", "<u2"), ("dz", "<f2")]
)


@dataclass(frozen=True, slots=True, eq=False)
class Surfels:
    """Arrays over n surfels: ``xyz`` (n, 3) float32 mean position, local metres; ``count`` (n,) points; ``rgb`` (n, 3)
    uint8; ``station`` (n,) uint16 of the last scan that saw it; ``spread`` (n,) float32 standard deviation of z inside
    the voxel, metres.
    """

    xyz: NDArray[np.float32]
    count: NDArray[np.uint32]
    rgb: NDArray[np.uint8]
    station: NDArray[np.uint16]
    spread: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.count)

    def pick(self, keep: NDArray[np.bool_] | NDArray[np.int64]) -> Surfels:
        """Those of a mask or index."""
        rows = np.flatnonzero(keep) if keep.dtype == np.bool_ else keep
        return Surfels(*(np.take(getattr(self, f.name), rows, axis=0) for f in fields(self)))

    @staticmethod
    def blocks(folder: Path) -> Iterator[Surfels]:
        """The surfels of the building, some at a time."""
        with (folder / "surfels.bin").open("rb") as file:
            while len(data := np.fromfile(file, SURFEL, BLOCK)):
                yield Surfels(
                    np.ascontiguousarray(data["xyz"]),
                    data["count"].copy(),
                    np.ascontiguousarray(data["rgb"]),
                    data["station"].copy(),
                    data["dz"].astype(np.float32),
                )

    @staticmethod
    def joined(parts: Sequence[Surfels]) -> Surfels:
        """One after the other."""
        if not parts:
            none = np.zeros(0, SURFEL)
            return Surfels(none["xyz"], none["count"], none["rgb"], none["station"], none["dz"].astype(np.float32))
        return Surfels(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Surfels)))

    @staticmethod
    def load(folder: Path) -> Surfels:
        """All surfels of the building."""
        return Surfels.joined(list(Surfels.blocks(folder)))


def make_surfels(
    scan_folders: Sequence[Path], folder: Path, settings: SurfelSettings, progress: Callable[[float], None]
) -> None:
    """Merge the tiles of all scans into ``folder``/surfels.bin (dtype SURFEL), tile by tile in a fixed order."""
    indices = [TileIndex.load(f) for f in scan_folders]
    tiles = np.unique(np.concatenate([index.runs["tile"] for index in indices]), axis=0)
    owners = [_tile_set(index) for index in indices]
    slots = np.full(NX * NX * NZ, -1, np.int32)
    with (folder / "surfels.bin").open("wb") as file:
        for done, tile in enumerate(tiles):
            key = tuple(tile.tolist())
            seen = (index for index, own in zip(indices, owners, strict=True) if key in own)
            _merge((run for index in seen for run in tile_runs(index, tile)), tile, slots).tofile(file)
            progress((done + 1) / len(tiles))


def _tile_set(index: TileIndex) -> set[tuple[int, ...]]:
    return {tuple(t) for t in index.runs["tile"].tolist()}


def _merge(runs: Iterable[NDArray[np.void]], tile: NDArray[np.int32], slots: NDArray[np.int32]) -> NDArray[np.void]:
    """Surfels (dtype SURFEL) of one tile's runs of points (dtype POINT), by voxel; ``slots`` is scratch, all -1."""
    sums, station, cells, used = np.zeros((4096, 9)), np.zeros(4096, np.uint16), np.zeros(4096, np.int32), 0
    for run in runs:
        raw = run.view(np.uint8).reshape(-1, POINT.itemsize)
        sums, station, cells, used = _accumulate(raw, slots, np.float32(TILE / STEPS), sums, station, cells, used)
    sums, station, cells = sums[:used], station[:used], cells[:used]
    out = np.zeros(len(cells), SURFEL)
    n = sums[:, 0]
    mean = sums[:, 1:4] / n[:, None]
    out["xyz"] = mean + tile * TILE
    out["count"] = n
    out["rgb"] = np.rint(sums[:, 4:7] / n[:, None])
    out["grey"] = np.rint(sums[:, 7] / n)
    out["station"] = station
    out["dz"] = np.sqrt(np.maximum(sums[:, 8] / n - mean[:, 2] ** 2, 0))
    slots[cells] = -1
    return out[np.argsort(cells)]


@nb.njit(cache=True, nogil=True)
def _accumulate(raw, slots, step, sums, station, cells, used):  # pyright: ignore
    """Add points (n, 12) uint8 to the voxels' sums; gives the arrays, grown where need be, and how many are used.

    Per occupied voxel: count, sums of x y z r g b grey zz (m, 9) float64, last station (m,), cell (m,).
    """
    capacity = sums.shape[0]
    for i in range(raw.shape[0]):
        qx = np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8
        qy = np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8
        qz = np.int64(raw[i, 4]) | np.int64(raw[i, 5]) << 8
        cell = ((qx * NX >> 16) * NX + (qy * NX >> 16)) * NZ + (qz * NZ >> 16)
        s = slots[cell]
        if s < 0:
            if used == capacity:
                more = np.zeros((2 * capacity, 9), np.float64)
                more[:capacity] = sums
                sums = more
                longer = np.zeros(2 * capacity, np.uint16)
                longer[:capacity] = station
                station = longer
                other = np.zeros(2 * capacity, np.int32)
                other[:capacity] = cells
                cells = other
                capacity *= 2
            s = used
            used += 1
            slots[cell] = s
            cells[s] = cell
        z = (qz + 0.5) * step
        sums[s, 0] += 1
        sums[s, 1] += (qx + 0.5) * step
        sums[s, 2] += (qy + 0.5) * step
        sums[s, 3] += z
        sums[s, 4] += raw[i, 6]
        sums[s, 5] += raw[i, 7]
        sums[s, 6] += raw[i, 8]
        sums[s, 7] += raw[i, 9]
        sums[s, 8] += z * z
        station[s] = np.uint16(raw[i, 10]) | np.uint16(raw[i, 11]) << 8
    return sums, station, cells, used
