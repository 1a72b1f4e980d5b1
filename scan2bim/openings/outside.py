"""Whether a window leads out of the building, or into a part of it that nobody looked into: a shaft, a core, a chimney.

Such a part shows nothing that a window needs: neither the open nor a thing beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.geometry.polygons import filled, polygons_of
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import StoreyShape, WallShape

GAP = 1.2
"""Width, metres, up to which a gap in a building's outline does not open what is behind it: ends of walls that were not
seen to meet, niches."""
BEYOND = 0.3
"""Metres beyond a wall from which on a thing is not the wall's own: reveals, frames and mixed ranges are nearer."""
FARTHEST = 6.0
"""Metres beyond the wall up to which something is looked for: a light well's width."""
SHALLOWEST = 1.0
"""Metres to which such a part must reach beyond the wall: light wells are wider, chimneys and ducts are narrower."""
SEEN = 20
"""Surface elements that must be seen beyond: 5 dm2, more than stray points and reflections in panes."""


def enclosed_parts(storey: StoreyShape) -> list[Polygon]:
    """What lies within a storey's outline and is neither space nor wall."""
    bodies = shapely.union_all(
        [*(s.polygon for s in storey.spaces), *(_outline(w) for w in storey.walls)], grid_size=1e-6
    )
    whole = bodies.buffer(GAP / 2).buffer(-GAP / 2)
    between = filled(whole).difference(bodies).buffer(-BEYOND / 2).buffer(BEYOND / 2)
    return polygons_of(between)


def _outline(wall: WallShape) -> BaseGeometry:
    return wall.line.buffer(wall.thickness / 2, cap_style="square")


def leads_somewhere(
    opening: OpeningShape,
    wall: WallShape,
    enclosed: Sequence[Polygon],
    surfels: NDArray[np.float32],
    index: PlanIndex,
) -> bool:
    """Whether behind an opening there is a space, the open, or something that was seen: of ``surfels`` (n, 3) and
    their ``index`` those of its height count.
    """
    if opening.kind != "window" or (wall.left and wall.right):
        return True
    wall = wall.straight_at(opening.offset + opening.width / 2)
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    outwards = np.array([-direction[1], direction[0]]) * (-1.0 if wall.left else 1.0)
    face = start + (opening.offset + opening.width / 2) * direction + wall.thickness / 2 * outwards
    part = next((p for p in enclosed if p.contains(Point(face + BEYOND * outwards))), None)
    if part is None:
        return True
    ahead = part.intersection(LineString([face, face + FARTHEST * outwards]))
    if ahead.length < SHALLOWEST:
        return False
    corners = [
        face + s * opening.width / 2 * direction + d * outwards
        for s, d in ((-1, BEYOND), (1, BEYOND), (1, FARTHEST), (-1, FARTHEST))
    ]
    beyond = part.intersection(Polygon(corners))
    low, high = wall.base + opening.sill, wall.base + opening.sill + opening.height
    middle = np.array([face, face + FARTHEST * outwards])
    rows = surfels[index.along(middle, opening.width / 2, ordered=False)]
    rows = rows[(rows[:, 2] > low) & (rows[:, 2] < high)]
    return int(shapely.contains_xy(beyond, rows[:, 0].astype(np.float64), rows[:, 1].astype(np.float64)).sum()) >= SEEN
