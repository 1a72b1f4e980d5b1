"""Downstand beams: found as beams, and no walls with wide passages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from members import HEIGHT, hung, post, room_of
from modelled import Modelled, modelled
from shapely.geometry import Point, Polygon

from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import DoorSpec, WallSpec

SPEC = ScannerSpec(step=math.radians(0.5))
WALL_TO_WALL, OVER_COLUMN = (3.0, 2.5), (5.5, 3.3)
ROOM = room_of(
    "beams",
    [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0)],
    [
        hung("beam", WALL_TO_WALL, (0.3, 4.7), 2.4),
        hung("beam on column", OVER_COLUMN, (4.7, 0.25), 2.45),
        post("column", (7.0, 3.3), (0.3, 0.3)),
        hung("lamp", (5.0, 1.5), (1.6, 0.2), 2.3, 2.5),
        hung("duct", (1.5, 2.5), (0.3, 2.2), 2.45),
    ],
    [(1.5, 1.2), (5.5, 2.0), (5.2, 4.2)],
)


@pytest.fixture(scope="module")
def model() -> Modelled:
    return modelled(ROOM, SPEC)


@pytest.mark.parametrize(
    ("middle", "size", "under"), [(WALL_TO_WALL, (4.7, 0.3), 2.4), (OVER_COLUMN, (4.7, 0.25), 2.45)]
)
def test_a_beam_is_found_from_wall_to_wall_or_to_another_beam(
    model: Modelled, middle: tuple[float, float], size: tuple[float, float], under: float
) -> None:
    place = ROOM.placement.points(np.array([[*middle, 0.0]]))[0, :2]
    beam = min(model.structure.storeys[0].beams, key=lambda b: Polygon(b.outline).centroid.distance(Point(place)))
    assert Polygon(beam.outline).centroid.distance(Point(place)) < 0.25
    assert beam.size[0] == pytest.approx(size[0], abs=0.35)
    assert beam.size[1] == pytest.approx(size[1], abs=0.03)
    assert (beam.base, beam.top) == pytest.approx((under, HEIGHT), abs=0.01)


def test_lamps_and_ducts_that_end_in_the_air_are_no_beams(model: Modelled) -> None:
    assert len(model.structure.storeys[0].beams) == 2
    assert len(model.building.storeys[0].beams) == 2


def test_a_beam_makes_no_wall_and_parts_no_space(model: Modelled) -> None:
    assert len(model.walls) == 4
    assert len(model.spaces) == 1
    assert model.spaces[0].area == pytest.approx(7.7 * 4.7, rel=0.02)


def test_the_lintel_over_a_wide_passage_stays_a_wall() -> None:
    passage = DoorSpec("passage", 0.9, 2.6, 2.3, leaf=False, casing=0.0)
    wall = WallSpec("middle", (4.0, 0.0), (4.0, 5.0), 0.2, doors=(passage,))
    points = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0)]
    found = modelled(room_of("lintel", points, [], [(2.0, 2.2), (6.0, 2.6)], wall), SPEC)
    assert not found.structure.storeys[0].beams
    assert len(found.walls) == 5
