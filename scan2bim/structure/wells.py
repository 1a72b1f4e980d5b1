"""Wells in a floor: where the stairs from below come up."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.polygons import polygons_of
from scan2bim.geometry.raster import closed
from scan2bim.structure.plan import Plan, pixels_in
from scan2bim.structure.stairs import FoundStair

LEDGE = 0.3
"""Width, metres, of what is too narrow to be floor between a well and a wall."""
ALONGSIDE = 0.2
"""Distance, metres, from the sides of a stair within which the floor beside its well begins."""
SMALLEST_WELL = 0.7
"""Plan area, square metres, of the smallest well: that of a spiral stair of 1 m."""
LANDING = 1.3
"""Floor beside a well, as a share of the well, from which it is more than the stair's landing."""
F64 = NDArray[np.float64]


def wells_of(below: Sequence[FoundStair], plan: Plan) -> list[Polygon]:
    """Outlines of the wells in a storey's floor through which the stairs from ``below`` come up.

    A stair opens the floor above it as far as no floor was seen over it.
    """
    wells: list[Polygon] = []
    bare = 1 - closed(plan.floor, 5)
    for stair in below:
        inside = pixels_in(stair.outline, plan)
        if (bare[inside] > 0).sum() > 0.5 * inside.sum():
            well = _open_part(stair, plan) if stair.kind == "straight" else stair.outline
            wells += [well] if well.area > SMALLEST_WELL else []
    return wells


def without_stairs(wells: Sequence[Polygon], stairs: Sequence[FoundStair]) -> list[Polygon]:
    """Wells over which no other of the ``stairs`` goes on: those belong to the room in which that stands."""
    standing = shapely.union_all([stair.outline for stair in stairs])
    return [well for well in wells if well.intersection(standing).area < 0.5 * well.area]


def without_wells(space: Polygon, wells: Sequence[Polygon]) -> tuple[list[Polygon], list[Polygon], list[LineString]]:
    """A space without the wells in its floor, those as parts of it, and the lines between both.

    A space that is little more than a well and its landing stays whole: it is the stair's own room. What would be left
    of the space between a well and a wall and is too narrow to stand on belongs to the well.
    """
    inside = [w for w in wells if w.intersection(space).area > 0.5 * w.area]
    if not inside or space.area < (1 + LANDING) * shapely.union_all(inside).area:
        return [space], [], []
    rest = space.difference(shapely.union_all(inside))
    rooms = [p for p in polygons_of(_opened(rest, LEDGE).intersection(space)) if p.area > SMALLEST_WELL]
    if not rooms:
        return [space], [], []
    left = _opened(space.difference(shapely.union_all(rooms)), LEDGE / 3)
    open_parts = [p for p in polygons_of(left) if p.area > SMALLEST_WELL / 2]
    shared = [shapely.intersection(room.boundary, shapely.buffer(part, 1e-3)) for room in rooms for part in open_parts]
    lines = [line for s in shared for line in shapely.get_parts(s) if isinstance(line, LineString)]
    sides = [LineString(pair) for line in lines for pair in pairwise(shapely.get_coordinates(line).tolist())]
    return rooms, open_parts, [side for side in sides if side.length > 0.05]


def _opened(shape: BaseGeometry, width: float) -> BaseGeometry:
    """A shape without what is narrower than a width, metres."""
    return shape.buffer(-width / 2, join_style="mitre").buffer(width / 2, join_style="mitre")


def _open_part(stair: FoundStair, plan: Plan) -> Polygon:
    """The well over a straight stair: its outline, each side moved to where the floor begins, the upper end cut off
    there.
    """
    along = stair.climb
    across = np.array([-along[1], along[0]])
    axes = np.array([along, across])
    corners = shapely.get_coordinates(stair.outline)[:4] @ axes.T
    low, high = corners.min(0), corners.max(0)
    row, col = np.nonzero(plan.floor)
    floor = (plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN) @ axes.T
    middle = (low[0] + high[0]) / 2
    sides = [
        _where_floor_begins(floor, 1, -1, low[1], low[0], high[0], ALONGSIDE),
        _where_floor_begins(floor, 1, 1, high[1], low[0], high[0], ALONGSIDE),
        _where_floor_begins(floor, 0, -1, low[0], low[1], high[1], ALONGSIDE),
        _where_floor_begins(floor, 0, 1, middle, low[1], high[1], high[0] - middle),
    ]
    (a, b, start), end = sides[:3], min(sides[3], high[0])
    if end == middle:
        end = high[0]
    return Polygon([s * along + t * across for s, t in ((start, a), (end, a), (end, b), (start, b))])


def _where_floor_begins(
    floor: F64, axis: int, sign: int, side: float, first: float, last: float, reach: float
) -> float:
    """Where floor (n, 2) begins beyond a side: the coordinate along ``axis``, from a little inside the side outwards
    (``sign``) to ``reach`` metres, where it fills most of the stretch from ``first`` to ``last``; else the side itself.
    """
    beside = (floor[:, 1 - axis] > first) & (floor[:, 1 - axis] < last)
    out = sign * (floor[beside, axis] - side) + ALONGSIDE / 2
    steps = np.bincount(np.floor(out[(out > 0) & (out < reach + ALONGSIDE / 2)] / PLAN).astype(int), minlength=1)
    full = np.flatnonzero(steps > 0.5 * (last - first) / PLAN)
    return side + sign * (float(full[0]) * PLAN - ALONGSIDE / 2) if len(full) else side
