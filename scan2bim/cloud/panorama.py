"""Depth panorama of a station: what it saw, by direction (design: the memory of the station).

A cube map: six square faces of ``edge`` x ``edge`` cells round the station, axes parallel to the building's local
frame. Each cell keeps the nearest range seen in it, or marks that a pulse went out and nothing came back. Cube faces
need no trigonometry and their cells differ in solid angle by a factor of five at most.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.lattice import Lattice

F32 = NDArray[np.float32]
UNSEEN = np.float32(0.0)
NO_RETURN = np.float32(-1.0)
RANGE_STEP = 0.002
"""Ranges are kept on disk in steps of 2 mm (uint16, so up to 131 m): below the noise of any scanner at any range."""
ASLANT = 0.1
"""Share by which inverse depths of neighbouring cells may differ from those of a plane: where in a cell of a third of a
degree a pulse went blurs them by so much on floors that are seen at 3 degrees."""

AT_A_TIME = 512
"""Points of which first the cells and then the ranges are found."""
MOST_KEPT = 64 << 20
"""Bytes of ranges read from files that stay in memory: those of the stations round a place, not of the building."""


class Panorama:
    """Position (3,) float64 in the local frame and ranges (6, edge, edge) float32 in metres; 0 unseen, -1 no return.

    The ranges of one that was loaded are read when they are asked for, and again where that was long ago.
    """

    __slots__ = ("_source", "_turn", "position")

    def __init__(
        self,
        position: NDArray[np.float64],
        ranges: F32 | tuple[str, int],
        turn: NDArray[np.float64] | None = None,
    ) -> None:
        self.position = position
        self._source = ranges
        self._turn = turn

    def turned(self, lattice: Lattice) -> Panorama:
        """The same in a lattice's own coordinates; to be asked by ``said``, or in the axes of its ``cube``."""
        return Panorama(lattice.own(self.position[None])[0], self._source, lattice.axes)

    def said(self, points: F32, margin: np.float32, misses: bool = False) -> NDArray[np.uint8]:
        """What ``seen_through`` says of points (n, 3)."""
        turned = self.cube(points) if self._turn is not None else points
        return seen_through(turned, self.cube(self.position[None])[0].astype(np.float32), self.ranges, margin, misses)

    def cube(self, points: NDArray[Any]) -> NDArray[Any]:
        """Points or directions (n, 2) or (n, 3), along the axes of its cells."""
        if self._turn is None:
            return points
        return np.concatenate([points[:, :2] @ self._turn.astype(points.dtype), points[:, 2:]], axis=1)

    @property
    def ranges(self) -> F32:
        """Metres, (6, edge, edge)."""
        return _recent.ranges(self._source) if isinstance(self._source, tuple) else self._source

    @property
    def step(self) -> float:
        """Angle, radians, between two pulses, or more where those are finer than the cells need."""
        if not isinstance(self._source, tuple):
            return 1.0 / self._source.shape[1]
        with Path(self._source[0]).open("rb") as file:
            np.load(file)
            np.lib.format.read_magic(file)
            return 1.0 / np.lib.format.read_array_header_1_0(file)[0][1]

    def save(self, path: Path) -> None:
        """Write position and uint16 ranges as numpy arrays, one after the other."""
        steps = np.clip(np.rint(self.ranges / RANGE_STEP), 0, 65_534).astype(np.uint16)
        steps[self.ranges == NO_RETURN] = 65_535
        with path.open("wb") as file:
            np.save(file, self.position)
            np.save(file, steps)

    @staticmethod
    def load(path: Path) -> Panorama:
        """What ``save`` wrote."""
        with path.open("rb") as file:
            return Panorama(np.load(file), (str(path), path.stat().st_mtime_ns))


class _Recent:
    """The ranges that were read last, MOST_KEPT bytes of them."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[str, int], F32] = OrderedDict()
        steps = np.arange(65_536, dtype=np.float32) * np.float32(RANGE_STEP)
        steps[65_535] = NO_RETURN
        self._metres = steps

    def ranges(self, key: tuple[str, int]) -> F32:
        """Of the panorama that was saved there, then."""
        if key not in self._kept:
            with Path(key[0]).open("rb") as file:
                np.load(file)
                self._kept[key] = self._metres[np.load(file)]
            while sum(ranges.nbytes for ranges in self._kept.values()) > MOST_KEPT and len(self._kept) > 1:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


_recent = _Recent()


def edge_for(step: float, limit: int) -> int:
    """Cells along a cube edge so that each holds at least one pulse, with ``step`` radians between pulses."""
    return int(np.clip(2.0 / max(step, 1e-4) * 0.5, 48, limit))


@nb.njit(cache=True, nogil=True, inline="always")
def cube_cell(dx, dy, dz, edge):  # pyright: ignore
    """Face, row and column of the cube map for a direction (any length)."""
    ax = abs(dx)
    ay = abs(dy)
    az = abs(dz)
    if ax >= ay and ax >= az:
        face = 0 if dx > 0 else 1
        m = ax
        u = dy
        v = dz
    elif ay >= az:
        face = 2 if dy > 0 else 3
        m = ay
        u = dx
        v = dz
    else:
        face = 4 if dz > 0 else 5
        m = az
        u = dx
        v = dy
    if m <= 0.0:
        return 0, 0, 0
    s = 0.5 * edge / m
    a = min(int(u * s + 0.5 * edge), edge - 1)
    b = min(int(v * s + 0.5 * edge), edge - 1)
    return face, a, b


@nb.njit(cache=True, nogil=True, inline="always")
def _place_of(dx, dy, dz, edge):  # pyright: ignore
    """The number of the cell that ``cube_cell`` gives among all, found without branches: of many at a time."""
    ax = abs(dx)
    ay = abs(dy)
    az = abs(dz)
    on_x = (ax >= ay) & (ax >= az)
    on_y = ay >= az
    m = ax if on_x else ay if on_y else az
    w = dx if on_x else dy if on_y else dz
    u = dy if on_x else dx
    v = dz if on_x | on_y else dy
    face = (0 if on_x else 2 if on_y else 4) + (0 if w > 0 else 1)
    s = 0.5 * edge / (m if m > 0.0 else 1.0)
    a = min(int(u * s + 0.5 * edge), edge - 1)
    b = min(int(v * s + 0.5 * edge), edge - 1)
    return (face * edge + a) * edge + b if m > 0.0 else 0


@nb.njit(cache=True, nogil=True, error_model="numpy")
def add_hits(local, position, ranges):  # pyright: ignore
    """Keep the nearest range of points ``local`` (n, 3) float32 in ``ranges`` (6, edge, edge); in place.

    Gives how many points lie clearly before or behind what was already seen in their direction: few for a scan, which
    sees one surface in each direction, many for a cloud that was not taken from this position.
    """
    edge = ranges.shape[1]
    flat = ranges.reshape(-1)
    n, block = np.uint64(local.shape[0]), np.uint64(AT_A_TIME)
    cell, away = np.empty(AT_A_TIME, np.uint32), np.empty(AT_A_TIME, np.float32)
    layered = 0
    for first in range(np.uint64(0), n, block):
        count = min(block, n - first)
        for j in range(count):
            dx = local[first + j, 0] - position[0]
            dy = local[first + j, 1] - position[1]
            dz = local[first + j, 2] - position[2]
            cell[j] = _place_of(dx, dy, dz, edge)
            away[j] = np.sqrt(dx * dx + dy * dy + dz * dz)
        for j in range(count):
            r = away[j]
            old = flat[cell[j]]
            layered += (old > 0.0) & (abs(r - old) > 0.15 * r + 0.1)
            flat[cell[j]] = r if (old <= 0.0) | (r < old) else old
    return layered


@nb.njit(cache=True, nogil=True)
def add_misses(directions, ranges):  # pyright: ignore
    """Mark cells that only pulses without return went through; directions (m, 3) float32 in the local frame."""
    edge = ranges.shape[1]
    for i in range(directions.shape[0]):
        f, a, b = cube_cell(directions[i, 0], directions[i, 1], directions[i, 2], edge)
        if ranges[f, a, b] == 0.0:
            ranges[f, a, b] = -1.0


@nb.njit(cache=True, nogil=True)
def seen_through(points, position, ranges, margin, misses=False):  # pyright: ignore
    """What a station says of each of ``points`` (n, 3) float32: 1 looked through it, 2 saw it, 3 was blocked before it,
    0 nothing.

    ``margin`` in metres is the half-width of "saw it". With ``misses``, a pulse that did not return went through: into
    the open, but a black or polished surface swallows pulses, too.
    """
    out = np.zeros(points.shape[0], np.uint8)
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        dz = points[i, 2] - position[2]
        f, a, b = cube_cell(dx, dy, dz, edge)
        r = ranges[f, a, b]
        if r == 0.0:
            continue
        d = np.sqrt(dx * dx + dy * dy + dz * dz)
        if r > d + margin:
            out[i] = 1
        elif r >= d - margin:
            out[i] = 2
        elif r > 0.0:
            out[i] = 3
        elif misses:
            out[i] = 1
    return out


@nb.njit(cache=True, nogil=True)
def _agreeing(points, position, ranges, out):  # pyright: ignore
    """Share of the 5 x 5 cells round each point's direction whose range is like the point's own; into ``out`` (n,)."""
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        dz = points[i, 2] - position[2]
        f, a, b = cube_cell(dx, dy, dz, edge)
        d = np.sqrt(dx * dx + dy * dy + dz * dz)
        seen = 0
        alike = 0
        for u in range(max(a - 2, 0), min(a + 3, edge)):
            for v in range(max(b - 2, 0), min(b + 3, edge)):
                r = ranges[f, u, v]
                if r == 0.0:
                    continue
                seen += 1
                if abs(r - d) < 0.1 * d + 0.1:
                    alike += 1
        out[i] = alike / seen if seen > 0 else 1.0
        if out[i] < 0.5:
            out[i] = max(out[i], _aslant(ranges, f, a, b, d))


@nb.njit(cache=True, nogil=True, inline="always")
def _aslant(ranges, face, a, b, distance):  # pyright: ignore
    """Share of the four lines of five cells through a cell along which what was seen lies in one plane with a point in
    it, at a ``distance`` from the station: the inverse of the depth is linear over a side of the cube.
    """
    edge = ranges.shape[1]
    planar = 0
    if a < 2 or b < 2 or a > edge - 3 or b > edge - 3:
        return 0.0
    own = _stretch(a, b, edge) / distance
    for step in range(4):
        da, db = (1, 0) if step == 0 else (0, 1) if step == 1 else (1, 1) if step == 2 else (1, -1)
        first, last = ranges[face, a - 2 * da, b - 2 * db], ranges[face, a + 2 * da, b + 2 * db]
        if first <= 0.0 or last <= 0.0:
            continue
        low, high = _stretch(a - 2 * da, b - 2 * db, edge) / first, _stretch(a + 2 * da, b + 2 * db, edge) / last
        fits = abs((low + high) / 2 - own) < ASLANT * own
        for k in (-1, 1):
            r = ranges[face, a + k * da, b + k * db]
            w = _stretch(a + k * da, b + k * db, edge) / r if r > 0.0 else 0.0
            fits &= abs(w - own - k * (high - low) / 4) < ASLANT * own
        planar += fits
    return planar / 4


@nb.njit(cache=True, nogil=True, inline="always")
def _stretch(a, b, edge):  # pyright: ignore
    """Range along a cell's middle for each metre of depth along its side's axis."""
    u, v = (2 * a + 1) / edge - 1, (2 * b + 1) / edge - 1
    return np.sqrt(1 + u * u + v * v)


def agreement(points: F32, station: NDArray[np.uint16], panoramas: Mapping[int, Panorama]) -> F32:
    """How far each point (n, 3) agrees with what its own station saw round it, (n,) in 0-1; 1 where the station is
    unknown.

    A surface fills its neighbourhood. A point that hangs alone before or behind what its neighbours saw is a mixed
    pixel, a reflection in a pane, dust, or a thin thing: nothing to build walls from.
    """
    share = np.ones(len(points), np.float32)
    order = np.argsort(station, kind="stable")
    numbers, starts = np.unique(station[order], return_index=True)
    for number, start, end in zip(numbers, starts, np.append(starts[1:], len(order)), strict=True):
        panorama = panoramas.get(int(number))
        if panorama is None:
            continue
        at = order[start:end]
        out = np.zeros(len(at), np.float32)
        _agreeing(np.ascontiguousarray(points[at]), panorama.position.astype(np.float32), panorama.ranges, out)
        share[at] = out
    return share
