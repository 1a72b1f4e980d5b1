"""Outlines of walls in plan, cut where they join: mitred where ends meet, butted against a wall that runs through.

An outline is in the wall's own frame: x along the axis (the arc, where it is curved) from its start, y to the left of
it, metres.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scan2bim.model.elements import Point2, Ring, Wall
from scan2bim.model.queries import wall_arc, wall_direction, wall_length

PARALLEL = math.sin(math.radians(3.0))
"""Walls that meet at less than this angle continue each other: their faces have no usable intersection."""

STRAIGHT = 1e-9
"""Metres. A cut whose two sides cancel out to this passes straight through the junction."""

LONGEST_MITRE = 3.0
"""Times half the greater thickness. A sharper corner than about 37 degrees is cut off here, so that no spike grows."""


@dataclass(frozen=True, slots=True)
class _End:
    """What leaves a junction: unit direction (in plan) and half the thickness, metres."""

    direction: Point2
    half: float

    @property
    def angle(self) -> float:
        return math.atan2(self.direction[1], self.direction[0])


@dataclass(frozen=True, slots=True)
class _Cut:
    """How far along the axis a wall's left and right face start, looking away from the junction, metres.

    pointed: the outline goes from one to the other by the junction itself, as where three or more walls share it.
    """

    left: float
    right: float
    pointed: bool = False


def wall_outlines(walls: Iterable[Wall]) -> dict[str, Ring]:
    """The outline of each wall (by id), counter-clockwise, cut by the joins that the walls name among themselves."""
    by_id = {wall.id: wall for wall in walls}
    through, meeting = _junctions(by_id)
    return {
        wall.id: _outline(
            wall, [through[wall.id, at] for at in ("start", "end")], [meeting[wall.id, at] for at in ("start", "end")]
        )
        for wall in by_id.values()
    }


def outline_area(outline: Sequence[Point2]) -> float:
    """Signed area of an outline, positive where it runs counter-clockwise; square metres."""
    return 0.5 * sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True))


def _junctions(by_id: dict[str, Wall]) -> tuple[dict[tuple[str, str], list[Wall]], dict[tuple[str, str], list[_End]]]:
    """Per wall end, the walls running through and the other ends meeting there; a join named once counts for both."""
    through: dict[tuple[str, str], list[Wall]] = defaultdict(list)
    meeting: dict[tuple[str, str], list[_End]] = defaultdict(list)
    seen: set[tuple[str, str, str, str]] = set()
    for wall in by_id.values():
        for join in wall.joins:
            other = by_id.get(join.wall)
            if other is None or other is wall:
                continue
            for one, at, two, other_at in (
                (wall, join.at, other, join.other_at),
                (other, join.other_at, wall, join.at),
            ):
                key = (one.id, at, two.id, other_at)
                if at == "path" or key in seen:
                    continue
                seen.add(key)
                if other_at == "path":
                    through[one.id, at].append(two)
                else:
                    meeting[one.id, at].append(_leaving(two, other_at))
    return through, meeting


def _leaving(wall: Wall, at: str) -> _End:
    dx, dy = wall_direction(wall, 0.0 if at == "start" else wall_length(wall))
    return _End((dx, dy) if at == "start" else (-dx, -dy), wall.thickness.value / 2)


def _outline(wall: Wall, through: Sequence[list[Wall]], meeting: Sequence[list[_End]]) -> Ring:
    length, half = wall_length(wall), wall.thickness.value / 2
    start, end = (
        _butt(_leaving(wall, at), _End(_passing(wall, at, through[i][0]), through[i][0].thickness.value / 2), length)
        if through[i]
        else _mitre(_leaving(wall, at), meeting[i], length)
        for i, at in enumerate(("start", "end"))
    )
    return (
        (start.right, -half),
        (length - end.left, -half),
        *(((length, 0.0),) if end.pointed else ()),
        (length - end.right, half),
        (start.left, half),
        *(((0.0, 0.0),) if start.pointed else ()),
    )


def _mitre(end: _End, others: list[_End], length: float) -> _Cut:
    """The cut of an end among the other ends that meet there."""
    if not others:
        return _Cut(0.0, 0.0)
    turns = sorted(((other.angle - end.angle) % math.tau, i) for i, other in enumerate(others))
    limit = LONGEST_MITRE * max(end.half, *(other.half for other in others))
    left = _clamp(_corner(end, others[turns[0][1]], 1.0), limit, length)
    right = _clamp(_corner(end, others[turns[-1][1]], -1.0), limit, length)
    return _Cut(left, right, pointed=abs(left + right) > STRAIGHT)


def _corner(end: _End, other: _End, side: float) -> float:
    """How far out the end's face on a side (1 left, -1 right) meets the other's face that looks to it."""
    (ux, uy), (vx, vy) = end.direction, other.direction
    sine, cosine = ux * vy - uy * vx, ux * vx + uy * vy
    if abs(sine) < PARALLEL:
        return 0.0
    return side * (other.half + end.half * cosine) / sine


def _passing(wall: Wall, at: str, through: Wall) -> Point2:
    """Direction of a wall that runs through, where the end meets it."""
    if through.bulge == 0.0:
        return wall_direction(through)
    x, y = wall.start if at == "start" else wall.end
    (dx, dy), (x0, y0) = wall_direction(through), through.start
    along = wall_arc(through).nearest((x - x0) * dx + (y - y0) * dy, (y - y0) * dx - (x - x0) * dy)
    return wall_direction(through, along)


def _butt(end: _End, through: _End, length: float) -> _Cut:
    """The cut of an end at the near face of a wall that runs through."""
    (ux, uy), (vx, vy) = end.direction, through.direction
    away = vx * uy - vy * ux  # the end's direction along the left normal of the wall that runs through
    if abs(away) < PARALLEL:
        return _Cut(0.0, 0.0)
    near = through.half / abs(away)
    slant = end.half * (ux * vx + uy * vy) / away
    limit = LONGEST_MITRE * max(end.half, through.half)
    return _Cut(_clamp(near - slant, limit, length), _clamp(near + slant, limit, length))


def _clamp(distance: float, limit: float, length: float) -> float:
    """Keeps a cut within the mitre's limit outwards and within the near half of the wall inwards."""
    return max(-limit, min(distance, 0.49 * length))
