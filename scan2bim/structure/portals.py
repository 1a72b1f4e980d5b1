"""Open plans: spaces that run into each other are told apart where a wall's line goes on across a passage.

A cut starts at a corner that juts into the space (a wall's free end) and goes on in the line of the wall to the next
border. It is made where the passage is narrow for the smaller of both parts, or a lintel hangs over it; no wall is put
there, only a virtual border.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.plan import Plan

WIDEST = 3.5
"""Width, metres, of the widest passage that can part two spaces."""
SMALLEST_PART = 3.0
"""Area, square metres, of the smallest part worth a space of its own (niches and bays stay with their space)."""
NARROW = 0.6
"""Largest ratio of the passage's width squared to the smaller part's area: a square part may be open on 3/4 of one
side.
"""
NARROW_UNDER_LINTEL = 1.2
"""The same where a lintel hangs over the passage: the wall goes on above it."""
LINTEL = 0.1
"""Metres that a lintel hangs lower than the ceilings on both sides of it."""
THICKEST = 0.5
"""Depth, metres, of the deepest lintel."""
F64 = NDArray[np.float64]


def split_at_portals(
    polygon: Polygon, under_lintel: Callable[[LineString], bool]
) -> tuple[list[Polygon], list[LineString]]:
    """Parts of a space and the cuts between them; the narrowest passage first, until none is narrow. ``under_lintel``
    tells whether a lintel hangs over a line.
    """
    best = min(_cuts(polygon, under_lintel), key=lambda c: c[0], default=None)
    if best is None:
        return [polygon], []
    _, cut, parts = best
    out: list[Polygon] = []
    cuts = [cut]
    for part in parts:
        pieces, more = split_at_portals(part, under_lintel)
        out += pieces
        cuts += more
    return out, cuts


def _cuts(
    polygon: Polygon, under_lintel: Callable[[LineString], bool]
) -> list[tuple[float, LineString, list[Polygon]]]:
    """Cuts of a space that leave two parts each large for the passage: (ratio, line, parts)."""
    found: list[tuple[float, LineString, list[Polygon]]] = []
    if polygon.area < 2 * SMALLEST_PART:
        return found
    outline = polygon.boundary
    for start, direction in _jutting_corners(polygon):
        line = _to_border(start, direction, outline)
        if line is None:
            continue
        parts = parts_of(polygon, line)
        if len(parts) != 2:
            continue
        smaller = min(p.area for p in parts)
        ratio = line.length**2 / smaller
        narrow = ratio <= NARROW or (ratio <= NARROW_UNDER_LINTEL and under_lintel(line))
        if smaller >= SMALLEST_PART and narrow:
            found.append((ratio, line, parts))
    return found


def under_lintel(line: LineString, plan: Plan) -> bool:
    """Whether along a line, no farther to a side than a wall is thick, something hangs lower than on both sides."""
    a, b = shapely.get_coordinates(line)
    along = (b - a) / np.linalg.norm(b - a)
    across = np.array([-along[1], along[0]])
    off = np.arange(-THICKEST - 4 * PLAN, THICKEST + 4.5 * PLAN, PLAN)
    steps = np.arange(PLAN / 2, line.length, PLAN)
    pixel = plan.grid.pixel_of(a + steps[:, None, None] * along + off[:, None] * across)
    inside = plan.grid.contains(pixel.reshape(-1, 2)).reshape(pixel.shape[:2])
    height = np.full(inside.shape, np.nan)
    height[inside] = plan.overhead_z[pixel[inside][:, 1], pixel[inside][:, 0]]
    profile = np.array([np.median(h[np.isfinite(h)]) if np.isfinite(h).mean() > 0.5 else np.nan for h in height.T])
    sides = [profile[off < -THICKEST], profile[off > THICKEST]]
    if any(np.isnan(side).all() for side in (*sides, profile)):
        return False
    return bool(min(float(np.nanmin(side)) for side in sides) - np.nanmin(profile) > LINTEL)


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


def parts_of(polygon: Polygon, line: LineString) -> list[Polygon]:
    """The parts into which a line from border to border cuts a space."""
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
