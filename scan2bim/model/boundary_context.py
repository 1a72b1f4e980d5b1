"""What stands round the spaces of a storey, in plan, and what is behind a point of a space's outline."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from scan2bim.model.elements import Point2, Space, Storey, Wall
from scan2bim.model.shapes import wall_footprints

if TYPE_CHECKING:
    from shapely import Polygon

BESIDE: Final = 0.15
"""Metres. A wall or column this near to a space's outline bounds it: outlines follow the faces to centimetres."""

THROUGH: Final = 0.4
"""Metres more than a wall is thick, within which the space behind it begins."""

OPEN: Final = 0.3
"""Metres. A space this near, with nothing between, is open to the other."""


@dataclass(frozen=True, slots=True)
class Solid:
    """A wall or column: outline in plan, top (z), how deep it is across, the wall where it is one."""

    id: str
    outline: Polygon
    top: float
    depth: float
    wall: Wall | None


@dataclass(frozen=True, slots=True)
class Behind:
    """What is behind a stretch of an outline: index of the solid, id of the space behind that or behind nothing."""

    solid: int | None
    beyond: str | None


class StoreyPlan:
    """The solids and spaces of a storey, to be asked by place."""

    def __init__(self, storey: Storey, solids: tuple[Solid, ...], areas: dict[str, tuple[Polygon, ...]]) -> None:
        import numpy as np
        import shapely

        self.solids = solids
        self.areas = areas
        self._spaces = [(space, polygon) for space in storey.spaces for polygon in areas.get(space.id, ())]
        self._solid_tree = shapely.STRtree([solid.outline for solid in solids])
        self._space_tree = shapely.STRtree([polygon for _, polygon in self._spaces])
        shapes = [solid.outline for solid in solids] + [polygon for _, polygon in self._spaces]
        corners: Any = shapely.get_coordinates(shapes) if shapes else np.zeros((0, 2))
        self._corners = corners
        self._corner_tree = shapely.STRtree(shapely.points(corners))

    def corners_near(self, start: Point2, end: Point2) -> list[Point2]:
        """Corners of solids and spaces within a metre of the line."""
        import shapely

        hits = self._corner_tree.query(shapely.LineString((start, end)), predicate="dwithin", distance=1.0)
        return [(float(x), float(y)) for x, y in self._corners[hits]]

    def behind(self, space: Space, place: Point2, outside: Point2) -> Behind:
        """What is behind a point of the outline, ``outside`` being a metre straight out from it."""
        if (to := _open_side(space, place)) is not None:
            return Behind(None, to)
        index = self._solid_at(place, outside)
        if index is None:
            return Behind(None, None)
        return Behind(index, self._beyond(space, place, outside, self.solids[index].depth + THROUGH))

    def open_to(self, space: Space, place: Point2, outward: Point2) -> str | None:
        """The space that begins behind a point of the outline where nothing is between."""
        return self._beyond(space, place, (place[0] + outward[0], place[1] + outward[1]), OPEN)

    def is_external(self, behind: Behind) -> bool | None:
        """Whether the outside is behind: by the wall, unless a space is."""
        if behind.beyond is not None:
            return False
        wall = None if behind.solid is None else self.solids[behind.solid].wall
        return None if wall is None else wall.external

    def _solid_at(self, place: Point2, outside: Point2) -> int | None:
        """The nearest solid, of several that touch the one that goes on outwards."""
        import shapely

        point = shapely.Point(place)
        hits: list[int] = self._solid_tree.query(point, predicate="dwithin", distance=BESIDE).tolist()
        if not hits:
            return None
        step = 0.02 / math.dist(place, outside)
        probe = shapely.Point(place[0] + step * (outside[0] - place[0]), place[1] + step * (outside[1] - place[1]))
        return min(hits, key=lambda i: (round(self.solids[i].outline.distance(probe), 4), self.solids[i].id))

    def _beyond(self, space: Space, place: Point2, outside: Point2, reach: float) -> str | None:
        import shapely

        out = ((outside[0] - place[0]) * reach + place[0], (outside[1] - place[1]) * reach + place[1])
        ray = shapely.LineString((place, out))
        touched: list[int] = self._space_tree.query(ray, predicate="intersects").tolist()
        hits = [i for i in touched if self._spaces[i][0].id != space.id]
        if not hits:
            return None
        start = shapely.Point(place)
        nearest = min(hits, key=lambda i: (self._spaces[i][1].distance(start), self._spaces[i][0].id))
        return self._spaces[nearest][0].id


def plan_of(storey: Storey) -> StoreyPlan:
    """The storey's plan; spaces without area or height have none."""
    import shapely

    outlines = wall_footprints(storey)
    walls = [
        Solid(wall.id, area, wall.base + wall.height.value, wall.thickness.value, wall)
        for wall in {wall.id: wall for wall in reversed(storey.walls)}.values()
        if (area := shapely.Polygon(outlines[wall.id])).is_valid and area.area > 1e-4 and wall.height.value > 0.0
    ]
    columns = [
        Solid(column.id, area, column.base + column.height.value, math.sqrt(area.area), None)
        for column in storey.columns
        if len(column.outline) > 2 and (area := shapely.Polygon(column.outline)).is_valid and area.area > 1e-4
    ]
    areas = {space.id: tuple(space_areas(space)) for space in storey.spaces if space.height.value > 0.0}
    return StoreyPlan(storey, (*walls[::-1], *columns), areas)


def space_areas(space: Space) -> list[Polygon]:
    """A space's area as valid polygons, outlines counter-clockwise and holes clockwise."""
    from scan2bim.model.plates import valid_areas

    return valid_areas(space.outline, space.holes)


def _open_side(space: Space, place: Point2) -> str | None:
    """The space to which the outline is open at a point."""
    for side in space.open_sides:
        run = math.dist(side.start, side.end)
        if run < 1e-6:
            continue
        dx, dy = (side.end[0] - side.start[0]) / run, (side.end[1] - side.start[1]) / run
        x, y = place[0] - side.start[0], place[1] - side.start[1]
        if 0.0 < x * dx + y * dy < run and abs(x * dy - y * dx) < BESIDE:
            return side.to
    return None
