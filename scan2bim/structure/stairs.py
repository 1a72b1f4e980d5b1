"""Stairs: chains of treads that climb from a storey's floor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.structure.plan import Plan
from scan2bim.structure.storeys import Layers, standing_and_hanging
from scan2bim.structure.treads import MOST_HIDDEN, STEEP, USUAL, Treads, chains_of, leads_up, treads_of

LEAST_RISE_TO_NOTHING = 1.6
"""Rise, metres, from which steps are a stair where no floor is known above: shelves and stacks in a room are lower."""
USUAL_TREAD = 0.04
"""Area seen, square metres, of half of a stair's treads at least: plants and heaps show less at one height."""
FILLED = 0.5
"""Share of what can be stood on in a stair's outline that its treads must be."""
PIECES = 2
"""Pieces of treads a riser, from which it is furniture at many heights: a tread is seldom seen in more than one piece.
"""
STRAIGHT = 0.9
"""Mean resultant length of the directions of climb from which a stair is straight (26 degrees of spread)."""
NEARLY = math.radians(12)
"""A stair that climbs this near to a wall's direction climbs along it."""
ROUND = 0.075
"""Spread of the distances of treads' far ends from the stair's middle, as a share, up to which it is a spiral stair:
those of one that winds reach into its corners.
"""
OVERLAP = 0.3
"""Share of a steep stair on what is a usual one, from which it is some of that one's treads."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class FoundStair:
    """A stair: its ``outline`` in plan; ``base`` and ``top`` heights; ``climb`` (2,) mean unit vector upwards in plan;
    ``kind``; ``risers`` counted, or reckoned where hidden; ``width`` metres across the climb.
    """

    outline: Polygon
    base: float
    top: float
    climb: F64
    kind: Literal["straight", "winding", "spiral"]
    risers: int
    width: float


def find_stairs(plan: Plan, above: float | None, surfels: Surfels, layers: Layers, yaw: float) -> list[FoundStair]:
    """Stairs that start in a storey. ``above`` is the next storey's floor (z), None if there is none; ``yaw`` radians
    the main wall direction.
    """
    floor = plan.levels.floor
    xyz = surfels.xyz[layers.order].astype(np.float64)
    pixel = plan.grid.pixel_of(xyz[:, :2])
    standing, _ = standing_and_hanging(layers)
    at = np.flatnonzero(
        standing
        & (xyz[:, 2] > floor + 0.08)
        & (xyz[:, 2] < (above if above is not None else plan.levels.top) - 0.05)
        & plan.grid.contains(pixel)
    )
    roof = plan.ceiling_z[pixel[at, 1], pixel[at, 0]]
    at = at[~(np.abs(xyz[at, 2] - roof) < 0.1)]
    index = np.full(plan.floor.shape, -1, np.int64)
    index[pixel[at, 1], pixel[at, 0]] = at
    row, col = np.nonzero(index >= 0)
    z = xyz[index[row, col], 2]
    xy = plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN
    found: list[FoundStair] = []
    for risers in (USUAL, STEEP):
        treads = treads_of(np.stack([row, col], 1), xy, z, index.shape, risers)
        chains = [c for c in chains_of(treads, floor) if risers is USUAL or leads_up(c, treads, floor, above)]
        stairs = [_stair(chain, treads, floor, above, yaw) for chain in chains]
        clear = shapely.union_all([stair.outline for stair in found])
        found += [s for s in stairs if s is not None and s.outline.intersection(clear).area < OVERLAP * s.outline.area]
    return found


def _stair(chain: I64, treads: Treads, floor: float, above: float | None, yaw: float) -> FoundStair | None:
    """The stair of a chain of treads; None if they do not climb from the floor."""
    xy, tread, steps = treads.xy, treads.tread, treads.steps
    count, height = treads.count, treads.height
    middle = np.stack([np.bincount(tread, weights=xy[:, k]) / count for k in range(2)], 1)
    mine = steps[np.isin(steps[:, 0], chain)]
    climb = middle[mine[:, 1]] - middle[mine[:, 0]]
    climb /= np.maximum(np.linalg.norm(climb, axis=1, keepdims=True), 1e-6)
    mean = np.average(climb, axis=0, weights=count[mine].min(1))
    straight = np.hypot(*mean) > STRAIGHT
    kind = "straight" if straight else "spiral" if _is_round(chain, tread, middle, count, xy) else "winding"
    riser = float(np.median(height[mine[:, 1]] - height[mine[:, 0]]))
    low, high = float(height[chain].min()), float(height[chain].max())
    if low > floor + 4 * riser or (above is None and high - floor < LEAST_RISE_TO_NOTHING):
        return None
    direction = _along_walls(mean, yaw)
    points = xy[np.isin(tread, chain)]
    if kind == "straight":
        points = _of_usual_width(points, tread[np.isin(tread, chain)], direction)
    top = above if above is not None and round((above - high) / riser) <= 3 else high
    if kind == "straight" and above is not None and above - high < MOST_HIDDEN * riser:
        going = float(np.median((middle[mine[:, 1]] - middle[mine[:, 0]]) @ direction))
        points = np.concatenate([points, points + direction * going * (round((above - high) / riser) - 1)])
        top = above
    outline = _outline(points, yaw, kind)
    risers = round((top - floor) / riser)
    within = shapely.contains_xy(outline, xy[:, 0], xy[:, 1])
    own = np.isin(tread[within], chain)
    small = np.median(count[chain]) * PLAN**2 < USUAL_TREAD
    if len(chain) > PIECES * risers or small or own.mean() < FILLED:
        return None
    if above is not None and above - high < MOST_HIDDEN * riser:  # turns hide the treads over them
        top, risers = above, round((above - floor) / riser)
    across = shapely.get_coordinates(outline) @ np.array([-direction[1], direction[0]])
    width = float(np.ptp(across)) if kind == "straight" else float(np.sqrt(np.median(count[chain]) * PLAN**2 * 4))
    return FoundStair(outline, floor, top, direction, kind, risers, width)


def _is_round(chain: I64, tread: I64, middle: F64, count: I64, xy: F64) -> bool:
    """Whether a chain's treads, of ``middle`` (t, 2) and ``count`` (t,) pixels, end on a circle about one point."""
    weight = count[chain].astype(np.float64)
    ones = np.sqrt(weight)
    square = (middle[chain] ** 2).sum(1)
    centre = np.linalg.lstsq(
        np.column_stack([2 * middle[chain], np.ones(len(chain))]) * ones[:, None], square * ones, rcond=None
    )[0][:2]
    ends = np.array([np.percentile(np.linalg.norm(xy[tread == t] - centre, axis=1), 98) for t in chain])
    mean = np.average(ends, weights=weight)
    return bool(np.sqrt(np.average((ends - mean) ** 2, weights=weight)) < ROUND * mean)


def _of_usual_width(points: F64, tread: I64, climb: F64) -> F64:
    """Points (n, 2) of treads without what lies beside most treads: something else at the height of one of them."""
    across = points @ np.array([-climb[1], climb[0]])
    order = np.argsort(tread, kind="stable")
    starts = np.flatnonzero(np.diff(tread[order], prepend=-1))
    sizes = np.diff(np.append(starts, len(order)))
    full = sizes >= np.median(sizes)
    low = float(np.percentile(np.minimum.reduceat(across[order], starts)[full], 25))
    high = float(np.percentile(np.maximum.reduceat(across[order], starts)[full], 75))
    return points[(across > low - PLAN) & (across < high + PLAN)]


def _along_walls(climb: F64, yaw: float) -> F64:
    """Unit vector of a climb, along the building's walls if it is nearly so."""
    angle = math.atan2(climb[1], climb[0])
    off = (angle - yaw + math.pi / 4) % (math.pi / 2) - math.pi / 4
    angle -= off if abs(off) < NEARLY else 0.0
    return np.array([math.cos(angle), math.sin(angle)])


def _outline(xy: F64, yaw: float, kind: str) -> Polygon:
    """Outline of treads (n, 2): a rectangle along the walls where they fill it, else their hull."""
    hull = shapely.buffer(shapely.convex_hull(shapely.multipoints(xy)), PLAN / 2, join_style="mitre")
    u = np.array([np.cos(yaw), np.sin(yaw)])
    v = np.array([-u[1], u[0]])
    along, across = np.percentile(xy @ u, [1, 99]), np.percentile(xy @ v, [1, 99])
    low, high = np.array([along[0], across[0]]) - PLAN / 2, np.array([along[1], across[1]]) + PLAN / 2
    corners = [low[0] * u + low[1] * v, high[0] * u + low[1] * v, high[0] * u + high[1] * v, low[0] * u + high[1] * v]
    box = Polygon(corners)
    fills = len(xy) * PLAN**2 > 0.6 * box.area or kind == "straight"
    return box if fills or not isinstance(hull, Polygon) else Polygon(shapely.simplify(hull, 0.05).exterior)
