"""Areas and volumes of walls with their openings, computed exactly from the model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from scan2bim.geometry.arcs import Arc
from scan2bim.model.elements import Opening, Point2, Ring, Wall
from scan2bim.model.queries import wall_arc, wall_length

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

LEAST_SIZE: Final = 0.01
"""Metres. Nothing narrower or lower is an opening."""

SAGITTA: Final = 1e-4
"""Metres that a polygon may leave an arc: no more than a hundred-thousandth of a wall's volume."""

BEYOND: Final = 10.0
"""Metres that an upper edge goes on beyond the axis, over the corners of joined walls."""


@dataclass(frozen=True, slots=True)
class WallMeasures:
    """Square and cubic metres. Gross as if nothing were cut out; net less openings, as far as these lie in the wall.

    Side areas are those of the wall's side along its axis; niches count in the volume alone.
    """

    footprint: float
    gross_side: float
    net_side: float
    gross_volume: float
    net_volume: float


@dataclass(frozen=True, slots=True)
class Void:
    """An opening's prism in a wall: outline in the wall's own frame, from z to z over the wall's base."""

    outline: Polygon
    low: float
    high: float


def measure_wall(wall: Wall, outline: Ring) -> WallMeasures:
    """The measures of a wall with this outline (in its own frame, as ``wall_outlines`` gives it)."""
    import shapely

    foot = shapely.Polygon(_bent(wall, outline))
    side = shapely.Polygon(side_outline(wall))
    boxes = [
        shapely.box(o.offset.value, o.sill.value, o.offset.value + o.width.value, o.sill.value + o.height.value)
        for o in wall.openings
        if is_opening(o) and o.depth is None
    ]
    net_side = side.area - (shapely.union_all(boxes).intersection(side).area if boxes else 0.0)
    # A slanted wall is cut level and swept askew: its section lies wider, its volume is that of an upright prism.
    widened = 1.0 / math.cos(wall.lean)
    gross = _prism_volume(foot, wall) * widened
    voids = [opening_void(wall, o) for o in wall.openings if is_opening(o)]
    return WallMeasures(foot.area * widened, side.area, net_side, gross, gross - _cut_volume(foot, wall, voids))


def is_opening(opening: Opening) -> bool:
    """Whether it is large enough to be one."""
    return min(opening.width.value, opening.height.value) >= LEAST_SIZE


def side_outline(wall: Wall) -> Ring:
    """The wall's side along its axis, from its base up to its upper edge; counter-clockwise."""
    length = wall_length(wall)
    top = wall.profile or ((0.0, wall.height.value), (length, wall.height.value))
    return ((0.0, 0.0), (length, 0.0), *reversed(top))


def _bent(wall: Wall, outline: Ring) -> Ring:
    """The outline of a curved wall in the frame of its chord, in steps that leave the arc by ``SAGITTA``."""
    axis = wall_arc(wall)
    if axis.curvature == 0.0:
        return outline
    points: list[Point2] = []
    for (x0, y0), (x1, y1) in pairwise((*outline, outline[0])):
        reach = max(abs(1.0 / axis.curvature - y0), SAGITTA)
        step = 2.0 * math.acos(1.0 - min(SAGITTA / reach, 1.0)) / abs(axis.curvature)
        count = max(1, math.ceil(abs(x1 - x0) / step))
        share = np.arange(count) / count
        points += [(x, y) for x, y in axis.place(x0 + (x1 - x0) * share, y0 + (y1 - y0) * share).tolist()]
    return tuple(points)


def reach_across(axis: Arc, width: float, thickness: float) -> float:
    """How far to each side of the axis a box of this width must reach to pierce the wall."""
    if axis.curvature == 0.0:
        return thickness / 2
    inner = max(abs(1.0 / axis.curvature) - thickness / 2, width / 2)
    return thickness / 2 + inner - math.sqrt(inner**2 - (width / 2) ** 2)


def opening_void(wall: Wall, opening: Opening) -> Void:
    """What the opening takes away: a box through the wall, or of a niche as deep as this is."""
    import shapely

    axis, half = wall_arc(wall), wall.thickness.value / 2
    width, start = opening.width.value, opening.offset.value
    reach = reach_across(axis, width, wall.thickness.value)
    low, high = -reach, reach
    if opening.depth is not None:
        deep = min(opening.depth.value, wall.thickness.value)
        low, high = (half - deep, reach) if opening.side == "left" else (-reach, deep - half)
    middle = start + width / 2
    turn = axis.direction(middle)
    cosine, sine = math.cos(turn), math.sin(turn)
    x, y = axis.place(np.array(middle), np.array(0.0)).tolist()
    corners = [(-width / 2, low), (width / 2, low), (width / 2, high), (-width / 2, high)]
    outline = shapely.Polygon([(x + cosine * u - sine * v, y + sine * u + cosine * v) for u, v in corners])
    low_edge = opening.sill.value / math.cos(wall.lean)
    return Void(outline, low_edge, low_edge + opening.height.value)


def height_at(profile: Sequence[Point2], along: float) -> float:
    """Height of an upper edge at a distance along the axis; beyond its ends it goes on as it does there."""
    for (x0, z0), (x1, z1) in pairwise(_prolonged(profile)):
        if along <= x1:
            return z0 + (z1 - z0) * (along - x0) / (x1 - x0) if x1 > x0 else z1
    return profile[-1][1]


def _prolonged(profile: Sequence[Point2]) -> list[Point2]:
    """The upper edge with its first and last stretch made longer by ``BEYOND``."""
    first, last = _onwards(profile[1], profile[0]), _onwards(profile[-2], profile[-1])
    return [first, *profile[1:-1], last]


def _onwards(inner: Point2, end: Point2) -> Point2:
    run = end[0] - inner[0]
    if run == 0.0:
        return end
    further = BEYOND if run > 0.0 else -BEYOND
    return (end[0] + further, end[1] + (end[1] - inner[1]) * further / run)


def _prism_volume(foot: Polygon, wall: Wall) -> float:
    """Volume of the wall below its upper edge: in each stretch the mean height is that at the stretch's centroid."""
    import shapely

    if not wall.profile:
        return foot.area * wall.height.value
    x0, y0, x1, y1 = foot.bounds
    cuts = [x0, *(x for x, _ in wall.profile if x0 < x < x1), x1]
    total = 0.0
    for left, right in pairwise(cuts):
        part = foot.intersection(shapely.box(left, y0, right, y1))
        if part.area > 0.0:
            total += part.area * height_at(wall.profile, part.centroid.x)
    return total


def _cut_volume(foot: Polygon, wall: Wall, voids: Sequence[Void]) -> float:
    """Volume that the voids take from the wall; what two share counts once."""
    import shapely

    if not voids:
        return 0.0
    top = wall.height.value / math.cos(wall.lean)
    levels = {0.0, top, *(z for _, z in wall.profile)}
    for void in voids:
        levels |= {void.low, void.high}
    heights = sorted(z for z in levels if 0.0 <= z <= top)
    total = 0.0
    for low, high in pairwise(heights):
        active = [void.outline for void in voids if void.low < (low + high) / 2 < void.high]
        if active:
            total += (high - low) * _mean_area(shapely.union_all(active).intersection(foot), wall, low, high)
    return total


def _mean_area(section: BaseGeometry, wall: Wall, low: float, high: float) -> float:
    """Mean area of a section from one height to another, below the wall's upper edge; it changes as a parabola."""
    if not wall.profile or section.area == 0.0:
        return section.area
    areas = [section.intersection(_below(wall, z, section)).area for z in (low + 1e-9, (low + high) / 2, high - 1e-9)]
    return (areas[0] + 4 * areas[1] + areas[2]) / 6


def _below(wall: Wall, height: float, section: BaseGeometry) -> BaseGeometry:
    """The plan strips in which the wall is higher than this."""
    import shapely

    _, y0, _, y1 = section.bounds
    strips: list[BaseGeometry] = []
    for (xa, za), (xb, zb) in pairwise(_prolonged(wall.profile)):
        if max(za, zb) <= height or xb <= xa:
            continue
        left, right = xa, xb
        if min(za, zb) < height:
            crossing = xa + (xb - xa) * (height - za) / (zb - za)
            left, right = (crossing, xb) if zb > za else (xa, crossing)
        strips.append(shapely.box(left, y0 - 1.0, right, y1 + 1.0))
    return shapely.union_all(strips)
