"""Which element each scan point lies on: looked up in rasters of the plan, a layer a kind and storey, with heights.

A point belongs to the first layer in whose element it lies: leaves, then doors and windows, columns, beams, stairs,
walls, ceilings, roofs, slabs. An element reaches ``TOLERANCE`` beyond its shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numba as nb
import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.model.classified import CLASSES, UNCLASSIFIED
from scan2bim.model.elements import Building, Door, Element, Flight, RoofPlane, Storey
from scan2bim.model.shapes import door_leaves, opening_layer, to_plan, wall_footprints
from scan2bim.model.swing import leaf_outline

TOLERANCE: Final = 0.04
"""Metres: of noise, registration and unevenness of what was built; furniture stands rarely so near to a wall."""
_STEP: Final = 0.12
"""Metres that a step may lie off the slope of its flight: half a riser and the tolerance."""
_PIXEL: Final = 0.02  # metres; larger where the building is, so that all rasters stay below ``_BYTES``
_BYTES: Final = 256 << 20
_FINE: Final = 4  # bits below a pixel in which outlines are drawn
_MOST: Final = 65_535  # elements in a layer, of which each has a number of 16 bits

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Zone:
    """Where points are an element's, or (None) nobody's: within ``shape`` in plan, from a plane (a x + b y + c) up by ``rise`` metres."""

    element: Element | None
    shape: shapely.Geometry
    plane: tuple[float, float, float]
    rise: float


@dataclass(frozen=True, slots=True, eq=False)
class PointLabels:
    """Rasters (layers, rows, columns) of uint16 numbers, 0 for none; the zone of number n of layer k is the row
    ``first[k] + n - 1`` of ``planes`` (a, b, c, rise) and ``owner`` (index of the element).

    elements: those that points can belong to, in the order of their numbers in files, from 1 on. classes: of each.
    """

    rasters: NDArray[np.uint16]
    low: tuple[float, float]
    pixel: float
    first: NDArray[np.int64]
    planes: Floats
    owner: NDArray[np.uint32]
    elements: tuple[Element, ...]
    classes: NDArray[np.uint8]

    def of(self, xyz: Floats) -> NDArray[np.uint32]:
        """Number of the element (from 1) that each point (n, 3) lies on, 0 for none."""
        return _look_up(xyz, self.rasters, self.low[0], self.low[1], self.pixel, self.first, self.planes, self.owner)


def point_labels(building: Building) -> PointLabels:
    """The rasters of a building."""
    by_storey = [_layers(storey) for storey in building.storeys]
    by_priority = [part for kinds in zip(*by_storey, strict=True) for layer in kinds for part in _parted(list(layer))]
    zones = [zone for layer in by_priority for zone in layer]
    elements = list({zone.element.id: zone.element for zone in zones if zone.element is not None}.values())
    numbers = {element.id: number for number, element in enumerate(elements, 1)}
    bounds = shapely.total_bounds([zone.shape for zone in zones]) if zones else np.zeros(4)
    area = float(np.prod(bounds[2:] - bounds[:2])) * max(len(by_priority), 1)
    pixel = max(_PIXEL, math.sqrt(2 * area / _BYTES))
    low = bounds[:2] - pixel
    columns, rows = (math.ceil(size / pixel) + 1 for size in (bounds[2:] - low).tolist())
    rasters = np.zeros((len(by_priority), rows, columns), np.uint16)
    for raster, layer in zip(rasters, by_priority, strict=True):
        for number, zone in enumerate(layer, 1):
            _draw(raster, zone.shape, low, pixel, number)
    return PointLabels(
        rasters,
        (float(low[0]), float(low[1])),
        pixel,
        np.cumsum([0, *(len(layer) for layer in by_priority)])[:-1].astype(np.int64),
        np.array([(*zone.plane, zone.rise) for zone in zones], np.float64).reshape(-1, 4),
        np.array([numbers[zone.element.id] if zone.element else 0 for zone in zones], np.uint32),
        tuple(elements),
        np.array([UNCLASSIFIED, *(CLASSES[type(element).__name__] for element in elements)], np.uint8),
    )


def _parted(layer: list[_Zone]) -> list[list[_Zone]]:
    """The layer in as many as it takes, so that in each no zone lies over another at other heights."""
    tree = shapely.STRtree([zone.shape for zone in layer])
    parts: list[list[_Zone]] = []
    place: dict[int, int] = {}
    for number, zone in enumerate(layer):
        near = tree.query(zone.shape, predicate="intersects").tolist()
        taken = {place[k] for k in near if k in place and not _level(zone, layer[k])}
        place[number] = next(k for k in range(len(taken) + 1) if k not in taken)
        if place[number] == len(parts):
            parts.append([])
        parts[place[number]].append(zone)
    return [part[:_MOST] for part in parts]


def _level(one: _Zone, other: _Zone) -> bool:
    """Whether two zones reach over about the same heights: where they meet, either will do."""
    if one.plane[:2] != other.plane[:2]:
        return False
    low, high = max(one.plane[2], other.plane[2]), min(one.plane[2] + one.rise, other.plane[2] + other.rise)
    return high - low > 0.9 * max(one.rise, other.rise)


def _layers(storey: Storey) -> Sequence[Iterable[_Zone]]:
    """Nine layers, the first to be asked first."""
    footprints = wall_footprints(storey)
    return (
        _leaves(storey),
        _fills(storey),
        (_upright(c, c.outline, c.base, c.height.value) for c in storey.columns),
        (_upright(b, b.outline, b.base, b.height.value) for b in storey.beams),
        _stairs(storey),
        (_upright(w, footprints[w.id], w.base, w.height.value) for w in storey.walls),
        (_upright(c, c.outline, c.top.value - c.thickness.value, c.thickness.value) for c in storey.coverings),
        (_roof(roof) for roof in storey.roofs),
        (_upright(s, s.outline, s.top.value - s.thickness.value, s.thickness.value) for s in storey.slabs),
    )


def _upright(element: Element, outline: Sequence[tuple[float, float]], base: float, height: float) -> _Zone:
    shape = shapely.make_valid(shapely.Polygon(outline)) if len(outline) > 2 else shapely.Polygon()
    return _Zone(element, shape.buffer(TOLERANCE), (0.0, 0.0, base - TOLERANCE), height + 2 * TOLERANCE)


def _leaves(storey: Storey) -> Iterator[_Zone]:
    for wall in storey.walls:
        for opening in wall.openings:
            for leaf in door_leaves(wall, opening) if opening.fill is not None else ():
                base = wall.base + opening.sill.value + leaf.bottom
                outline = leaf_outline(wall, opening, leaf, leaf.angle)
                yield _upright(opening.fill or opening, outline, base, leaf.height)


def _fills(storey: Storey) -> Iterator[_Zone]:
    """Openings across the wall as far as noise reaches: a fill without the floor below, a void without its borders."""
    for wall in storey.walls:
        for opening in wall.openings:
            if opening.depth is not None:
                continue
            low, high = opening_layer(wall, opening)
            inset = TOLERANCE if opening.fill is None else 0.0
            above = TOLERANCE if opening.fill is None or isinstance(opening.fill, Door) else 0.0
            x0, base = opening.offset.value + inset, wall.base + opening.sill.value + above
            x1 = opening.offset.value + opening.width.value - inset
            sides = ((x0, low - TOLERANCE), (x1, low - TOLERANCE), (x1, high + TOLERANCE), (x0, high + TOLERANCE))
            shape = shapely.Polygon([to_plan(wall, x, y) for x, y in sides])
            yield _Zone(opening.fill, shape, (0.0, 0.0, base), opening.height.value - above - inset)


def _stairs(storey: Storey) -> Iterator[_Zone]:
    """Flights along their slopes; a stair without flights as a whole."""
    for stair in storey.stairs:
        if not stair.flights:
            yield _upright(stair, stair.outline, stair.base, stair.height.value)
        for flight in stair.flights:
            line = shapely.LineString([flight.start, flight.end])
            shape = line.buffer(flight.width.value / 2 + TOLERANCE, cap_style="square")
            yield _Zone(stair, shape, _slope(flight), 2 * _STEP)


def _slope(flight: Flight) -> tuple[float, float, float]:
    (x0, y0), (x1, y1) = flight.start, flight.end
    run = max(math.dist(flight.start, flight.end), 1e-6)
    a, b = flight.height * (x1 - x0) / run**2, flight.height * (y1 - y0) / run**2
    return a, b, flight.base - a * x0 - b * y0 - _STEP


def _roof(roof: RoofPlane) -> _Zone:
    corners = np.array(roof.outline)
    plan = np.column_stack([corners[:, :2], np.ones(len(corners))])
    (a, b, c), *_ = np.linalg.lstsq(plan, corners[:, 2], rcond=None)
    shape = shapely.make_valid(shapely.Polygon(corners[:, :2])).buffer(TOLERANCE)
    plane = (float(a), float(b), float(c) - 2 * TOLERANCE)
    return _Zone(roof, shape, plane, roof.thickness.value + 4 * TOLERANCE)


def _draw(raster: NDArray[np.uint16], shape: shapely.Geometry, low: Floats, pixel: float, number: int) -> None:
    for part in shapely.get_parts(shape).tolist():
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            rings = [shapely.get_coordinates(ring)[:-1] for ring in (part.exterior, *part.interiors)]
            fine = [np.round(((ring - low) / pixel - 0.5) * (1 << _FINE)).astype(np.int32) for ring in rings]
            cv2.fillPoly(raster, fine, number, shift=_FINE)


@nb.njit(cache=True, nogil=True)
def _look_up(xyz, rasters, x0, y0, pixel, first, planes, owner):  # pyright: ignore
    """The owner of the first zone that holds each point, 0 for none."""
    out = np.zeros(len(xyz), np.uint32)
    layers, rows, columns = rasters.shape
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        column = int(math.floor((x - x0) / pixel))
        row = int(math.floor((y - y0) / pixel))
        if row < 0 or column < 0 or row >= rows or column >= columns:
            continue
        for k in range(layers):
            number = rasters[k, row, column]
            if number:
                zone = first[k] + number - 1
                over = z - (planes[zone, 0] * x + planes[zone, 1] * y + planes[zone, 2])
                if 0.0 <= over <= planes[zone, 3]:
                    out[i] = owner[zone]
                    break
    return out
