"""Shapes of the plane as polygons."""

from __future__ import annotations

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons that a shape is made of, their outer rings counter-clockwise; its lines and points are left out."""
    return [shapely.orient_polygons(p) for p in shapely.get_parts(shape) if isinstance(p, Polygon)]


def largest_part(shape: BaseGeometry, default: Polygon) -> Polygon:
    """The largest polygon of a shape; ``default`` where it has none."""
    return max(polygons_of(shape), key=lambda part: part.area, default=default)


def area_outside(shape: BaseGeometry, other: BaseGeometry, grid: float) -> BaseGeometry:
    """What of a shape's area lies outside another's, corners on a grid (metres).

    Without the lines that a grid makes of slivers: GEOS refuses polygons and lines in one shape at the next overlay.
    """
    rest = shapely.difference(shape, other, grid_size=grid)
    return rest if rest.geom_type != "GeometryCollection" else shapely.MultiPolygon(polygons_of(rest))


def filled(shape: BaseGeometry) -> BaseGeometry:
    """The area of a shape without its holes."""
    return shapely.union_all([Polygon(part.exterior) for part in polygons_of(shape)])


def largest_valid(polygon: Polygon) -> Polygon:
    """The polygon, or where its outline crosses itself the largest of the parts."""
    if polygon.is_valid:
        return polygon
    return largest_part(shapely.make_valid(polygon), polygon)
