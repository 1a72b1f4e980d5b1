"""Walls that would take each other's place are cut back, and such as stop just short of another reach it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from scan2bim.geometry.polygons import area_outside, largest_part, polygons_of
from scan2bim.structure.axes import F64, Axis, AxisJoin

PARALLEL = 0.9986
"""Cosine of 3 degrees: walls that differ by more cross or corner, and are cut where they join."""
LEAST = 0.02
"""Metres, along and across, that two walls may share: the walls of one strip differ by this."""
THINNEST = 0.06
"""Metres. What is left of a wall beside another and thinner than this is a pilaster's front or noise, not a wall."""
SHORTEST = 0.15
"""Metres. What is left of a wall and shorter than this is none."""
SAME = 0.8
"""Share of its area in a longer wall across it of what is the same pier, taken by its sides."""
IN_OTHERS = 0.5
"""Share of its area that lies in joined walls of what is none beside them."""
DEEP = 0.02
"""Metres that a space may reach into a wall: the evenness of a face."""
SHORT_OF = 0.12
"""Metres. An end this near before another wall was meant to reach it."""
SNAP = 1e-6
"""Metres. Overlays snap to this grid."""
BEFORE = 0.12
"""Metres. What holds a space off a wall's face by less is a curtain or panel before it: were it wall, it had a body."""
AROUND = 1.0
"""Metres. Walls beyond have no part in what holds a space off a wall's face."""
ALONG = 0.3
"""Share of its outline with which what lies between a space and a wall's face lies on this face."""


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """The bodies in plan of walls, (n,) polygons, to be asked which of them lie near a shape."""

    polygons: NDArray[np.object_]
    tree: shapely.STRtree

    @staticmethod
    def of(axes: Sequence[Axis], cap: Literal["flat", "square"] = "flat") -> Bodies:
        """Those of straight axes, with these ends."""
        polygons = np.array([_body(axis, cap) for axis in axes], dtype=object)
        return Bodies(polygons, shapely.STRtree(polygons))

    def near(self, shape: Polygon, distance: float = 0.0) -> NDArray[np.object_]:
        """Those within a distance, metres, in their order."""
        return self.polygons[np.sort(self.tree.query(shape, predicate="dwithin", distance=distance))]


def parted(axes: Sequence[Axis]) -> list[Axis]:
    """Walls of which no two that run alike overlap: the longer one stays, of the shorter one the larger rest does.

    A thick short wall over a thin long one is a pier beside it: it keeps the face that was seen. Ends, not joined yet,
    stay on their lines.
    """
    order = sorted(range(len(axes)), key=lambda k: -axes[k].length)
    kept: dict[int, Axis] = {}
    for number, near in zip(order, _meeting([axes[k] for k in order]), strict=True):
        rest: Axis | None = axes[number]
        for longer in (kept[order[k]] for k in near if order[k] in kept):
            rest = None if rest is None else _beside(longer, rest)
        if rest is not None:
            kept[number] = rest
    return [kept[number] for number in sorted(kept)]


def _meeting(axes: Sequence[Axis]) -> Iterator[list[int]]:
    """For each wall the numbers of the walls that may meet it, rising, by circles round them."""
    middles = np.array([(axis.start + axis.end) / 2 for axis in axes]).reshape(-1, 2)
    radii = np.array([(axis.length + axis.thickness) / 2 for axis in axes])
    for middle, radius in zip(middles, radii, strict=True):
        yield np.flatnonzero(np.hypot(*(middles - middle).T) <= radii + radius).tolist()


def parted_again(axes: Sequence[Axis], joins: Sequence[AxisJoin]) -> tuple[list[Axis], list[AxisJoin]]:
    """Walls without joins cut back once more, from those that were drawn on to their joints; joins renumbered."""
    joined = {number for join in joins for number in (join.one, join.other)}
    rests: list[Axis | None] = list(axes)
    near = list(_meeting(axes))
    for number in sorted(set(range(len(axes))) - joined, key=lambda k: -axes[k].length):
        for other in near[number]:
            rest, longer = rests[number], rests[other]
            if rest is not None and longer is not None and (other in joined or longer.length > rest.length):
                rests[number] = _beside(longer, rest)
    bodies = Bodies.of([axes[k] for k in joined], "square")  # about as far as their mitres reach
    rests = [rest if k in joined or rest is None else _unless_inside(rest, bodies) for k, rest in enumerate(rests)]
    new = {old: number for number, old in enumerate(k for k, rest in enumerate(rests) if rest is not None)}
    kept = [replace(join, one=new[join.one], other=new[join.other]) for join in joins]
    return [rest for rest in rests if rest is not None], kept


def _unless_inside(axis: Axis, joined: Bodies) -> Axis | None:
    """None for a wall with more than half of its area in walls that are joined: a step at their corner."""
    own = _body(axis)
    return None if own.intersection(shapely.union_all(joined.near(own))).area > IN_OTHERS * own.area else axis


def _beside(longer: Axis, axis: Axis) -> Axis | None:
    """What is left of a wall where the longer one does not stand: itself if they share nothing, None for nothing."""
    turn = float(longer.direction @ axis.direction)
    if abs(turn) < PARALLEL:
        own = _body(axis)
        return None if own.intersection(_body(longer)).area > SAME * own.area else axis
    ends = np.array([axis.start, axis.end]) - longer.start
    low, high = sorted((ends @ longer.direction).tolist())
    middle = float((ends @ longer.normal).mean())
    right, left = middle - axis.thickness / 2, middle + axis.thickness / 2
    half = longer.thickness / 2
    if min(high, longer.length) - max(low, 0.0) < LEAST or min(left, half) - max(right, -half) < LEAST:
        return axis
    along = max(((low, min(high, 0.0)), (max(low, longer.length), high)), key=lambda part: part[1] - part[0])
    sides = [part for part in ((max(right, half), left), (right, min(left, -half))) if _shows(axis, part, turn, right)]
    across = max(sides, key=lambda part: part[1] - part[0], default=(0.0, 0.0))
    thick, length = across[1] - across[0], along[1] - along[0]
    if length * (left - right) >= thick * (high - low):
        return None if length < SHORTEST else _placed(longer, axis, along, (right, left), turn)
    if thick < THINNEST:
        return None
    rest = _placed(longer, axis, (low, high), across, turn)
    hidden_left = (across[0] == right) == (
        turn > 0
    )  # what is cut off is the wall's left, where the longer one stands now
    return replace(rest, left=frozenset()) if hidden_left else replace(rest, right=frozenset())


def _shows(axis: Axis, part: tuple[float, float], turn: float, right: float) -> bool:
    """Whether a part, from right to left of the longer wall's axis, has a face that was seen.

    Of a wall with a space on one side it is that side's.
    """
    if axis.left and axis.right:
        return True
    faces_left = bool(axis.left) == (turn > 0)
    return faces_left == (part[0] > right)


def _placed(longer: Axis, axis: Axis, along: tuple[float, float], across: tuple[float, float], turn: float) -> Axis:
    """The wall over these stretches along and across the longer one."""
    aside = longer.start + longer.normal * (across[0] + across[1]) / 2
    ends = [aside + longer.direction * t for t in (along if turn > 0 else along[::-1])]
    return replace(axis, start=ends[0], end=ends[1], thickness=across[1] - across[0])


def reaching(axes: Sequence[Axis], joins: Sequence[AxisJoin]) -> list[Axis]:
    """The walls, those of which a free end stops just short of another one drawn on to its face."""
    if not axes:
        return []
    bodies = np.array([_body(axis) for axis in axes])
    tree = shapely.STRtree(bodies)
    joined = {(join.one, join.at) for join in joins}
    out = list(axes)
    for number, axis in enumerate(axes):
        for at, end, away in (("start", axis.start, -axis.direction), ("end", axis.end, axis.direction)):
            if (number, at) in joined:
                continue
            near = [k for k in tree.query(bodies[number], predicate="dwithin", distance=SHORT_OF) if k != number]
            if near and not any(shapely.dwithin(bodies[k], shapely.Point(end), 0.01) for k in near):
                out[number] = _drawn_on(out[number], at, end, away, bodies[near])
    return out


def _body(axis: Axis, cap: Literal["flat", "square"] = "flat") -> Polygon:
    return shapely.buffer(axis.line, axis.thickness / 2, cap_style=cap)


def _drawn_on(axis: Axis, at: str, end: F64, away: F64, others: NDArray[np.object_]) -> Axis:
    ray = shapely.LineString([end, end + away * SHORT_OF])
    met = shapely.distance(shapely.intersection(ray, others), shapely.Point(end))
    gap = float(np.nanmin(met)) if np.isfinite(met).any() else np.nan
    if not np.isfinite(gap):
        return axis
    point = end + away * gap
    return replace(axis, start=point) if at == "start" else replace(axis, end=point)


def clear_of(space: Polygon, walls: Bodies) -> Polygon:
    """A space without the walls that reach into it: assumed ones, and straight ones whose face was not."""
    near = walls.near(space)
    shared = shapely.intersection(near, space)
    inside = [
        body
        for body, part in zip(near, shared, strict=True)
        if part.area < 0.9 * body.area and not part.buffer(-DEEP / 2).is_empty
    ]
    if not inside:
        return space
    rest = area_outside(space, shapely.union_all(inside), SNAP)
    even = rest.buffer(-DEEP / 2, join_style="mitre").buffer(DEEP / 2, join_style="mitre")
    return largest_part(even, space)


def up_to(space: Polygon, walls: Bodies, others: Sequence[Polygon] = ()) -> Polygon:
    """A space drawn on to the faces of walls where something flat before them held it off, and no other space is."""
    bodies = walls.near(space, AROUND)
    if not len(bodies):
        return space
    near = shapely.union_all(bodies)
    both = shapely.union_all(polygons_of(shapely.union(space, near, grid_size=SNAP)))
    closed = both.buffer(BEFORE / 2, join_style="mitre").buffer(-BEFORE / 2, join_style="mitre")
    strips = [s for s in shapely.get_parts(shapely.difference(closed, both, grid_size=SNAP)) if s.intersects(space)]
    faces = near.boundary.buffer(2 * SNAP)
    between = [
        strip
        for strip in strips
        if strip.boundary.intersection(faces).length > ALONG * strip.length
        and not strip.buffer(-DEEP / 2).is_empty
        and not shapely.dwithin(strip, np.array(others, dtype=object), SNAP).any()
    ]
    if not between:
        return space
    whole = shapely.union_all([space, *between], grid_size=SNAP)
    even = whole.buffer(DEEP / 2, join_style="mitre").buffer(-DEEP / 2, join_style="mitre").simplify(DEEP / 4)
    return even if isinstance(even, Polygon) else space
