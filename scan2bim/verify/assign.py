"""Kernels that give points to the faces of a model, by distance and normal, one tile at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import STEPS, TILE
from scan2bim.verify.faces import FILL, PATCH, RIM, FaceTable

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
I32 = NDArray[np.int32]

REACH = 0.2
"""Farthest that a point may lie from the face that it is given to, metres: shifts of walls stay below, and furniture
along walls is mostly deeper. A face narrower than this reaches as far as it is wide: what lies farther from a handrail
is another thing."""
LEAST_REACH = 0.03
"""Reach of the narrowest faces, metres."""
TOP, TOP_REACH = 0.6, 0.05
"""Width, metres, of faces that look up which are the tops of walls, and how far they reach: in models without floors,
those of the storey above lie over them."""
VOXEL = 0.08
"""Edge of the voxels in which points tell their normal, metres: some ten points of a usual scan on a surface."""
NV = round(TILE / VOXEL)
BIN = 0.4
"""Edge of the bins in which faces are looked up, metres: about twice the reach."""
NB = round(TILE / BIN)
NEAR_UNKNOWN = 0.03
"""Farthest, metres, that a point without a clear normal may lie from its face: it stands at an edge or corner."""
COSINE = 0.82
"""Of the angle between a point's normal and its face's, 35 degrees: half way to a perpendicular neighbour, less the
noise of a normal from few points."""
EXPLAINED = 0.05
"""Distance, metres, up to which a face of either side explains a point: plaster, skirtings and noise lie within."""


@dataclass(frozen=True, slots=True, eq=False)
class FaceBins:
    """Which faces can own points in a bin of 0.4 m: tile (k, 3) and bin within it (k,) sorted, face (k,)."""

    tile: I64
    bin: I32
    face: I32

    def of_tile(self, tile: I32) -> tuple[I32, I32]:
        """First entry (NB**3 + 1,) of each bin of a tile, and the faces."""
        rows = self._rows(tile)
        starts = np.searchsorted(self.bin[rows], np.arange(NB**3 + 1)).astype(np.int32)
        return starts, self.face[rows]

    def _rows(self, tile: I32) -> slice:
        key = int(_tile_key(np.asarray(tile, np.int64)[None])[0])
        first, last = np.searchsorted(self.tile, [key, key + 1])
        return slice(int(first), int(last))


def reach_of(table: FaceTable) -> F64:
    """How far each face (f,) reaches, metres."""
    width = table.shape.min(axis=1) * table.size
    top = (table.normal[:, 2] > 0.9) & (width < TOP)
    return np.clip(width, LEAST_REACH, np.where(top, TOP_REACH, REACH))


def face_arrays(table: FaceTable) -> tuple[F64, I64, NDArray[Any]]:
    """The faces as ``assign`` takes them, side by side in memory: origin, normal, reach, size, u and v (f, 14); shape,
    start, whether it is two-sided, part and element (f, 6); and the grid of their cells.
    """
    reach, size = reach_of(table)[:, None], table.size[:, None]
    measures = np.concatenate([table.origin, table.normal, reach, size, table.u, table.v], axis=1)
    flags = [table.start, table.two_sided, table.part, table.element]
    counts = np.column_stack([table.shape, *flags]).astype(np.int64)
    return np.ascontiguousarray(measures, np.float64), np.ascontiguousarray(counts), table.grid


def _tile_key(tile: I64) -> I64:
    shifted = tile + (1 << 20)
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]


def make_bins(table: FaceTable) -> FaceBins:
    """Bins of all places within reach of a face's cells."""
    pad = float(table.size.max(initial=0.01))
    axes = table.normal, table.origin, table.u, table.v
    pairs = _bin_pairs(*axes, table.size, table.shape, table.cell_face, table.cell_at, pad)
    place, face = pairs[:, :3], pairs[:, 3]
    tile = np.floor_divide(place, NB)
    inner = place - tile * NB
    number = ((inner[:, 0] * NB + inner[:, 1]) * NB + inner[:, 2]).astype(np.int32)
    key = _tile_key(tile)
    order = np.lexsort((number, key))  # stable: the faces of a bin stay in order, each is there once
    return FaceBins(key[order], number[order], face[order].astype(np.int32))


@nb.njit(cache=True, nogil=True)
def _bin_pairs(normal, origin, u, v, size, shape, cell_face, cell_at, pad):  # pyright: ignore
    """(k, 4) bins x, y, z and face, each once."""
    out = np.empty((1 << 16, 4), np.int64)
    used = 0
    steps = 4
    last = -1
    low, width = np.zeros(3, np.int64), np.ones(3, np.int64)
    seen = np.zeros(1, np.bool_)  # of the face's own bins
    for c in range(cell_face.shape[0]):
        f = cell_face[c]
        if f != last:
            _bins_of_face(origin[f], shape[f] * size[f], (u[f], v[f], normal[f]), pad, low, width)
            seen = np.zeros(width.prod(), np.bool_)
            last = f
        stride = max(1, int(0.1 / size[f]))
        if cell_at[c, 0] % stride != 0 and cell_at[c, 1] % stride != 0:
            continue
        a = (cell_at[c, 0] + 0.5) * size[f]
        b = (cell_at[c, 1] + 0.5) * size[f]
        for k in range(-steps, steps + 1):
            d = REACH * k / steps
            px = origin[f, 0] + a * u[f, 0] + b * v[f, 0] + d * normal[f, 0]
            py = origin[f, 1] + a * u[f, 1] + b * v[f, 1] + d * normal[f, 1]
            pz = origin[f, 2] + a * u[f, 2] + b * v[f, 2] + d * normal[f, 2]
            for x in range(np.int64(np.floor((px - pad) / BIN)), np.int64(np.floor((px + pad) / BIN)) + 1):
                for y in range(np.int64(np.floor((py - pad) / BIN)), np.int64(np.floor((py + pad) / BIN)) + 1):
                    for z in range(np.int64(np.floor((pz - pad) / BIN)), np.int64(np.floor((pz + pad) / BIN)) + 1):
                        at = ((x - low[0]) * width[1] + y - low[1]) * width[2] + z - low[2]
                        if seen[at]:
                            continue
                        seen[at] = True
                        if used == out.shape[0]:
                            out = np.concatenate((out, np.empty_like(out)))
                        out[used, 0], out[used, 1], out[used, 2], out[used, 3] = x, y, z, f
                        used += 1
    return out[:used]


@nb.njit(cache=True, nogil=True)
def _bins_of_face(origin, extent, axes, pad, low, width):  # pyright: ignore
    """The first bin (3,) of those within reach of a face of an ``extent`` (2,) and their number each way, in place."""
    for j in range(3):
        first = last = origin[j]
        for k, (least, most) in enumerate(((0.0, extent[0]), (0.0, extent[1]), (-REACH, REACH))):
            first += min(least * axes[k][j], most * axes[k][j])
            last += max(least * axes[k][j], most * axes[k][j])
        low[j] = np.int64(np.floor((first - pad) / BIN)) - 1
        width[j] = np.int64(np.floor((last + pad) / BIN)) + 2 - low[j]


@nb.njit(cache=True, nogil=True)
def add_moments(raw, slots, sums, used):  # pyright: ignore
    """Add a run's points (n, 12) uint8 to their voxels' moments; gives the moments, grown where need be, and how many
    are used. Per voxel: count, sums of x y z and of xx xy xz yy yz zz in steps from the voxel's corner.
    """
    scale = NV / STEPS
    for i in range(raw.shape[0]):
        qx = np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8
        qy = np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8
        qz = np.int64(raw[i, 4]) | np.int64(raw[i, 5]) << 8
        fx = qx * scale
        fy = qy * scale
        fz = qz * scale
        ix = int(fx)
        iy = int(fy)
        iz = int(fz)
        cell = (ix * NV + iy) * NV + iz
        s = slots[cell]
        if s < 0:
            if used == sums.shape[0]:
                more = np.zeros((2 * used, 10), np.float64)
                more[:used] = sums
                sums = more
            s = used
            used += 1
            slots[cell] = s
        x = fx - ix
        y = fy - iy
        z = fz - iz
        sums[s, 0] += 1
        sums[s, 1] += x
        sums[s, 2] += y
        sums[s, 3] += z
        sums[s, 4] += x * x
        sums[s, 5] += x * y
        sums[s, 6] += x * z
        sums[s, 7] += y * y
        sums[s, 8] += y * z
        sums[s, 9] += z * z
    return sums, used


@nb.njit(cache=True, nogil=True)
def voxel_normals(sums, used):  # pyright: ignore
    """Unit normal (used, 3) float32 of the points in each voxel, zero where they are few or lie in no plane."""
    out = np.zeros((used, 3), np.float32)
    for s in range(used):
        n = sums[s, 0]
        if n < 4:
            continue
        mx = sums[s, 1] / n
        my = sums[s, 2] / n
        mz = sums[s, 3] / n
        xx = sums[s, 4] / n - mx * mx
        xy = sums[s, 5] / n - mx * my
        xz = sums[s, 6] / n - mx * mz
        yy = sums[s, 7] / n - my * my
        yz = sums[s, 8] / n - my * mz
        zz = sums[s, 9] / n - mz * mz
        low, middle = _eigenvalues(xx, xy, xz, yy, yz, zz)
        if middle < 0.01 or low > 0.1 * middle:
            continue
        x, y, z = _eigenvector(xx - low, xy, xz, yy - low, yz, zz - low)
        out[s, 0] = x
        out[s, 1] = y
        out[s, 2] = z
    return out


@nb.njit(cache=True, nogil=True)
def _eigenvalues(a, b, c, d, e, f):  # pyright: ignore
    """Smallest and middle eigenvalue of the symmetric matrix [[a, b, c], [b, d, e], [c, e, f]], by Cardano."""
    q = (a + d + f) / 3.0
    square = (a - q) ** 2 + (d - q) ** 2 + (f - q) ** 2 + 2.0 * (b * b + c * c + e * e)
    p = math.sqrt(square / 6.0)
    if p < 1e-9:
        return 0.0, 0.0
    det = (a - q) * ((d - q) * (f - q) - e * e) - b * (b * (f - q) - e * c) + c * (b * e - (d - q) * c)
    angle = math.acos(min(max(det / (2.0 * p * p * p), -1.0), 1.0)) / 3.0
    high = q + 2.0 * p * math.cos(angle)
    low = q + 2.0 * p * math.cos(angle + 2.0 * math.pi / 3.0)
    return low, 3.0 * q - high - low


@nb.njit(cache=True, nogil=True)
def _eigenvector(a, b, c, d, e, f):  # pyright: ignore
    """Unit vector that the singular symmetric matrix [[a, b, c], [b, d, e], [c, e, f]] takes to nothing: the longest of
    its rows' cross products; zero where all vanish.
    """
    best = 0.0
    x = 0.0
    y = 0.0
    z = 0.0
    for px, py, pz, qx, qy, qz in ((a, b, c, b, d, e), (a, b, c, c, e, f), (b, d, e, c, e, f)):
        cx = py * qz - pz * qy
        cy = pz * qx - px * qz
        cz = px * qy - py * qx
        length = math.sqrt(cx * cx + cy * cy + cz * cz)
        if length > best:
            best = length
            x = cx / length
            y = cy / length
            z = cz / length
    return x, y, z


@nb.njit(cache=True, nogil=True)
def assign(raw, corner, voxels, stations, ignored, bins, faces, sums, owner):  # pyright: ignore
    """Give a run's points (n, 12) uint8 to faces. Adds count, deviation and its square to ``sums`` (c, 3) float64 of
    the cells; writes to ``owner`` (n,) int32 the element, -1 for explained by a face that is not its own side, -2 for
    explained by none, -3 for points of ``ignored`` stations.

    A point belongs to the nearest face whose plane is within reach, whose cells lie under it, whose front the point's
    station stood before, and whose normal is that of the points round it. corner (3,) of the tile; voxels: slots and
    normals; bins: first entries and faces, as ``FaceBins.of_tile``; faces: as ``face_arrays``.
    """
    slots, normals = voxels
    starts, members = bins
    measures, counts, grid = faces
    step = TILE / STEPS
    for i in range(raw.shape[0]):
        qx = np.int64(raw[i, 0]) | np.int64(raw[i, 1]) << 8
        qy = np.int64(raw[i, 2]) | np.int64(raw[i, 3]) << 8
        qz = np.int64(raw[i, 4]) | np.int64(raw[i, 5]) << 8
        number = np.int64(raw[i, 10]) | np.int64(raw[i, 11]) << 8
        if ignored[number]:
            owner[i] = -3
            continue
        b = ((qx * NB // STEPS) * NB + qy * NB // STEPS) * NB + qz * NB // STEPS
        owner[i] = -2
        if starts[b] == starts[b + 1]:
            continue
        x = (qx + 0.5) * step + corner[0]
        y = (qy + 0.5) * step + corner[1]
        z = (qz + 0.5) * step + corner[2]
        s = slots[((qx * NV // STEPS) * NV + qy * NV // STEPS) * NV + qz * NV // STEPS]
        n = normals[s, 0], normals[s, 1], normals[s, 2]
        eye = stations[number, 0], stations[number, 1], stations[number, 2]
        found, cell, deviation = _owner(x, y, z, n, eye, starts[b], starts[b + 1], members, measures, counts, grid)
        owner[i] = found
        if cell >= 0:
            sums[cell, 0] += 1.0
            sums[cell, 1] += deviation
            sums[cell, 2] += deviation * deviation


@nb.njit(cache=True, nogil=True)
def _owner(x, y, z, n, station, first, end, members, measures, counts, grid):  # pyright: ignore
    """Owner as in ``assign``, cell (-1 for none) and signed deviation of a point with normal ``n`` (3,), of the faces
    ``members`` from the first to before the end.

    The nearest face takes the point. At its rim it takes it off the others, but measures nothing. What lies nearest to
    a door or window is measured on the patch of its opening, where there is one.
    """
    clear = n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0
    best = REACH if clear else NEAR_UNKNOWN
    best_patch = best
    explained = -2
    own = patch = -1
    own_deviation = patch_deviation = 0.0
    fills = False
    for k in range(first, end):
        f = members[k]
        dx = x - measures[f, 0]
        dy = y - measures[f, 1]
        dz = z - measures[f, 2]
        deviation = dx * measures[f, 3] + dy * measures[f, 4] + dz * measures[f, 5]
        away = abs(deviation)
        part = counts[f, 4]
        near = min(best_patch if part == PATCH else best, measures[f, 6])
        if away >= near and (away > EXPLAINED or explained != -2):
            continue
        cell = _cell_under(f, dx, dy, dz, measures, counts, grid)
        if cell == -1:
            continue
        if away <= EXPLAINED and explained == -2:
            explained = -1
        if away >= near:
            continue
        if clear and abs(n[0] * measures[f, 3] + n[1] * measures[f, 4] + n[2] * measures[f, 5]) < COSINE:
            continue
        front = station[0] - x, station[1] - y, station[2] - z
        if front[0] * measures[f, 3] + front[1] * measures[f, 4] + front[2] * measures[f, 5] < 0.0:
            if not counts[f, 3]:  # seen from behind; never so from unknown stations, whose positions are nan
                continue
            deviation = -deviation
        if deviation < -EXPLAINED and _is_past(f, x, y, z, away, front, measures, counts, grid):
            continue
        if part == PATCH and cell != RIM:
            best_patch = away
            patch = cell
            patch_deviation = deviation
        if away < best:
            best = away
            explained = counts[f, 5]
            fills = part == FILL
            own = -1 if fills or cell == RIM else cell
            own_deviation = deviation
    if fills and patch >= 0:
        return explained, patch, patch_deviation
    return explained, own, own_deviation


@nb.njit(cache=True, nogil=True)
def _is_past(f, x, y, z, away, front, measures, counts, grid):  # pyright: ignore
    """Whether the ray to a point ``away`` metres behind face ``f`` passed the face's plane beside the face: then what
    it met lies behind the end of an element or in an opening, and says nothing of the face. front (3,): to the station.
    """
    height = abs(front[0] * measures[f, 3] + front[1] * measures[f, 4] + front[2] * measures[f, 5])
    if height <= away:
        return False
    share = away / height
    dx = x + share * front[0] - measures[f, 0]
    dy = y + share * front[1] - measures[f, 1]
    dz = z + share * front[2] - measures[f, 2]
    return _cell_under(f, dx, dy, dz, measures, counts, grid) == -1


@nb.njit(cache=True, nogil=True)
def _cell_under(f, dx, dy, dz, measures, counts, grid):  # pyright: ignore
    """The cell of face ``f`` under a point at (dx, dy, dz) from the face's origin, RIM at its rim, -1 for none."""
    p = math.floor((dx * measures[f, 8] + dy * measures[f, 9] + dz * measures[f, 10]) / measures[f, 7])
    q = math.floor((dx * measures[f, 11] + dy * measures[f, 12] + dz * measures[f, 13]) / measures[f, 7])
    if p < 0 or q < 0 or p >= counts[f, 0] or q >= counts[f, 1]:
        return -1
    return grid[counts[f, 2] + p * counts[f, 1] + q]
