from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, room, surfels_of, upright

from scan2bim.structure.storeys import StoreyLevels, find_storeys, layers_of

F64 = NDArray[np.float64]


NOWHERE = np.full((1, 3), np.nan)


def storeys(*parts: F64, stations: F64 = NOWHERE) -> tuple[StoreyLevels, ...]:
    surfels = surfels_of(np.concatenate(parts))
    return find_storeys(surfels, layers_of(surfels), stations)


def box(x0: float, y0: float, x1: float, y1: float, height: float) -> list[F64]:
    """A solid box on the floor, without its underside and without the floor under it."""
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return [level(x0, y0, x1, y1, height)] + [upright(corners[i], corners[(i + 1) % 4], 0.0, height) for i in range(4)]


def test_one_room_is_one_storey_with_its_floor_and_ceiling() -> None:
    (only,) = storeys(*room(0, 0, 6, 5))
    assert only.floor == pytest.approx(0.0, abs=0.003)
    assert only.ceiling == pytest.approx(2.5, abs=0.003)
    assert only.area == pytest.approx(30.0, rel=0.1)
    assert only.sigma is not None and 0 < only.sigma < 0.01


@pytest.mark.parametrize("slab", [0.15, 0.25, 0.6])
def test_a_slab_parts_two_storeys(slab: float) -> None:
    low, high = storeys(*room(0, 0, 6, 5), *room(0, 0, 6, 5, 2.5 + slab, 5.0 + slab))
    assert (low.floor, high.floor) == pytest.approx((0.0, 2.5 + slab), abs=0.003)
    assert (low.ceiling, high.ceiling) == pytest.approx((2.5, 5.0 + slab), abs=0.003)
    assert low.top == pytest.approx(high.floor)


def test_storeys_are_ordered_from_the_lowest_up_even_below_zero() -> None:
    found = storeys(*room(0, 0, 6, 5, -2.8, -0.3), *room(0, 0, 6, 5), *room(1, 0, 5, 4, 2.8, 5.2))
    assert [s.floor for s in found] == pytest.approx([-2.8, 0.0, 2.8], abs=0.003)


def test_a_small_storey_over_a_large_one_is_not_lost() -> None:
    found = storeys(*room(0, 0, 12, 8), *room(0, 0, 3, 4, 2.75, 5.25))
    assert [s.floor for s in found] == pytest.approx([0.0, 2.75], abs=0.003)


def test_without_a_ceiling_the_floor_makes_a_storey_as_high_as_was_scanned() -> None:
    (only,) = storeys(*room(0, 0, 6, 5, 0.0, None))
    assert only.floor == pytest.approx(0.0, abs=0.003)
    assert only.ceiling is None
    assert only.top == pytest.approx(2.5, abs=0.1)


def test_a_podium_is_no_storey() -> None:
    floor_round = [level(0, 0, 8, 2, 0.0), level(0, 5, 8, 8, 0.0), level(4, 2, 8, 5, 0.0)]
    (only,) = storeys(*room(0, 0, 8, 8)[1:], *floor_round, *box(0, 2, 4, 5, 0.4))
    assert only.floor == pytest.approx(0.0, abs=0.003)


def test_tables_and_wardrobes_are_no_storeys() -> None:
    (only,) = storeys(*room(0, 0, 8, 8), *box(1, 1, 3, 4, 0.75), *box(5, 1, 8, 2.5, 0.9), *box(5, 4, 8, 5.2, 2.0))
    assert only.floor == pytest.approx(0.0, abs=0.003)
    assert only.ceiling == pytest.approx(2.5, abs=0.003)


def test_the_largest_ceiling_is_the_storeys() -> None:
    parts = [*room(0, 0, 6, 5), *room(6.1, 0, 9, 5, 0.0, 2.2)]
    (only,) = storeys(*parts)
    assert only.ceiling == pytest.approx(2.5, abs=0.003)


def test_where_no_floor_was_seen_there_is_no_storey() -> None:
    assert storeys(level(0, 0, 6, 5, 2.5)) == ()
    assert storeys(upright((0.0, 0.0), (0.0, 6.0), 0.0, 2.5)) == ()


def test_stations_over_a_ceiling_stand_in_a_storey_whose_floor_was_not_seen() -> None:
    attic = [upright((0, y), (6, y), 2.7, 4.9) for y in (0, 5)]
    eyes = np.array([[2.0, 2.0, 1.6], [2.0, 2.0, 4.2], [4.0, 3.0, 4.3]])
    low, high = storeys(*room(0, 0, 6, 5), *attic, stations=eyes)
    assert high.sigma is None
    assert high.floor == pytest.approx(2.7, abs=0.1)
    assert low.top == high.floor
    assert len(storeys(*room(0, 0, 6, 5), *attic, stations=eyes[:2])) == 1


def test_a_ceiling_with_much_room_above_it_is_no_storey_though_it_lies_on_the_border_of_two_voxels() -> None:
    (upper_floor,) = [level(0, 0, 6, 5, 4.2)]
    low = [*room(0, 0, 6, 5, 0.0, 2.5), level(0, 0, 6, 5, 2.506)]
    high = [upper_floor, level(0, 0, 6, 5, 6.7)]
    surfels = surfels_of(np.concatenate([*low, *high]), np.repeat([0, 1], [sum(map(len, p)) for p in (low, high)]))
    for eyes in (np.array([[2.0, 2.0, 1.6], [2.0, 2.0, 5.8]]), NOWHERE):
        found = find_storeys(surfels, layers_of(surfels, eyes), eyes)
        assert [s.floor for s in found] == pytest.approx([0.0, 4.2][: len(found)], abs=0.003)
    found = find_storeys(surfels, layers_of(surfels, np.array([[2.0, 2.0, 1.6], [2.0, 2.0, 5.8]])), NOWHERE)
    assert len(found) == 2
