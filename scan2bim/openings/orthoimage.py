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
from scan2bim.geometry.raster import nearest_labels
from scan2bim.openings.face_points import LEAST, NEAREST, STEEPEST, FacePoints, equalised, level, seen_from, splat
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
    along, left = wall.locate(stations[:, :2])
    places = np.column_stack([along, left * _sign(side) - wall.thickness / 2, stations[:, 2] - wall.base])
    across = (points.across, points.up, points.rgb, points.station)
    half = np.float32(wall.thickness / 2)
    seen = FacePoints(*seen_from(points.along, *across, places, _sign(side), half))
    if len(seen) < LEAST:
        return None
    level(seen, breaks)
    length = wall.length
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(length / PIXEL))))
    count, rgb, depth = splat(
        seen.along, seen.up, seen.depth, seen.rgb, seen.slot, equalised(seen), shape, np.float32(1 / PIXEL)
    )
    known = _fill(count, rgb, depth)
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


def _fill(count: NDArray[np.int32], rgb: F32, depth: F32) -> NDArray[np.bool_]:
    """Give pixels without points the values of the nearest one, in place; and tell where it is within FILL."""
    measured = count > 0
    if not measured.any():
        return measured
    return _taken(measured, nearest_labels(measured), rgb, depth, (FILL / PIXEL) ** 2 + 1e-6)


@nb.njit(cache=True, nogil=True)
def _taken(measured, labels, rgb, depth, farthest):  # pyright: ignore
    """Values from the measured pixel of each label (r, c), in place; and whether it is near: squared pixels."""
    rows, cols = labels.shape
    source = np.zeros((labels.max() + 1, 2), np.int32)
    for r in range(rows):
        for c in range(cols):
            if measured[r, c]:
                source[labels[r, c], 0], source[labels[r, c], 1] = r, c
    known = measured.copy()
    for r in range(rows):
        for c in range(cols):
            if not measured[r, c]:
                row, col = source[labels[r, c]]
                known[r, c] = (row - r) ** 2 + (col - c) ** 2 <= farthest
                rgb[r, c, 0], rgb[r, c, 1], rgb[r, c, 2] = rgb[row, col, 0], rgb[row, col, 1], rgb[row, col, 2]
                depth[r, c] = depth[row, col]
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
