"""Which lengths a plan is dimensioned with: outer walls with their openings, and the whole along its directions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from scan2bim.model.elements import Building, Point2, Storey, Wall
from scan2bim.model.shapes import to_plan, wall_footprints
from scan2bim.model.wall_outlines import wall_outlines

_SHORTEST: Final = 0.05
"""Metres: nearer points are one."""


@dataclass(frozen=True, slots=True)
class DimensionLine:
    """A chain of lengths between points on one straight line, drawn beside it.

    points: metres, at least two, in the chain's order. outwards: unit vector to the side that it is drawn on. row: how
    many rows of chains out, 1 for the nearest.
    """

    points: tuple[Point2, ...]
    outwards: Point2
    row: int

    @property
    def lengths(self) -> tuple[float, ...]:
        """Of its parts, metres."""
        return tuple(math.dist(a, b) for a, b in pairwise(self.points))


def dimension_lines(storey: Storey, building: Building) -> tuple[DimensionLine, ...]:
    """The chains of a storey: one along each straight outer wall with openings, and two for the whole."""
    return (*_wall_lines(storey), *_whole(storey, building.frame.yaw))


def _wall_lines(storey: Storey) -> Iterator[DimensionLine]:
    outlines = wall_outlines(storey.walls)
    for wall in storey.walls:
        side = outer_side(wall)
        through = [opening for opening in wall.openings if opening.depth is None]
        if side == 0 or wall.bulge or not through:
            continue
        xs = [x for x, y in outlines[wall.id] if y * side > 0]
        cuts = [o.offset.value + share * o.width.value for o in through for share in (0, 1)]
        face = side * wall.thickness.value / 2
        points = tuple(to_plan(wall, x, face) for x in _apart(sorted([*xs, *cuts])))
        if len(points) > 1:
            yield DimensionLine(points, _normal(wall, side), 1)


def outer_side(wall: Wall) -> int:
    """1 where the left side looks outside, -1 where the right one does, else 0."""
    if bool(wall.left_spaces) == bool(wall.right_spaces):
        return -1 if wall.external and not wall.left_spaces else 0
    return -1 if wall.left_spaces else 1


def _normal(wall: Wall, side: int) -> Point2:
    (x0, y0), (x1, y1) = to_plan(wall, 0.0, 0.0), to_plan(wall, 0.0, float(side))
    return x1 - x0, y1 - y0


def _apart(values: list[float]) -> list[float]:
    return [value for k, value in enumerate(values) if k == 0 or value - values[k - 1] > _SHORTEST]


def _whole(storey: Storey, yaw: float) -> Iterator[DimensionLine]:
    """Length and breadth over all walls, along the building's main directions."""
    points = np.array([point for ring in wall_footprints(storey).values() for point in ring]).reshape(-1, 2)
    if not len(points):
        return
    c, s = math.cos(yaw), math.sin(yaw)
    turned = points @ np.array([[c, -s], [s, c]])
    low, high = turned.min(axis=0), turned.max(axis=0)
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]]]) @ np.array([[c, s], [-s, c]])
    a, b, d = ((float(x), float(y)) for x, y in corners)
    yield DimensionLine((a, b), (s, -c), 2)
    yield DimensionLine((b, d), (c, s), 2)
