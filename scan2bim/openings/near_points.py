"""The scan points near walls, read from the tiles on disk: surfels of 5 cm are too coarse for orthoimages of 1 cm.

Walls of one neighbourhood are read together, so that a tile is read a few times and not once for each of its walls, and
no more than one neighbourhood's points are held at a time.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import STEPS, TILE, TileIndex, tile_runs
from scan2bim.structure.shapes import WallShape

BAND = 0.12
"""Distance from a wall's faces, metres, up to which points are read: handles stand out 8 cm, trims 3."""
FOOT = 0.02
"""Metres below a wall's base down to which points are read."""
CELL = 0.1
"""Edge, metres, of the plan cells by which a point finds its walls."""
CELLS = round(TILE / CELL)
MOST_POINTS = 2_000_000
"""Points held at a time, but for one wall's: 22 bytes each and twice while they are sorted, so 88 MB."""
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WallPoints:
    """Points near one wall: ``along`` its axis from its start, ``across`` it (to the left positive, 0 on the axis),
    ``up`` from its base, (n,) float32 metres; ``rgb`` (n, 3) uint8; ``station`` (n,) uint16.
    """

    along: F32
    across: F32
    up: F32
    rgb: NDArray[np.uint8]
    station: NDArray[np.uint16]

    def pick(self, keep: NDArray[np.bool_]) -> WallPoints:
        """Those of a mask (n,)."""
        rows = np.flatnonzero(keep)
        return WallPoints(self.along[rows], self.across[rows], self.up[rows], self.rgb[rows], self.station[rows])


def points_by_wall(
    scan_folders: Sequence[Path], walls: Sequence[WallShape], expected: NDArray[np.int64]
) -> Iterator[tuple[int, WallPoints]]:
    """Each wall's place in ``walls`` and its points, neighbourhood by neighbourhood.

    ``expected`` (w,) are the points that each wall has, roughly: how many are read at a time hangs on it.
    """
    indices = [TileIndex.load(folder) for folder in scan_folders]
    owners = [{tuple(t) for t in index.runs["tile"].tolist()} for index in indices]
    for batch in _neighbourhoods(walls, expected):
        lines = np.array([_line(walls[w]) for w in batch])
        found = _Found()
        for tile in _tiles_of(lines, owners):
            starts, members = _walls_by_cell(lines, tile)
            for index, own in zip(indices, owners, strict=True):
                if tile in own:
                    for run in tile_runs(index, np.array(tile, np.int32)):
                        found.add(run, lines, starts, members, tile)
        yield from ((batch[k], points) for k, points in enumerate(found.by_wall(len(batch))))


def _line(wall: WallShape) -> tuple[float, ...]:
    """Start, direction, length, half of the thickness with the band, base and top of a wall."""
    start, end = np.array(wall.start), np.array(wall.end)
    length = float(np.linalg.norm(end - start))
    direction = (end - start) / max(length, 1e-9)
    return (*start, *direction, length, wall.thickness / 2 + BAND, wall.base, wall.top)


def _neighbourhoods(walls: Sequence[WallShape], expected: NDArray[np.int64]) -> Iterator[list[int]]:
    """Walls of neighbouring tiles of the plan, as many as do not have too many points together: the more, the fewer
    tiles are read again.
    """
    middle = np.array([(np.array(w.start) + np.array(w.end)) / 2 for w in walls]).reshape(-1, 2)
    tile = np.floor(middle / TILE).astype(np.int64)
    order = np.lexsort((np.arange(len(walls)), tile[:, 1], tile[:, 0]))
    batch: list[int] = []
    for w in order.tolist():
        if batch and expected[batch].sum() + expected[w] > MOST_POINTS:
            yield batch
            batch = []
        batch.append(w)
    if batch:
        yield batch


def _tiles_of(lines: NDArray[np.float64], owners: Sequence[set[tuple[int, ...]]]) -> list[tuple[int, int, int]]:
    """The tiles with points that any of the walls reaches into, in order."""
    touched: set[tuple[int, int, int]] = set()
    for x, y, dx, dy, length, reach, base, top in lines:
        places = np.append(np.arange(0.0, length, TILE / 16), length)
        path = np.array([x, y]) + places[:, None] * np.array([dx, dy])
        corners = (path[:, None] + np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * reach).reshape(-1, 2)
        layers = range(int(np.floor(base / TILE)), int(np.floor(top / TILE)) + 1)
        plan = {tuple(t) for t in np.floor(corners / TILE).astype(int).tolist()}
        touched.update((a, b, c) for a, b in plan for c in layers)
    return sorted(t for t in touched if any(t in own for own in owners))


def _walls_by_cell(
    lines: NDArray[np.float64], tile: tuple[int, int, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """For each plan cell of a tile where its walls begin in ``members``: starts (CELLS * CELLS + 1,), members (m,)."""
    place = (np.arange(CELLS) + 0.5) * CELL
    x, y = np.meshgrid(place + tile[0] * TILE, place + tile[1] * TILE, indexing="ij")
    cells, members = [], []
    for k, (x0, y0, dx, dy, length, reach, _, _) in enumerate(lines):
        along, across = (x - x0) * dx + (y - y0) * dy, (y - y0) * dx - (x - x0) * dy
        near = (np.abs(across) < reach + CELL) & (along > -CELL) & (along < length + CELL)
        at = np.flatnonzero(near)
        cells.append(at)
        members.append(np.full(len(at), k))
    cell, member = np.concatenate(cells), np.concatenate(members)
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(CELLS * CELLS + 1)).astype(np.int32)
    return starts, member[order].astype(np.int32)


class _Found:
    """Grows by the points of each run."""

    def __init__(self) -> None:
        self._used = 0
        self._owner = np.empty(0, np.int32)
        self._place = np.empty((0, 3), np.float32)
        self._rgb = np.empty((0, 3), np.uint8)
        self._station = np.empty(0, np.uint16)

    def add(
        self,
        run: NDArray[np.void],
        lines: NDArray[np.float64],
        starts: NDArray[np.int32],
        members: NDArray[np.int32],
        tile: tuple[int, int, int],
    ) -> None:
        words = run.view(np.uint32).reshape(-1, 3)
        self._make_room(len(words) * int(np.diff(starts).max()))
        out = self._owner, self._place, self._rgb, self._station
        self._used = _near(words, np.array(tile, np.float64) * TILE, lines, starts, members, *out, self._used)

    def _make_room(self, more: int) -> None:
        """For so many points more, at the most; what is not used of it takes no memory."""
        if self._used + more > len(self._owner):
            size = 2 * (self._used + more)
            self._owner, self._place = self._longer(self._owner, size), self._longer(self._place, size)
            self._rgb, self._station = self._longer(self._rgb, size), self._longer(self._station, size)

    def _longer(self, part: NDArray[Any], size: int) -> NDArray[Any]:
        longer = np.empty((size, *part.shape[1:]), part.dtype)
        longer[: self._used] = part[: self._used]
        return longer

    def by_wall(self, count: int) -> list[WallPoints]:
        """The points of each of the ``count`` walls."""
        used = slice(self._used)
        bounds, along, across, up, rgb, station = _parted(
            self._owner[used], self._place[used], self._rgb[used], self._station[used], count
        )
        return [
            WallPoints(along[a:b], across[a:b], up[a:b], rgb[a:b], station[a:b])
            for a, b in itertools.pairwise(bounds.tolist())
        ]


@nb.njit(cache=True, nogil=True)
def _parted(owner, place, rgb, station, count):  # pyright: ignore
    """Bounds (count + 1,) of each wall's points, then their along, across, up (n,), colour (n, 3) and station (n,)."""
    bounds = np.zeros(count + 1, np.int64)
    for k in owner:
        bounds[k + 1] += 1
    bounds = np.cumsum(bounds)
    at = bounds[:-1].copy()
    n = len(owner)
    along, across, up = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.float32)
    colour, number = np.empty((n, 3), np.uint8), np.empty(n, np.uint16)
    for i in range(n):
        j = at[owner[i]]
        at[owner[i]] += 1
        along[j], across[j], up[j] = place[i, 0], place[i, 1], place[i, 2]
        colour[j, 0], colour[j, 1], colour[j, 2] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
        number[j] = station[i]
    return bounds, along, across, up, colour, number


@nb.njit(cache=True, nogil=True)
def _near(words, origin, lines, starts, members, owner, place, rgb, station, used):  # pyright: ignore
    """Add those of points (n, 3) uint32 of a tile at ``origin`` that are near walls: wall, along, across and up, colour
    and station, from row ``used`` on; a point near two walls comes twice. Gives the rows used then.
    """
    step = TILE / STEPS
    for i in range(np.uint64(words.shape[0])):
        qx, qy = np.int64(words[i, 0] & 0xFFFF), np.int64(words[i, 0] >> 16)
        cell = (qx * CELLS >> 16) * CELLS + (qy * CELLS >> 16)
        first, last = starts[cell], starts[cell + 1]
        if first == last:
            continue
        x = origin[0] + (qx + 0.5) * step
        y = origin[1] + (qy + 0.5) * step
        z = origin[2] + (np.int64(words[i, 1] & 0xFFFF) + 0.5) * step
        for m in range(first, last):
            k = members[m]
            dx = x - lines[k, 0]
            dy = y - lines[k, 1]
            along = dx * lines[k, 2] + dy * lines[k, 3]
            across = dy * lines[k, 2] - dx * lines[k, 3]
            if abs(across) < lines[k, 5] and 0 < along < lines[k, 4] and lines[k, 6] - FOOT < z < lines[k, 7]:
                owner[used] = k
                place[used, 0] = along
                place[used, 1] = across
                place[used, 2] = z - lines[k, 6]
                rgb[used, 0] = words[i, 1] >> 16 & 0xFF
                rgb[used, 1] = words[i, 1] >> 24
                rgb[used, 2] = words[i, 2] & 0xFF
                station[used] = words[i, 2] >> 16
                used += 1
    return used
