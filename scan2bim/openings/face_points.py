"""The points of one face of a wall: those seen from its side, their distance to its plane, and equalised colours.

Each pass over the points is one compiled loop: a building has far more points than anything else here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

CELL = 0.10
"""Edge, metres, of the cells in which stations are compared."""
ON_PLANE = 0.03
"""Points within this distance of a face, metres, may belong to its plane."""
OFF_PLANE = 0.08
"""Distance, metres, at which the plane is looked for where next to nothing lies on the wall's own: walls of several
rooms in one line.
"""
WORST_OFFSET = 0.004
"""Metres by which a station's registration may be off and be corrected; more is a surface of its own."""
TRUSTED = 20.0
"""Independent measurements that a face's points are worth: what errs is registration and unevenness, not noise."""
PRIOR = (0.0, 36.0, 36.0)
"""How sure the wall's own direction and plumb are, in (residual of 3 mm / 0.5 mm a metre) squared: a door that fills
half of a face does not tilt it."""
STEEPEST = 6.0
"""Slant (1 / cosine) beyond which points are left out: their noise and their footprints grow with it."""
LEAST = 200
"""Points that a face must have to be looked at."""
NEAREST = 0.25
"""Distance to the face, metres, below which a station does not look at it but along it."""
ENOUGH = 20_000
"""Points by which a plane is fitted: with more it does not get better."""
CLOSE, FINE = 0.01, 0.00005
"""Distance to the plane, metres, of the points by which a station's offset is taken, and the step of their histogram.
"""
FEWEST = 100
"""Points that an offset needs."""
DARKEST = 4
"""Least colour, of 255, that is compared: below it there is noise alone."""
ROUNDS, DAMPING = 15, 20.0
"""Rounds of the stations' gains, and the points that keep a gain near 1."""
HEAVIEST = 20
"""Points up to which a cell's mean gets surer."""
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FacePoints:
    """Points seen from one side of a wall: ``along`` and ``up`` (n,) metres, ``depth`` (n,) metres from the face, into
    the room positive; ``rgb`` (n, 3) uint8; ``slot`` (n,) uint16 the place of the point's station among the ``slots``
    stations that saw the face.
    """

    along: F32
    up: F32
    depth: F32
    rgb: NDArray[np.uint8]
    slot: NDArray[np.uint16]
    slots: int

    def __len__(self) -> int:
        return len(self.along)


@nb.njit(cache=True, nogil=True)
def seen_from(along, across, up, rgb, station, places, sign, half):  # pyright: ignore
    """Of the points near a wall those that were seen from its side ``sign``, not too much at a slant: along, up, depth
    (n,), colour (n, 3), slot (n,), and how many slots there are.

    ``places`` (s, 3) are the stations along the wall, ahead of the face and over the base, metres. Points of an unknown
    station (nan) count for the side that they lie on.
    """
    rows = np.empty(along.shape[0], np.int32)
    used = 0
    steep = STEEPEST**2 - 1
    for i in range(along.shape[0]):
        s = station[i]
        ahead = places[s, 1]
        if np.isnan(ahead):
            keep = across[i] * sign > 0
        elif ahead > NEAREST:
            aside = places[s, 0] - along[i]
            lift = places[s, 2] - up[i]
            keep = aside * aside + lift * lift < steep * ahead * ahead
        else:
            keep = False
        rows[used] = i
        used += keep
    slot_of = np.full(places.shape[0], -1, np.int32)
    slots = 0
    along_out, up_out = np.empty(used, np.float32), np.empty(used, np.float32)
    depth, colour = np.empty(used, np.float32), np.empty((used, 3), np.uint8)
    slot = np.empty(used, np.uint16)
    for k in range(used):
        i = rows[k]
        s = station[i]
        if slot_of[s] < 0:
            slot_of[s] = slots
            slots += 1
        slot[k] = slot_of[s]
        along_out[k] = along[i]
        up_out[k] = up[i]
        depth[k] = across[i] * np.float32(sign) - half
        colour[k, 0], colour[k, 1], colour[k, 2] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
    return along_out, up_out, depth, colour, slot, slots


def level(points: FacePoints, breaks: Sequence[float]) -> None:
    """Make the depths distances to the plane fitted to the face's own points, each station's small offset taken off;
    between two ``breaks`` (metres along) the face has a plane of its own. In place.
    """
    part = _parts(points.along, np.array(breaks, np.float64))
    near, wide = _counted(part, points.depth, len(breaks) + 1)
    off = near < 0.2 * wide
    used = np.where(off, wide, near)
    band = np.where(off, OFF_PLANE, ON_PLANE).astype(np.float32)
    rows, ends = _some(part, points.depth, band, np.maximum(1, used // ENOUGH), used)
    planes = np.full((len(used), 3), np.nan)
    for k in np.flatnonzero(used >= LEAST).tolist():
        at = rows[ends[k] : ends[k + 1]]
        planes[k] = _plane(points.along[at], points.up[at], points.depth[at])
    _flatten(points.along, points.up, points.depth, points.slot, points.slots, part, planes)


@nb.njit(cache=True, nogil=True)
def _parts(along, breaks):  # pyright: ignore
    """The number of ``breaks`` (b,) before each place (n,)."""
    out = np.zeros(along.shape[0], np.int32)
    for place in breaks:
        for i in range(along.shape[0]):
            out[i] += along[i] > place
    return out


def _plane(along: F32, up: F32, depth: F32) -> F64:
    """Depth at the start and base of a wall, and its slopes along and up."""
    plane = np.array([_mode(depth), 0.0, 0.0])
    for band in (0.015, 0.010, 0.008, 0.008):
        count, normal, right = _equations(along, up, depth, plane, band)
        if count < FEWEST:
            break
        weight = TRUSTED / count
        plane = np.asarray(np.linalg.solve(normal * weight + np.diag(PRIOR), right * weight), np.float64)
    return plane


def _mode(depth: F32) -> float:
    """The most frequent depth: middle of the fullest 6 mm."""
    counts, edges = np.histogram(depth, np.arange(-OFF_PLANE, OFF_PLANE + 0.001, 0.002))
    best = int(np.argmax(np.convolve(counts, np.ones(3), mode="same")))
    return float(edges[best] + edges[best + 1]) / 2


@nb.njit(cache=True, nogil=True)
def _counted(part, depth, parts):  # pyright: ignore
    """Points of each part of a face (p,) that lie near it, and within OFF_PLANE of it."""
    near, wide = np.zeros(parts, np.int64), np.zeros(parts, np.int64)
    for i in range(part.shape[0]):
        away = abs(depth[i])
        near[part[i]] += away < np.float32(ON_PLANE)
        wide[part[i]] += away < np.float32(OFF_PLANE)
    return near, wide


@nb.njit(cache=True, nogil=True)
def _some(part, depth, band, step, count):  # pyright: ignore
    """Every ``step``-th (p,) of the ``count`` points (p,) of each part within its ``band`` (p,) of the face: rows (m,)
    and where those of each part begin (p + 1,).
    """
    parts = len(band)
    ends = np.zeros(parts + 1, np.int64)
    for k in range(parts):
        ends[k + 1] = ends[k] + (count[k] + step[k] - 1) // step[k]
    rows = np.empty(ends[-1], np.int64)
    at, seen = ends[:-1].copy(), np.zeros(parts, np.int64)
    for i in range(part.shape[0]):
        k = part[i]
        if abs(depth[i]) < band[k]:
            if seen[k] % step[k] == 0:
                rows[at[k]] = i
                at[k] += 1
            seen[k] += 1
    return rows, ends


@nb.njit(cache=True, nogil=True)
def _equations(along, up, depth, plane, band):  # pyright: ignore
    """Points within ``band`` of a plane, and the normal equations of the plane through them."""
    count = 0
    normal = np.zeros((3, 3))
    right = np.zeros(3)
    for i in range(along.shape[0]):
        a, b, d = np.float64(along[i]), np.float64(up[i]), np.float64(depth[i])
        if abs(d - plane[0] - a * plane[1] - b * plane[2]) < band:
            count += 1
            normal[0, 1] += a
            normal[0, 2] += b
            normal[1, 1] += a * a
            normal[1, 2] += a * b
            normal[2, 2] += b * b
            right[0] += d
            right[1] += a * d
            right[2] += b * d
    normal[0, 0] = count
    normal[1, 0], normal[2, 0], normal[2, 1] = normal[0, 1], normal[0, 2], normal[1, 2]
    return count, normal, right


@nb.njit(cache=True, nogil=True)
def _flatten(along, up, depth, slot, slots, part, planes):  # pyright: ignore
    """Take the plane of its part (p, 3), and its station's median distance to that, off each depth; nan for none."""
    bins = int(2 * CLOSE / FINE)
    counts = np.zeros((planes.shape[0], slots, bins), np.int32)
    for i in range(along.shape[0]):
        k = part[i]
        if not np.isnan(planes[k, 0]):
            depth[i] = depth[i] - (planes[k, 0] + along[i] * planes[k, 1] + up[i] * planes[k, 2])
            if abs(depth[i]) < CLOSE:
                counts[k, slot[i], min(int((depth[i] + CLOSE) / FINE), bins - 1)] += 1
    offset = np.zeros((planes.shape[0], slots), np.float32)
    for k in range(planes.shape[0]):
        for s in range(slots):
            offset[k, s] = _offset(counts[k, s])
    for i in range(along.shape[0]):
        depth[i] -= offset[part[i], slot[i]]


@nb.njit(cache=True, nogil=True)
def _offset(counts):  # pyright: ignore
    """The median of a histogram of distances (n,), metres, as far as it is an error of registration."""
    total = counts.sum()
    if total <= FEWEST:
        return 0.0
    below = 0
    k = 0
    while below + counts[k] < total / 2:
        below += counts[k]
        k += 1
    median = (k + (total / 2 - below) / counts[k]) * FINE - CLOSE
    return min(max(median, -WORST_OFFSET), WORST_OFFSET)


def equalised(points: FacePoints) -> F32:
    """Colours 0-1 by slot, channel and value (slots, 3, 256), each station's exposure and white balance taken out.

    The gains, one for each station and channel, make the stations agree in the cells that several of them saw; where
    none overlap they stay near 1.
    """
    logs = np.log(np.maximum(np.arange(256), DARKEST).astype(np.float32) / np.float32(255))
    gains = np.zeros((points.slots, 3))
    if points.slots > 1:
        keys, counts, means = _cell_means(points.along, points.up, points.rgb, points.slot, points.slots, logs)
        cell, slot = keys // points.slots, keys % points.slots
        gains = _gains(_numbered(cell), slot, np.minimum(counts, HEAVIEST).astype(np.float64), means, points.slots)
    return np.clip(np.exp(logs - gains.astype(np.float32)[..., None]), 0, 1).astype(np.float32)


def _numbered(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells (m,) numbered without gaps."""
    used = np.zeros(int(cell.max(initial=0)) + 1, np.int64)
    used[cell] = 1
    return (np.cumsum(used) - 1)[cell]


@nb.njit(cache=True, nogil=True)
def _cell_means(along, up, rgb, slot, slots, logs):  # pyright: ignore
    """Of each cell and slot with points: key cell * slots + slot (m,), points (m,), mean of the logarithms (m, 3)."""
    far, high = np.float32(0), np.float32(0)
    for i in range(along.shape[0]):
        far = max(far, along[i])
        high = max(high, up[i])
    cols = int(far / CELL) + 1
    row = np.full((int(high / CELL) + 1) * cols * slots, -1, np.int32)
    keys = np.empty(min(row.shape[0], along.shape[0]), np.int64)
    counts = np.zeros(keys.shape[0], np.int64)
    sums = np.zeros((keys.shape[0], 3))
    used = 0
    for i in range(along.shape[0]):
        key = (max(int(up[i] / CELL), 0) * cols + int(along[i] / CELL)) * slots + slot[i]
        k = row[key]
        if k < 0:
            k = row[key] = used
            keys[k] = key
            used += 1
        counts[k] += 1
        for c in range(3):
            sums[k, c] += logs[rgb[i, c]]
    for k in range(used):
        for c in range(3):
            sums[k, c] /= counts[k]
    return keys[:used], counts[:used], sums[:used]


@nb.njit(cache=True, nogil=True)
def _gains(cell, slot, weight, means, slots):  # pyright: ignore
    """Logarithms of the stations' gains (slots, 3) from the means (m, 3) of cells and slots."""
    gains = np.zeros((slots, 3))
    cells = cell.max() + 1
    per_cell, per_slot = np.zeros(cells), np.zeros(slots)
    for k in range(cell.shape[0]):
        per_cell[cell[k]] += weight[k]
        per_slot[slot[k]] += weight[k]
    for _ in range(ROUNDS):
        base = np.zeros((cells, 3))
        for k in range(cell.shape[0]):
            for c in range(3):
                base[cell[k], c] += (means[k, c] - gains[slot[k], c]) * weight[k]
        gains[:] = 0.0
        for k in range(cell.shape[0]):
            for c in range(3):
                gains[slot[k], c] += (means[k, c] - base[cell[k], c] / per_cell[cell[k]]) * weight[k]
        for s in range(slots):
            for c in range(3):
                gains[s, c] /= per_slot[s] + DAMPING
    return gains


@nb.njit(cache=True, nogil=True)
def splat(along, up, depth, rgb, slot, colours, shape, scale):  # pyright: ignore
    """Points a pixel (r, c), and means of their red, green and blue (r, c, 3) and of their depth (r, c)."""
    rows, cols = shape
    sums = np.zeros((rows, cols, 4), np.float32)  # side by side: each point goes to one place in memory
    count = np.zeros(shape, np.int32)
    for i in range(along.shape[0]):
        r = int(np.floor(up[i] * scale))
        c = int(np.floor(along[i] * scale))
        if r < 0 or r >= rows or c < 0 or c >= cols:
            continue
        count[r, c] += 1
        here, colour, value = sums[r, c], colours[slot[i]], rgb[i]
        here[0] += colour[0, value[0]]
        here[1] += colour[1, value[1]]
        here[2] += colour[2, value[2]]
        here[3] += depth[i]
    mean, deep = np.empty((rows, cols, 3), np.float32), np.empty(shape, np.float32)
    for r in range(rows):
        for c in range(cols):
            n = max(count[r, c], 1)
            for k in range(3):
                mean[r, c, k] = sums[r, c, k] / n
            deep[r, c] = sums[r, c, 3] / n
    return count, mean, deep
