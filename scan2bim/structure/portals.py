"""Open plans: spaces that run into each other are told apart where a wall's line goes on across a passage.

A cut starts at a corner that juts into the space (a wall's free end) and goes on in the line of the wall to another
such corner, or to the next border. The space is wider beside it: on one side where walls jut in at both ends, as where
a corridor ends; where one does, on both sides, or many times on one, since a corridor's corner is no passage. All cuts
together part the space; then parts are joined again, first over those cuts that are too wide for the smaller of both.
So a ring of corridors is parted, too. No wall is put at a cut, only a virtual border.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.plan import Plan

WIDEST = 3.5
"""Width, metres, of the widest passage that can part two spaces."""
NARROWEST = 0.4
"""Width, metres, of the narrowest: nobody walks through less."""
SMALLEST_PART = 3.0
"""Area, square metres, of the smallest part worth a space of its own (niches and bays stay with their space)."""
NARROW = 0.6
"""Largest ratio of the passage's width squared to the smaller part's area: a square part may be open on 3/4 of one
side.
"""
NARROW_UNDER_LINTEL = 1.2
"""The same where a lintel hangs over the passage: the wall goes on above it."""
WIDER = 1.3
"""How many times wider than the passage the space is beside it."""
SHORTEST = 0.25
"""Length, metres, of the shortest edge whose line is a wall's."""
SHORT_OF = 1e-3
"""Metres by which a line may leave a space: the noise of walls in one line."""
FAR = 100.0
"""Metres: beyond all spaces."""
HALL = 4.0
"""How many times wider than a passage that one wall goes on past the room is into which it opens: less is a room with
an arm, such as its entrance.
"""
BESIDE = 0.6
"""Metres beside a cut at which the space's width is taken: beyond a wall's thickness."""
PAST = 1.25
"""The same for halls, in widths of the passage: beyond a corridor that turns or meets another there."""
OPPOSITE = 0.1
"""Metres that a corner may lie beside the line of the wall opposite: jambs of one passage, drawn from other faces."""
LINTEL = 0.1
"""Metres that a lintel hangs lower than the ceilings on both sides of it."""
THICKEST = 0.5
"""Depth, metres, of the deepest lintel."""
F64 = NDArray[np.float64]
Lintel = Callable[[LineString], bool]


def split_at_portals(
    polygon: Polygon, under_lintel: Lintel, wells: Sequence[Polygon] = ()
) -> tuple[list[Polygon], list[LineString]]:
    """Parts of a space and the cuts between them. ``under_lintel`` tells whether a lintel hangs over a line; parts
    between which a cut would cross one of the ``wells`` are one.
    """
    lines = _cuts(polygon) if polygon.area >= 2 * SMALLEST_PART else []
    if not lines:
        return [polygon], []
    parts = dict(enumerate(_pieces(polygon, lines)))
    borders = _borders(parts, lines, under_lintel, wells)
    while borders:
        unfit = _unfit(borders, parts)
        worst = int(np.argmax(unfit))
        if unfit[worst] <= 1.0:
            break
        one, other = borders[worst].one, borders[worst].other
        parts[one] = _joined(parts[one], parts.pop(other))
        borders = [b for b in (_renamed(b, other, one) for b in borders) if b.one != b.other]
    lines = [b.line for b in borders]
    return (_pieces(polygon, lines) if lines else [polygon]), lines


@dataclass(frozen=True, slots=True, eq=False)
class _Border:
    """A straight border between two parts, by their numbers, on the cut of number ``cut``; whether a ``lintel`` hangs
    over it, and whether it crosses a ``well``.
    """

    one: int
    other: int
    cut: int
    line: LineString
    lintel: bool
    well: bool


def _unfit(borders: Sequence[_Border], parts: dict[int, Polygon]) -> F64:
    """How much too wide each border (b,) is for the smaller of both parts; over 1 if they are one space."""
    width: dict[tuple[int, int, int], float] = {}
    for b in borders:
        width[b.one, b.other, b.cut] = width.get((b.one, b.other, b.cut), 0.0) + b.line.length
    out: list[float] = []
    for b in borders:
        smaller = min(parts[b.one].area, parts[b.other].area)
        ratio = width[b.one, b.other, b.cut] ** 2 / smaller / (NARROW_UNDER_LINTEL if b.lintel else NARROW)
        out.append(ratio + 1e3 * (b.well + (smaller < SMALLEST_PART)))
    return np.array(out)


def _renamed(border: _Border, old: int, new: int) -> _Border:
    """A border after a part was joined to another one."""
    one, other = sorted(new if k == old else k for k in (border.one, border.other))
    return replace(border, one=one, other=other)


def _joined(one: Polygon, other: Polygon) -> Polygon:
    """Two parts as one, without the points of the border between them."""
    whole = shapely.orient_polygons(shapely.simplify(shapely.union_all([one, other], grid_size=1e-6), 1e-4))
    return whole if isinstance(whole, Polygon) else one


def _pieces(polygon: Polygon, lines: Sequence[LineString]) -> list[Polygon]:
    """What lines from border to border cut a polygon into."""
    drawn = shapely.union_all([polygon.boundary, *(_drawn_on(line) for line in lines)], grid_size=1e-6)
    pieces = shapely.orient_polygons(shapely.get_parts(shapely.polygonize([drawn])))
    return [p for p in pieces if isinstance(p, Polygon) and polygon.contains(p.representative_point())]


def _borders(
    parts: dict[int, Polygon], lines: Sequence[LineString], under_lintel: Lintel, wells: Sequence[Polygon]
) -> list[_Border]:
    """What the parts share of each cut."""
    found: list[_Border] = []
    for cut, line in enumerate(lines):
        lintel = under_lintel(line)
        beside = [k for k, part in parts.items() if shapely.dwithin(part, line, SHORT_OF)]
        for one, other in combinations(beside, 2):
            shared = shapely.get_parts(shapely.intersection(parts[one].boundary, parts[other].boundary))
            sides = [s for s in shared if isinstance(s, LineString) and s.within(line.buffer(SHORT_OF))]
            found += [_Border(one, other, cut, s, lintel, any(s.crosses(well) for well in wells)) for s in sides]
    return found


def under_lintel(line: LineString, plan: Plan) -> bool:
    """Whether along a line, no farther to a side than a wall is thick, something hangs lower than on both sides."""
    a, b = shapely.get_coordinates(line)
    along = (b - a) / np.linalg.norm(b - a)
    across = np.array([-along[1], along[0]])
    off = np.arange(-THICKEST - 4 * PLAN, THICKEST + 4.5 * PLAN, PLAN)
    steps = np.arange(PLAN / 2, line.length, PLAN)
    pixel = plan.grid.pixel_of(a + steps[:, None, None] * along + off[:, None] * across)
    inside = plan.grid.contains(pixel.reshape(-1, 2)).reshape(pixel.shape[:2])
    height = np.full(inside.shape, np.nan)
    height[inside] = plan.overhead_z[pixel[inside][:, 1], pixel[inside][:, 0]]
    profile = np.array([np.median(h[np.isfinite(h)]) if np.isfinite(h).mean() > 0.5 else np.nan for h in height.T])
    sides = [profile[off < -THICKEST], profile[off > THICKEST]]
    if any(np.isnan(side).all() for side in (*sides, profile)):
        return False
    return bool(min(float(np.nanmin(side)) for side in sides) - np.nanmin(profile) > LINTEL)


def _cuts(polygon: Polygon) -> list[LineString]:
    """Lines across passages, each once."""
    corners = _jutting_corners(polygon)
    all_corners = np.array([c for c, _ in corners]).reshape(-1, 2)
    found: dict[tuple[float, float], LineString] = {}
    for start, direction in corners:
        line = _to_corner(start, direction, all_corners, polygon)
        opposed = line is not None
        line = line if line is not None else _to_border(start, direction, polygon.boundary)
        if line is None:
            continue
        if _is_wider_beside(line, opposed, polygon):
            x, y = line.interpolate(0.5, normalized=True).coords[0]
            found.setdefault((round(x, 1), round(y, 1)), line)
    return list(found.values())


def _is_wider_beside(line: LineString, opposed: bool, polygon: Polygon) -> bool:
    """Whether a cut lies where the space is wider beside it than there."""
    near, far = (
        [_width_beside(line, k * off, polygon) / line.length for k in (1, -1)] for off in (BESIDE, PAST * line.length)
    )
    if opposed:
        return max(near) > WIDER
    return bool(min(near) > WIDER or np.minimum(near, far).max() > HALL)


def _width_beside(line: LineString, side: float, polygon: Polygon) -> float:
    """Width, metres, of a polygon along a line ``side`` metres beside a cut; 0 where it does not reach so far."""
    a, b = shapely.get_coordinates(line)
    along = (b - a) / np.linalg.norm(b - a)
    middle = (a + b) / 2 + side * np.array([-along[1], along[0]])
    across = polygon.intersection(LineString([middle - FAR * along, middle + FAR * along]))
    return max((p.length for p in shapely.get_parts(across) if p.distance(shapely.Point(middle)) < 1e-6), default=0.0)


def _jutting_corners(polygon: Polygon) -> list[tuple[F64, F64]]:
    """Corners where the border turns away from the space, each with the directions in which its two edges go on."""
    out: list[tuple[F64, F64]] = []
    for ring in [polygon.exterior, *polygon.interiors]:
        xy = shapely.get_coordinates(ring)[:-1]
        before, after = xy - np.roll(xy, 1, 0), np.roll(xy, -1, 0) - xy
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        for i in np.flatnonzero(cross < -1e-3 * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)):
            for edge in (before[i], -after[i]):
                length = float(np.linalg.norm(edge))
                if length > SHORTEST:
                    out.append((xy[i], edge / length))
    return out


def _to_corner(start: F64, direction: F64, corners: F64, polygon: Polygon) -> LineString | None:
    """From a corner to the nearest other one in the line of its wall, if the passage between is free."""
    along = (corners - start) @ direction
    across = np.abs((corners - start) @ np.array([-direction[1], direction[0]]))
    opposite = np.flatnonzero((across < OPPOSITE) & (along > NARROWEST) & (along < WIDEST))
    if not len(opposite):
        return None
    line = LineString([start, corners[opposite[np.argmin(along[opposite])]]])
    return line if polygon.buffer(SHORT_OF).covers(line) else None


def _to_border(start: F64, direction: F64, outline: BaseGeometry) -> LineString | None:
    """From a corner straight on to the next border; None if that is farther than the widest passage."""
    ray = LineString([start + direction * 0.02, start + direction * WIDEST])
    hit = ray.intersection(outline)
    if hit.is_empty:
        return None
    distance = float(min(np.linalg.norm(shapely.get_coordinates(hit) - start, axis=1)))
    return LineString([start, start + direction * distance]) if distance > NARROWEST else None


def parts_of(polygon: Polygon, line: LineString) -> list[Polygon]:
    """The parts into which a line from border to border cuts a space."""
    return _pieces(polygon, [line])


def _drawn_on(line: LineString) -> LineString:
    """A line a little longer at both ends, so that it meets the borders."""
    a, b = shapely.get_coordinates(line)
    u = (b - a) / np.linalg.norm(b - a)
    return LineString([a - 1e-4 * u, b + 1e-4 * u])


def on_cut(points: F64, cuts: Sequence[LineString]) -> bool:
    """Whether all points (n, 2) lie on one of the cuts."""
    geometry = shapely.points(points)
    return any(bool((shapely.distance(cut, geometry) < 0.02).all()) for cut in cuts)
