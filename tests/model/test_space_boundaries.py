from __future__ import annotations

import pytest
import shapely
from buildings import building
from every_shape import every_shape, front

from scan2bim.model.elements import Building
from scan2bim.model.space_boundaries import Boundary, space_boundaries


@pytest.fixture(scope="module")
def every() -> tuple[Boundary, ...]:
    return space_boundaries(every_shape())


def area(boundary: Boundary) -> float:
    return shapely.Polygon(boundary.patch.outline, boundary.patch.holes).area


def of(boundaries: tuple[Boundary, ...], space: str, element: str | None) -> list[Boundary]:
    return [b for b in boundaries if (b.space, b.element) == (space, element)]


@pytest.mark.parametrize("make", [every_shape, building])
def test_top_level_boundaries_cover_the_surface_of_each_space_once(make):
    house: Building = make()
    found = space_boundaries(house)
    for storey in house.storeys:
        for space in storey.spaces:
            shape = shapely.Polygon(space.outline, space.holes)
            surface = shape.length * space.height.value + 2 * shape.area
            covered = sum(area(b) for b in found if b.space == space.id and b.parent is None)
            assert covered == pytest.approx(surface, rel=1e-3), space.name


def test_normals_point_out_of_the_space(every):
    room = shapely.Polygon(every_shape().storeys[0].spaces[0].outline)
    for boundary in every:
        if boundary.space != "room-store":
            continue
        (x, y, z), (nx, ny, nz) = boundary.patch.origin, boundary.patch.normal
        if nz == 0.0:
            first = boundary.patch.outline[1][0] / 2
            dx, dy, _ = boundary.patch.x_axis
            assert not room.contains(shapely.Point(x + first * dx + 0.05 * nx, y + first * dy + 0.05 * ny))
        else:
            assert nz == (1.0 if z > 1.0 else -1.0)


def test_a_door_lies_in_the_boundary_of_its_wall_on_both_sides(every):
    by_key = {b.key: b for b in every}
    (store,), (hall,) = of(every, "room-store", "door-measured"), of(every, "room-hall", "door-measured")
    assert (store.twin, hall.twin) == (hall.key, store.key)
    assert area(store) == pytest.approx(0.9 * 2.1)
    for side in (store, hall):
        assert side.parent is not None
        assert by_key[side.parent].element == "wall-inner"
        assert side.external is False


def test_a_passage_is_a_boundary_of_its_opening_and_a_niche_is_none(every):
    assert len([b for b in every if b.element == "opening-pass"]) == 2
    assert [b for b in every if b.element in ("opening-niche-arc", "opening-niche-back")] == []


def test_spaces_that_are_open_to_each_other_share_a_virtual_boundary(every):
    between = [b for b in of(every, "room-hall", None) if b.beyond == "room-kitchen"]
    wide = max(between, key=area)
    assert area(wide) == pytest.approx((4.0 - front(5.5) - 0.12) * 2.6, rel=5e-3)
    twin = next(b for b in every if b.key == wide.twin)
    assert (twin.space, twin.beyond, twin.element) == ("room-kitchen", "room-hall", None)


def test_above_a_low_wall_the_boundary_is_virtual(every):
    low = sum(area(b) for b in of(every, "room-hall", "wall-counter"))
    assert low == pytest.approx(1.1 * 1.87, rel=0.02)


def test_a_wall_between_two_spaces_and_one_to_the_outside_are_told_apart(every):
    inner = of(every, "room-store", "wall-inner")
    outer = of(every, "room-store", "wall-west")
    assert {b.beyond for b in inner if area(b) > 0.1} == {"room-hall"}
    assert {(b.beyond, b.external) for b in outer} == {(None, True)}


def test_floors_and_ceilings_are_of_slabs_and_coverings(every):
    assert [b.patch.normal[2] for b in of(every, "room-store", "plate-ground")] == [-1.0]
    assert {b.patch.normal[2] for b in of(every, "room-store", "plate-store")} == {1.0}
    over = list(of(every, "room-kitchen", "plate-upper"))
    assert {b.beyond for b in over} >= {"room-attic"}


def test_keys_are_their_own_and_stay_from_run_to_run(every):
    keys = [b.key for b in every]
    assert len(set(keys)) == len(keys)
    assert keys == [b.key for b in space_boundaries(every_shape())]
