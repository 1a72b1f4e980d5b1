"""The scan points near walls, read from the tiles on disk: surfels of 5 cm are too coarse for orthoimages of 1 cm.

Walls of one neighbourhood are read together, so that a tile is read a few times and not once for each of its walls, and
no more than one neighbourhood's points are held at a time.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE, TileIndex, tile_runs
from scan2bim.structure.shapes import WallShape

BAND = 0.12
"""Distance from a wall's faces, metres, up to which points are read: handles stand out 8 cm, trims 3."""
FOOT = 0.02
"""Metres below a wall's base down to which points are read."""
CELL = 0.1
"""Edge, metres, of the plan cells by which a point finds its walls."""
CELLS = round(TILE / CELL)
MOST_POINTS = 3_000_000
"""Points held at a time, but for one wall's: 22 bytes each, so 66 MB."""
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
    """Walls whose middles lie in one tile of the plan, parted where they have too many points together."""
    middle = np.array([(np.array(w.start) + np.array(w.end)) / 2 for w in walls]).reshape(-1, 2)
    tile = np.floor(middle / TILE).astype(np.int64)
    order = np.lexsort((np.arange(len(walls)), tile[:, 1], tile[:, 0]))
    batch: list[int] = []
    for w in order.tolist():
        full = batch and expected[batch].sum() + expected[w] > MOST_POINTS
        if batch and (full or (tile[w] != tile[batch[0]]).any()):
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
        self._parts: list[tuple[NDArray[np.int32], F32, NDArray[np.uint8], NDArray[np.uint16]]] = []

    def add(
        self,
        run: NDArray[np.void],
        lines: NDArray[np.float64],
        starts: NDArray[np.int32],
        members: NDArray[np.int32],
        tile: tuple[int, int, int],
    ) -> None:
        raw = run.view(np.uint8).reshape(-1, POINT.itemsize)
        owner, place, rgb, station = _near(raw, np.array(tile, np.float64) * TILE, lines, starts, members)
        if len(owner):
            self._parts.append((owner, place, rgb, station))

    def by_wall(self, count: int) -> list[WallPoints]:
        """The points of each of the ``count`` walls."""
        if not self._parts:
            none = np.zeros(0, np.float32)
            return [WallPoints(none, none, none, np.zeros((0, 3), np.uint8), np.zeros(0, np.uint16))] * count
        owner, place, rgb, station = (np.concatenate(p) for p in zip(*self._parts, strict=True))
        self._parts.clear()
        order = np.argsort(owner, kind="stable")
        bounds = np.searchsorted(owner[order], np.arange(count + 1))
        out: list[WallPoints] = []
        for first, last in itertools.pairwise(bounds.tolist()):
            at = order[first:last]
            along, across, up = place[at].T
            out.append(
                WallPoints(np.ascontiguousarray(along), np.ascontiguousarray(across), up.copy(), rgb[at], station[at])
            )
        return out


@nb.njit(cache=True, nogil=True)
def _near(raw, origin, lines, starts, members):  # pyright: ignore
    """Of points (n, 12) uint8 of a tile at ``origin`` those near walls: wall (m,), along, across and up (m, 3), colour
    (m, 3) and station (m,); a point near two walls comes twice.
    """
    step = TILE / STEPS
    room = 0
    for i in range(raw.shape[0]):
        cell = _cell(raw, i)
        room += starts[cell + 1] - starts[cell]
    owner = np.empty(room, np.int32)
    place = np.empty((room, 3), np.float32)
    rgb = np.empty((room, 3), np.uint8)
    station = np.empty(room, np.uint16)
    used = 0
    for i in range(raw.shape[0]):
        cell = _cell(raw, i)
        if starts[cell] == starts[cell + 1]:
            continue
        x = origin[0] + ((np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8) + 0.5) * step
        y = origin[1] + ((np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8) + 0.5) * step
        z = origin[2] + ((np.int64(raw[i, 4]) | np.int64(raw[i, 5]) << 8) + 0.5) * step
        for m in range(starts[cell], starts[cell + 1]):
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
                rgb[used] = raw[i, 6:9]
                station[used] = np.uint16(raw[i, 10]) | np.uint16(raw[i, 11]) << 8
                used += 1
    return owner[:used].copy(), place[:used].copy(), rgb[:used].copy(), station[:used].copy()


@nb.njit(cache=True, nogil=True, inline="always")
def _cell(raw, i):  # pyright: ignore
    """The plan cell of a point."""
    qx = np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8
    qy = np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8
    return (qx * CELLS >> 16) * CELLS + (qy * CELLS >> 16)
