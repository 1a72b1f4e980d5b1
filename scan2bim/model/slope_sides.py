"""What of a space's side, under slopes, a wall stands beside."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from scan2bim.model.boundary_context import Solid
from scan2bim.model.ceilings import under_ceiling
from scan2bim.model.elements import Point2, Ring, Space, Wall
from scan2bim.model.queries import wall_direction
from scan2bim.model.wall_measures import height_at

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

NARROW: Final = 0.15
"""Metres. What a wall ends lower than the ceiling by less reaches it: the two were measured apart."""
BEYOND: Final = 10.0
"""Metres that an upper edge goes on beyond the axis, over the corners of joined walls."""
PARALLEL: Final = 0.9
"""Cosine of the angle up to which an edge runs along a wall: else it is that of its end."""
LEAST: Final = 1e-4
"""Square metres of the smallest area."""


def stretch_under(space: Space, start: Point2, end: Point2, part: tuple[float, float]) -> Polygon:
    """The upright area over a part of an edge, ``part`` metres along it: x from the part's start, y over the base."""
    import shapely

    whole = under_ceiling(space, start, end)
    cut = shapely.intersection(whole, shapely.box(part[0], 0.0, part[1], space.height.value), grid_size=1e-4)
    polygons = [p for p in shapely.get_parts(cut) if isinstance(p, shapely.Polygon)]
    largest = max(polygons, key=lambda p: p.area, default=shapely.box(part[0], 0.0, part[1], space.height.value))
    return shapely.transform(largest, lambda xy: xy - [part[0], 0.0])


def beside_wall(
    room: Polygon, solid: Solid, base: float, start: Point2, along: Point2
) -> tuple[Polygon | None, BaseGeometry]:
    """The area that a solid stands beside, up to its upper edge, and the rest; ``start`` is where x is 0."""
    import shapely

    from scan2bim.geometry.polygons import area_outside

    top = shapely.box(-1.0, -1.0, room.bounds[2] + 1.0, solid.top - base)
    below = top if solid.wall is None or not solid.wall.profile else _below(solid.wall, base, start, along)
    rest = shapely.difference(room, below)
    high = [p for p in shapely.get_parts(rest) if not p.buffer(-NARROW / 2).is_empty]
    own = shapely.difference(room, shapely.union_all(high), grid_size=1e-4)
    parts = [p for p in shapely.get_parts(own) if isinstance(p, shapely.Polygon) and p.area > LEAST]
    if not parts:
        return None, room
    largest = max(parts, key=lambda p: p.area)
    return largest, area_outside(room, largest, 1e-4)


def _below(wall: Wall, base: float, start: Point2, along: Point2) -> Polygon:
    """The area below a wall's upper edge, as seen along an edge beside it."""
    import shapely

    (ux, uy), (dx, dy) = wall_direction(wall, 0.0), along
    if abs(ux * dx + uy * dy) < PARALLEL:
        across = (start[0] - wall.start[0]) * ux + (start[1] - wall.start[1]) * uy
        return shapely.box(-BEYOND, -1.0, BEYOND, wall.base + height_at(wall.profile, across) - base)
    turn = 1.0 if ux * dx + uy * dy > 0 else -1.0
    offset = (wall.start[0] - start[0]) * dx + (wall.start[1] - start[1]) * dy
    edge = [(offset + turn * x, wall.base + z - base) for x, z in wall.profile]
    ends = (edge[0][0] - turn * BEYOND, edge[0][1]), (edge[-1][0] + turn * BEYOND, edge[-1][1])
    line = [ends[0], *edge, ends[1]]
    quads = [shapely.Polygon([(a, -1.0), (b, -1.0), (b, z1), (a, z0)]) for (a, z0), (b, z1) in pairwise(line) if a != b]
    found = shapely.union_all(quads, grid_size=1e-6)
    return max((p for p in shapely.get_parts(found) if isinstance(p, shapely.Polygon)), key=lambda p: p.area)


def ring_of(area: Polygon) -> Ring:
    """An area's outline counter-clockwise, the first point not repeated."""
    import shapely

    outline = shapely.get_coordinates(shapely.orient_polygons(area).exterior)[:-1]
    return tuple((float(x), float(y)) for x, y in outline)
