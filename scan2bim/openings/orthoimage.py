"""Orthoimages of a wall's faces: colour, distance to the wall's plane, and what the stations say of each place.

The paper's image J_CD (section V.A) with pixels of 1 cm, one for each face. Colours of different stations are made
equal first, and so are their distances, since each station's registration is off by a millimetre or two.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numba as nb
import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, seen_through
from scan2bim.geometry.raster import nearest_of
from scan2bim.openings.near_points import BAND, WallPoints
from scan2bim.structure.shapes import SpaceShape, WallShape

PIXEL = 0.01
"""Edge of a pixel, metres."""
COARSE = 0.05
"""Edge, metres, of the pixels in which stations are asked what they saw: a panorama's cell at 10 m."""
FILL = 0.04
"""Distance, metres, over which pixels without points take their nearest neighbour's value: the step of a scan of 0.4
degrees at 6 m."""
BESIDE = 0.2
"""Distance from a face, metres, at which the spaces beside it are told apart."""
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
REACH = 12.0
"""Stations farther than this, metres, are not asked what they looked through."""
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Side = Literal["left", "right"]


@dataclass(frozen=True, slots=True, eq=False)
class Orthoimage:
    """A face of a wall, rows bottom up from its base, columns along its axis from its start, as wide on both faces.

    ``count`` (r, c) points; ``rgb`` (r, c, 3) 0-1, equalised; ``depth`` (r, c) metres from the wall's plane, into the
    room positive; ``known`` (r, c) where these are measured or taken from a neighbour within FILL. On the coarse raster
    ``on``, ``through`` and ``blocked`` (m, n) count the stations that saw something in the wall there, looked through,
    and were blocked before it (the paper's labels occupied, opening, occluded).
    """

    side: Side
    count: NDArray[np.uint16]
    rgb: F32
    depth: F32
    known: NDArray[np.bool_]
    on: NDArray[np.uint8]
    through: NDArray[np.uint8]
    blocked: NDArray[np.uint8]

    @property
    def seen(self) -> float:
        """Share of the face with data, 0-1."""
        return float(self.known.mean())


def orthoimage(
    wall: WallShape,
    side: Side,
    points: WallPoints,
    stations: F64,
    panoramas: Mapping[int, Panorama],
    breaks: Sequence[float] = (),
) -> Orthoimage | None:
    """One face's image; None where too little of it was seen. ``stations`` (s, 3) positions, nan where unknown;
    ``breaks`` the places along the wall, metres, where one space ends and the next begins: the face may step there.
    """
    seen = _before(wall, side, points, stations)
    depth = _depth(wall, side, seen)
    if len(depth) < LEAST:
        return None
    part = np.searchsorted(np.asarray(breaks, np.float64), seen.along)
    for number in range(len(breaks) + 1):
        rows = np.flatnonzero(part == number)
        depth[rows] = _levelled(seen.pick(part == number), depth[rows])
    colour = _equalised(seen)
    length = float(np.hypot(wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]))
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(length / PIXEL))))
    count, sums = _splat(seen.along, seen.up, depth, colour, shape[0], shape[1], np.float32(1 / PIXEL))
    mean = (sums / np.maximum(count, 1)[..., None]).astype(np.float32)
    full, known = _filled(mean, count > 0)
    labels = _labels(wall, side, shape, panoramas)
    return Orthoimage(side, np.minimum(count, 65_535).astype(np.uint16), full[..., :3], full[..., 3], known, *labels)


def _sign(side: Side) -> float:
    return 1.0 if side == "left" else -1.0


def _frame(wall: WallShape) -> tuple[F64, F64, F64]:
    """Start, direction and normal (to the left) of a wall in plan."""
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    return start, direction, np.array([-direction[1], direction[0]])


def breaks_of(wall: WallShape, side: Side, spaces: Sequence[SpaceShape]) -> list[float]:
    """Places along a wall where one space beside it ends and the next begins; ``spaces`` are the storey's."""
    start, direction, normal = _frame(wall)
    numbers = wall.left if side == "left" else wall.right
    if len(numbers) < 2:
        return []
    out = normal * _sign(side) * (wall.thickness / 2 + BESIDE)
    line = shapely.LineString([np.array(wall.start) + out, np.array(wall.end) + out])
    spans: list[tuple[float, float]] = []
    for number in numbers:
        places = (shapely.get_coordinates(line.intersection(spaces[number].polygon)) - start) @ direction
        if len(places):
            spans.append((float(places.min()), float(places.max())))
    spans.sort()
    return [(a[1] + b[0]) / 2 for a, b in itertools.pairwise(spans)]


def _before(wall: WallShape, side: Side, points: WallPoints, stations: F64) -> WallPoints:
    """The points that were seen from this side of the wall, not too much at a slant.

    Points of an unknown station count for the side that they lie on.
    """
    start, direction, normal = _frame(wall)
    place = stations[points.station, :2]
    ahead = (place - start) @ normal * _sign(side) - wall.thickness / 2
    aside = (place - start) @ direction - points.along
    lift = stations[points.station, 2] - wall.base - points.up
    known = np.isfinite(ahead)
    with np.errstate(invalid="ignore"):
        square = (ahead > NEAREST) & (aside**2 + lift**2 < (STEEPEST**2 - 1) * ahead**2)
    return points.pick(np.where(known, square, points.across * _sign(side) > 0))


def _depth(wall: WallShape, side: Side, points: WallPoints) -> F32:
    return (points.across * np.float32(_sign(side)) - np.float32(wall.thickness / 2)).astype(np.float32)


def _levelled(points: WallPoints, depth: F32) -> F32:
    """Distances to the plane fitted to the face's own points, each station's small offset taken off."""
    near, wide = np.abs(depth) < ON_PLANE, np.abs(depth) < OFF_PLANE
    if near.sum() < 0.2 * wide.sum():
        near = wide
    if near.sum() < LEAST:
        return depth
    terms = np.stack([np.ones(len(depth)), points.along, points.up], 1)
    rows = np.flatnonzero(near)[:: max(1, int(near.sum()) // 20_000)]
    plane = np.array([_mode(depth[rows]), 0.0, 0.0])
    prior = np.diag(PRIOR)
    for band in (0.015, 0.010, 0.008, 0.008):
        use = rows[np.abs(depth[rows] - terms[rows] @ plane) < band]
        if len(use) < 100:
            break
        weight = TRUSTED / len(use)
        normal = terms[use].T @ terms[use] * weight + prior
        plane = np.linalg.solve(normal, terms[use].T @ depth[use].astype(np.float64) * weight)
    level = (depth - terms @ plane).astype(np.float32)
    for number in np.unique(points.station):
        mine = points.station == number
        close = mine & (np.abs(level) < 0.01)
        if close.sum() > 100:
            offset = np.float32(np.median(level[close]))
            level[mine] -= np.clip(offset, -WORST_OFFSET, WORST_OFFSET)
    return level


def _mode(depth: F32) -> float:
    """The most frequent depth: middle of the fullest 6 mm."""
    counts, edges = np.histogram(depth, np.arange(-OFF_PLANE, OFF_PLANE + 0.001, 0.002))
    best = int(np.argmax(np.convolve(counts, np.ones(3), mode="same")))
    return float(edges[best] + edges[best + 1]) / 2


def _equalised(points: WallPoints) -> F32:
    """Colours (n, 3) 0-1 with each station's exposure and white balance taken out.

    The gains, one for each station and channel, make the stations agree in the cells that several of them saw; where
    none overlap they stay near 1.
    """
    colour = np.maximum(points.rgb, 4).astype(np.float32) / np.float32(255)
    numbers, number = np.unique(points.station, return_inverse=True)
    if len(numbers) < 2:
        return colour
    cols = int(points.along.max() / CELL) + 1
    cell = (points.up / CELL).astype(np.int64) * cols + (points.along / CELL).astype(np.int64)
    cell = np.clip(cell, 0, None)
    key = cell * len(numbers) + number
    keys, inverse, counts = np.unique(key, return_inverse=True, return_counts=True)
    cells, of_cell = np.unique(keys // len(numbers), return_inverse=True)
    of_station = keys % len(numbers)
    weight = np.minimum(counts, 20).astype(np.float64)
    logs = np.log(colour)
    gains = np.zeros((len(numbers), 3))
    means = np.stack([np.bincount(inverse, logs[:, k]) / counts for k in range(3)], 1)
    for k in range(3):
        for _ in range(15):
            rest = means[:, k] - gains[of_station, k]
            base = np.bincount(of_cell, rest * weight, len(cells)) / np.bincount(of_cell, weight, len(cells))
            off = (means[:, k] - base[of_cell]) * weight
            gains[:, k] = np.bincount(of_station, off, len(numbers)) / (
                np.bincount(of_station, weight, len(numbers)) + 20.0
            )
    return np.clip(np.exp(logs - gains[number].astype(np.float32)), 0, 1).astype(np.float32)


@nb.njit(cache=True, nogil=True)
def _splat(along, up, depth, colour, rows, cols, scale):  # pyright: ignore
    """Points (n,) a pixel, and sums of their red, green, blue and depth (r, c, 4) float32."""
    count = np.zeros((rows, cols), np.int32)
    sums = np.zeros((rows, cols, 4), np.float32)
    for i in range(along.shape[0]):
        r = int(np.floor(up[i] * scale))
        c = int(np.floor(along[i] * scale))
        if r < 0 or r >= rows or c < 0 or c >= cols:
            continue
        count[r, c] += 1
        for k in range(3):
            sums[r, c, k] += colour[i, k]
        sums[r, c, 3] += depth[i]
    return count, sums


def _filled(values: F32, measured: NDArray[np.bool_]) -> tuple[F32, NDArray[np.bool_]]:
    """Values (r, c, 4), where there are none those of the nearest pixel within FILL; and where there are any."""
    if not measured.any():
        return values, measured
    rows, cols = measured.shape
    source = nearest_of(measured)
    row, col = np.mgrid[0:rows, 0:cols]
    distance = np.hypot(source // cols - row, source % cols - col) * PIXEL
    known = distance <= FILL
    return values.reshape(-1, 4)[source.ravel()].reshape(rows, cols, 4), known


def _labels(
    wall: WallShape, side: Side, shape: tuple[int, int], panoramas: Mapping[int, Panorama]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """How many stations on this side saw something in the wall, looked through, were blocked before it."""
    start, direction, normal = _frame(wall)
    coarse = (int(np.ceil(shape[0] * PIXEL / COARSE)), int(np.ceil(shape[1] * PIXEL / COARSE)))
    rows, cols = np.mgrid[0 : coarse[0], 0 : coarse[1]]
    xy = start + (cols.ravel()[:, None] + 0.5) * COARSE * direction
    places = np.column_stack([xy, wall.base + (rows.ravel() + 0.5) * COARSE]).astype(np.float32)
    said = np.zeros((3, len(places)), np.uint8)
    outer = not (wall.left and wall.right)
    margin = np.float32(wall.thickness / 2 + BAND / 2)
    for panorama in panoramas.values():
        ahead = float((panorama.position[:2] - start) @ normal) * _sign(side) - wall.thickness / 2
        if ahead < NEAREST or not wall.base - 0.5 < panorama.position[2] < wall.top + 0.5:
            continue
        slant = np.linalg.norm(places[:, :2] - panorama.position[:2], axis=1) / ahead
        answer = seen_through(places, panorama.position.astype(np.float32), panorama.ranges, margin, outer)
        asked = (slant < STEEPEST) & (slant * ahead < REACH)
        for k, code in enumerate((2, 1, 3)):
            said[k] += (answer == code) & asked
    on, through, blocked = (plane.reshape(coarse) for plane in said)
    return on, through, blocked
