"""The scan points near walls, read from the tiles on disk: surfels of 5 cm are too coarse for orthoimages of 1 cm.

Each tile is read once, those of one side of the building first. A wall's points are handed out as soon as the last
tile that it reaches into was read, so that few have to be held, and what are too many of them in a file.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from io import BufferedRandom
from pathlib import Path
from tempfile import TemporaryFile

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE, TileIndex, tile_runs
from scan2bim.errors import InputError
from scan2bim.geometry.arcs import Arc
from scan2bim.openings.within import stretch_bounds, within
from scan2bim.structure.shapes import WallShape

BAND = 0.12
"""Distance from a wall's faces, metres, up to which points are read: handles stand out 8 cm, trims 3."""
FOOT = 0.02
"""Metres below a wall's base down to which points are read."""
CELL = 0.1
"""Edge, metres, of the plan cells by which a point finds its walls."""
CELLS = round(TILE / CELL)
HELD = 1 << 20
"""Points held until they are sorted by wall: 16 bytes each."""
WAITING = 8 << 20
"""Sorted points that wait in memory for the rest of their walls, 12 bytes each; what are more go to a file."""
LINE = 10
"""Numbers of a wall's line."""
F32 = NDArray[np.float32]
Tile = tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Points of one wall in one ``tile``: ``words`` (count, 3) uint32, None where the file holds them meanwhile, from
    its point ``start`` on.
    """

    tile: Tile
    words: NDArray[np.uint32] | None
    count: int
    start: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class WallPoints:
    """Points near one wall: ``along`` its axis from its start, ``across`` it (to the left positive, 0 on the axis),
    ``up`` from its base, (n,) float32 metres; ``rgb`` (n, 3) uint8; ``station`` (n,) uint16. bounds: as of
    ``stretch_bounds``.
    """

    along: F32
    across: F32
    up: F32
    rgb: NDArray[np.uint8]
    station: NDArray[np.uint16]
    bounds: F32 = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bounds", stretch_bounds(self.along, self.up))

    def inside(self, left: float, right: float, bottom: float, top: float) -> WallPoints:
        """Those within a rectangle of the wall, metres."""
        rows = self._within(left, right, bottom, top)
        return WallPoints(self.along[rows], self.across[rows], self.up[rows], self.rgb[rows], self.station[rows])

    def stations_inside(self, left: float, right: float, bottom: float, top: float) -> NDArray[np.int64]:
        """How many of those are of each station (s,)."""
        return np.bincount(self.station[self._within(left, right, bottom, top)])

    def _within(self, left: float, right: float, bottom: float, top: float) -> NDArray[np.int64]:
        return np.asarray(within(self.along, self.up, self.bounds, np.array([left, right, bottom, top], np.float32)))


def points_by_wall(
    scan_folders: Sequence[Path], walls: Sequence[WallShape], folder: Path
) -> Iterator[tuple[int, WallPoints]]:
    """Each wall's place in ``walls`` and its points, from one side of the building to the other; a file without a name
    in ``folder`` holds them meanwhile where they are many.
    """
    lines = np.array([_line(wall) for wall in walls]).reshape(-1, LINE)
    indices = [TileIndex.load(path) for path in scan_folders]
    owners = [{tuple(t) for t in index.runs["tile"].tolist()} for index in indices]
    tiles = _tiles_of(lines, owners)
    last = {wall: place for place, (_, near) in enumerate(tiles) for wall in near}
    with TemporaryFile(dir=folder) as file:
        found = _Found(file, folder)
        for place, (tile, near) in enumerate(tiles):
            starts, members = _walls_by_cell(lines, near, tile)
            for index, own in zip(indices, owners, strict=True):
                if tile in own:
                    for run in tile_runs(index, np.array(tile, np.int32)):
                        found.add(run, lines, starts, members, tile)
            found.part(tile)
            for wall in near:
                if last[wall] == place:
                    yield wall, found.take(wall, lines[wall])
        for wall in range(len(walls)):
            if wall not in last:
                yield wall, found.take(wall, lines[wall])


def _line(wall: WallShape) -> tuple[float, ...]:
    """Start, direction of the chord, length, half of the thickness with the band, base and top of a wall, the curvature
    of its line and by how much that turns left from start to end.
    """
    reach, axis = wall.thickness / 2 + BAND, wall.axis
    return (*wall.start, *wall.chord[0].tolist(), axis.length, reach, wall.base, wall.top, axis.curvature, axis.angle)


def _arc_of(line: NDArray[np.float64]) -> Arc:
    """The arc of a wall's line."""
    half = line[9] / 2
    return Arc(line[4] * float(np.sin(half) / half) if half else line[4], float(np.tan(half / 2)))


@nb.njit(cache=True, nogil=True)
def _located(u, v, curvature, angle):  # pyright: ignore
    """How far along a wall's line and to the left of it a place lies, from its place along and left of the chord."""
    if curvature == 0.0:
        return u, v
    start = -angle / 2
    a, b = u + np.sin(start) / curvature, np.cos(start) / curvature - v
    turned = (np.arctan2(a * curvature, b * curvature) - start + np.pi - angle / 2) % (2 * np.pi) - np.pi + angle / 2
    return turned / curvature, 1.0 / curvature - np.sign(curvature) * np.hypot(a, b)


def _tiles_of(lines: NDArray[np.float64], owners: Sequence[set[tuple[int, ...]]]) -> list[tuple[Tile, list[int]]]:
    """The tiles with points that any of the walls reaches into, along the building's longer side, each with the numbers
    of these walls.
    """
    touched: dict[Tile, list[int]] = {}
    for k, (x, y, dx, dy, length, reach, base, top, *_) in enumerate(lines):
        places = np.append(np.arange(0.0, length, TILE / 16), length)
        path = np.array([x, y]) + _arc_of(lines[k]).place(places, np.zeros(len(places))) @ np.array(
            [[dx, dy], [-dy, dx]]
        )
        corners = (path[:, None] + np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * reach).reshape(-1, 2)
        layers = range(int(np.floor(base / TILE)), int(np.floor(top / TILE)) + 1)
        plan = {tuple(t) for t in np.floor(corners / TILE).astype(int).tolist()}
        for a, b in plan:
            for c in layers:
                touched.setdefault((a, b, c), []).append(k)
    found = [(tile, near) for tile, near in touched.items() if any(tile in own for own in owners)]
    spread = np.ptp(np.array([tile for tile, _ in found]).reshape(-1, 3)[:, :2], axis=0) if found else np.zeros(2)
    first = int(spread[1] > spread[0])
    return sorted(found, key=lambda one: (one[0][first], one[0]))


def _walls_by_cell(
    lines: NDArray[np.float64], near: Sequence[int], tile: Tile
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """For each plan cell of a tile where its walls, of those ``near``, begin in ``members``: starts
    (CELLS * CELLS + 1,), members (m,).
    """
    place = (np.arange(CELLS) + 0.5) * CELL
    x, y = np.meshgrid(place + tile[0] * TILE, place + tile[1] * TILE, indexing="ij")
    cells, members = [], []
    for k in near:
        x0, y0, dx, dy, length, reach, *_ = lines[k]
        flat = (x - x0) * dx + (y - y0) * dy, (y - y0) * dx - (x - x0) * dy
        along, across = _arc_of(lines[k]).locate(*flat)
        at = np.flatnonzero((np.abs(across) < reach + CELL) & (along > -CELL) & (along < length + CELL))
        cells.append(at)
        members.append(np.full(len(at), k))
    cell, member = np.concatenate(cells), np.concatenate(members)
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(CELLS * CELLS + 1)).astype(np.int32)
    return starts, member[order].astype(np.int32)


class _Found:
    """Takes the points of each run and hands out those that are near a wall; ``folder`` is that of the file."""

    def __init__(self, file: BufferedRandom, folder: Path) -> None:
        self._blocks: defaultdict[int, list[Block]] = defaultdict(list)
        self._file = file
        self._folder = folder
        self._written = 0
        self._waiting = 0
        self._used = 0
        self._owner = np.empty(HELD, np.int32)
        self._words = np.empty((HELD, 3), np.uint32)

    def add(
        self,
        run: NDArray[np.void],
        lines: NDArray[np.float64],
        starts: NDArray[np.int32],
        members: NDArray[np.int32],
        tile: Tile,
    ) -> None:
        """Take those of one run of a tile."""
        words = run.view(np.uint32).reshape(-1, 3)
        most = len(words) * int(np.diff(starts).max())
        if self._used + most > len(self._owner):
            self.part(tile)
        if most > len(self._owner):
            self._owner, self._words = np.empty(most, np.int32), np.empty((most, 3), np.uint32)
        origin = np.array(tile, np.float64) * TILE
        self._used = _near(words, origin, lines, starts, members, self._owner, self._words, self._used)

    def part(self, tile: Tile) -> None:
        """Sort what was taken of a tile by wall."""
        if not self._used:
            return
        walls, bounds, words = _parted(self._owner[: self._used], self._words[: self._used])
        for wall, (start, end) in zip(walls.tolist(), itertools.pairwise(bounds.tolist()), strict=True):
            self._blocks[wall].append(Block(tile, words[start:end].copy(), end - start))
        self._waiting += self._used
        self._used = 0
        if self._waiting > WAITING:
            self._write()

    def _write(self) -> None:
        """Put all that waits into the file."""
        self._file.seek(self._written * POINT.itemsize)
        for blocks in self._blocks.values():
            for place, block in enumerate(blocks):
                if block.words is not None:
                    self._file.write(block.words.data)
                    blocks[place] = replace(block, words=None, start=self._written)
                    self._written += block.count
        self._file.flush()
        self._waiting = 0

    def take(self, wall: int, line: NDArray[np.float64]) -> WallPoints:
        """The points of one wall, which are not held any longer."""
        blocks = sorted(self._blocks.pop(wall, []), key=lambda block: block.tile)
        n = sum(block.count for block in blocks)
        out = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.float32), np.empty((n, 3), np.uint8)
        station = np.empty(n, np.uint16)
        used = 0
        for block in blocks:
            if block.words is not None:
                self._waiting -= block.count
            _place(self._read(block), np.array(block.tile) * TILE, line, *out, station, used)
            used += block.count
        return WallPoints(*out, station)

    def _read(self, block: Block) -> NDArray[np.uint32]:
        """The points of a block (n, 3)."""
        if block.words is not None:
            return block.words
        words = np.empty((block.count, 3), np.uint32)
        self._file.seek(block.start * POINT.itemsize)
        if self._file.readinto(words.view(np.uint8).data) != words.nbytes:
            raise InputError(self._folder, "ends early: it was changed while it was read.", "Run again.")
        return words


@nb.njit(cache=True, nogil=True)
def _parted(owner, words):  # pyright: ignore
    """The walls (w,) that points (n,) belong to, ascending, the bounds (w + 1,) of each one's points among all, and
    those, in their order (n, 3).
    """
    counts = np.zeros(owner.max() + 1, np.int64)
    for k in owner:
        counts[k] += 1
    walls = np.flatnonzero(counts)
    bounds = np.zeros(len(walls) + 1, np.int64)
    bounds[1:] = np.cumsum(counts[walls])
    counts[walls] = bounds[:-1]
    out = np.empty_like(words)
    for i in range(len(owner)):
        j = counts[owner[i]]
        counts[owner[i]] += 1
        out[j, 0], out[j, 1], out[j, 2] = words[i, 0], words[i, 1], words[i, 2]
    return walls, bounds, out


@nb.njit(cache=True, nogil=True)
def _near(words, origin, lines, starts, members, owner, out, used):  # pyright: ignore
    """Add those of points (n, 3) uint32 of a tile at ``origin`` that are near walls, with the wall, from row ``used``
    on; a point near two walls comes twice. Gives the rows used then.
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
            u, v = dx * lines[k, 2] + dy * lines[k, 3], dy * lines[k, 2] - dx * lines[k, 3]
            along, across = _located(u, v, lines[k, 8], lines[k, 9])
            if abs(across) < lines[k, 5] and 0 < along < lines[k, 4] and lines[k, 6] - FOOT < z < lines[k, 7]:
                owner[used] = k
                out[used, 0], out[used, 1], out[used, 2] = words[i, 0], words[i, 1], words[i, 2]
                used += 1
    return used


@nb.njit(cache=True, nogil=True)
def _place(words, origin, line, along, across, up, rgb, station, first):  # pyright: ignore
    """Place points (n, 3) uint32 of a tile at ``origin`` along, across and up a wall, from row ``first`` on."""
    step = TILE / STEPS
    for i in range(words.shape[0]):
        dx = origin[0] + (np.int64(words[i, 0] & 0xFFFF) + 0.5) * step - line[0]
        dy = origin[1] + (np.int64(words[i, 0] >> 16) + 0.5) * step - line[1]
        z = origin[2] + (np.int64(words[i, 1] & 0xFFFF) + 0.5) * step
        j = first + i
        along[j], across[j] = _located(dx * line[2] + dy * line[3], dy * line[2] - dx * line[3], line[8], line[9])
        up[j] = z - line[6]
        rgb[j, 0] = words[i, 1] >> 16 & 0xFF
        rgb[j, 1] = words[i, 1] >> 24
        rgb[j, 2] = words[i, 2] & 0xFF
        station[j] = words[i, 2] >> 16
