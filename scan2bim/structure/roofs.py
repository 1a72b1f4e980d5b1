"""Roof planes over an attic: sloping ceilings as planes, and the upper edges of the walls that follow them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.polygons import largest_part
from scan2bim.geometry.raster import closed, opened
from scan2bim.structure.plan import Plan, pixels_in, rise
from scan2bim.structure.shapes import Point, RoofShape

SLOPES = (0.2, 2.7)
"""Tangents of the slopes of roofs: 11 to 70 degrees; flatter are level ceilings, steeper are walls."""
SMALLEST = 2.0
"""Square metres in plan of the smallest plane: less are dormers' cheeks and the undersides of stairs."""
ALIKE = 0.1
"""Difference of slopes within which places belong to one plane at first."""
BAND = 0.04
"""Distance in height, metres, within which places lie on a plane."""
FLAT = 0.008
"""Greatest root mean square distance, metres, of a plane: a vault's strip within BAND of a plane has more."""
NARROWEST = 0.8
"""Width, metres, of the narrowest plane."""
MEETING = 0.3
"""Metres that planes are drawn on to their meeting lines, ridges and hips, and to the walls."""
FAR = 1000.0
"""Metres: beyond all buildings."""
UNDER = 0.8
"""Distance, metres, from a plane's outline up to which a wall's upper edge follows it: a wall's thickness."""
COVERED = 0.8
"""Share of a wall's length near roof planes from which on its upper edge follows them."""
RIDGE = 0.15
"""Metres by which planes may meet above the highest that was seen: there is a ridge beam, or little was seen."""
LEVEL = 0.1
"""Difference of heights, metres, along a wall up to which its upper edge is level."""
STRAIGHT = 0.015
"""Metres to which an upper edge is drawn with as few points as possible."""
F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Slope:
    """A roof plane: z = ``plane`` . (x, y, 1), its ``outline`` in plan, ``rms`` metres, ``coverage`` the share seen."""

    plane: F64
    outline: Polygon
    rms: float
    coverage: float

    def height(self, xy: F64) -> F64:
        """Heights (n,) over points (n, 2)."""
        return xy @ self.plane[:2] + self.plane[2]


def find_roofs(plan: Plan, spaces: Sequence[Polygon], crown: float = np.inf) -> list[Slope]:
    """The roof planes over a topmost storey and its spaces, largest first; ``crown`` (z) is the greatest height that
    was seen there.
    """
    gradient = np.stack([rise(plan.overhead_z, 1), rise(plan.overhead_z, 0)], -1)
    known = np.isfinite(plan.overhead_z)
    places = _Places(
        plan.overhead_z[known].astype(np.float64), plan.ceiling_xy[known].astype(np.float64), gradient[known]
    )
    steep = np.linalg.norm(places.gradient, axis=1)
    free = (steep > SLOPES[0]) & (steep < SLOPES[1])
    found: list[tuple[F64, Mask, float]] = []
    while free.sum() * PLAN**2 > SMALLEST:
        seed = _seed(places, free)
        plane, on, rms = _fit(places, seed)
        free[seed] = free[on] = False
        if rms < FLAT and SLOPES[0] < np.hypot(plane[0], plane[1]) < SLOPES[1]:
            region = np.zeros(known.shape, bool)
            region[known] = on
            region = _largest(region)
            if region.sum() * PLAN**2 > SMALLEST:
                found.append((plane, region, rms))
    return _trimmed(found, plan, _covered(spaces), crown)


@dataclass(frozen=True, slots=True, eq=False)
class _Places:
    """What hangs overhead: heights ``z`` (n,), places ``xy`` (n, 2), metres, and slopes ``gradient`` (n, 2), nan where
    unknown.
    """

    z: F64
    xy: F64
    gradient: NDArray[np.float32]

    def off(self, plane: F64) -> F64:
        """Heights (n,) over a plane."""
        return self.z - (self.xy @ plane[:2] + plane[2])


def _covered(spaces: Sequence[Polygon]) -> BaseGeometry:
    """The area of spaces and of the walls between them, over which a roof goes on."""
    return (
        shapely.union_all(list(spaces))
        .buffer(UNDER / 2, join_style="mitre")
        .buffer(0.02 - UNDER / 2, join_style="mitre")
    )


def crown_of(plan: Plan, spaces: Sequence[Polygon]) -> float:
    """Greatest height of what hangs over the spaces: the ridge, or a level ceiling under it."""
    heights = np.concatenate([plan.overhead_z[pixels_in(s, plan)] for s in spaces] or [np.zeros(0, np.float32)])
    heights = heights[np.isfinite(heights)]
    return float(np.percentile(heights, 99.8)) if len(heights) else plan.levels.top


def _seed(places: _Places, free: Mask) -> Mask:
    """Places of the commonest slope and the commonest plane of that slope, among those that are free."""
    at = np.flatnonzero(free)
    slopes = places.gradient[at].astype(np.float64)
    bins = np.floor(slopes / ALIKE).astype(np.int64)
    _, inverse, counts = np.unique(bins, axis=0, return_inverse=True, return_counts=True)
    mode = np.median(slopes[inverse.ravel() == counts.argmax()], axis=0)
    at = at[(np.abs(places.gradient[at] - mode) < ALIKE).all(1)]
    offset = places.z[at] - places.xy[at] @ mode
    steps = np.floor((offset - offset.min()) / ALIKE).astype(np.int64)
    best = (np.bincount(steps).argmax() + 0.5) * ALIKE + offset.min()
    seed = np.zeros(len(free), bool)
    seed[at] = np.abs(offset - best) < ALIKE
    return seed


def _fit(places: _Places, seed: Mask) -> tuple[F64, Mask, float]:
    """The plane (3,) through places, all places on it, and their root mean square distance in height, metres."""
    on = seed
    plane: F64 = np.zeros(3)
    for _ in range(4):
        rows = np.column_stack([places.xy[on], np.ones(np.count_nonzero(on))])
        plane = np.linalg.lstsq(rows, places.z[on], rcond=None)[0].astype(np.float64)
        on = np.abs(places.off(plane)) < BAND
        if on.sum() < 10:
            return plane, seed, np.inf
    return plane, on, float(np.sqrt(np.mean(places.off(plane)[on] ** 2)))


def _largest(on: Mask) -> Mask:
    """The largest connected part of a mask, gaps closed, without what is narrower than NARROWEST."""
    whole = opened(closed(on.astype(np.uint8), 9), round(NARROWEST / PLAN))
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(whole)
    return np.asarray(labels == 1 + boxes[1:, cv2.CC_STAT_AREA].argmax()) if len(boxes) > 1 else whole > 0


def _trimmed(found: Sequence[tuple[F64, Mask, float]], plan: Plan, inside: BaseGeometry, crown: float) -> list[Slope]:
    """The planes with their outlines: rectangles up the slope, cut at the lines where planes meet each other or a level
    ceiling, and at the walls.
    """
    rectangles = [_rectangle(plane, region, plan) for plane, region, _ in found]
    slopes: list[Slope] = []
    for number, (plane, region, rms) in enumerate(found):
        outline: BaseGeometry = rectangles[number].buffer(MEETING, join_style="mitre")
        for other, (against, _, _) in enumerate(found):
            if other != number and rectangles[other].distance(rectangles[number]) < MEETING:
                outline = outline.intersection(lower_side(plane - against, outline))
        if (shapely.get_coordinates(outline) @ plane[:2] + plane[2]).max(initial=0.0) > crown + RIDGE:
            outline = outline.intersection(lower_side(plane - [0.0, 0.0, crown], outline))
        largest = largest_part(outline.intersection(inside), Polygon())
        if largest.area > NARROWEST**2:
            largest = shapely.orient_polygons(largest)
            outline = Polygon(shapely.simplify(largest, 0.02).exterior)
            slopes.append(Slope(plane, outline, rms, min(1.0, float(region.sum()) * PLAN**2 / outline.area)))
    return sorted(slopes, key=lambda s: -s.outline.area)


def _rectangle(plane: F64, region: Mask, plan: Plan) -> Polygon:
    """The rectangle in plan round a region, one side up the plane's slope."""
    row, col = np.nonzero(region)
    xy = plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN
    up = plane[:2] / np.linalg.norm(plane[:2])
    axes = np.array([up, [-up[1], up[0]]])
    (a, b), (c, d) = np.percentile(xy @ axes.T, [0.5, 99.5], axis=0)
    return Polygon(np.array([[a, b], [c, b], [c, d], [a, d]]) @ axes)


def lower_side(difference: F64, near: BaseGeometry) -> BaseGeometry:
    """Where one plane lies below another, as a large rectangle beside their meeting line; ``difference`` (3,).
    Where the planes do not meet or ``near`` is empty, ``near`` itself.
    """
    size = float(np.linalg.norm(difference[:2]))
    if size < 1e-6 or near.is_empty:
        return near
    middle = np.array(near.centroid.coords[0])
    normal = difference[:2] / size
    along = np.array([-normal[1], normal[0]])
    foot = middle - normal * (middle @ difference[:2] + difference[2]) / size
    far = 1e3
    return Polygon(
        [foot - far * along, foot + far * along, foot + far * (along - normal), foot - far * (along + normal)]
    )


def roof_of(slope: Slope) -> RoofShape:
    """A roof plane as the stage's result."""
    corners = np.array(slope.outline.exterior.coords)[:-1]
    heights = slope.height(corners)
    return RoofShape(
        tuple(
            (round(float(x), 4), round(float(y), 4), round(float(z), 4))
            for (x, y), z in zip(corners, heights, strict=True)
        ),
        round(slope.rms, 4),
        round(slope.coverage, 3),
    )


def upper_edge(start: F64, end: F64, roofs: Sequence[Slope], base: float, level: float) -> tuple[Point, ...]:
    """The upper edge of a wall whose face runs from ``start`` to ``end`` (2,), as points (distance along, height over
    ``base``): under the lowest roof plane near it, at most ``level`` (z); empty where no plane is over it.
    """
    length = float(np.linalg.norm(end - start))
    t = np.linspace(0.0, length, max(2, round(length / PLAN) + 1))
    xy = start + np.outer(t / max(length, 1e-9), end - start)
    near = [r for r in roofs if r.outline.distance(MultiPoint(xy)) < UNDER]
    if not near:
        return ()
    apart = np.array([shapely.distance(r.outline, shapely.points(xy)) for r in near])
    if (apart.min(0) < UNDER).mean() < COVERED:
        return ()
    heights = np.array([r.height(xy) for r in near])
    z = np.where(apart < UNDER, heights, np.inf).min(0)
    z = np.where(np.isfinite(z), z, heights.min(0))
    z = (np.minimum(z, level) if z.max() > level + RIDGE else z) - base
    edge = shapely.get_coordinates(LineString(np.column_stack([t, np.maximum(z, 0.1)])).simplify(STRAIGHT))
    return tuple((round(float(a), 4), round(float(h), 4)) for a, h in edge)
