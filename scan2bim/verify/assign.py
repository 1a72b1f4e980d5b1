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


def face_arrays(table: FaceTable) -> tuple[NDArray[Any], ...]:
    """The arrays of a table as ``assign`` takes them."""
    return (
        table.normal,
        table.origin,
        table.u,
        table.v,
        table.size,
        table.shape,
        table.start,
        table.grid,
        table.two_sided,
        table.part,
        table.element,
        reach_of(table),
    )


def _tile_key(tile: I64) -> I64:
    shifted = tile + (1 << 20)
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]


def make_bins(table: FaceTable) -> FaceBins:
    """Bins of all places within reach of a face's cells."""
    pad = float(table.size.max(initial=0.01))
    pairs = _bin_pairs(
        table.normal, table.origin, table.u, table.v, table.size, table.cell_face, table.cell_at, pad, REACH, BIN
    )
    place, face = pairs[:, :3], pairs[:, 3]
    tile = np.floor_divide(place, NB)
    inner = place - tile * NB
    number = ((inner[:, 0] * NB + inner[:, 1]) * NB + inner[:, 2]).astype(np.int32)
    key = _tile_key(tile)
    order = np.lexsort((number, key))  # stable: the faces of a bin stay in order, each is there once
    return FaceBins(key[order], number[order], face[order].astype(np.int32))


@nb.njit(cache=True, nogil=True)
def _bin_pairs(normal, origin, u, v, size, cell_face, cell_at, pad, reach, edge):  # pyright: ignore
    """(k, 4) bins x, y, z and face; a face's bins are met once or few times each."""
    out = np.empty((1 << 16, 4), np.int64)
    used = 0
    steps = 4
    last = -1
    seen = set()
    seen.add((np.int64(0), np.int64(0), np.int64(0)))
    for c in range(cell_face.shape[0]):
        f = cell_face[c]
        if f != last:
            seen.clear()
            last = f
        stride = max(1, int(0.1 / size[f]))
        if cell_at[c, 0] % stride != 0 and cell_at[c, 1] % stride != 0:
            continue
        a = (cell_at[c, 0] + 0.5) * size[f]
        b = (cell_at[c, 1] + 0.5) * size[f]
        for k in range(-steps, steps + 1):
            d = reach * k / steps
            px = origin[f, 0] + a * u[f, 0] + b * v[f, 0] + d * normal[f, 0]
            py = origin[f, 1] + a * u[f, 1] + b * v[f, 1] + d * normal[f, 1]
            pz = origin[f, 2] + a * u[f, 2] + b * v[f, 2] + d * normal[f, 2]
            x0 = np.int64(np.floor((px - pad) / edge))
            x1 = np.int64(np.floor((px + pad) / edge))
            y0 = np.int64(np.floor((py - pad) / edge))
            y1 = np.int64(np.floor((py + pad) / edge))
            z0 = np.int64(np.floor((pz - pad) / edge))
            z1 = np.int64(np.floor((pz + pad) / edge))
            for x in range(x0, x1 + 1):
                for y in range(y0, y1 + 1):
                    for z in range(z0, z1 + 1):
                        if (x, y, z) in seen:
                            continue
                        seen.add((x, y, z))
                        if used == out.shape[0]:
                            more = np.empty((2 * used, 4), np.int64)
                            more[:used] = out
                            out = more
                        out[used, 0] = x
                        out[used, 1] = y
                        out[used, 2] = z
                        out[used, 3] = f
                        used += 1
    return out[:used]


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
        first = bins[0][b]
        end = bins[0][b + 1]
        owner[i] = -2
        if first == end:
            continue
        x = (qx + 0.5) * step + corner[0]
        y = (qy + 0.5) * step + corner[1]
        z = (qz + 0.5) * step + corner[2]
        n = normals[slots[((qx * NV // STEPS) * NV + qy * NV // STEPS) * NV + qz * NV // STEPS]]
        found, cell, deviation = _owner(x, y, z, n, stations[number], bins[1][first:end], faces)
        owner[i] = found
        if cell >= 0:
            sums[cell, 0] += 1.0
            sums[cell, 1] += deviation
            sums[cell, 2] += deviation * deviation


@nb.njit(cache=True, nogil=True)
def _owner(x, y, z, n, station, candidates, faces):  # pyright: ignore
    """Owner as in ``assign``, cell (-1 for none) and signed deviation of a point with normal ``n`` (3,).

    The nearest face takes the point. At its rim it takes it off the others, but measures nothing. What lies nearest to
    a door or window is measured on the patch of its opening, where there is one.
    """
    normal, origin, _, _, _, _, _, _, two_sided, part, element, reach = faces
    clear = n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0
    best = REACH if clear else NEAR_UNKNOWN
    best_patch = best
    explained = -2
    own = patch = -1
    own_deviation = patch_deviation = 0.0
    fills = False
    for f in candidates:
        dx = x - origin[f, 0]
        dy = y - origin[f, 1]
        dz = z - origin[f, 2]
        deviation = dx * normal[f, 0] + dy * normal[f, 1] + dz * normal[f, 2]
        away = abs(deviation)
        near = min(best_patch if part[f] == PATCH else best, reach[f])
        if away >= near and (away > EXPLAINED or explained != -2):
            continue
        cell = _cell_under(f, dx, dy, dz, faces)
        if cell == -1:
            continue
        if away <= EXPLAINED and explained == -2:
            explained = -1
        if away >= near:
            continue
        if clear and abs(n[0] * normal[f, 0] + n[1] * normal[f, 1] + n[2] * normal[f, 2]) < COSINE:
            continue
        front = (station[0] - x) * normal[f, 0] + (station[1] - y) * normal[f, 1] + (station[2] - z) * normal[f, 2]
        if front < 0.0:  # never so for unknown stations, whose positions are nan
            if not two_sided[f]:
                continue
            deviation = -deviation
        if part[f] == PATCH and cell != RIM:
            best_patch = away
            patch = cell
            patch_deviation = deviation
        if away < best:
            best = away
            explained = element[f]
            fills = part[f] == FILL
            own = -1 if fills or cell == RIM else cell
            own_deviation = deviation
    if fills and patch >= 0:
        return explained, patch, patch_deviation
    return explained, own, own_deviation


@nb.njit(cache=True, nogil=True, inline="always")
def _cell_under(f, dx, dy, dz, faces):  # pyright: ignore
    """The cell of face ``f`` under a point at (dx, dy, dz) from the face's origin, RIM at its rim, -1 for none."""
    _, _, u, v, size, shape, start, grid, _, _, _, _ = faces
    p = math.floor((dx * u[f, 0] + dy * u[f, 1] + dz * u[f, 2]) / size[f])
    q = math.floor((dx * v[f, 0] + dy * v[f, 1] + dz * v[f, 2]) / size[f])
    if p < 0 or q < 0 or p >= shape[f, 0] or q >= shape[f, 1]:
        return -1
    return grid[start[f] + p * shape[f, 1] + q]
