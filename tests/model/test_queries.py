from __future__ import annotations

import math

import pytest
from buildings import building, opening, turned, wall

from scan2bim.model.elements import Door, Wall
from scan2bim.model.queries import (
    doors_of,
    everything,
    find,
    opening_corners,
    openings_of,
    point_on_wall,
    wall_direction,
    wall_length,
    walls_of,
    windows_of,
)


def test_all_walls_come_with_their_storey():
    found = list(walls_of(building()))
    assert len(found) == 13
    assert {storey.name for storey, _ in found} == {"Ground floor", "Upper floor"}


def test_all_doors_come_with_opening_wall_and_storey():
    found = {door.id: (hosted.opening.id, hosted.wall.id, hosted.storey.id) for hosted, door in doors_of(building())}
    assert found["door-g4"] == ("opening-g4", "wall-g-cross", "storey-0")
    assert len(found) == 8


def test_doors_windows_and_passages_are_all_openings():
    house = building()
    passages = [hosted for hosted in openings_of(house) if hosted.opening.fill is None]
    assert len(passages) == 1
    assert len(list(doors_of(house))) + len(list(windows_of(house))) + 1 == len(list(openings_of(house)))


@pytest.mark.parametrize(
    "name", ["building-1", "s1", "storey-1", "wall-u-ne", "opening-g9", "door-g4", "space-u3", "slab-g", "stair-1"]
)
def test_anything_with_an_id_is_found_by_it(name):
    found = find(building(), name)
    assert found is not None
    assert found.id == name


def test_what_is_not_there_is_not_found():
    assert find(building(), "nothing") is None


def test_everything_is_listed_once():
    names = [thing.id for thing in everything(building())]
    assert len(names) == len(set(names)) == 60
    assert isinstance(find(building(), "door-g1"), Door)


def test_the_corners_of_an_opening_lie_in_the_walls_centre_plane():
    host = wall("a", (1.0, 2.0), (5.0, 2.0), 0.2, 3.0)
    low_start, low_end, high_end, high_start = opening_corners(host, opening("a", 1.0, 0.9, 0.1, 2.0, None))
    assert low_start == pytest.approx((*turned(2.0, 2.0), 3.1), abs=1e-6)
    assert low_end == pytest.approx((*turned(2.9, 2.0), 3.1), abs=1e-6)
    assert high_end == pytest.approx((*turned(2.9, 2.0), 5.1), abs=1e-6)
    assert high_start == pytest.approx((*turned(2.0, 2.0), 5.1), abs=1e-6)


def test_left_of_a_wall_is_left_of_who_walks_from_start_to_end():
    host = wall("a", (0.0, 0.0), (5.0, 0.0), 0.2, 0.0)
    assert point_on_wall(host, 1.0, 0.1, 0.0)[:2] == pytest.approx(turned(1.0, 0.1), abs=1e-6)


def test_a_wall_without_length_still_has_a_direction():
    host: Wall = wall("a", (1.0, 1.0), (1.0, 1.0), 0.2, 0.0)
    assert wall_length(host) == 0.0
    assert math.hypot(*wall_direction(host)) == 1.0
