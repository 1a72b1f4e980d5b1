"""Relations between walls where they meet: as the model joins them, and wherever else their bodies touch."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity
from scan2bim.model.elements import Join, Ring, Wall
from scan2bim.model.queries import wall_direction, wall_length
from scan2bim.model.shapes import to_plan

if TYPE_CHECKING:
    from shapely import Polygon

TOUCHING: Final = 0.01
"""Metres. Walls whose bodies are this near to each other meet."""
EDGE: Final = 0.03
"""Metres. What two walls touch with must be longer: where they meet with an edge only, they do not join."""
PARALLEL: Final = math.cos(math.radians(3.0))
"""Cosine of the angle between walls that run alike: they join end to end, or lie beside each other and do not join."""
BESIDE: Final = 0.8
"""Times half their thicknesses by which the axes of walls that run alike are apart where these lie side by side."""

End = Literal["start", "end", "path"]
_CONNECTION: Final = {"start": "ATSTART", "end": "ATEND", "path": "ATPATH"}
_JOINT: Final = {"L": "MITRE", "T": "BUTT", "X": "CROSS"}


def relate_joints(draft: Draft, walls: Sequence[Wall], outlines: dict[str, Ring], made: dict[str, Entity]) -> None:
    """Writes a relation for each joint, once."""
    joined = set(_as_modelled(draft, walls, made))
    for wall, join in _touching(walls, outlines, joined):
        _relation(draft, wall, join, made)


def _as_modelled(draft: Draft, walls: Sequence[Wall], made: dict[str, Entity]) -> Iterator[frozenset[str]]:
    """Relations for the joins of the model, each once, whichever of its walls names it; gives the joined walls."""
    done: set[frozenset[tuple[str, str]]] = set()
    for wall in walls:
        for join in wall.joins:
            pair = frozenset(((wall.id, join.at), (join.wall, join.other_at)))
            if pair in done:
                continue
            done.add(pair)
            if join.wall not in made or join.wall == wall.id:
                draft.notes.append(f"Wall {wall.name!r} joins a wall {join.wall!r} that is not in its storey.")
                continue
            _relation(draft, wall, join, made)
            yield frozenset((wall.id, join.wall))


def _touching(
    walls: Sequence[Wall], outlines: dict[str, Ring], joined: set[frozenset[str]]
) -> Iterator[tuple[Wall, Join]]:
    """Joins of walls that meet without one in the model, as in a knot of more than two; nothing is cut for them."""
    import shapely

    areas = [shapely.Polygon([to_plan(wall, x, y) for x, y in outlines[wall.id]]) for wall in walls]
    bodies = np.array(shapely.buffer(areas, TOUCHING / 2), dtype=object)
    pairs: list[list[int]] = shapely.STRtree(bodies).query(bodies, predicate="intersects").T.tolist()
    for i, j in sorted(pairs):
        one, other = walls[i], walls[j]
        if i >= j or frozenset((one.id, other.id)) in joined or not _level(one, other):
            continue
        contact = shapely.intersection(bodies[i], bodies[j])
        x0, y0, x1, y1 = contact.bounds
        if math.hypot(x1 - x0, y1 - y0) < EDGE:
            continue
        at, other_at = _end_at(one, bodies[j]), _end_at(other, bodies[i])
        if at == "path" and other_at != "path":
            one, other, at, other_at = other, one, other_at, at
        if not _side_by_side(one, other, at, other_at):
            kind = "X" if at == "path" else "T" if other_at == "path" else "L"
            yield one, Join(wall=other.id, at=at, other_at=other_at, kind=kind)


def _level(wall: Wall, other: Wall) -> bool:
    """Whether two walls share some height."""
    tops = wall.base + wall.height.value, other.base + other.height.value
    return min(tops) - max(wall.base, other.base) > TOUCHING


def _end_at(wall: Wall, body: Polygon) -> End:
    """The end of a wall that is in or at the other's body, as far as its own half thickness; else "path"."""
    import shapely

    reach = wall.thickness.value / 2 + TOUCHING
    ends: dict[End, float] = {
        "start": body.distance(shapely.Point(wall.start)),
        "end": body.distance(shapely.Point(wall.end)),
    }
    near = min(ends, key=lambda end: ends[end])
    return near if ends[near] < reach else "path"


def _side_by_side(one: Wall, other: Wall, at: End, other_at: End) -> bool:
    """Whether two walls run alike where they touch, one beside the other, as a pier before a wall."""
    (ax, ay), (bx, by) = _direction(one, at), _direction(other, other_at)
    if abs(ax * bx + ay * by) < PARALLEL:
        return False
    (px, py), (qx, qy) = to_plan(one, _along(one, at), 0.0), to_plan(other, _along(other, other_at), 0.0)
    apart = abs((qx - px) * ay - (qy - py) * ax)
    return at == other_at == "path" or apart > BESIDE * (one.thickness.value + other.thickness.value) / 2


def _direction(wall: Wall, end: End) -> tuple[float, float]:
    return wall_direction(wall, _along(wall, end))


def _along(wall: Wall, end: End) -> float:
    return {"start": 0.0, "end": wall_length(wall), "path": wall_length(wall) / 2}[end]


def _relation(draft: Draft, wall: Wall, join: Join, made: dict[str, Entity]) -> None:
    draft.ifc.root(
        "IfcRelConnectsPathElements",
        f"join of {wall.id} {join.at} to {join.wall} {join.other_at}",
        Description=_JOINT[join.kind],
        RelatingElement=made[wall.id],
        RelatedElement=made[join.wall],
        RelatingPriorities=(),
        RelatedPriorities=(),
        RelatingConnectionType=_CONNECTION[join.at],
        RelatedConnectionType=_CONNECTION[join.other_at],
    )
