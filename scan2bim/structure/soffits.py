"""The upper side of a space under roof planes, in plane pieces that cover its area once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from scan2bim.geometry.polygons import area_outside, polygons_of
from scan2bim.structure.roofs import Slope, lower_side

LEAST = 0.5
"""Square metres of the smallest piece: smaller ones go with their neighbour."""
NARROWEST = 0.3
"""Width, metres, of the narrowest piece."""
GRID = 1e-4
"""Metres to which the corners of pieces are rounded, so that neighbours share them."""
F64 = NDArray[np.float64]
Soffit = tuple[tuple[float, float, float], ...]


def soffits_of(space: Polygon, roofs: Sequence[Slope], level: float) -> tuple[Soffit, ...]:
    """Plane pieces, as corners in space counter-clockwise in plan, over a space: under the roof planes, and at
    ``level`` (z) elsewhere; none where no roof plane is over it.
    """
    whole = shapely.set_precision(space, GRID)
    over = [(r.plane, _shared(whole, r.outline)) for r in roofs]
    pieces = [(plane, part) for plane, part in over if part.area > LEAST]
    if not pieces:
        return ()
    rest = area_outside(whole, shapely.union_all([part for _, part in pieces]), GRID)
    broad = rest.buffer(-NARROWEST / 2, join_style="mitre").buffer(NARROWEST / 2 + GRID, join_style="mitre")
    flat = [p for p in shapely.get_parts(shapely.intersection(rest, broad, grid_size=GRID)) if p.area > LEAST]
    pieces += [(np.array([0.0, 0.0, level]), part) for part in flat]
    if flat:
        rest = area_outside(rest, shapely.union_all(flat), GRID)
    for sliver in shapely.get_parts(rest):
        if sliver.area > GRID**2:
            near = sliver.buffer(10 * GRID)
            pieces = _with_sliver(pieces, sliver, [k for k, (_, part) in enumerate(pieces) if part.intersects(near)])
    return tuple(_raised(plane, p) for plane, part in pieces for p in _without_holes(part))


def _with_sliver(
    pieces: Sequence[tuple[F64, BaseGeometry]], sliver: BaseGeometry, beside: Sequence[int]
) -> list[tuple[F64, BaseGeometry]]:
    """The pieces, those ``beside`` a sliver drawn on over it as far as each is the lowest there."""
    out = list(pieces)
    for number in beside:
        plane, part = pieces[number]
        mine = sliver
        for other in beside:
            if other != number:
                mine = _shared(mine, lower_side(plane - pieces[other][0], mine))
        out[number] = plane, shapely.union(part, mine, grid_size=GRID)
    return out


def _shared(shape: BaseGeometry, other: BaseGeometry) -> BaseGeometry:
    """The area that two areas share, without the lines and points in which they only touch."""
    return shapely.union_all(polygons_of(shapely.intersection(shape, other, grid_size=GRID)))


def volume_under(soffits: Sequence[Soffit], floor: float) -> float:
    """Cubic metres between a level floor (z) and plane pieces over it."""
    total = 0.0
    for soffit in soffits:
        corners = np.array(soffit)
        for a, b in pairwise(corners[1:]):
            first = corners[0]
            (ux, uy), (vx, vy) = (a - first)[:2], (b - first)[:2]
            total += (ux * vy - uy * vx) / 2 * float((first[2] + a[2] + b[2]) / 3 - floor)
    return total


def _without_holes(part: BaseGeometry) -> list[Polygon]:
    """The polygons of a piece, cut through their holes."""
    found: list[Polygon] = []
    for polygon in shapely.get_parts(part):
        if not isinstance(polygon, Polygon) or polygon.area < GRID:
            continue
        if not polygon.interiors:
            found.append(shapely.orient_polygons(polygon))
            continue
        x0, y0, x1, y1 = polygon.bounds
        x = Polygon(polygon.interiors[0]).centroid.x
        for half in (box(x0, y0, x, y1), box(x, y0, x1, y1)):
            found += _without_holes(shapely.intersection(polygon, half, grid_size=GRID))
    return found


def _raised(plane: F64, polygon: Polygon) -> Soffit:
    xy = shapely.get_coordinates(polygon.exterior)[:-1]
    heights = xy @ plane[:2] + plane[2]
    return tuple(
        (round(float(x), 4), round(float(y), 4), round(float(z), 4)) for (x, y), z in zip(xy, heights, strict=True)
    )
