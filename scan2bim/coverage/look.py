"""What points and stations say of each cell of the panels: seen, looked through, or blocked by something before it."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.cloud.surfels import Surfels
from scan2bim.coverage.panels import Panels
from scan2bim.coverage.rooms import INSIDE, PIXEL, Rooms

F64 = NDArray[np.float64]

BEHIND, BEFORE = 0.04, 0.06
"""Metres behind and before a face within which points lie on it: noise and plaster; skirting boards and trims."""
FLAT = 0.03
"""Metres within which points count for the deviation from the face: what stands out more is a trim."""
SPREAD = 0.0125
"""Metres round a surfel within which cells are seen: a quarter of its voxel. Voxels may lie half a cell off the
cells all along a wall, and some cells would be left out between.
"""
FARTHEST = 20.0
"""Metres from which on a station is not asked: its panorama's cells are wider than a face's there."""
STEEPEST = 0.12
"""Cosine of the angle between ray and normal below which a face is seen edge-on: ranges say nothing of it."""
MARGIN, THROUGH = 0.05, 0.10
"""Metres before and behind a face, across it, between which a ray that ends has seen it."""
CLOSE = 0.3
"""Metres before a face within which what blocks a ray stands before the face itself, as a flat cupboard does."""
STRIDE = 0.10
"""Metres between the places at which the line from what blocks a ray to the cell is looked at."""
ENDS = 0.15
"""Metres before the cell at which that line ends: the cell's own wall may be drawn a little off."""
BIN = 4
"""Pixels of the rooms' raster, 20 cm, along an edge of the bins by which points find panels."""
REACH = 0.15
"""Metres from a wall's face within which bins know of it: more than BEFORE, and a bin's rounding."""

SEEN, LOOKED_THROUGH, BLOCKED = 1, 2, 4
"""Bits of a cell: points lie in it or a ray ended there; a ray went on behind it; a ray that would have met it was
blocked by what is not part of the building."""


@dataclass(frozen=True, slots=True, eq=False)
class Bins:
    """By bins in plan, the panels near: ``starts`` (n + 1,), ``members`` (m,) int32, ``columns`` bins in a row."""

    starts: NDArray[np.int64]
    members: NDArray[np.int32]
    columns: int


def bins_of(panels: Panels, rooms: Rooms) -> Bins:
    """Bins over the raster of the rooms."""
    rows, cols = (n // BIN + 1 for n in rooms.space.shape)
    owners, keys = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for p in range(len(panels)):
        key = _bins_near(panels, p, rooms, rows, cols)
        owners.append(np.full(len(key), p))
        keys.append(key)
    key, owner = np.concatenate(keys), np.concatenate(owners)
    order = np.argsort(key, kind="stable")
    starts = np.searchsorted(key[order], np.arange(rows * cols + 1)).astype(np.int64)
    return Bins(starts, owner[order].astype(np.int32), cols)


def _bins_near(panels: Panels, p: int, rooms: Rooms, rows: int, cols: int) -> NDArray[np.int64]:
    edge = BIN * PIXEL
    plane = panels.plane[p]
    width, height = plane[12:14] * panels.cells[p, :2]
    if panels.level[p]:
        low = np.floor(rooms.turned(plane[None, :2])[0] / edge).astype(int)
        high = low + np.ceil(np.array([width, height]) / edge).astype(int)
        col, row = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    else:
        reach = REACH + height * abs(plane[6:8]).max()
        steps = np.arange(0.0, width + edge / 2, edge / 2)
        across = np.arange(-reach, reach + edge / 2, edge / 2)
        side = plane[9:11] / np.linalg.norm(plane[9:11])
        line = plane[:2] + steps[:, None] * plane[3:5]
        place = np.floor(rooms.turned((line[:, None] + across[:, None] * side).reshape(-1, 2)) / edge).astype(int)
        col, row = place.T
    inside = (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
    return np.unique((row * cols + col)[inside])


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """bits (c,) uint8 of each cell. tally (f, 3) float64 of each face: points on it, points within FLAT of it, sum of
    these points' squared distances to it.
    """

    bits: NDArray[np.uint8]
    tally: F64


def no_marks(panels: Panels) -> Marks:
    """Nothing seen yet."""
    return Marks(np.zeros(len(panels.asked), np.uint8), np.zeros((len(panels.faces), 3)))


def mark_points(panels: Panels, rooms: Rooms, bins: Bins, surfels: Surfels, stations: F64, marks: Marks) -> None:
    """Mark the cells that points lie in which were seen from the face's side; ``stations`` (s, 3), nan if unknown."""
    points, found = (surfels.xyz, surfels.count, surfels.station), (bins.starts, bins.members, bins.columns)
    _mark(points, stations, rooms.frame, found, panels.plane, panels.cells, panels.face, panels.asked, *_out(marks))


def look(panels: Panels, rooms: Rooms, panorama: Panorama, marks: Marks, *, holes: bool = False) -> None:
    """Ask a station about the cells that no points lie in; with ``holes`` about those of openings, too, through which
    pulses that did not return went.
    """
    station, air = (panorama.position, panorama.ranges), (rooms.frame, rooms.low, rooms.high, rooms.inner)
    hole = panels.hole if holes else np.zeros_like(panels.hole)
    _look(station, air, panels.plane, panels.cells, panels.asked | hole, hole, marks.bits)


def _out(marks: Marks) -> tuple[NDArray[np.uint8], F64]:
    return marks.bits, marks.tally


@nb.njit(cache=True, nogil=True, inline="always")
def bin_of(x, y, frame, columns, most):  # pyright: ignore
    """The bin of a place, -1 outside; ``most`` is how many bins there are."""
    dx, dy = x - frame[0], y - frame[1]
    col = int(np.floor((dx * frame[2] + dy * frame[3]) / (BIN * PIXEL)))
    row = int(np.floor((dy * frame[2] - dx * frame[3]) / (BIN * PIXEL)))
    key = row * columns + col
    return key if 0 <= col < columns and 0 <= key < most else -1


@nb.njit(cache=True, nogil=True, inline="always")
def on_panel(x, y, z, plane, cells):  # pyright: ignore
    """Distance of a point before a panel, and its column and row there; (-1, -1) beside it."""
    px, py, pz = x - plane[0], y - plane[1], z - plane[2]
    depth = px * plane[9] + py * plane[10] + pz * plane[11]
    a = int(np.floor((px * plane[3] + py * plane[4] + pz * plane[5]) / plane[12]))
    b = int(np.floor((px * plane[6] + py * plane[7] + pz * plane[8]) / plane[13]))
    if a < 0 or b < 0 or a >= cells[0] or b >= cells[1]:
        return depth, -1, -1
    return depth, a, b


@nb.njit(cache=True, nogil=True, inline="always")
def ahead_of(position, plane):  # pyright: ignore
    """How far a place lies before a panel, metres; nan where it is unknown."""
    return (
        (position[0] - plane[0]) * plane[9]
        + (position[1] - plane[1]) * plane[10]
        + (position[2] - plane[2]) * plane[11]
    )


@nb.njit(cache=True, nogil=True)
def _reach(plane, cells):  # pyright: ignore
    """Lowest and highest z at which points may lie on a panel."""
    low, high = np.inf, -np.inf
    for p in range(plane.shape[0]):
        end = plane[p, 2] + plane[p, 8] * plane[p, 13] * cells[p, 1]
        low = min(low, plane[p, 2], end)
        high = max(high, plane[p, 2], end)
    return low - BEFORE, high + BEFORE


@nb.njit(cache=True, nogil=True)
def _mark(surfels, stations, frame, bins, plane, cells, face, asked, bits, tally):  # pyright: ignore
    xyz, count, station = surfels
    starts, members, columns = bins
    bottom, top = _reach(plane, cells)
    for i in range(xyz.shape[0]):
        if xyz[i, 2] < bottom or xyz[i, 2] > top:
            continue
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        key = bin_of(x, y, frame, columns, starts.shape[0] - 1)
        if key < 0:
            continue
        for m in range(starts[key], starts[key + 1]):
            p = members[m]
            depth, a, b = on_panel(x, y, z, plane[p], cells[p])
            k = cells[p, 2] + b * cells[p, 0] + a
            if a < 0 or depth < -BEHIND or depth > BEFORE or not asked[k]:
                continue
            if ahead_of(stations[station[i]], plane[p]) < 0.0:  # seen from behind; nan, unknown, is not
                continue
            _mark_round(x, y, z, plane[p], cells[p], asked, bits)
            tally[face[p], 0] += count[i]
            if abs(depth) < FLAT:
                tally[face[p], 1] += count[i]
                tally[face[p], 2] += count[i] * depth * depth


@nb.njit(cache=True, nogil=True)
def _mark_round(x, y, z, plane, cells, asked, bits):  # pyright: ignore
    """Mark the cells that the voxel round a surfel covers: cells and voxels are of one size, and not in step."""
    for s in (-SPREAD, SPREAD):
        for t in (-SPREAD, SPREAD):
            moved = x + s * plane[3] + t * plane[6], y + s * plane[4] + t * plane[7], z + s * plane[5] + t * plane[8]
            _, a, b = on_panel(moved[0], moved[1], moved[2], plane, cells)
            k = cells[2] + b * cells[0] + a
            if a >= 0 and asked[k]:
                bits[k] |= SEEN


@nb.njit(cache=True, nogil=True)
def _look(station, air, plane, cells, asked, hole, bits):  # pyright: ignore
    position, ranges = station
    edge = ranges.shape[1]
    for p in range(plane.shape[0]):
        o, u, v = plane[p, 0:3], plane[p, 3:6] * plane[p, 12], plane[p, 6:9] * plane[p, 13]
        ahead = ahead_of(position, plane[p])
        half = 0.5 * (u * cells[p, 0] + v * cells[p, 1])
        if ahead < MARGIN or np.sqrt(((o + half - position) ** 2).sum()) - np.sqrt((half**2).sum()) > FARTHEST:
            continue
        for b in range(cells[p, 1]):
            for a in range(cells[p, 0]):
                k = cells[p, 2] + b * cells[p, 0] + a
                if not asked[k] or bits[k] & SEEN:
                    continue
                s, t = a + 0.5, b + 0.5
                dx = o[0] + u[0] * s + v[0] * t - position[0]
                dy = o[1] + u[1] * s + v[1] * t - position[1]
                dz = o[2] + u[2] * s + v[2] * t - position[2]
                d = np.sqrt(dx * dx + dy * dy + dz * dz)
                if d > FARTHEST or ahead < STEEPEST * d:
                    continue
                f, row, col = cube_cell(dx, dy, dz, edge)
                r = np.float64(ranges[f, row, col])
                slant = d / ahead
                if r < 0.0 and hole[k]:
                    bits[k] |= LOOKED_THROUGH
                if r <= 0.0:
                    continue
                if r > d + THROUGH * slant:
                    bits[k] |= LOOKED_THROUGH
                elif r >= d - MARGIN * slant:
                    bits[k] |= SEEN
                elif not bits[k] & BLOCKED and _by_things(position, (dx / d, dy / d, dz / d), r, d, air):
                    bits[k] |= BLOCKED


@nb.njit(cache=True, nogil=True)
def _by_things(position, towards, r, d, air):  # pyright: ignore
    """Whether a ray that ended at ``r`` would have gone on through air to ``d``: what it met is no wall."""
    frame, low, high, inner = air
    x, y, z = towards
    rows, cols = low.shape
    first = True
    at = r
    while at < d - ENDS or first:
        dx, dy = position[0] + x * at - frame[0], position[1] + y * at - frame[1]
        h = position[2] + z * at
        col = int(np.floor((dx * frame[2] + dy * frame[3]) / PIXEL))
        row = int(np.floor((dy * frame[2] - dx * frame[3]) / PIXEL))
        if col < 0 or row < 0 or col >= cols or row >= rows:
            return False
        if first and d - r > CLOSE:
            if not inner[row, col] or h < low[row, col] + INSIDE or h > high[row, col] - INSIDE:
                return False
        elif (h < low[row, col] - PIXEL or h > high[row, col] + PIXEL) and at < d - ENDS:
            return False
        first = False
        at += STRIDE
    return True
