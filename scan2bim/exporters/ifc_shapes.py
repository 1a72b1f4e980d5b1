"""Placements, profiles and solids of IFC, from outlines in metres."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.model.elements import Point2, Ring
from scan2bim.model.plates import LEAST_AREA, valid_areas

if TYPE_CHECKING:
    from shapely import Polygon

UP = (0.0, 0.0, 1.0)
STRAY = 0.001
"""Metres. Corners of an outline nearer than this to the line between their neighbours are no corners."""


def placement(
    ifc: IfcFile, relative_to: Entity | None, location: Sequence[float], x_axis: Point2 = (1.0, 0.0)
) -> Entity:
    """An upright placement: location in the frame of ``relative_to``, turned so that x runs along ``x_axis``."""
    return ifc.add("IfcLocalPlacement", relative_to, axes(ifc, location, x_axis))


def axes(ifc: IfcFile, location: Sequence[float], x_axis: Point2 = (1.0, 0.0)) -> Entity:
    """An upright coordinate system."""
    if x_axis == (1.0, 0.0):
        return ifc.add("IfcAxis2Placement3D", ifc.point(location))
    direction = ifc.direction((*x_axis, 0.0))
    return ifc.add("IfcAxis2Placement3D", ifc.point(location), ifc.direction(UP), direction)


def polyline(ifc: IfcFile, points: Iterable[Sequence[float]], closed: bool = False) -> Entity:
    """A polyline; a closed one ends in the very point that it starts with."""
    made = [ifc.point(p) for p in points]
    return ifc.add("IfcPolyline", [*made, made[0]] if closed else made)


def profile(ifc: IfcFile, outline: Ring, holes: Sequence[Ring] = ()) -> Entity:
    """The area inside an outline and outside its holes."""
    if holes:
        inner = [polyline(ifc, hole, closed=True) for hole in holes]
        return ifc.add("IfcArbitraryProfileDefWithVoids", "AREA", None, polyline(ifc, outline, closed=True), inner)
    return ifc.add("IfcArbitraryClosedProfileDef", "AREA", None, polyline(ifc, outline, closed=True))


def extrusion(ifc: IfcFile, area: Entity, depth: float, position: Entity | None = None) -> Entity:
    """A solid: the area swept along z of its position."""
    place = position if position is not None else axes(ifc, (0.0, 0.0, 0.0))
    return ifc.add("IfcExtrudedAreaSolid", area, place, ifc.direction(UP), round(depth, 6))


def rectangle_through(ifc: IfcFile, width: float, height: float, depth: float) -> Entity:
    """A box over x 0 to width, y 0 to depth, z 0 to height: one rectangle profile swept across a wall, along y."""
    centre = ifc.add("IfcAxis2Placement2D", ifc.point((0.0, 0.0)))
    area = ifc.add("IfcRectangleProfileDef", "AREA", None, centre, round(width, 6), round(height, 6))
    position = ifc.add(
        "IfcAxis2Placement3D",
        ifc.point((width / 2, depth, height / 2)),
        ifc.direction((0.0, -1.0, 0.0)),
        ifc.direction((1.0, 0.0, 0.0)),
    )
    return extrusion(ifc, area, depth, position)


def representation(ifc: IfcFile, context: Entity, kind: str, items: Sequence[Entity]) -> Entity:
    """The items as the representation that their context stands for."""
    return ifc.add("IfcShapeRepresentation", context, context.ContextIdentifier, kind, items)


def shape(ifc: IfcFile, *representations: Entity) -> Entity:
    """A product's shape."""
    return ifc.add("IfcProductDefinitionShape", None, None, representations)


def polygons(outline: Ring, holes: Sequence[Ring] = ()) -> list[Polygon]:
    """The area of an outline as valid polygons: one as a rule, none where it has no area, several where it crosses.

    Corners that stray from a straight line by less than ``STRAY`` are left out.
    """
    import shapely

    simple = [shapely.orient_polygons(area.simplify(STRAY)) for area in valid_areas(outline, holes)]
    return [area for area in simple if isinstance(area, shapely.Polygon) and area.area > LEAST_AREA]


def rings(polygon: Polygon) -> tuple[Ring, tuple[Ring, ...]]:
    """A polygon's outline and holes, the first point not repeated."""
    return _ring(polygon.exterior.coords), tuple(_ring(inner.coords) for inner in polygon.interiors)


def _ring(coordinates: Iterable[Sequence[float]]) -> Ring:
    points = [(float(c[0]), float(c[1])) for c in coordinates][:-1]
    return tuple(p for i, p in enumerate(points) if math.dist(p, points[i - 1]) > 1e-6)


def prisms(ifc: IfcFile, areas: Iterable[Polygon], depth: float, bottom: float) -> list[Entity]:
    """Upright solids over the polygons, from ``bottom`` up by ``depth``."""
    return [extrusion(ifc, profile(ifc, *rings(area)), depth, axes(ifc, (0.0, 0.0, bottom))) for area in areas]
