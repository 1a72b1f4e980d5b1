"""Surface elements: the points of all scans merged in voxels of 5 x 5 x 10 cm, a tile at a time.

The voxels lie along the building's walls (``Lattice``), so that some reach over the sides of tiles: those are put
together at the end.

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

from scan2bim.cloud.ingest import load_panoramas, load_stations
from scan2bim.cloud.lattice import Lattice
from scan2bim.cloud.panorama import agreement
from scan2bim.cloud.tiles import SAMPLE, STEPS, TILE, TileIndex, tile_runs
from scan2bim.config import SurfelSettings

PLAN = 0.05
"""Edge of a voxel in plan, metres: half of the thinnest common partition, several points wide at 10 m."""
TALL = 0.10
"""Height of a voxel, metres: walls are tall, so more points share a voxel where a scan is sparse."""
NX, NZ = round(TILE / PLAN), round(TILE / TALL)
SIDE = np.array([PLAN, PLAN, TALL])
"""Of a voxel, metres."""
BLOCK = 1 << 19
"""Surfels read at a time."""
SURFEL = np.dtype(
    [("xyz", "<f4", (3,)), ("count", "<u4"), ("rgb", "u1", (3,)), ("trusted", "?"), ("station", "<u2"), ("dz", "<f2")]
)
COLUMNS = ("xyz", "count", "rgb", "station", "dz")
"""Of SURFEL, in the order of the fields of ``Surfels``."""
PART = np.dtype(
    [("cell", "<i8", (3,)), ("count", "<i8"), ("xyz", "<f8", (3,)), ("dz2", "<f8"), ("rgb", "<f8", (3,)),
     ("station", "<u2"), ("seen", "<i8"), ("cut", "?")]
)  # fmt: skip
"""What one tile holds of a voxel: the voxel's place in the lattice, means of ``count`` points, the station that has
most of them and how many it has (``seen``), and whether the voxel reaches over the tile's side (``cut``).
"""
TRUST = 0.5
"""Share of its neighbourhood that must agree with a trusted surfel: half, as for the edge of a surface."""


@dataclass(frozen=True, slots=True, eq=False)
class Surfels:
    """Arrays over n surfels: ``xyz`` (n, 3) float32 mean position, local metres; ``count`` (n,) points; ``rgb`` (n, 3)
    uint8; ``station`` (n,) uint16 of the scan that saw it most, of equals the nearest; ``spread`` (n,) float16 standard
    deviation of z inside the voxel, metres.
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
    scan_folders: Sequence[Path],
    folder: Path,
    settings: SurfelSettings,
    progress: Callable[[float], None],
    lattice: Lattice | None = None,
) -> None:
    """Merge the tiles of all scans into ``folder``/surfels.bin (dtype SURFEL), tile by tile in a fixed order, in the
    voxels of a lattice, which is kept beside them.

    Those that the surroundings in their own station's panorama do not bear out are not trusted.
    """
    lattice = lattice or Lattice()
    lattice.save(folder)
    panoramas = load_panoramas(scan_folders)
    cut: list[NDArray[np.void]] = []
    with (folder / "surfels.bin").open("wb") as file:

        def write(parts: NDArray[np.void]) -> None:
            if not len(parts):
                return
            merged = _surfels_of(parts)
            merged["trusted"] = agreement(merged["xyz"], merged["station"], panoramas) >= TRUST
            merged.tofile(file)

        indices = [TileIndex.load(f) for f in scan_folders]
        for parts, share in _tile_parts(indices, load_stations(scan_folders), lattice, 1):
            cut.append(parts[parts["cut"]])
            write(parts[~parts["cut"]])
            progress(share)
        write(_put_together(np.concatenate(cut)))


def rough_surfels(scan_folders: Sequence[Path], lattice: Lattice, points: int) -> Surfels:
    """Surfels of about so many points, in pieces at the sides of tiles, none judged, in memory."""
    samples = [TileIndex.load(f / SAMPLE) for f in scan_folders]
    every = max(1, sum(int(one.runs["count"].sum()) for one in samples) // points)
    merged = [_surfels_of(parts) for parts, _ in _tile_parts(samples, load_stations(scan_folders), lattice, every)]
    return Surfels(*(np.concatenate([m[name] for m in merged]) for name in COLUMNS))


def _tile_parts(
    indices: Sequence[TileIndex], stations: NDArray[np.float64], lattice: Lattice, every: int
) -> Iterator[tuple[NDArray[np.void], float]]:
    """What each tile holds of voxels (dtype PART), of one in ``every`` points, and the share of the work done.
    ``stations`` (s, 3) positions by station number, nan where unknown.
    """
    tiles = np.unique(np.concatenate([index.runs["tile"] for index in indices]), axis=0)
    owners = [_tile_set(index) for index in indices]
    slots = np.full(_extent(lattice).prod(), -1, np.int32)
    for done, tile in enumerate(tiles):
        key = tuple(tile.tolist())
        seen = (index for index, own in zip(indices, owners, strict=True) if key in own)
        runs = (run[::every] for index in seen for run in tile_runs(index, tile))
        yield _merge(runs, tile, stations, lattice, slots), (done + 1) / len(tiles)


def _tile_set(index: TileIndex) -> set[tuple[int, ...]]:
    return {tuple(t) for t in index.runs["tile"].tolist()}


def _extent(lattice: Lattice) -> NDArray[np.int64]:
    """How many voxels (3,) a tile's surroundings along the lattice hold each way."""
    plan = int(np.ceil(NX * np.abs(lattice.axes).sum(1)[0])) + 2
    return np.array([plan, plan, NZ + 2])


def _merge(
    runs: Iterable[NDArray[np.void]],
    tile: NDArray[np.int32],
    stations: NDArray[np.float64],
    lattice: Lattice,
    slots: NDArray[np.int32],
) -> NDArray[np.void]:
    """What one tile's runs of points (dtype POINT) hold of each voxel (dtype PART); ``slots`` is scratch, all -1."""
    extent = _extent(lattice)
    turn = lattice.axes
    corner = np.append(NX * (turn @ tile[:2]), float(NZ * tile[2])) - [*lattice.corner, lattice.level] / SIDE
    reach = np.append(NX * np.minimum(turn, 0.0).sum(1), 0.0)
    first = np.floor(corner + reach).astype(np.int64)
    eyes = (stations - tile * TILE) * (2 * STEPS / TILE)
    sums, cells, used = np.zeros((4096, 8), np.int64), np.zeros(4096, np.int32), 0
    scale = np.array([turn[0, 0] * NX, turn[0, 1] * NX, float(NZ)]) / STEPS
    for run in runs:
        words = np.ascontiguousarray(run).view(np.uint32).reshape(-1, 3)
        sums, cells, used = _accumulate(words, slots, sums, cells, used, scale, corner - first, extent, eyes)
    slots[cells[:used]] = -1
    out = np.zeros(used, PART)
    _fill(out, sums, cells, np.argsort(cells[:used]), extent, first, corner, turn, tile * float(TILE), eyes)
    return out


@nb.njit(cache=True, nogil=True)
def _fill(out, sums, cells, order, extent, first, corner, turn, origin, eyes):  # pyright: ignore
    """Parts (dtype PART) from the sums of voxels, in an order; ``first`` (3,) is the place of their surroundings in the
    lattice, ``corner`` (3,) that of the tile's corner in voxels, ``turn`` the lattice's axes, ``origin`` (3,) metres.
    """
    half = 0.5 * TILE / STEPS
    for i in range(len(order)):
        k, part = order[i], out[i]
        n = sums[k, 0] >> 16
        part.count = n
        for j in range(3):
            part.xyz[j] = sums[k, 1 + j] * half / n + origin[j]
        height = sums[k, 3] * half / n
        part.dz2 = sums[k, 4] * half**2 / n - height * height
        part.rgb[0], part.rgb[1], part.rgb[2] = (sums[k, 5] >> 32) / n, (sums[k, 5] & 0xFFFFFFFF) / n, sums[k, 6] / n
        x, y, z = sums[k, 1] / n, sums[k, 2] / n, sums[k, 3] / n
        kept = _changed(sums[k, 7], sums[k, 0] & 0xFFFF, x, y, z, eyes)
        part.station, part.seen = kept & 0xFFFF, kept >> 16
        u, rest = divmod(np.int64(cells[k]), extent[1] * extent[2])
        v, w = rest // extent[2], rest % extent[2]
        part.cell[0], part.cell[1], part.cell[2] = u + first[0], v + first[1], w + first[2]
        part.cut = _reaches_out(u + first[0] - corner[0], v + first[1] - corner[1], w + first[2] - corner[2], turn)


@nb.njit(cache=True, nogil=True)
def _reaches_out(u, v, w, turn):  # pyright: ignore
    """Whether a voxel reaches over its tile's sides; ``u``, ``v``, ``w`` are its corner's place from the tile's, in
    voxels along the lattice's axes ``turn``.
    """
    over = w < -1e-6 or w + 1 > NZ + 1e-6
    for j in range(2):
        low = u * turn[0, j] + v * turn[1, j]
        least = min(0.0, turn[0, j], turn[1, j], turn[0, j] + turn[1, j])
        most = max(0.0, turn[0, j], turn[1, j], turn[0, j] + turn[1, j])
        over |= low + least < -1e-6 or low + most > NX + 1e-6
    return over


def _put_together(parts: NDArray[np.void]) -> NDArray[np.void]:
    """One part for each voxel, from those of several tiles; in the order of the voxels."""
    order = np.lexsort((-parts["seen"], *parts["cell"].T[::-1]))
    parts = parts[order]
    first = np.flatnonzero(np.append(True, (np.diff(parts["cell"], axis=0) != 0).any(1))) if len(parts) else order
    out = parts[first]
    if len(first) == len(parts):
        return out
    n = parts["count"].astype(np.float64)
    total = np.add.reduceat(n, first)
    out["count"] = total
    for name in ("xyz", "rgb"):
        out[name] = np.add.reduceat(n[:, None] * parts[name], first) / total[:, None]
    off = parts["xyz"][:, 2] - np.repeat(out["xyz"][:, 2], np.diff(np.append(first, len(parts))))
    out["dz2"] = np.add.reduceat(n * (parts["dz2"] + off**2), first) / total
    return out


def _surfels_of(parts: NDArray[np.void]) -> NDArray[np.void]:
    """Parts that are whole voxels as surfels (dtype SURFEL)."""
    out = np.zeros(len(parts), SURFEL)
    for name in ("xyz", "count", "station"):
        out[name] = parts[name]
    out["rgb"] = np.rint(parts["rgb"])
    out["dz"] = np.sqrt(np.maximum(parts["dz2"], 0))
    return out


@nb.njit(cache=True, nogil=True)
def _accumulate(points, slots, sums, cells, used, scale, shift, extent, eyes):  # pyright: ignore
    """Add points (n, 3) uint32, the words of POINT, to the voxels' sums; gives the arrays, grown where need be, and how
    many rows are used.

    ``scale`` (3,) voxels along a step of the tile's x, its y and upwards; ``shift`` (3,) place of the tile's corner in
    voxels from the first of ``extent`` (3,); ``eyes`` (s, 3) the stations in half steps from it.

    Per occupied voxel: number of points times 65536 plus the last one's station, sums of x y z (twice the steps plus
    one), of z z, of r (times 2 to the 32) and g, of b, and what ``_changed`` keeps of its stations (m, 8) int64, which
    is a line of the processor's cache; cell (m,).
    """
    capacity = sums.shape[0]
    last, s = np.int64(-1), np.int32(0)
    for i in range(np.uint64(points.shape[0])):
        xy = np.int64(points[i, 0])
        zrg = np.int64(points[i, 1])
        rest = np.int64(points[i, 2])
        qx = xy & 0xFFFF
        qy = xy >> 16
        qz = zrg & 0xFFFF
        u = np.int64(qx * scale[0] + qy * scale[1] + shift[0])
        v = np.int64(qy * scale[0] - qx * scale[1] + shift[1])
        w = np.int64(qz * scale[2] + shift[2])
        cell = (u * extent[1] + v) * extent[2] + w
        if cell != last:
            last, s = cell, slots[cell]
            if s < 0:
                if used == capacity:
                    more = np.zeros((2 * capacity, 8), np.int64)
                    more[:capacity] = sums
                    sums = more
                    other = np.zeros(2 * capacity, np.int32)
                    other[:capacity] = cells
                    cells = other
                    capacity *= 2
                s = np.int32(used)
                used += 1
                slots[cell] = s
                cells[s] = cell
                sums[s, 0] = rest >> 16
        z = 2 * qz + 1
        k = np.uint64(s)
        head = sums[k, 0]
        station = rest >> 16
        if station != head & 0xFFFF:
            sums[k, 7] = _changed(sums[k, 7], head & 0xFFFF, 2 * qx, 2 * qy, z, eyes)
        sums[k, 7] += 1 << 40
        sums[k, 0] = ((head >> 16) + 1) << 16 | station
        sums[k, 1] += 2 * qx + 1
        sums[k, 2] += 2 * qy + 1
        sums[k, 3] += z
        sums[k, 4] += z * z
        sums[k, 5] += (zrg >> 16 & 0xFF) << 32 | zrg >> 24
        sums[k, 6] += rest & 0xFF
    return sums, cells, used


@nb.njit(cache=True, nogil=True)
def _changed(kept, station, x, y, z, eyes):  # pyright: ignore
    """What is kept of a voxel's stations after the last point of one: 24 bits with the points of the one that goes on,
    now none, 24 bits with those of the one that has most so far, 16 bits with its number.
    """
    count = kept >> 40
    most = kept >> 16 & 0xFFFFFF
    best = kept & 0xFFFF
    if count == most and station < eyes.shape[0] and best < eyes.shape[0]:
        one = (eyes[station, 0] - x) ** 2 + (eyes[station, 1] - y) ** 2 + (eyes[station, 2] - z) ** 2
        other = (eyes[best, 0] - x) ** 2 + (eyes[best, 1] - y) ** 2 + (eyes[best, 2] - z) ** 2
        if one < other:
            return most << 16 | station
    return count << 16 | station if count > most else most << 16 | best
