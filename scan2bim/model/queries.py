"""Questions to the model that more than one reader of it asks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scan2bim.geometry.arcs import Arc
from scan2bim.model.elements import (
    Building,
    Door,
    Element,
    Opening,
    Point2,
    Point3,
    ScanSource,
    Storey,
    Wall,
    Window,
)


@dataclass(frozen=True, slots=True)
class Hosted:
    """An opening with the wall and the storey that it is in."""

    storey: Storey
    wall: Wall
    opening: Opening


def everything(building: Building) -> Iterator[Building | Storey | ScanSource | Element]:
    """All that has an id: the building, its scans, storeys, elements, openings and what fills them."""
    yield building
    yield from building.scans
    for storey in building.storeys:
        yield storey
        yield from elements_of(storey)


def elements_of(storey: Storey) -> Iterator[Element]:
    """All elements of a storey, a wall's openings and their fills right after the wall."""
    for wall in storey.walls:
        yield wall
        for opening in wall.openings:
            yield opening
            if opening.fill is not None:
                yield opening.fill
    yield from (*storey.spaces, *storey.slabs, *storey.coverings, *storey.columns, *storey.beams)
    yield from (*storey.stairs, *storey.roofs)


def find(building: Building, identifier: str) -> Building | Storey | ScanSource | Element | None:
    """The thing with this id, or None."""
    return next((thing for thing in everything(building) if thing.id == identifier), None)


def walls_of(building: Building) -> Iterator[tuple[Storey, Wall]]:
    """All walls, each with its storey."""
    for storey in building.storeys:
        for wall in storey.walls:
            yield storey, wall


def openings_of(building: Building) -> Iterator[Hosted]:
    """All openings of walls, filled or not."""
    for storey, wall in walls_of(building):
        for opening in wall.openings:
            yield Hosted(storey, wall, opening)


def doors_of(building: Building) -> Iterator[tuple[Hosted, Door]]:
    """All doors, each with its opening, wall and storey."""
    for hosted in openings_of(building):
        if isinstance(hosted.opening.fill, Door):
            yield hosted, hosted.opening.fill


def windows_of(building: Building) -> Iterator[tuple[Hosted, Window]]:
    """All windows, each with its opening, wall and storey."""
    for hosted in openings_of(building):
        if isinstance(hosted.opening.fill, Window):
            yield hosted, hosted.opening.fill


def wall_arc(wall: Wall) -> Arc:
    """The wall's axis as an arc in the frame whose x axis is its chord from start to end."""
    return Arc(math.dist(wall.start, wall.end), wall.bulge)


def wall_length(wall: Wall) -> float:
    """Length of the wall's axis, along the arc where it is curved; metres."""
    return wall_arc(wall).length


def wall_direction(wall: Wall, along: float | None = None) -> Point2:
    """Unit vector in plan from the axis's start to its end; (1, 0) for an axis without length.

    along: of a curved wall, the direction of its axis this many metres from its start.
    """
    chord = math.dist(wall.start, wall.end)
    if chord == 0.0:
        return (1.0, 0.0)
    dx, dy = (wall.end[0] - wall.start[0]) / chord, (wall.end[1] - wall.start[1]) / chord
    if along is None or wall.bulge == 0.0:
        return (dx, dy)
    turn = wall_arc(wall).direction(along)
    c, s = math.cos(turn), math.sin(turn)
    return (c * dx - s * dy, s * dx + c * dy)


def point_on_wall(wall: Wall, along: float, left: float, up: float) -> Point3:
    """The point ``along`` metres from the axis's start, ``left`` metres to its left, ``up`` metres over the base.

    Along the arc where the wall is curved; where it leans, the point leans with it.
    """
    dx, dy = wall_direction(wall)
    left += up * math.tan(wall.lean)
    if wall.bulge:
        along, left = wall_arc(wall).place(np.array(along), np.array(left)).tolist()
    return (wall.start[0] + along * dx - left * dy, wall.start[1] + along * dy + left * dx, wall.base + up)


def opening_corners(wall: Wall, opening: Opening, left: float = 0.0) -> tuple[Point3, Point3, Point3, Point3]:
    """The opening's corners, metres, in the wall's centre plane, or ``left`` metres to the left of it.

    Lower one nearer to the wall's start, lower one nearer to its end, upper one nearer to the end, upper one nearer to
    the start.
    """
    start, low = opening.offset.value, opening.sill.value
    end, high = start + opening.width.value, low + opening.height.value
    return (
        point_on_wall(wall, start, left, low),
        point_on_wall(wall, end, left, low),
        point_on_wall(wall, end, left, high),
        point_on_wall(wall, start, left, high),
    )
