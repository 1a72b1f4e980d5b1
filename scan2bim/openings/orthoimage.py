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
from scan2bim.openings.face_points import LEAST, NEAREST, STEEPEST, View, adjusted, splat
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
    view = View.of(wall, _sign(side), stations)
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(wall.length / PIXEL))))
    count, rgb, depth = splat(points, view, adjusted(points, view, breaks), shape, PIXEL)
    if count.sum() < LEAST:
        return None
    known = _filled(count, rgb, depth, round(FILL / PIXEL))
    labels = _all_labels(wall, side, shape, panoramas)
    return Orthoimage(side, np.minimum(count, 65_535).astype(np.uint16), rgb, depth, known, *labels)


def _sign(side: Side) -> float:
    return 1.0 if side == "left" else -1.0


def _frame(wall: WallShape) -> tuple[F64, F64, F64]:
    """Start, direction and normal (to the left) of a wall in plan."""
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    return start, direction, np.array([-direction[1], direction[0]])


def breaks_of(wall: WallShape, side: Side, spaces: Sequence[SpaceShape]) -> list[float]:
    """Places along a wall where one space beside it ends and the next begins; ``spaces`` are the storey's."""
    numbers = wall.left if side == "left" else wall.right
    if len(numbers) < 2:
        return []
    steps = np.linspace(0.0, wall.length, 2 if not wall.bulge else 40)
    line = shapely.LineString(wall.place(steps, _sign(side) * (wall.thickness / 2 + BESIDE)))
    spans: list[tuple[float, float]] = []
    for number in numbers:
        places, _ = wall.locate(shapely.get_coordinates(line.intersection(spaces[number].polygon)))
        if len(places):
            spans.append((float(places.min()), float(places.max())))
    spans.sort()
    return [(a[1] + b[0]) / 2 for a, b in itertools.pairwise(spans)]


@nb.njit(cache=True, nogil=True)
def _filled(count, rgb, depth, reach):  # pyright: ignore
    """Give pixels without points (r, c) the values of the nearest one with points, if it is within ``reach`` pixels; in
    place. Gives where the values are known.
    """
    rows, cols = count.shape
    known = count > 0
    far = reach + 1
    last = np.full(cols, far, np.int64)  # rows down to the nearest pixel with points in the column, far if none is near
    near = np.empty(cols, np.int64)  # rows up or down to it
    above = np.full((rows, cols), far, np.uint8)  # rows up to it
    for r in range(rows - 1, -1, -1):
        for c in range(cols):
            above[r, c] = 0 if count[r, c] > 0 else min(above[r + 1, c] + 1, far) if r + 1 < rows else far
    for r in range(rows):
        for c in range(cols):
            last[c] = 0 if count[r, c] > 0 else min(last[c] + 1, far)
            near[c] = min(last[c], above[r, c])
        newest = -far  # the last column, up to c + reach, in which one is near
        for c in range(-reach, cols):
            if c + reach < cols and near[c + reach] < far:
                newest = c + reach
            if c < 0 or near[c] == 0 or newest < c - reach:
                continue
            best, col = reach * reach + 1, -1
            for k in range(max(c - reach, 0), min(c + reach + 1, cols)):
                away = near[k] * near[k] + (k - c) * (k - c)
                if near[k] < far and away < best:
                    best, col = away, k
            if col >= 0:
                row = r - last[col] if last[col] <= above[r, col] else r + near[col]
                known[r, c] = True
                depth[r, c] = depth[row, col]
                rgb[r, c, 0], rgb[r, c, 1], rgb[r, c, 2] = rgb[row, col, 0], rgb[row, col, 1], rgb[row, col, 2]
    return known


def _all_labels(
    wall: WallShape, side: Side, shape: tuple[int, int], panoramas: Mapping[int, Panorama]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """As ``_labels``, stretch by stretch of a curved wall."""
    first, *rest = wall.flat_parts()
    out = _labels(first[2], side, shape, panoramas)
    for low, high, flat in rest:
        cols = slice(round(low / COARSE), round(high / COARSE) + 1)
        for whole, part in zip(out, _labels(flat, side, shape, panoramas), strict=True):
            whole[:, cols] = part[:, cols]
    return out


def _labels(
    wall: WallShape, side: Side, shape: tuple[int, int], panoramas: Mapping[int, Panorama]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """How many stations on this side saw something in the wall, looked through, were blocked before it."""
    start, direction, normal = _frame(wall)
    coarse = (int(np.ceil(shape[0] * PIXEL / COARSE)), int(np.ceil(shape[1] * PIXEL / COARSE)))
    xy = start + (np.arange(coarse[1])[:, None] + 0.5) * COARSE * direction
    places = np.empty((*coarse, 3), np.float32)
    places[..., :2] = xy
    places[..., 2] = (wall.base + (np.arange(coarse[0]) + 0.5) * COARSE)[:, None]
    said = np.zeros((3, *coarse), np.uint8)
    outer = not (wall.left and wall.right)
    margin = np.float32(wall.thickness / 2 + BAND / 2)
    for panorama in panoramas.values():
        ahead = float((panorama.position[:2] - start) @ normal) * _sign(side) - wall.thickness / 2
        if ahead < NEAREST or not wall.base - 0.5 < panorama.position[2] < wall.top + 0.5:
            continue
        away = np.hypot(*(xy - panorama.position[:2]).T)
        asked = np.flatnonzero(away < min(STEEPEST * ahead, REACH))
        if not len(asked):
            continue
        cols = slice(int(asked[0]), int(asked[-1]) + 1)
        near = np.ascontiguousarray(places[:, cols]).reshape(-1, 3)
        answer = seen_through(near, panorama.position.astype(np.float32), panorama.ranges, margin, outer)
        for k, code in enumerate((2, 1, 3)):
            said[k][:, cols] += (answer == code).reshape(coarse[0], -1)
    on, through, blocked = said
    return on, through, blocked
