"""Spaces reach the walls round them: what hangs before a wall is no part of it."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from scan2bim.structure.axes import Axis
from scan2bim.structure.overlaps import Bodies, up_to

ROOM = shapely.box(0.0, 0.0, 4.0, 3.0)
CORNERS = ((-0.1, -0.1), (4.1, -0.1), (4.1, 3.1), (-0.1, 3.1))
ROUND = [
    Axis(np.array(start), np.array(end), 0.2, True, frozenset({0}), frozenset())
    for start, end in zip(CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True)
]


def without(*things: shapely.Polygon) -> shapely.Polygon:
    rest = shapely.difference(ROOM, shapely.union_all(list(things)))
    assert isinstance(rest, shapely.Polygon)
    return rest


def test_a_space_reaches_the_wall_behind_what_hangs_before_it():
    found = up_to(without(shapely.box(0.5, 0.0, 0.9, 0.09), shapely.box(2.0, 0.0, 2.4, 0.08)), Bodies.of(ROUND))
    assert found.symmetric_difference(ROOM).area < 1e-4
    assert len(found.exterior.coords) == 5


@pytest.mark.parametrize(
    "notch",
    [
        shapely.box(0.5, 0.0, 0.9, 0.2),  # a pier
        shapely.box(1.0, 1.0, 1.4, 1.09),  # before no wall
        shapely.box(2.0, 0.0, 2.09, 1.0),  # across the wall, not along it
        shapely.box(0.5, 0.0, 2.0, 0.015),  # as uneven as a face
    ],
)
def test_a_space_stays_off_what_is_no_thin_thing_along_a_wall(notch: shapely.Polygon):
    held = without(notch)
    assert up_to(held, Bodies.of(ROUND)) is held


def test_a_strip_that_another_space_has_stays_its_own():
    strip = shapely.box(0.5, 0.0, 0.9, 0.09)
    held = without(strip)
    assert up_to(held, Bodies.of(ROUND), [strip]) is held


def test_a_space_of_a_storey_without_walls_stays():
    assert up_to(ROOM, Bodies.of([])) is ROOM
