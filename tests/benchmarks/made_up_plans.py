"""Made-up buildings: random plans of usual dimensions, as plain shapes. Metres, z up.

A building has an outline (rectangle, L, U, one corner cut off), a grid of rooms that comes from cutting it again and
again, sometimes a corridor, sometimes a wall askew, doors that make all rooms reachable, windows, one to three
storeys with a straight stair, columns in large rooms, lowered ceilings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from made_up_holes import make_holes
from made_up_shapes import Building, Level, Piece, Stair, Style
from shapely.affinity import translate
from shapely.geometry import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import split, unary_union

Rng = np.random.Generator

GOING, STAIR_WIDTH, STEEPEST = 0.27, 1.0, 0.18
"""Of stairs: going and width, and the highest riser, metres."""
NARROWEST, SMALLEST = 1.45, 3.2
"""Least width (metres) and area (m2) of a room."""


def make_building(seed: int) -> Building:
    """The building of a seed."""
    rng = np.random.default_rng([seed, 17])
    outline = _outline(rng)
    style = _style(rng)
    count = int(rng.choice([1, 1, 2, 2, 3]))
    inner = max(_polygons(outline.buffer(-style.outer, join_style="mitre")), key=lambda p: p.area)
    levels: list[Level] = []
    cells, cuts = _cut(inner, style, rng)
    stair = _stair(cells, style) if count > 1 else None
    for number in range(count if stair else 1):
        if number and rng.random() < 0.7:
            cells, cuts = _cut(inner, style, rng)
        climbs = stair if stair and number < count - 1 else None
        well = stair.outline.buffer(0.02, join_style="mitre") if stair and number else Polygon()
        floor = max(_polygons(outline.difference(well)), key=lambda p: p.area)
        pieces, rooms = _walls(outline, inner, cuts, stair, style)
        holes = make_holes(pieces, rooms, stair, number == 0, style, rng)
        walls = tuple(Piece(p.outline, p.axis, p.thickness, tuple(h)) for p, h in zip(pieces, holes, strict=True))
        keep = None if stair is None else stair.outline
        ceilings = _ceilings(rooms, keep, style, rng)
        columns = _columns(rooms, keep, rng)
        elevation = number * (style.height + style.slab)
        levels.append(Level(elevation, walls, ceilings, columns, floor, climbs))
    return Building(style, outline, tuple(levels))


def _style(rng: Rng) -> Style:
    height = float(rng.uniform(2.45, 3.3))
    door = float(rng.choice([2.0, 2.01, 2.05, 2.1, 2.135]))
    return Style(
        outer=float(rng.choice([0.2, 0.24, 0.3, 0.365, 0.4, 0.425, 0.49])),
        inner=float(rng.choice([0.1, 0.115, 0.125, 0.15])),
        bearing=float(rng.choice([0.175, 0.2, 0.24])),
        height=height,
        slab=float(rng.choice([0.2, 0.22, 0.25, 0.3])),
        door_height=height if rng.random() < 0.1 else door,
        sill=float(rng.choice([0.8, 0.9, 1.0])),
        head=min(height - 0.1, float(rng.choice([2.1, 2.2, 2.3]))),
    )


def _outline(rng: Rng) -> Polygon:
    wide, deep = float(rng.uniform(9, 22)), float(rng.uniform(7, 13))
    whole: BaseGeometry = box(0, 0, wide, deep)
    kind = rng.choice(["rectangle", "rectangle", "L", "cut corner", "U"])
    if kind == "L":
        whole = whole.union(box(0, 0, rng.uniform(4.5, 6.5), deep + rng.uniform(4, 7)))
    if kind == "U" and wide > 14:
        whole = unary_union([whole, box(0, 0, 4.8, deep + 4.5), box(wide - 4.8, 0, wide, deep + 4.5)])
    if kind == "cut corner":
        cut = float(rng.uniform(2, 3.5))
        corner = [(wide - cut, deep), (wide, deep - cut * rng.uniform(0.6, 1.4)), (wide + 1, deep + 1)]
        whole = whole.difference(Polygon(corner))
    plain = whole.simplify(0.01)
    return max(_polygons(plain), key=lambda p: p.area)


def _cut(inner: Polygon, style: Style, rng: Rng) -> tuple[list[Polygon], list[tuple[LineString, float]]]:
    """Rooms by cutting, and the lines of the cuts with the thickness of the walls on them."""
    cells, cuts = [inner], list[tuple[LineString, float]]()
    x0, y0, x1, y1 = inner.bounds
    corridor = rng.random() < 0.5 and x1 - x0 > 12
    if corridor:
        low = y0 + (y1 - y0) * float(rng.uniform(0.38, 0.5))
        for y in (low, low + float(rng.uniform(1.4, 2.0))):
            line = LineString([(x0 - 1, y), (x1 + 1, y)])
            cells = [part for cell in cells for part in _polygons(split(cell, line))]
            cuts += [(part, style.bearing) for part in _lines(line.intersection(inner))]
    done: list[Polygon] = []
    while cells:
        cell = cells.pop()
        found = None if _is_room(cell, corridor, rng) else _halves(cell, rng)
        if found is None:
            done.append(cell)
            continue
        line, parts = found
        thickness = style.bearing if rng.random() < 0.3 else style.inner
        cuts += [(part, thickness) for part in _lines(line.intersection(cell))]
        cells += parts
    return done, cuts


def _is_room(cell: Polygon, corridor: bool, rng: Rng) -> bool:
    x0, y0, x1, y1 = cell.bounds
    small, large = sorted((x1 - x0, y1 - y0))
    hall = small < 2.4 and (large < 6 or corridor)
    return bool(hall or large < 3.3 or cell.area < rng.uniform(9, 32))


def _halves(cell: Polygon, rng: Rng) -> tuple[LineString, list[Polygon]] | None:
    """A cut across the longer side that leaves two rooms that can be used; None where none is found."""
    x0, y0, x1, y1 = cell.bounds
    wide = x1 - x0 > y1 - y0
    low, high = (x0, x1) if wide else (y0, y1)
    margin = max(1.6, 0.3 * (high - low))
    for _ in range(8):
        at = float(rng.uniform(low + margin, high - margin)) if high - low > 2 * margin else (low + high) / 2
        askew = float(rng.choice([0.8, -0.8])) if rng.random() < 0.15 and min(x1 - x0, y1 - y0) > 3 else 0.0
        line = (
            LineString([(at, y0 - 1), (at + askew, y1 + 1)])
            if wide
            else LineString([(x0 - 1, at), (x1 + 1, at + askew)])
        )
        parts = _polygons(split(cell, line))
        if len(parts) == 2 and min(p.area for p in parts) > SMALLEST and min(map(_width, parts)) > NARROWEST:
            return line, parts
    return None


def _width(cell: Polygon) -> float:
    x0, y0, x1, y1 = cell.bounds
    return min(x1 - x0, y1 - y0)


def _stair(cells: Sequence[Polygon], style: Style) -> Stair | None:
    """A flight along a side of the largest room that it fits into."""
    risers = math.ceil((style.height + style.slab) / STEEPEST)
    long = (risers - 1) * GOING
    for cell in sorted(cells, key=lambda c: -c.area):
        x0, y0, x1, y1 = cell.bounds
        for along_x in (x1 - x0 > y1 - y0, x1 - x0 <= y1 - y0):
            size = (long, STAIR_WIDTH) if along_x else (STAIR_WIDTH, long)
            start = (x0 + 0.3, y0 + 0.15) if along_x else (x0 + 0.15, y0 + 0.3)
            flight = box(*start, start[0] + size[0], start[1] + size[1])
            beyond = (x1 - x0 if along_x else y1 - y0) - long
            if cell.buffer(-0.12).contains(flight) and beyond > 1.5:
                return Stair(flight, along_x, risers)
    return None


def _walls(
    outline: Polygon, inner: Polygon, cuts: Sequence[tuple[LineString, float]], stair: Stair | None, style: Style
) -> tuple[list[Piece], list[Polygon]]:
    """Walls that do not overlap, and the rooms between them."""
    pieces = _outer_walls(outline, inner, style.outer)
    solid = unary_union([piece.outline for piece in pieces])
    for line, thickness in cuts:
        strip = _longer(line, 0.3).buffer(thickness / 2, cap_style="flat").difference(solid)
        if stair is not None and strip.buffer(0.17).intersects(stair.outline):
            strip = strip.difference(stair.outline.buffer(0.9))
        parts = _polygons(strip)
        if parts:
            outer = max(parts, key=lambda p: p.area)
            pieces.append(Piece(outer, line, thickness))
            solid = solid.union(outer)
    rooms = [
        q
        for p in _polygons(inner.difference(solid))
        for q in _polygons(p.buffer(-0.02).buffer(0.02, join_style="mitre"))
    ]
    return pieces, [room for room in rooms if room.area > 1.2]


def _outer_walls(outline: Polygon, inner: Polygon, thickness: float) -> list[Piece]:
    """One for each side of the outline, mitred."""
    inside = np.array(inner.exterior.coords)[:-1]
    corners = np.array(outline.exterior.coords)[:-1]
    nearest = [inside[np.hypot(*(inside - corner).T).argmin()] for corner in corners]
    found: list[Piece] = []
    for i, a in enumerate(corners):
        j = (i + 1) % len(corners)
        ring = Polygon([a, corners[j], nearest[j], nearest[i]])
        if ring.is_valid and ring.area > 0.05:
            axis = LineString([(a + nearest[i]) / 2, (corners[j] + nearest[j]) / 2])
            found.append(Piece(ring, axis, thickness))
    return found


def _ceilings(
    rooms: Sequence[Polygon], keep: Polygon | None, style: Style, rng: Rng
) -> tuple[tuple[Polygon, float], ...]:
    """Rooms with the heights of their ceilings: some are lowered, none above the stair."""
    lowered = rng.random() < 0.3 and max(style.door_height, style.head) < style.height - 0.3
    heights = [
        style.height - float(rng.uniform(0.15, 0.28))
        if lowered and rng.random() < 0.4 and not (keep and room.intersects(keep))
        else style.height
        for room in rooms
    ]
    return tuple(zip(rooms, heights, strict=True))


def _columns(rooms: Sequence[Polygon], keep: Polygon | None, rng: Rng) -> tuple[Polygon, ...]:
    """A square or round one in some large rooms."""
    found: list[Polygon] = []
    for room in rooms:
        if room.area > 40 and rng.random() < 0.7:
            middle = room.representative_point()
            shape = box(-0.15, -0.15, 0.15, 0.15) if rng.random() < 0.5 else Point(0, 0).buffer(0.17, 8)
            column = translate(shape, middle.x, middle.y)
            if room.buffer(-0.6).contains(column) and not (keep and column.buffer(0.5).intersects(keep)):
                found.append(column)
    return tuple(found)


def _longer(line: LineString, by: float) -> LineString:
    start, end = np.array(line.coords[0]), np.array(line.coords[-1])
    along = (end - start) / line.length * by
    return LineString([start - along, end + along])


def _polygons(shape: BaseGeometry) -> list[Polygon]:
    return [p for p in shapely.get_parts(shape) if isinstance(p, Polygon) and p.area > 1e-4]


def _lines(shape: BaseGeometry) -> list[LineString]:
    return [p for p in shapely.get_parts(shape) if isinstance(p, LineString) and p.length > 0.3]
