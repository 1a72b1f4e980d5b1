"""One face of a wall from the points near it: those seen from its side, their distance to its plane, and equalised
colours.

Plane, the stations' offsets and their gains are fitted to a sample: a dense scan does not make them better. Then all
points go to the image in one compiled pass.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.medians import median
from scan2bim.openings.near_points import WallPoints
from scan2bim.structure.shapes import WallShape

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
ENOUGH = 8_000
"""Points of each station near a wall by which a face's planes, its own offset and its gains are fitted: noise of 2 mm
is then under 0.05 mm."""
DOOR_HEADS = 2.3
"""Height over the base, metres, above which few doors reach."""
CLOSE = 0.01
"""Distance to the plane, metres, of the points by which a station's offset is taken."""
MODE = 0.002
"""Step, metres, in which the most frequent depth is looked for."""
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
class View:
    """From where a face is seen: its side's ``sign`` across the wall, ``half`` of the wall's thickness; ``places``
    (s, 3) of the stations along the wall, ahead of the face and over the base, metres, nan where unknown.
    """

    sign: float
    half: float
    places: F64

    @staticmethod
    def of(wall: WallShape, sign: float, stations: F64) -> View:
        """Of the face on a wall's left (sign 1) or right; ``stations`` (s, 3) are positions."""
        along, left = wall.locate(stations[:, :2])
        half = wall.thickness / 2
        return View(sign, half, np.column_stack([along, left * sign - half, stations[:, 2] - wall.base]))


@dataclass(frozen=True, slots=True, eq=False)
class Adjustment:
    """What makes a face's points comparable. Each part (p) between two of its ``breaks`` (p - 1,), metres along, has a
    plane: ``planes`` (p, 3) its depth at the wall's start and base and its slopes along and up, nan where too little
    was seen. ``slot`` (s,) of each station, the last one for those of which too little was seen; ``offsets`` (p, k)
    metres of each slot from there; ``colours`` (k, 3, 256) 0-1 by slot, channel and value, each station's exposure and
    white balance taken out.
    """

    breaks: F64
    planes: F64
    slot: NDArray[np.int32]
    offsets: F32
    colours: F32


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """Of the points of a face: ``along``, ``up`` (n,), ``depth`` (n,) metres from the face, into the room positive;
    ``rgb`` (n, 3) uint8; ``slot`` (n,) uint16 the place of the point's station in ``stations`` (k,); ``part`` (n,).
    """

    along: F32
    up: F32
    depth: F32
    rgb: NDArray[np.uint8]
    slot: NDArray[np.uint16]
    stations: NDArray[np.int32]
    part: NDArray[np.int64]


def adjusted(points: WallPoints, view: View, breaks: Sequence[float]) -> Adjustment:
    """Planes, offsets and colours of a face, from a sample of the ``points`` near its wall."""
    across = (points.across, points.up, points.rgb, points.station)
    seen = seen_from(points.along, *across, view.places, view.sign, np.float32(view.half))
    at = np.array(breaks, np.float64)
    sample = _Sample(*seen, np.searchsorted(at, seen[0]))
    planes = _planes(sample, len(at) + 1)
    slot = np.full(len(view.places), len(sample.stations), np.int32)
    slot[sample.stations] = np.arange(len(sample.stations))
    return Adjustment(at, planes, slot, _offsets(sample, planes), _colours(sample))


@nb.njit(cache=True, nogil=True, inline="always")
def _looks(place, along, across, up, sign):  # pyright: ignore
    """Whether a station at ``place`` (3,) sees a point from its side ``sign``, not too much at a slant; one whose place
    is unknown (nan) sees what lies on that side.
    """
    ahead = place[1]
    if ahead > NEAREST:
        aside, lift = place[0] - along, place[2] - up
        return aside * aside + lift * lift < (STEEPEST**2 - 1) * ahead * ahead
    return np.isnan(ahead) and across * sign > 0


@nb.njit(cache=True, nogil=True)
def seen_from(along, across, up, rgb, station, places, sign, half):  # pyright: ignore
    """Of the points near a wall, or if a station has more than ENOUGH of as many evenly among them, those that were
    seen from its side ``sign``: along, up, depth (n,), colour (n, 3), slot (n,), and the station of each slot (k,).
    """
    steps = np.zeros(places.shape[0], np.int64)
    for i in range(along.shape[0]):
        steps[station[i]] += 1
    most = 0
    for s in range(places.shape[0]):
        count, steps[s] = steps[s], max(steps[s] // ENOUGH, 1)
        most += (count + steps[s] - 1) // steps[s]
    passed = np.zeros(places.shape[0], np.int64)
    slot_of = np.full(places.shape[0], -1, np.int32)
    stations = np.empty(places.shape[0], np.int32)
    along_out, up_out = np.empty(most, np.float32), np.empty(most, np.float32)
    depth, colour = np.empty(most, np.float32), np.empty((most, 3), np.uint8)
    slot = np.empty(most, np.uint16)
    slots, used = 0, 0
    for i in range(along.shape[0]):
        s = station[i]
        if passed[s] > 0:
            passed[s] -= 1
            continue
        passed[s] = steps[s] - 1
        if not _looks(places[s], along[i], across[i], up[i], sign):
            continue
        if slot_of[s] < 0:
            slot_of[s] = slots
            stations[slots] = s
            slots += 1
        slot[used] = slot_of[s]
        along_out[used] = along[i]
        up_out[used] = up[i]
        depth[used] = across[i] * np.float32(sign) - half
        colour[used, 0], colour[used, 1], colour[used, 2] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
        used += 1
    return along_out[:used], up_out[:used], depth[:used], colour[:used], slot[:used], stations[:slots]


def _planes(sample: _Sample, parts: int) -> F64:
    """The plane of each part (p, 3), nan where too little of it was seen."""
    planes = np.full((parts, 3), np.nan)
    away = np.abs(sample.depth)
    wide = np.flatnonzero(away < OFF_PLANE)
    for k in range(parts):
        here = wide[sample.part[wide] == k] if parts > 1 else wide
        near = here[away[here] < ON_PLANE]
        rows = near if len(near) >= 0.2 * len(here) else here
        if len(rows) >= LEAST:
            planes[k] = _plane(sample.along[rows], sample.up[rows], sample.depth[rows])
    return planes


def _plane(along: F32, up: F32, depth: F32) -> F64:
    """Depth at the start and base of a wall, and its slopes along and up: of the planes that the most frequent depths
    of all and of what lies above doors lead to the one that holds more. Leaves in one plane may be more alike in depth
    than a wall that its own line follows badly.
    """
    above = up > DOOR_HEADS
    starts = [np.ones(len(up), np.bool_), above] if above.sum() >= LEAST else [np.ones(len(up), np.bool_)]
    found = [_plane_from(along, up, depth, start) for start in starts]
    return max(found, key=lambda f: f[0])[1]


def _plane_from(along: F32, up: F32, depth: F32, start: NDArray[np.bool_]) -> tuple[int, F64]:
    """How many points lie near the plane that those of a mask ``start`` (n,) lead to, and the plane."""
    first = along[start], up[start], depth[start]
    plane, held = np.array([_mode(first[2]), 0.0, 0.0]), 0
    for band, rows in ((0.015, first), (0.010, first), (0.008, (along, up, depth)), (0.008, (along, up, depth))):
        count, normal, right = _equations(*rows, plane, band)
        if count < FEWEST:
            break
        weight = TRUSTED / count
        plane = np.asarray(np.linalg.solve(normal * weight + np.diag(PRIOR), right * weight), np.float64)
        held = count
    return held, plane


def _mode(depth: F32) -> float:
    """The most frequent depth: middle of the fullest 6 mm."""
    bins = np.floor((depth[np.abs(depth) < OFF_PLANE] + OFF_PLANE) / MODE).astype(np.int64)
    counts = np.bincount(bins, minlength=3)
    return float((np.argmax(np.convolve(counts, np.ones(3), mode="same")) + 0.5) * MODE - OFF_PLANE)


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


def _offsets(sample: _Sample, planes: F64) -> F32:
    """Each slot's median distance to the plane of each part (p, k), as far as it is an error of registration; none for
    the last slot.
    """
    parts, slots = len(planes), len(sample.stations) + 1
    plane = planes[sample.part] if parts > 1 else planes
    away = sample.depth - (plane[:, 0] + sample.along * plane[:, 1] + sample.up * plane[:, 2])
    near = np.flatnonzero(np.abs(away) < CLOSE)
    group = sample.part[near] * slots + sample.slot[near]
    order = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[order], np.arange(parts * slots + 1)).tolist()
    away = away[near[order]]
    found = [float(median(away[a:b])) if b - a > FEWEST else 0.0 for a, b in itertools.pairwise(ends)]
    return np.clip(found, -WORST_OFFSET, WORST_OFFSET).astype(np.float32).reshape(parts, slots)


def _colours(sample: _Sample) -> F32:
    """Colours 0-1 by slot, channel and value (k, 3, 256), unchanged for the last slot.

    The gains, one for each station and channel, make the stations agree in the cells that several of them saw; where
    none overlap they stay near 1.
    """
    logs = np.log(np.maximum(np.arange(256), DARKEST).astype(np.float32) / np.float32(255))
    slots = len(sample.stations)
    gains = np.zeros((slots + 1, 3, 1), np.float32)
    if slots > 1:
        keys, counts, means = _cell_means(sample.along, sample.up, sample.rgb, sample.slot, slots, logs)
        cell, slot = keys // slots, keys % slots
        weight = np.minimum(counts, HEAVIEST).astype(np.float64)
        gains[:-1, :, 0] = _gains(_numbered(cell), slot, weight, means, slots)
    return np.clip(np.exp(logs - gains), 0, 1)


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


def splat(
    points: WallPoints, view: View, adjustment: Adjustment, shape: tuple[int, int], pixel: float
) -> tuple[NDArray[np.int32], F32, F32]:
    """Points a pixel (r, c), and means of their red, green and blue (r, c, 3) and of their depth (r, c)."""
    across = (points.across, points.up, points.rgb, points.station)
    seen = (points.along, *across, view.places, view.sign, view.half)
    a = adjustment
    return _splat(*seen, a.breaks, a.planes, a.slot, a.offsets, a.colours, shape, np.float32(1 / pixel))


@nb.njit(cache=True, nogil=True)
def _splat(along, across, up, rgb, station, places, sign, half, breaks, planes, slots, offsets, colours, shape, scale):  # pyright: ignore
    """As ``splat``."""
    rows, cols = shape
    sums = np.zeros((rows, cols, 4), np.float32)  # side by side: each point goes to one place in memory
    count = np.zeros(shape, np.int32)
    for i in range(along.shape[0]):
        s = station[i]
        r = int(np.floor(up[i] * scale))
        c = int(np.floor(along[i] * scale))
        if r < 0 or r >= rows or c < 0 or c >= cols or not _looks(places[s], along[i], across[i], up[i], sign):
            continue
        k = 0
        while k < breaks.shape[0] and along[i] > breaks[k]:
            k += 1
        depth = across[i] * sign - half
        if not np.isnan(planes[k, 0]):
            depth -= planes[k, 0] + along[i] * planes[k, 1] + up[i] * planes[k, 2] + offsets[k, slots[s]]
        count[r, c] += 1
        here, colour, value = sums[r, c], colours[slots[s]], rgb[i]
        here[0] += colour[0, value[0]]
        here[1] += colour[1, value[1]]
        here[2] += colour[2, value[2]]
        here[3] += depth
    mean, deep = np.empty((rows, cols, 3), np.float32), np.empty(shape, np.float32)
    for r in range(rows):
        for c in range(cols):
            n = max(count[r, c], 1)
            for k in range(3):
                mean[r, c, k] = sums[r, c, k] / n
            deep[r, c] = sums[r, c, 3] / n
    return count, mean, deep
