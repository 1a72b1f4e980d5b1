"""Surface elements: the points of all scans merged in voxels of 5 x 5 x 10 cm, a tile at a time.

A surfel keeps the *mean* position of its points and their number. Sums of positions are additive, so a plane fitted to
surfels by their counts is the plane fitted to the points, but there are as many surfels as there is surface in the
building, not as there are points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import load_panoramas
from scan2bim.cloud.panorama import agreement
from scan2bim.cloud.tiles import STEPS, TILE, TileIndex, tile_runs
from scan2bim.config import SurfelSettings

PLAN = 0.05
"""Edge of a voxel in plan, metres: half of the thinnest common partition, several points wide at 10 m."""
TALL = 0.10
"""Height of a voxel, metres: walls are tall, so more points share a voxel where a scan is sparse."""
NX, NZ = round(TILE / PLAN), round(TILE / TALL)
BLOCK = 1 << 19
"""Surfels read at a time."""
SURFEL = np.dtype(
    [("xyz", "<f4", (3,)), ("count", "<u4"), ("rgb", "u1", (3,)), ("trusted", "?"), ("station", "<u2"), ("dz", "<f2")]
)
COLUMNS = ("xyz", "count", "rgb", "station", "dz")
"""Of SURFEL, in the order of the fields of ``Surfels``."""
TRUST = 0.5
"""Share of its neighbourhood that must agree with a trusted surfel: half, as for the edge of a surface."""


@dataclass(frozen=True, slots=True, eq=False)
class Surfels:
    """Arrays over n surfels: ``xyz`` (n, 3) float32 mean position, local metres; ``count`` (n,) points; ``rgb`` (n, 3)
    uint8; ``station`` (n,) uint16 of the last scan that saw it; ``spread`` (n,) float16 standard deviation of z inside
    the voxel, metres.
    """

    xyz: NDArray[np.float32]
    count: NDArray[np.uint32]
    rgb: NDArray[np.uint8]
    station: NDArray[np.uint16]
    spread: NDArray[np.float16]

    def __len__(self) -> int:
        return len(self.count)

    def pick(self, keep: NDArray[np.bool_] | NDArray[np.int64]) -> Surfels:
        """Those of a mask or index."""
        rows = np.flatnonzero(keep) if keep.dtype == np.bool_ else keep
        return Surfels(*(np.take(getattr(self, f.name), rows, axis=0) for f in fields(self)))

    @staticmethod
    def load(folder: Path, *, trusted: bool | None = None) -> Surfels:
        """All surfels of the building, or those that are trusted, or those that are not."""
        path = folder / "surfels.bin"
        most = path.stat().st_size // SURFEL.itemsize
        columns = [np.empty((most, *SURFEL[name].shape), SURFEL[name].base) for name in COLUMNS]
        count = 0
        with path.open("rb") as file:
            while len(block := np.fromfile(file, SURFEL, BLOCK)):
                rows = np.flatnonzero(block["trusted"] == trusted) if trusted is not None else np.arange(len(block))
                for column, name in zip(columns, COLUMNS, strict=True):
                    column[count : count + len(rows)] = block[name][rows]
                count += len(rows)
        return Surfels(*(column[:count] for column in columns))


def make_surfels(
    scan_folders: Sequence[Path], folder: Path, settings: SurfelSettings, progress: Callable[[float], None]
) -> None:
    """Merge the tiles of all scans into ``folder``/surfels.bin (dtype SURFEL), tile by tile in a fixed order.

    Those that the surroundings in their own station's panorama do not bear out are not trusted.
    """
    indices = [TileIndex.load(f) for f in scan_folders]
    panoramas = load_panoramas(scan_folders)
    tiles = np.unique(np.concatenate([index.runs["tile"] for index in indices]), axis=0)
    owners = [_tile_set(index) for index in indices]
    slots = np.full(NX * NX * NZ, -1, np.int32)
    with (folder / "surfels.bin").open("wb") as file:
        for done, tile in enumerate(tiles):
            key = tuple(tile.tolist())
            seen = (index for index, own in zip(indices, owners, strict=True) if key in own)
            merged = _merge((run for index in seen for run in tile_runs(index, tile)), tile, slots)
            merged["trusted"] = agreement(merged["xyz"], merged["station"], panoramas) >= TRUST
            merged.tofile(file)
            progress((done + 1) / len(tiles))


def _tile_set(index: TileIndex) -> set[tuple[int, ...]]:
    return {tuple(t) for t in index.runs["tile"].tolist()}


def _merge(runs: Iterable[NDArray[np.void]], tile: NDArray[np.int32], slots: NDArray[np.int32]) -> NDArray[np.void]:
    """Surfels (dtype SURFEL) of one tile's runs of points (dtype POINT), by voxel; ``slots`` is scratch, all -1."""
    sums, cells, used = np.zeros((4096, 8), np.int64), np.zeros(4096, np.int32), 0
    for run in runs:
        sums, cells, used = _accumulate(run.view(np.uint32).reshape(-1, 3), slots, sums, cells, used)
    order = np.argsort(cells[:used])
    sums, cells = sums[order], cells[order]
    out = np.zeros(used, SURFEL)
    n = sums[:, 0] >> 16
    half_step = 0.5 * TILE / STEPS
    mean = sums[:, 1:4] * half_step / n[:, None]
    out["xyz"] = mean + tile * TILE
    out["count"] = n
    out["rgb"] = np.rint(sums[:, 5:8] / n[:, None])
    out["station"] = sums[:, 0] & 0xFFFF
    out["dz"] = np.sqrt(np.maximum(sums[:, 4] * half_step**2 / n - mean[:, 2] ** 2, 0))
    slots[cells] = -1
    return out


@nb.njit(cache=True, nogil=True)
def _accumulate(points, slots, sums, cells, used):  # pyright: ignore
    """Add points (n, 3) uint32, the words of POINT, to the voxels' sums; gives the arrays, grown where need be, and how
    many rows are used.

    Per occupied voxel: number of points times 65536 plus the last one's station, sums of x y z (twice the steps plus
    one), of z z, of r g b (m, 8) int64, which is a line of the processor's cache; cell (m,).
    """
    capacity = sums.shape[0]
    for i in range(points.shape[0]):
        xy = np.int64(points[i, 0])
        zrg = np.int64(points[i, 1])
        rest = np.int64(points[i, 2])
        qx = xy & 0xFFFF
        qy = xy >> 16
        qz = zrg & 0xFFFF
        cell = ((qx * NX >> 16) * NX + (qy * NX >> 16)) * NZ + (qz * NZ >> 16)
        s = slots[cell]
        if s < 0:
            if used == capacity:
                more = np.zeros((2 * capacity, 8), np.int64)
                more[:capacity] = sums
                sums = more
                other = np.zeros(2 * capacity, np.int32)
                other[:capacity] = cells
                cells = other
                capacity *= 2
            s = used
            used += 1
            slots[cell] = s
            cells[s] = cell
        z = 2 * qz + 1
        row = sums[s]
        row[0] = ((row[0] >> 16) + 1) << 16 | rest >> 16
        row[1] += 2 * qx + 1
        row[2] += 2 * qy + 1
        row[3] += z
        row[4] += z * z
        row[5] += zrg >> 16 & 0xFF
        row[6] += zrg >> 24
        row[7] += rest & 0xFF
    return sums, cells, used
