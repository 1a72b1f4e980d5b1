"""The free space of a storey's model as a raster: at each place of the plan, from which to which height there is air.

Spaces are air from floor to ceiling, openings from sill to head, all else is solid or unknown. It answers whether the
model itself stands between two places.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.model.ceilings import plane_of
from scan2bim.model.elements import Opening, Storey, Wall
from scan2bim.model.queries import wall_arc, wall_length

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

PIXEL = 0.05
"""Edge of a pixel, metres: half of the thinnest partition that is found."""
INSIDE = 0.10
"""Metres from walls, floor and ceiling from which on a place is inside a space: skirting boards and errors are less."""
RIM = 1.0
"""Metres round the spaces that the raster reaches: outer walls and what is right before them."""
_FIXED = 4
"""Bits of a pixel's fraction that polygons are drawn to."""


@dataclass(frozen=True, slots=True, eq=False)
class Rooms:
    """The raster, turned into the building's main direction.

    origin (2,) local metres of the lower left corner; yaw (radians) of its columns' direction. space (r, c) int16:
    number of the space in the storey, -1 for none. low, high (r, c) float32: z between which there is air, low > high
    for none. inner (r, c) bool: farther than ``INSIDE`` from the border of all spaces.
    """

    origin: F64
    yaw: float
    space: NDArray[np.int16]
    low: F32
    high: F32
    inner: NDArray[np.bool_]

    @property
    def frame(self) -> F64:
        """(4,): origin, cosine and sine of the yaw, as compiled loops take it."""
        return np.array([self.origin[0], self.origin[1], math.cos(self.yaw), math.sin(self.yaw)])

    def turned(self, xy: F64) -> F64:
        """(n, 2) local metres as metres along columns and rows."""
        _, _, c, s = self.frame
        return (xy - self.origin) @ np.array([[c, -s], [s, c]])

    def local(self, along: F64) -> F64:
        """(n, 2) metres along columns and rows as local metres."""
        _, _, c, s = self.frame
        return along @ np.array([[c, s], [-s, c]]) + self.origin

    def pixels(self, xy: F64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns (n,) of places (n, 2) local metres; those outside are moved to the (empty) edge."""
        place = np.floor(self.turned(xy) / PIXEL).astype(np.intp)
        rows, cols = self.space.shape
        return np.clip(place[:, 1], 0, rows - 1), np.clip(place[:, 0], 0, cols - 1)


def rooms_of(storey: Storey, yaw: float, rim: float = RIM) -> Rooms | None:
    """The raster of a storey, ``rim`` metres round its spaces and walls; None where it has no spaces."""
    if not storey.spaces:
        return None
    corners = np.array([p for space in storey.spaces for p in space.outline])
    ends = np.array([p for wall in storey.walls for p in (wall.start, wall.end)]).reshape(-1, 2)
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, -s], [s, c]])
    turned = np.concatenate([corners, ends]) @ turn
    low = turned.min(0) - rim
    shape = tuple(int(n) for n in np.ceil((turned.max(0) + rim - low) / PIXEL).astype(int)[::-1])
    origin = low @ turn.T
    space = np.full(shape, -1, np.int16)
    floor, ceiling = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
    raster = Rooms(origin, yaw, space, floor, ceiling, np.zeros(shape, np.bool_))
    for wall in storey.walls:
        _cut_openings(wall, raster, lambda _: True)
    for number, room in enumerate(storey.spaces):
        mask = drawn([room.outline, *room.holes], raster)
        space[mask] = number
        floor[mask], ceiling[mask] = room.base, room.base + room.height.value
        for piece in room.ceiling:
            _slope(piece, raster, number)
    away = cv2.distanceTransform((space >= 0).astype(np.uint8), cv2.DIST_L2, 3)
    raster.inner[:] = away * PIXEL > INSIDE
    return raster


def _slope(piece: Sequence[tuple[float, float, float]], raster: Rooms, space: int) -> None:
    """The height of the air under a plane piece of a space's ceiling."""
    row, col = np.nonzero(drawn([[(x, y) for x, y, _ in piece]], raster) & (raster.space == space))
    a, b, c = plane_of(tuple(piece))
    xy = raster.local(np.stack([col + 0.5, row + 0.5], 1).astype(np.float64) * PIXEL)
    raster.high[row, col] = xy @ np.array([a, b]) + c


def drawn(rings: Sequence[Sequence[tuple[float, float]]], raster: Rooms) -> NDArray[np.bool_]:
    """Pixels inside rings (even-odd), local metres."""
    mask = np.zeros(raster.space.shape, np.uint8)
    corners = [raster.turned(np.array(ring)) / PIXEL - 0.5 for ring in rings]
    fixed = [np.rint(ring * (1 << _FIXED)).astype(np.int32) for ring in corners]
    if fixed:
        cv2.fillPoly(mask, fixed, 1, shift=_FIXED)
    return mask > 0


def with_openings(storey: Storey, raster: Rooms, wanted: Callable[[Opening], bool]) -> Rooms:
    """The raster with air in the spaces and in those openings alone that are ``wanted``."""
    inside = raster.space >= 0
    low = np.where(inside, raster.low, np.float32(np.inf)).astype(np.float32)
    high = np.where(inside, raster.high, np.float32(-np.inf)).astype(np.float32)
    out = replace(raster, low=low, high=high)
    for wall in storey.walls:
        _cut_openings(wall, out, wanted)
    low[inside], high[inside] = raster.low[inside], raster.high[inside]
    return out


def _cut_openings(wall: Wall, raster: Rooms, wanted: Callable[[Opening], bool]) -> None:
    """Air from sill to head through the wall; a pixel farther on either side, so that it joins the spaces."""
    for opening in wall.openings:
        if opening.depth is not None or not wanted(opening):
            continue
        mask = drawn(
            [_stretch(wall, opening.offset.value, opening.offset.value + opening.width.value, 1.5 * PIXEL)], raster
        )
        sill = wall.base + opening.sill.value
        raster.low[mask] = np.minimum(raster.low[mask], sill)
        raster.high[mask] = np.maximum(raster.high[mask], sill + opening.height.value)


def _stretch(wall: Wall, start: float, end: float, more: float) -> list[tuple[float, float]]:
    """Outline of a wall from ``start`` to ``end`` along its axis, ``more`` metres thicker on either side."""
    axis, half = wall_arc(wall), wall.thickness.value / 2 + more
    direction = (np.array(wall.end) - wall.start) / max(axis.chord, 1e-9)
    low, high = np.clip([start, end], 0.0, wall_length(wall)).tolist()
    along = np.linspace(low, high, 2 if wall.bulge == 0.0 else 12)
    flat = np.concatenate(
        [axis.place(along, np.full(len(along), -half)), axis.place(along[::-1], np.full(len(along), half))]
    )
    ring = flat[:, :1] * direction + flat[:, 1:] * np.array([-direction[1], direction[0]]) + wall.start
    return [(float(x), float(y)) for x, y in ring]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Between which heights (z) each pixel is body: low, high (r, c) float32; low > high where none is."""

    low: F32
    high: F32

    def add(self, mask: NDArray[np.bool_], low: float, high: float) -> None:
        """A body on some pixels; in place."""
        self.low[mask] = np.minimum(self.low[mask], low)
        self.high[mask] = np.maximum(self.high[mask], high)


def bodies_of(storey: Storey, raster: Rooms) -> tuple[Bodies, Bodies]:
    """Walls with their openings filled; and what stands in spaces as part of the building: columns, beams, stairs."""
    shape = raster.space.shape
    walls, others = (Bodies(np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)) for _ in range(2))
    for wall in storey.walls:
        mask = drawn([_stretch(wall, 0.0, wall_length(wall), 0.0)], raster)
        walls.add(mask, wall.base, wall.base + wall.height.value)
    for part in (*storey.columns, *storey.beams, *storey.stairs):
        mask = cv2.dilate(drawn([part.outline], raster).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        others.add(mask, part.base - PIXEL, part.base + part.height.value + PIXEL)
    return walls, others
