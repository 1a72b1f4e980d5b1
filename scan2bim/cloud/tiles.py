"""Points of one scan on disk, grouped by tile, in 12 bytes each.

A tile is a cube of 8 m in the building's local frame. Coordinates in it are uint16 in steps of 8 m / 65536 = 0.12 mm,
far below the noise of any scanner. A scan's points lie in one file, chunk after chunk, each chunk sorted by tile; the
index says which run of records belongs to which tile.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import InputError

TILE = 8.0
"""Edge of a tile, metres: small enough for dense grids in a tile (5 cm: 2 M cells), large enough to keep the index
short.
"""
STEPS = 65_536
POINT = np.dtype(
    [("x", "<u2"), ("y", "<u2"), ("z", "<u2"), ("r", "u1"), ("g", "u1"), ("b", "u1"), ("i", "u1"), ("station", "<u2")]
)
RUN = np.dtype([("tile", "<i4", (3,)), ("start", "<i8"), ("count", "<i8")])
SAMPLE = "sample"
"""Name of the folder below a scan's, in which some of its points lie in the same way."""
MAX_TILES_A_CHUNK = 65_536
TABLE = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class TileIndex:
    """Which runs of a scan's point file belong to which tile: records of dtype RUN, sorted by tile."""

    path: Path
    runs: NDArray[np.void]

    @staticmethod
    def load(folder: Path) -> TileIndex:
        """Of the scan whose results lie in ``folder``."""
        return TileIndex(folder / "points.bin", np.load(folder / "runs.npy"))


class TileWriter:
    """Writes a scan's points; a context manager. ``add`` takes local coordinates (n, 3) float32.

    ``source`` is the file that they come from, for errors.
    """

    def __init__(self, folder: Path, source: Path | None = None) -> None:
        self._folder = folder
        self._source = source or folder
        self._runs: list[NDArray[np.void]] = []
        self._written = 0

    def __enter__(self) -> TileWriter:
        self._file = (self._folder / "points.bin").open("wb")
        return self

    def __exit__(self, *exc: object) -> None:
        self._file.close()
        if exc[0] is None:
            runs = np.concatenate(self._runs) if self._runs else np.zeros(0, RUN)
            order = np.lexsort((runs["start"], runs["tile"][:, 2], runs["tile"][:, 1], runs["tile"][:, 0]))
            np.save(self._folder / "runs.npy", runs[order])

    def add(
        self, local: NDArray[np.float32], rgb: NDArray[np.uint8], grey: NDArray[np.uint8], station: NDArray[np.uint16]
    ) -> None:
        """Append a chunk: colour (n, 3) uint8, grey (n,) uint8 intensity, station (n,) uint16.

        Raises InputError where the points spread farther than any building.
        """
        slots, keys, counts = _group(local, np.float32(1.0 / TILE))
        if len(keys) > MAX_TILES_A_CHUNK:
            raise InputError(
                self._source,
                f"its points spread over more than {MAX_TILES_A_CHUNK:,} cubes of {TILE:g} m: in this unit they are "
                "not those of a building.",
                "Check the coordinates with `scan2bim info`, and give their unit with --unit.",
            )
        starts = np.concatenate([[0], np.cumsum(counts)])[:-1]
        records = np.empty(len(local), POINT)
        words = records.view(np.uint32).reshape(-1, 3)
        _scatter(
            local, rgb, grey, station, slots, starts.copy(), np.float32(STEPS / TILE), keys, np.float32(TILE), words
        )
        self._file.write(records.data)
        runs = np.zeros(len(keys), RUN)
        runs["tile"], runs["start"], runs["count"] = keys, self._written + starts, counts
        self._runs.append(runs)
        self._written += len(local)


def tile_runs(index: TileIndex, tile: NDArray[np.int32]) -> Iterator[NDArray[np.void]]:
    """The points of one scan in one tile, dtype POINT, run by run; each is overwritten by the next."""
    runs = index.runs[(index.runs["tile"] == tile).all(1)]
    buffer = np.empty(int(runs["count"].max(initial=0)), POINT)
    with index.path.open("rb", buffering=0) as file:
        for run in runs:
            part = buffer[: int(run["count"])]
            file.seek(int(run["start"]) * POINT.itemsize)
            if file.readinto(part.view(np.uint8).data) != part.nbytes:
                raise InputError(index.path, "ends early: it was changed while it was read.", "Run again.")
            yield part


def read_tile(index: TileIndex, tile: NDArray[np.int32]) -> NDArray[np.void]:
    """All points of one scan in one tile, dtype POINT (n,)."""
    return np.concatenate([np.zeros(0, POINT), *(run.copy() for run in tile_runs(index, tile))])


@nb.njit(cache=True, nogil=True)
def _group(local, inverse):  # pyright: ignore
    """Slot of each point's tile (n,), the tiles' keys (t, 3) and their point counts (t,); stops beyond
    MAX_TILES_A_CHUNK tiles.
    """
    n = local.shape[0]
    slots = np.empty(n, np.int32)
    keys = np.empty((1024, 3), np.int32)
    counts = np.zeros(1024, np.int64)
    table = np.full(TABLE, -1, np.int32)
    used = 0
    i = 0
    while i < n and used <= MAX_TILES_A_CHUNK:
        corner = (np.floor(local[i, 0] * inverse), np.floor(local[i, 1] * inverse), np.floor(local[i, 2] * inverse))
        key = (np.int32(corner[0]), np.int32(corner[1]), np.int32(corner[2]))
        slot, place = _look_up(key, keys, table)
        if slot < 0:
            if used == keys.shape[0]:
                keys = np.concatenate((keys, np.empty_like(keys)))
                counts = np.concatenate((counts, np.zeros_like(counts)))
            slot = used
            used += 1
            table[place] = slot
            keys[slot, 0], keys[slot, 1], keys[slot, 2] = key
        run = _run(local, i, inverse, corner, slot, slots)
        counts[slot] += run
        i += run
    return slots, keys[:used].copy(), counts[:used].copy()


@nb.njit(cache=True, nogil=True)
def _look_up(key, keys, table):  # pyright: ignore
    """Slot of a tile, -1 if it has none, and where in the table of slots it stands or should."""
    place = (key[0] * 73_856_093 ^ key[1] * 19_349_663 ^ key[2] * 83_492_791) & (TABLE - 1)
    while table[place] >= 0:
        slot = table[place]
        if keys[slot, 0] == key[0] and keys[slot, 1] == key[1] and keys[slot, 2] == key[2]:
            return slot, place
        place = (place + 1) & (TABLE - 1)
    return -1, place


@nb.njit(cache=True, nogil=True)
def _run(local, first, inverse, corner, slot, slots):  # pyright: ignore
    """How many points from the first on lie in the tile at ``corner``, one at least; they get its slot."""
    one = np.float32(1.0)
    x, y, z = corner
    begin = np.uint64(first)
    slots[begin] = slot
    for i in range(begin + np.uint64(1), np.uint64(local.shape[0])):
        u = local[i, 0] * inverse
        v = local[i, 1] * inverse
        w = local[i, 2] * inverse
        if not ((u >= x) & (u < x + one) & (v >= y) & (v < y + one) & (w >= z) & (w < z + one)):
            return np.int64(i) - first
        slots[i] = slot
    return local.shape[0] - first


@nb.njit(cache=True, nogil=True)
def _scatter(local, rgb, grey, station, slots, at, scale, keys, tile, out):  # pyright: ignore
    """Write each point as 3 little-endian words (the 12 bytes of POINT) at its tile's next place, to ``out`` (n, 3)
    uint32; ``at`` (t,) are the first places.
    """
    for i in range(np.uint64(local.shape[0])):
        s = np.uint64(slots[i])
        j = np.uint64(at[s])
        at[s] += 1
        x = min(max(int((local[i, 0] - keys[s, 0] * tile) * scale), 0), 65_535)
        y = min(max(int((local[i, 1] - keys[s, 1] * tile) * scale), 0), 65_535)
        z = min(max(int((local[i, 2] - keys[s, 2] * tile) * scale), 0), 65_535)
        out[j, 0] = x | y << 16
        out[j, 1] = z | int(rgb[i, 0]) << 16 | int(rgb[i, 1]) << 24
        out[j, 2] = int(rgb[i, 2]) | int(grey[i]) << 8 | int(station[i]) << 16
