"""Shapes of the plane as polygons."""

from __future__ import annotations

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons that a shape is made of, their outer rings counter-clockwise; its lines and points are left out."""
    return [shapely.orient_polygons(p) for p in shapely.get_parts(shape) if isinstance(p, Polygon)]
