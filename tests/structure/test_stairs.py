"""Stairs and the wells over them, in a scene of two storeys."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from modelled import Modelled, modelled
from shapely.geometry import LineString, Polygon, box
from synthetic import two_storeys

from scan2bim.model.elements import Stair
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.structure.stairs import without_wells

SPEC = ScannerSpec(step=math.radians(0.7))
YAW = 0.4


@pytest.fixture(scope="module")
def model() -> Modelled:
    return modelled(two_storeys(YAW), SPEC)


def test_the_stair_is_found_with_its_risers_its_width_and_its_direction(model: Modelled) -> None:
    (stair,) = model.structure.storeys[0].stairs
    assert (stair.kind, stair.risers) == ("straight", 15)
    assert stair.width == pytest.approx(0.9, abs=0.1)
    assert (stair.base, stair.top) == pytest.approx((0.0, 2.75), abs=0.01)
    assert abs(np.dot(stair.climb, [math.cos(YAW), math.sin(YAW)])) == pytest.approx(1.0, abs=0.001)
    assert not model.structure.storeys[1].stairs


def test_the_storey_above_has_no_space_over_the_stair(model: Modelled) -> None:
    (stair,) = model.structure.storeys[0].stairs
    outline = Polygon(stair.outline)
    over = sum(space.polygon.intersection(outline).area for space in model.structure.storeys[1].spaces)
    assert over < 0.1 * outline.area


def test_the_model_has_the_stair_with_one_flight_from_floor_to_floor(model: Modelled) -> None:
    (stair,) = model.building.storeys[0].stairs
    assert isinstance(stair, Stair)
    (flight,) = stair.flights
    assert flight.height == pytest.approx(2.75, abs=0.01)
    assert math.dist(flight.start, flight.end) == pytest.approx(15 * 0.25, abs=0.3)


def test_a_well_beside_a_wall_takes_the_ledge_too_narrow_to_stand_on() -> None:
    rooms, wells, cuts = without_wells(box(0, 0, 5, 3), [box(0.1, 0.1, 3, 1.1)])
    assert [p.area for p in rooms] == pytest.approx([15.0 - 3.0 * 1.1], abs=0.01)
    assert [p.area for p in wells] == pytest.approx([3.0 * 1.1], abs=0.01)
    assert shapely.union_all(cuts).length == pytest.approx(3.0 + 1.1, abs=0.02)
    assert all(isinstance(cut, LineString) for cut in cuts)


def test_a_space_without_a_well_stays_as_it_is() -> None:
    room = box(0, 0, 5, 3)
    assert without_wells(room, [box(6, 0, 9, 1)]) == ([room], [], [])
