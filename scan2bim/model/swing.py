"""How far door leaves can turn in the building: until they meet a wall or a column."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import shapely

from scan2bim.model.elements import Opening, Storey, Wall
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import Leaf, opening_angle, opening_outline, wall_footprints

OPEN_LIMIT: Final = math.radians(110.0)
"""How far a leaf turns where nothing is in its way: past a right angle, short of the wall that it hangs in."""
_STEP: Final = math.radians(2.0)
_TOUCH: Final = 0.003  # metres that a leaf may reach into an obstacle: less than walls are placed to


class Obstacles:
    """What stands in a storey at the height of doors, for the leaves of all its doors."""

    def __init__(self, storey: Storey) -> None:
        voids = [
            shapely.Polygon(opening_outline(wall, opening)).buffer(1e-4)
            for wall in storey.walls
            for opening in wall.openings
            if opening.depth is None
        ]
        solid = [shapely.Polygon(ring) for ring in wall_footprints(storey).values()]
        solid += [shapely.Polygon(column.outline) for column in storey.columns if len(column.outline) > 2]
        cut = shapely.difference(shapely.make_valid(np.array(solid, object)), shapely.union_all(voids))
        self._tree = shapely.STRtree(shapely.buffer(cut, -_TOUCH))

    def swing_limit(self, wall: Wall, opening: Opening, leaf: Leaf) -> float:
        """The angle, radians, that the leaf can turn from closed; at least as far as it was found open.

        A leaf that already stands in an obstacle when closed has the usual limit: then the model is not exact enough.
        """
        limit = own = min(OPEN_LIMIT, _jamb_limit(wall, opening, leaf))
        for angle in np.arange(0.0, OPEN_LIMIT + _STEP / 2, _STEP).tolist():
            shape = shapely.Polygon(leaf_outline(wall, opening, leaf, leaf.turn * angle))
            if len(self._tree.query(shape, predicate="intersects")):
                limit = own if angle == 0.0 else min(own, angle - _STEP)
                break
        return max(limit, abs(leaf.angle))


def _jamb_limit(wall: Wall, opening: Opening, leaf: Leaf) -> float:
    """The angle, radians, at which a leaf that hangs behind the wall's face meets the edge of its own opening."""
    side = leaf.turn * math.copysign(1.0, leaf.reach)
    behind = wall.thickness.value / 2 - side * leaf.hinge[1]
    beside = min(leaf.hinge[0], opening.width.value - leaf.hinge[0])
    return math.pi / 2 + math.atan2(max(beside, 0.0), behind) if behind > 0.0 else math.pi


def leaf_outline(wall: Wall, opening: Opening, leaf: Leaf, angle: float) -> list[tuple[float, float]]:
    """The leaf's corners in plan, turned from closed by a signed angle, radians."""
    x0, y0, _ = point_on_wall(wall, opening.offset.value, 0.0, 0.0)
    frame = opening_angle(wall, opening)
    hinge = complex(x0, y0) + complex(*leaf.hinge) * np.exp(1j * frame)
    low, high = leaf.depth
    corners = np.array([complex(0.0, low), complex(leaf.reach, low), complex(leaf.reach, high), complex(0.0, high)])
    turned = hinge + corners * np.exp(1j * (frame + angle))
    return [(float(point.real), float(point.imag)) for point in turned]
