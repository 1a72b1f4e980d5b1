"""Open plans: spaces that run into each other are told apart where a wall's line goes on across a passage.

A cut starts at a corner that juts into the space (a wall's free end) and goes on in the line of the wall to the next
border. It is made where the passage is narrow for the smaller of both parts; no wall is put there, only a virtual
border.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

WIDEST = 3.5
"""Width, metres, of the widest passage that can part two spaces."""
SMALLEST_PART = 3.0
"""Area, square metres, of the smallest part worth a space of its own (niches and bays stay with their space)."""
NARROW = 0.6
"""Largest ratio of the passage's width squared to the smaller part's area: a square part may be open on 3/4 of one
side.
"""
F64 = NDArray[np.float64]


def split_at_portals(polygon: Polygon) -> tuple[list[Polygon], list[LineString]]:
    """Parts of a space and the cuts between them; the narrowest passage first, until none is narrow."""
    best = min(_cuts(polygon), key=lambda c: c[0], default=None)
    if best is None:
        return [polygon], []
    _, cut, parts = best
    out: list[Polygon] = []
    cuts = [cut]
    for part in parts:
        pieces, more = split_at_portals(part)
        out += pieces
        cuts += more
    return out, cuts


def _cuts(polygon: Polygon) -> list[tuple[float, LineString, list[Polygon]]]:
    """Cuts of a space that leave two parts each large for the passage: (ratio, line, parts)."""
    found: list[tuple[float, LineString, list[Polygon]]] = []
    if polygon.area < 2 * SMALLEST_PART:
        return found
    outline = polygon.boundary
    for start, direction in _jutting_corners(polygon):
        line = _to_border(start, direction, outline)
        if line is None:
            continue
        parts = _parts(polygon, line)
        if len(parts) != 2:
            continue
        smaller = min(p.area for p in parts)
        ratio = line.length**2 / smaller
        if smaller >= SMALLEST_PART and ratio <= NARROW:
            found.append((ratio, line, parts))
    return found


def _jutting_corners(polygon: Polygon) -> list[tuple[F64, F64]]:
    """Corners where the border turns away from the space, each with the directions in which its two edges go on."""
    out: list[tuple[F64, F64]] = []
    for ring in [polygon.exterior, *polygon.interiors]:
        xy = shapely.get_coordinates(ring)[:-1]
        before, after = xy - np.roll(xy, 1, 0), np.roll(xy, -1, 0) - xy
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        for i in np.flatnonzero(cross < -1e-3 * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)):
            for edge in (before[i], -after[i]):
                length = float(np.linalg.norm(edge))
                if length > 0.25:
                    out.append((xy[i], edge / length))
    return out


def _to_border(start: F64, direction: F64, outline: BaseGeometry) -> LineString | None:
    """From a corner straight on to the next border; None if that is farther than the widest passage."""
    ray = LineString([start + direction * 0.02, start + direction * WIDEST])
    hit = ray.intersection(outline)
    if hit.is_empty:
        return None
    distance = float(min(np.linalg.norm(shapely.get_coordinates(hit) - start, axis=1)))
    return LineString([start, start + direction * distance]) if distance > 0.4 else None


def _parts(polygon: Polygon, line: LineString) -> list[Polygon]:
    a, b = shapely.get_coordinates(line)
    u = (b - a) / np.linalg.norm(b - a)
    longer = LineString([a - 1e-4 * u, b + 1e-4 * u])
    pieces = shapely.polygonize([shapely.union_all([polygon.boundary, longer], grid_size=1e-6)])
    oriented = shapely.orient_polygons(shapely.get_parts(pieces))
    inside = [p for p in oriented if polygon.contains(p.representative_point())]
    return [p for p in inside if isinstance(p, Polygon)]


def on_cut(points: F64, cuts: Sequence[LineString]) -> bool:
    """Whether all points (n, 2) lie on one of the cuts."""
    geometry = shapely.points(points)
    return any(bool((shapely.distance(cut, geometry) < 0.02).all()) for cut in cuts)
