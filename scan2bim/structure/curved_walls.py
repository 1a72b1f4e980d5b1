"""Curved walls from the borders of the spaces that follow curved faces, and their joins with the straight ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import Polygon

from scan2bim.structure.arcs import ON_ARC, Bend
from scan2bim.structure.axes import F64, Axis, AxisJoin

CONCENTRIC = 0.15
"""Metres between the centres of the two faces of one curved wall."""
THINNEST, THICKEST = 0.03, 0.80
"""Distances between faces, metres, that one wall can have."""
SHORTEST = 0.3
"""Length, metres, of the shortest curved wall."""
LONGEST_STUB = 0.8
"""Metres at the end of a wall on which one of its faces ends earlier: at a corner, the other wall is that thick."""
TOGETHER = 0.3
"""Metres between borders on one arc that are one: a pilaster or a reveal lies between."""
MOST = 2.8
"""Radians that one wall bends at most: a longer arc is several walls in a row."""
REACH = 0.15
"""Metres more than half of both thicknesses within which walls join."""
TANGENT = 0.97
"""Cosine of 14 degrees: a straight wall that meets an arc more flatly goes on in it."""


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """A stretch of a space's outline on a curved face, between two of its turns (radians)."""

    space: int
    bend: Bend
    low: float
    high: float


def is_on(start: F64, end: F64, bend: Bend) -> bool:
    """Whether an edge of a space's outline, the space on its left, lies on a curved face that has it as its air."""
    places = np.array([start, end, (start + end) / 2])
    if (np.abs(bend.off(places)) > ON_ARC).any():
        return False
    turn, step = bend.turns(places), 0.02 / bend.radius
    along = end - start
    out = places[2] - bend.centre
    counter = out[0] * along[1] - out[1] * along[0] > 0
    within = np.minimum(turn, 2 * np.pi - turn) < step
    return bool(counter == bend.inside and ((turn < bend.sweep + step) | within).all())


def borders_on(spaces: Sequence[Polygon], bends: Sequence[Bend]) -> list[Border]:
    """The stretches of the spaces' outlines on curved faces."""
    found: list[Border] = []
    for number, space in enumerate(spaces):
        for bend in bends:
            spans: list[tuple[float, float]] = []
            for ring in (space.exterior, *space.interiors):
                for a, b in pairwise(shapely.get_coordinates(ring)):
                    if is_on(a, b, bend):
                        low, high = np.sort(bend.places(np.array([a, b]))).tolist()
                        spans.append((low, high) if high - low < np.pi else (0.0, low))
            for low, high in _united(spans, TOGETHER / bend.radius):
                if (high - low) * bend.radius > SHORTEST:
                    found.append(Border(number, bend, low, high))
    return found


def _united(spans: Sequence[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    out: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if out and low - out[-1][1] < gap:
            out[-1] = out[-1][0], max(out[-1][1], high)
        else:
            out.append((low, high))
    return out


def curved_axes(borders: Sequence[Border], outer: float) -> list[Axis]:
    """The walls along curved borders: between two faces of like centres, or ``outer`` metres thick behind one."""
    inner = [b for b in borders if b.bend.inside]
    others = [b for b in borders if not b.bend.inside]
    taken: dict[int, list[tuple[float, float]]] = {}
    axes: list[Axis] = []
    for one in inner:
        used: list[tuple[float, float]] = []
        for number, two in enumerate(others):
            span = _shared(one, two)
            if span is not None:
                span = _drawn_on(span, (one.low, one.high), LONGEST_STUB / one.bend.radius)
                axes += _wall(one.bend, span, _between(one.bend, two.bend, span), {one.space}, {two.space})
                used.append(span)
                turn = two.bend.places(one.bend.points(*span))
                ends = float(turn[0]), float(turn[-1])
                taken.setdefault(number, []).append(
                    _drawn_on(ends, (two.low, two.high), LONGEST_STUB / two.bend.radius)
                )
        for span in _rest((one.low, one.high), used, SHORTEST / one.bend.radius):
            axes += _wall(one.bend, span, (one.bend.radius + outer / 2, outer), {one.space}, set())
    for number, two in enumerate(others):
        for span in _rest((two.low, two.high), taken.get(number, []), SHORTEST / two.bend.radius):
            axes += _wall(two.bend, span, (two.bend.radius - outer / 2, outer), set(), {two.space})
    return axes


def _drawn_on(span: tuple[float, float], whole: tuple[float, float], stub: float) -> tuple[float, float]:
    """A stretch drawn on to the ends of the whole where no more than a stub would be left."""
    low, high = span
    return whole[0] if low - whole[0] < stub else low, whole[1] if whole[1] - high < stub else high


def _shared(one: Border, two: Border) -> tuple[float, float] | None:
    """The turns of the inner face along which the outer one is the other side of the same wall."""
    gap = two.bend.radius - one.bend.radius
    apart = float(np.linalg.norm(one.bend.centre - two.bend.centre))
    if not THINNEST < gap < THICKEST or apart > CONCENTRIC:
        return None
    ends = one.bend.places(two.bend.points(two.low, two.high))[[0, -1]]
    low, high = max(one.low, float(ends[0])), min(one.high, float(ends[1]))
    return (low, high) if (high - low) * one.bend.radius > SHORTEST else None


def _between(one: Bend, two: Bend, span: tuple[float, float]) -> tuple[float, float]:
    """Radius of the middle and thickness of the wall between an inner and an outer face."""
    thickness = float(two.off(one.points(*span)).mean()) * -1.0
    return one.radius + thickness / 2, thickness


def _rest(span: tuple[float, float], used: Sequence[tuple[float, float]], least: float) -> list[tuple[float, float]]:
    """What is left of a stretch."""
    low, out = span[0], list[tuple[float, float]]()
    for a, b in sorted(used):
        out.append((low, a))
        low = max(low, b)
    out.append((low, span[1]))
    return [(a, b) for a, b in out if b - a > least]


def _wall(
    bend: Bend, span: tuple[float, float], section: tuple[float, float], left: set[int], right: set[int]
) -> list[Axis]:
    """The axis over a stretch of a curved face, counter-clockwise; several where it bends far."""
    (low, high), (radius, thickness) = span, section
    count = int(np.ceil((high - low) / MOST))
    turns = np.linspace(low, high, count + 1)
    ends = bend.centre + radius * np.stack([np.cos(bend.first + turns), np.sin(bend.first + turns)], 1)
    bulge = float(np.tan((high - low) / count / 4))
    measured = bool(left and right)
    return [
        Axis(ends[k], ends[k + 1], thickness, measured, frozenset(left), frozenset(right), bulge) for k in range(count)
    ]


def with_curved(
    axes: Sequence[Axis], joins: Sequence[AxisJoin], curved: Sequence[Axis]
) -> tuple[list[Axis], list[AxisJoin]]:
    """Straight walls and curved ones after them, the ends of both moved to where they meet."""
    out, found = [*axes, *curved], list(joins)
    first = len(axes)
    for number in range(first, len(out)):
        for other in range(first, len(out)):
            if other > number and np.linalg.norm(out[number].end - out[other].start) < 1e-6:
                found.append(AxisJoin(number, "end", other, "start"))
        for other in range(first):
            _meet(out, found, number, other)
    return out, found


def _meet(axes: list[Axis], joins: list[AxisJoin], number: int, other: int) -> None:
    """Join a curved wall and a straight one where they meet, if they do, in place."""
    bent, wall = axes[number], axes[other]
    slack = (bent.thickness + wall.thickness) / 2 + REACH
    for point in _crossings(bent, wall):
        along, _ = bent.local(point[None])
        t = float((point - wall.start) @ wall.direction)
        s = float(along[0])
        if not (-slack < s < bent.length + slack and -slack < t < wall.length + slack):
            continue
        at = "start" if s < slack else "end" if s > bent.length - slack else "path"
        other_at = "start" if t < slack else "end" if t > wall.length - slack else "path"
        if at == other_at == "path" or not _is_free(joins, number, at) or not _is_free(joins, other, other_at):
            continue
        if at != "path":
            axes[number] = _ending(bent, at, s)
        if other_at != "path":
            axes[other] = replace(wall, start=point) if other_at == "start" else replace(wall, end=point)
        one = AxisJoin(number, at, other, other_at) if at != "path" else AxisJoin(other, other_at, number, at)
        joins.append(one)
        return


def _is_free(joins: Sequence[AxisJoin], number: int, at: str) -> bool:
    return at == "path" or (number, at) not in {(j.one, j.at) for j in joins}


def _crossings(bent: Axis, wall: Axis) -> list[F64]:
    """Where a straight wall's line crosses a curved wall's circle, or touches it, nearest to the wall's ends first."""
    radius = 1.0 / abs(bent.arc.curvature)
    to_centre = np.array([bent.arc.chord / 2, np.cos(bent.arc.angle / 2) / bent.arc.curvature])
    centre = bent.start + to_centre[0] * bent.direction + to_centre[1] * bent.normal
    foot = wall.start + ((centre - wall.start) @ wall.direction) * wall.direction
    off = float(np.linalg.norm(foot - centre)) / radius
    if off > TANGENT:
        return [foot] if off < 1 + (bent.thickness + wall.thickness) / 2 / radius else []
    half = radius * np.sqrt(1 - off * off) * wall.direction
    ends = (wall.start, wall.end)
    return sorted((foot - half, foot + half), key=lambda p: min(float(np.linalg.norm(p - e)) for e in ends))


def _ending(bent: Axis, at: str, along: float) -> Axis:
    """A curved wall that begins or ends ``along`` metres from its start."""
    low, high = (along, bent.length) if at == "start" else (0.0, along)
    flat = bent.arc.place(np.array([low, high]), np.zeros(2))
    ends = bent.start + flat[:, :1] * bent.direction + flat[:, 1:] * bent.normal
    return replace(bent, start=ends[0], end=ends[1], bulge=float(np.tan(bent.arc.curvature * (high - low) / 4)))
