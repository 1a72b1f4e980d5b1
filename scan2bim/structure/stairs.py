"""Stairs: treads each a riser above the last, and the wells that they leave in the floor above.

Level pieces of surface that one could stand on are chained where one begins beside the other a riser higher. Furniture
has two or three such heights, a stair many; it makes no difference whether it is straight or winds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.geometry.graphs import connected_parts
from scan2bim.geometry.polygons import polygons_of
from scan2bim.geometry.raster import closed
from scan2bim.structure.plan import Plan, pixels_in
from scan2bim.structure.storeys import Layers, standing_and_hanging

LEVEL = 0.03
"""Difference of height, metres, between neighbouring pixels of one tread."""
NEAR = 2
"""Pixels: what lies level within 10 cm is the same tread."""
NEXT = 4
"""Pixels: the next tread begins within 20 cm; of a tread over one's eyes only the front is seen."""
SMALLEST_TREAD = 0.015
"""Area seen, square metres, of the smallest tread: the edge of one."""
LARGEST_TREAD = 3.0
"""Area, square metres, of the largest: a landing."""
EVEN, MOST_EVEN = 0.03, 0.7
"""Metres by which a tread may lie off an even climb, and the share of them that do not: things have any height."""
LEAST_RISER, MOST_RISER = 0.13, 0.23
"""Heights, metres, that a riser can have, with the noise of seeing it."""
FEWEST_TREADS = 5
"""Treads that make a stair: sofas and cupboards have fewer heights."""
MOST_HIDDEN = 10
"""Upper treads of a straight flight that may have been hidden from below: it is drawn on to the floor above; and treads
of any stair between those seen below and above."""
LEAST_RISE_TO_NOTHING = 1.6
"""The same where no floor is known above: shelves and stacks in a room are lower."""
FEWEST_SEEN = 3
"""Treads of a part of a stair, where those between it and another part were hidden."""
MOST_GOING = 0.35
"""Depth, metres, of the deepest tread where one was hidden."""
LEAST_RISE = 0.9
"""Rise, metres, from which steps are a stair."""
LEDGE = 0.3
"""Width, metres, of what is too narrow to be floor between a well and a wall."""
ALONGSIDE = 0.2
"""Distance, metres, from the sides of a stair within which the floor beside its well begins."""
SMALLEST_WELL = 0.7
"""Plan area, square metres, of the smallest well: that of a spiral stair of 1 m."""
USUAL_TREAD = 0.04
"""Area seen, square metres, of half of a stair's treads at least: plants and heaps show less at one height."""
FILLED = 0.5
"""Share of what can be stood on in a stair's outline that its treads must be."""
PIECES = 2
"""Pieces of treads a riser, from which it is furniture at many heights: a tread is seldom seen in more than one piece.
"""
LANDING = 1.3
"""Floor beside a well, as a share of the well, from which it is more than the stair's landing."""
STRAIGHT = 0.9
"""Mean resultant length of the directions of climb from which a stair is straight (26 degrees of spread)."""
NEARLY = math.radians(12)
"""A stair that climbs this near to a wall's direction climbs along it."""
ROUND = 0.075
"""Spread of the distances of treads' far ends from the stair's middle, as a share, up to which it is a spiral stair:
those of one that winds reach into its corners.
"""
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
    tread, steps = _treads(row, col, z, index.shape)
    return [
        stair
        for chain in _chains(tread, steps, z - floor, xy)
        if (stair := _stair(chain, tread, steps, xy, z, floor, above, yaw)) is not None
    ]


def _pairs(row: I64, col: I64, shape: tuple[int, ...], near: int) -> I64:
    """Numbers (p, 2) of pixels that lie within ``near`` pixels of each other, each pair once."""
    number = np.full((shape[0] + 2 * near, shape[1] + 2 * near), -1, np.int64)
    number[row + near, col + near] = np.arange(len(row))
    found: list[I64] = []
    for dr in range(near + 1):
        for dc in range(-near, near + 1):
            if dr > 0 or dc > 0:
                other = number[row + near + dr, col + near + dc]
                at = np.flatnonzero(other >= 0)
                found.append(np.stack([at, other[at]], 1))
    return np.concatenate(found)


def _treads(row: I64, col: I64, z: F64, shape: tuple[int, ...]) -> tuple[I64, I64]:
    """Tread number (n,) of each pixel, and pairs of treads (s, 2) that are a riser apart, the lower first."""
    pairs = _pairs(row, col, shape, NEAR)
    rise = z[pairs[:, 1]] - z[pairs[:, 0]]
    tread = connected_parts(len(z), pairs[np.abs(rise) < LEVEL])
    size = np.bincount(tread)
    height = np.bincount(tread, weights=z) / np.maximum(size, 1)
    fits = (size * PLAN**2 > SMALLEST_TREAD) & (size * PLAN**2 < LARGEST_TREAD)
    steps = np.flatnonzero(fits[tread])
    couples = tread[steps[_pairs(row[steps], col[steps], shape, NEXT)]]
    step = np.abs(height[couples[:, 1]] - height[couples[:, 0]])
    couples = couples[(step > LEAST_RISER) & (step < MOST_RISER)]
    count = max(len(size), 1)
    couples = np.stack(np.divmod(np.unique(couples.min(1) * count + couples.max(1)), count), 1)
    up = height[couples[:, 1]] > height[couples[:, 0]]
    return tread, np.where(up[:, None], couples, couples[:, ::-1])


def _chains(tread: I64, steps: I64, z: F64, xy: F64) -> list[I64]:
    """Groups of tread numbers that follow each other, of enough different heights ``z`` above the floor."""
    if not len(steps):
        return []
    count = int(tread.max()) + 1
    group = connected_parts(count, steps)
    height = np.bincount(tread, weights=z) / np.bincount(tread)
    runs = [np.flatnonzero(group == number) for number in np.unique(group[steps[:, 0]])]
    runs = _over_gaps([run for run in runs if _levels(height[run]) >= FEWEST_SEEN], tread, height, xy)
    return [run for run in runs if _levels(height[run]) >= FEWEST_TREADS and np.ptp(height[run]) > LEAST_RISE]


def _levels(height: F64) -> int:
    """Number of different heights of treads."""
    return 1 + int((np.diff(np.sort(height)) > LEAST_RISER / 2).sum())


def _over_gaps(runs: list[I64], tread: I64, height: F64, xy: F64) -> list[I64]:
    """Runs of tread numbers, those joined of which one goes on above the other with hidden treads between."""
    runs = sorted(runs, key=lambda run: float(height[run].min()))
    order = np.argsort(tread, kind="stable")
    ends = np.searchsorted(tread[order], np.arange(len(height) + 1))

    def within(first: int, second: int, reach: float) -> bool:
        lower, upper = (xy[order[ends[number] : ends[number + 1]]] for number in (first, second))
        apart = np.maximum(lower.min(0) - upper.max(0), upper.min(0) - lower.max(0))
        if max(apart) >= reach:
            return False
        return float(np.linalg.norm(lower[:, None] - upper[None], axis=2).min()) < reach

    for lower, run in enumerate(runs):
        stair = _from_floor(height[run])
        for upper in range(lower + 1, len(runs)) if stair else ():
            if _goes_on(run, stair or (0.0, 0.0), runs[upper], height, within):
                runs[lower], runs[upper] = run[:0], np.concatenate([run, runs[upper]])
                break
    return [run for run in runs if len(run)]


def _from_floor(height: F64) -> tuple[float, float] | None:
    """Riser and height, metres, of the first of a run's treads if it starts at the floor: those that most pairs of
    treads tell, for something else may stand beside them.
    """
    number = np.rint((height - height.min()) / _riser(height))
    apart = number[:, None] - number
    riser = float(np.median((height[:, None] - height)[apart > 0] / apart[apart > 0]))
    first = float(np.median(height - number * riser))
    even = float((np.abs(height - first - number * riser) < EVEN).mean())
    rises = LEAST_RISER < riser < MOST_RISER and even > MOST_EVEN
    return (riser, first) if rises and first <= 1.5 * riser else None


def _goes_on(
    lower: I64, stair: tuple[float, float], upper: I64, height: F64, within: Callable[[int, int, float], bool]
) -> bool:
    """Whether an ``upper`` run of treads continues a ``lower`` one, of a ``stair``'s riser and first height: whole
    numbers of risers higher, no farther off than the treads between reach.
    """
    riser, first = stair
    number, over = (np.rint((height[run] - first) / riser) for run in (lower, upper))
    off = [np.median(np.abs(height[run] - first - n * riser)) for run, n in ((lower, number), (upper, over))]
    if max(off) >= LEVEL:
        return False
    between = over[None] - number[:, None]
    follows = (between > 0) & (over > number.max()) & (between < MOST_HIDDEN)
    return any(within(int(lower[a]), int(upper[b]), float(between[a, b]) * MOST_GOING) for a, b in np.argwhere(follows))


def _riser(height: F64) -> float:
    """Median step, metres, between different heights of treads."""
    steps = np.diff(np.sort(height))
    return float(np.median(steps[steps > LEAST_RISER / 2]))


def _stair(
    chain: I64, tread: I64, steps: I64, xy: F64, z: F64, floor: float, above: float | None, yaw: float
) -> FoundStair | None:
    """The stair of a chain of treads; None if they do not climb from the floor."""
    count = np.maximum(np.bincount(tread), 1)
    height = np.bincount(tread, weights=z) / count
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
    treads = np.isin(tread[within], chain)
    small = np.median(count[chain]) * PLAN**2 < USUAL_TREAD
    if len(chain) > PIECES * risers or small or treads.mean() < FILLED:
        return None
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
