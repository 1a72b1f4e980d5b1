"""Stairs and the wells over them, in a scene of two storeys."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from modelled import Modelled, modelled
from numpy.typing import NDArray
from shapely import orient_polygons, union_all
from shapely.geometry import LineString, Polygon, box
from surfaces import level, room, surfels_of
from synthetic import two_storeys

from scan2bim.model.elements import Stair
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.structure.build import parts_and_wells
from scan2bim.structure.plan import plan_of
from scan2bim.structure.stairs import FoundStair, find_stairs
from scan2bim.structure.storeys import StoreyLevels, layers_of
from scan2bim.structure.wells import without_stairs, without_wells

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


def test_a_well_with_little_more_than_a_landing_is_a_room_of_its_own() -> None:
    rooms, wells, cuts = without_wells(box(0, 0, 3, 2.5), [box(0, 0, 2, 2)])
    assert [p.area for p in rooms] == pytest.approx([7.5])
    assert not wells
    assert not cuts


def half_turn(risers: int, riser: float) -> list[NDArray[np.float64]]:
    """Treads of a stair 2 m wide that climbs along x, crosses over and comes back, without the uppermost."""
    side = (risers - 1) // 2
    up = [level(1 + 0.26 * k, 1, 1.26 + 0.26 * k, 1.9, (k + 1) * riser) for k in range(side)]
    back = [
        level(0.74 + 0.26 * (side - k), 2.1, 1 + 0.26 * (side - k), 3, (side + 1 + k) * riser)
        for k in range(risers - 1 - side)
    ]
    return up + back


def round_a_post(risers: int, riser: float) -> list[NDArray[np.float64]]:
    """Treads of a spiral stair 1.8 m across, without the uppermost."""
    disc = level(1, 1, 2.8, 2.8, 0.0)
    angle = np.arctan2(disc[:, 1] - 1.9, disc[:, 0] - 1.9) % (2 * math.pi)
    radius = np.hypot(disc[:, 1] - 1.9, disc[:, 0] - 1.9)
    number = np.floor(angle / (1.7 * math.pi) * (risers - 1)).astype(int)
    on = (radius > 0.1) & (radius < 0.9) & (number < risers - 1)
    treads = disc + np.column_stack([np.zeros((len(disc), 2)), (number + 1) * riser])
    return [treads[on & (number == k)] for k in range(risers - 1)]


def stairs_among(treads: list[NDArray[np.float64]], above: float) -> list[FoundStair]:
    around = [*room(0, 0, 8, 5, 0.0, None)[1:], level(4.5, 0, 8, 5, 0.0), level(4.5, 0, 8, 5, above - 0.2)]
    surfels = surfels_of(np.concatenate([*around, *treads]))
    layers = layers_of(surfels)
    plan = plan_of(StoreyLevels(0.0, 0.002, above - 0.2, above, 30.0), surfels, layers, np.array([[6.0, 2.0, 1.6]]))
    return find_stairs(plan, above, surfels, layers, 0.0)


@pytest.mark.parametrize(("treads", "kind"), [(half_turn, "winding"), (round_a_post, "spiral")])
def test_a_stair_of_which_middle_treads_are_hidden_is_one(
    treads: Callable[[int, float], list[NDArray[np.float64]]], kind: str
) -> None:
    (stair,) = stairs_among([t for k, t in enumerate(treads(15, 0.19)) if k not in (5, 6, 7)], 2.85)
    assert (stair.kind, stair.risers, stair.top) == (kind, 15, 2.85)


@pytest.mark.parametrize("treads", [half_turn, round_a_post])
def test_a_stair_that_turns_and_hides_its_upper_treads_goes_up_to_the_floor_above(
    treads: Callable[[int, float], list[NDArray[np.float64]]],
) -> None:
    (stair,) = stairs_among(treads(15, 0.19)[:9], 2.85)
    assert (stair.risers, stair.top) == (15, 2.85)


def test_a_thing_beside_a_flight_does_not_keep_it_from_what_goes_on_behind_hidden_treads() -> None:
    treads = [t for k, t in enumerate(half_turn(15, 0.19)) if k not in (5, 6, 7)]
    last = treads[4]
    thing = np.array([[last[:, 0].min() - 0.08, y, last[0, 2] + 0.145] for y in np.arange(1.2, 1.5, 0.05)])
    assert [(s.kind, s.risers) for s in stairs_among([*treads, thing], 2.85)] == [("winding", 15)]


def ladder(first: int, last: int) -> list[NDArray[np.float64]]:
    """Treads, some of ten risers of 28.5 cm, of a steep stair along x."""
    return [level(1 + 0.2 * k, 1, 1.2 + 0.2 * k, 1.7, (k + 1) * 0.285) for k in range(first, last)]


def test_a_steep_stair_from_floor_to_floor_is_one() -> None:
    (stair,) = stairs_among(ladder(0, 9), 2.85)
    assert (stair.kind, stair.risers) == ("straight", 10)


@pytest.mark.parametrize(("first", "last"), [(0, 6), (3, 9)])
def test_steep_steps_that_lead_nowhere_are_shelves(first: int, last: int) -> None:
    assert not stairs_among(ladder(first, last), 2.85)


def test_shelves_above_a_stair_at_other_heights_do_not_go_on_with_it() -> None:
    shelves = [level(3.2, 1 + 0.3 * k, 3.5, 1.3 + 0.3 * k, 1.35 + 0.21 * k) for k in range(4)]
    (stair,) = stairs_among([*half_turn(15, 0.19)[:6], *shelves], 2.85)
    assert stair.kind == "straight"
    assert Polygon(stair.outline).bounds[3] == pytest.approx(1.9, abs=0.1)


def test_a_well_over_which_the_next_stair_stands_belongs_to_its_room() -> None:
    (stair,) = stairs_among(half_turn(15, 0.19), 2.85)
    assert not without_stairs([stair.outline], [stair])
    assert without_stairs([box(5, 0, 6, 1)], [stair])


def test_furniture_of_many_heights_beside_each_other_is_no_stair() -> None:
    things = [
        level(1 + 0.3 * (k % 8), 1 + 0.3 * (k // 8), 1.25 + 0.3 * (k % 8), 1.25 + 0.3 * (k // 8), 0.0)
        for k in range(32)
    ]
    heights = [0.19 * (1 + (k % 8 if k // 8 % 2 == 0 else 7 - k % 8)) for k in range(32)]
    assert not stairs_among([t + np.array([0, 0, h]) for t, h in zip(things, heights, strict=True)], 2.85)


def test_a_space_with_a_well_is_parted_at_its_portals_too() -> None:
    rooms = orient_polygons(union_all([box(0, 0, 6, 4), box(6, 1, 6.2, 1.9), box(6.2, 0, 10, 4)]))
    assert isinstance(rooms, Polygon)
    well = box(2, 0, 5, 1)
    parts, below, borders = parts_and_wells(rooms, [well], lambda _: False)
    assert sorted(p.area for p in parts) == pytest.approx([15.2, 21.0], abs=0.3)
    assert [p.area for p in below] == pytest.approx([3.0])
    assert sum(b.length for b in borders) == pytest.approx(0.9 + 3.0 + 1.0 + 1.0, abs=0.02)


def test_a_portal_over_a_well_leaves_the_others() -> None:
    """Three rooms in a row; the well lies under the portal between the first two."""
    gaps = [box(6, 1, 6.2, 2.9), box(10.2, 1, 10.4, 1.9)]
    rooms = orient_polygons(union_all([box(0, 0, 6, 4), gaps[0], box(6.2, 0, 10.2, 4), gaps[1], box(10.4, 0, 14, 4)]))
    assert isinstance(rooms, Polygon)
    well = box(5.5, 1.8, 6.7, 2.1)
    parts, below, borders = parts_and_wells(rooms, [well], lambda _: False)
    assert sorted(p.area for p in parts) == pytest.approx([14.4, 40.0 - well.area], abs=0.4)
    assert [p.area for p in below] == pytest.approx([well.area])
    assert sum(b.length for b in borders) == pytest.approx(0.9 + well.length, abs=0.02)


def test_small_things_a_riser_apart_are_no_stair() -> None:
    steps = [(1 + 0.2 * k, 0.19 * (k + 1)) for k in range(10)]
    assert len(stairs_among([level(x, 1, x + 0.2, 2, h) for x, h in steps], 2.85)) == 1
    assert not stairs_among([level(x, 1, x + 0.15, 1.15, h) for x, h in steps], 2.85)


def test_things_a_riser_apart_round_other_things_are_no_stair() -> None:
    angles = np.linspace(0, 2 * math.pi, 14, endpoint=False)
    places = [(2.5 + 1.1 * math.cos(a), 2.5 + 1.1 * math.sin(a)) for a in angles]
    ring = [level(x - 0.2, y - 0.2, x + 0.2, y + 0.2, 0.19 * (k + 1)) for k, (x, y) in enumerate(places)]
    assert len(stairs_among(ring, 2.85)) == 1
    assert not stairs_among([*ring, level(1.6, 1.6, 3.4, 3.4, 0.1)], 2.85)


def test_things_that_rise_unevenly_in_a_row_are_no_stair() -> None:
    even = [level(1.0, 0.28 * k, 1.9, 0.28 * (k + 1), 0.18 * (k + 1)) for k in range(9)]
    (stair,) = stairs_among(even, 3.0)
    assert stair.risers >= 9
    heights = [0.18, 0.41, 0.55, 0.78, 0.94, 1.11, 1.32, 1.49, 1.68]
    assert not stairs_among([level(1.0, 0.28 * k, 1.9, 0.28 * (k + 1), z) for k, z in enumerate(heights)], 3.0)
