from __future__ import annotations

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely.affinity import rotate
from shapely.geometry import LineString, Polygon

from scan2bim.structure.axes import Axis, AxisJoin
from scan2bim.structure.thicknesses import OUTER, OneFaced
from scan2bim.structure.walls import THICKEST, find_walls

F64 = NDArray[np.float64]
YAWS = [0.0, 17.0, 45.0, 123.0]


def turned(polygons: list[Polygon], degrees: float) -> list[Polygon]:
    return [rotate(p, degrees, origin=(0.0, 0.0)) for p in polygons]


def two_rooms(gap: float, degrees: float = 0.0) -> list[Polygon]:
    """Rooms of 4 x 3 m side by side."""
    return turned([shapely.box(0, 0, 4, 3), shapely.box(4 + gap, 0, 8 + gap, 3)], degrees)


def between(axes: list[Axis]) -> list[Axis]:
    """Walls with a space on both sides."""
    return [a for a in axes if a.left and a.right]


def assert_ends_lie_on_their_walls(axes: list[Axis], joins: list[AxisJoin]) -> None:
    for join in joins:
        end = axes[join.one].start if join.at == "start" else axes[join.one].end
        line = LineString([axes[join.other].start, axes[join.other].end])
        assert line.distance(shapely.Point(end)) < 1e-6
        if join.other_at != "path":
            other = axes[join.other].start if join.other_at == "start" else axes[join.other].end
            np.testing.assert_allclose(end, other, atol=1e-6)


@pytest.mark.parametrize("degrees", YAWS)
@pytest.mark.parametrize("gap", [0.05, 0.1, 0.3, 0.75])
def test_the_strip_between_two_spaces_is_one_wall_of_exactly_its_thickness(gap: float, degrees: float) -> None:
    axes, _ = find_walls(two_rooms(gap, degrees), [])
    (wall,) = between(axes)
    assert wall.measured
    assert wall.thickness == pytest.approx(gap, abs=1e-9)
    middle = rotate(shapely.Point(4 + gap / 2, 1.5), degrees, origin=(0.0, 0.0))
    assert LineString([wall.start, wall.end]).distance(middle) < 1e-9


@pytest.mark.parametrize("degrees", YAWS)
def test_a_room_alone_has_four_walls_outside_of_its_outline_that_meet_in_the_corners(degrees: float) -> None:
    (room,) = turned([shapely.box(0, 0, 5, 4)], degrees)
    axes, joins = find_walls([room], [])
    assert len(axes) == 4
    assert not any(a.measured for a in axes)
    assert {a.thickness for a in axes} == {OUTER}
    for axis in axes:
        assert LineString([axis.start, axis.end]).distance(room) == pytest.approx(OUTER / 2, abs=1e-6)
    assert len(joins) == 8
    assert_ends_lie_on_their_walls(axes, joins)
    assert sum(a.length for a in axes) == pytest.approx(2 * (5 + 4 + 2 * OUTER), abs=1e-6)


@pytest.mark.parametrize("degrees", YAWS)
def test_walls_in_one_line_are_one_wall_over_several_rooms(degrees: float) -> None:
    rooms = turned([shapely.box(0, 0, 4, 3), shapely.box(4.1, 0, 8, 3), shapely.box(8.1, 0, 12, 3)], degrees)
    axes, joins = find_walls(rooms, [])
    assert len(axes) == 6
    longest = sorted(a.length for a in axes)[-2:]
    assert longest == pytest.approx([12 + OUTER, 12 + OUTER], abs=0.02)
    assert_ends_lie_on_their_walls(axes, joins)
    assert sum(j.other_at == "path" for j in joins) == 4


def test_spaces_lie_on_the_sides_of_their_walls_at_any_yaw() -> None:
    for degrees in range(0, 360, 7):
        rooms = two_rooms(0.12, degrees)
        axes, _ = find_walls(rooms, [])
        assert len(axes) == 5
        assert_spaces_beside(axes, rooms)


def assert_spaces_beside(axes: list[Axis], rooms: list[Polygon]) -> None:
    for axis in axes:
        for spaces, side in ((axis.left, 1.0), (axis.right, -1.0)):
            beside = axis.normal * side * (axis.thickness / 2 + 0.01)
            strip = LineString([axis.start + beside, axis.end + beside])
            assert spaces == {number for number, room in enumerate(rooms) if strip.intersects(room)}


def test_rooms_farther_apart_than_any_wall_have_walls_of_their_own() -> None:
    axes, _ = find_walls(two_rooms(THICKEST + 0.4), [])
    assert len(axes) == 8
    assert not between(axes)


def test_no_wall_stands_on_a_virtual_border() -> None:
    halves = [shapely.box(0, 0, 4, 3), shapely.box(4, 0, 8, 3)]
    axes, _ = find_walls(halves, [LineString([(4, 0), (4, 3)])])
    assert not any(abs(a.start[0] - 4) < 0.1 and abs(a.end[0] - 4) < 0.1 and a.length > 1 for a in axes)


def test_a_thickness_for_one_faced_counts_for_them_alone() -> None:
    axes, _ = find_walls(two_rooms(0.1), [], OneFaced(0.45))
    assert sorted({round(a.thickness, 6) for a in axes}) == [0.1, 0.45]


def test_an_l_shaped_room_has_six_joined_walls() -> None:
    ring = [(0, 0), (6, 0), (6, 3), (3, 3), (3, 6), (0, 6)]
    axes, joins = find_walls([Polygon(ring)], [])
    assert len(axes) == 6
    assert len(joins) == 12
    assert_ends_lie_on_their_walls(axes, joins)


def test_a_free_end_of_a_wall_is_not_joined() -> None:
    ring = [(0, 0), (6, 0), (6, 4), (3.1, 4), (3.1, 2), (3.0, 2), (3.0, 4), (0, 4)]
    axes, joins = find_walls([Polygon(ring)], [])
    (stub,) = [i for i, a in enumerate(axes) if a.thickness == pytest.approx(0.1) and a.length > 1]
    assert len([j for j in joins if j.one == stub]) == 1
    assert_ends_lie_on_their_walls(axes, joins)


def test_the_walls_of_a_notch_join_exactly() -> None:
    ring = [(0, 0), (4, 0), (4, 3), (3.8, 3), (3.8, 2.4), (2.4, 2.4), (2.4, 3), (0, 3)]
    axes, joins = find_walls([Polygon(ring)], [])
    assert_ends_lie_on_their_walls(axes, joins)


def test_a_room_on_a_longer_corridor_joins_its_walls_exactly() -> None:
    axes, joins = find_walls([shapely.box(0, 0, 10, 1.3), shapely.box(4, 1.42, 6, 4.5)], [])
    assert len(axes) == 9
    assert_ends_lie_on_their_walls(axes, joins)


def test_a_wall_goes_on_behind_the_piers_before_it() -> None:
    piers = [(8, 4), (8, 3.8), (6, 3.8), (6, 4), (4, 4), (4, 3.8), (2, 3.8), (2, 4)]
    axes, _ = find_walls([Polygon([(0, 0), (10, 0), (10, 4), *piers, (0, 4)])])
    long = [a for a in axes if a.length > 9 and a.start[1] > 3]
    assert [round(float(a.start[1] - a.thickness / 2), 3) for a in long] == [4.0]
    before = [a for a in axes if 1 < a.length < 3 and a.start[1] > 3]
    assert [round(a.thickness, 3) for a in before] == [0.2, 0.2]


def test_a_long_lining_before_a_wall_is_as_thick_as_a_partition() -> None:
    lining = [(8, 4), (8, 3.6), (4, 3.6), (4, 4)]
    axes, _ = find_walls([Polygon([(0, 0), (12, 0), (12, 4), *lining, (0, 4)])], sole=OneFaced(inner=0.12))
    before = [a for a in axes if 3 < a.length < 5 and 3 < a.start[1] < 4]
    assert [(round(a.thickness, 3), round(float(a.start[1]), 3)) for a in before] == [(0.12, 3.66)]


def test_without_spaces_there_are_no_walls() -> None:
    assert find_walls([], []) == ([], [])


def test_the_sides_of_a_window_recess_are_no_walls() -> None:
    recess = Polygon([(0, 0), (6, 0), (6, 4), (3.5, 4), (3.5, 4.35), (2.5, 4.35), (2.5, 4), (0, 4)])
    walls, _ = find_walls([recess], sole=OneFaced(0.45))
    across = [w for w in walls if abs(w.direction[1]) > 0.9]
    assert sorted(round(w.length, 1) for w in across) == [4.4, 4.4]


def test_a_wall_goes_on_across_a_doorway_in_which_spaces_meet() -> None:
    west = shapely.Polygon([(0, 0), (4, 0), (4, 1), (4.1, 1), (4.1, 1.9), (4, 1.9), (4, 4), (0, 4)])
    east = shapely.box(4.1, 0, 8, 4)
    meeting = shapely.LineString([(4.1, 1), (4.1, 1.9)])
    between = [a for a in find_walls([west, east], [meeting])[0] if a.measured]
    assert [round(a.length, 1) for a in between] == [pytest.approx(4.0, abs=0.4)]
    wide = shapely.Polygon([(0, 0), (4, 0), (4, 1), (4.1, 1), (4.1, 2.6), (4, 2.6), (4, 4), (0, 4)])
    assert (
        len([a for a in find_walls([wide, east], [shapely.LineString([(4.1, 1), (4.1, 2.6)])])[0] if a.measured]) == 2
    )


@pytest.mark.parametrize("longer", [0.0, 0.02, -0.02])
def test_an_end_between_two_walls_as_long_lies_on_the_thicker_one(longer: float) -> None:
    low, high = shapely.box(0, 0, 4, 2.0), shapely.box(4.5, 0, 8.5 + longer, 2.0)
    upper = [shapely.box(0, 2.12, 4, 5), shapely.box(4.6, 2.18, 8.6, 5)]
    axes, joins = find_walls([low, high, *upper], [])
    party = next(k for k, a in enumerate(axes) if a.measured and abs(a.thickness - 0.5) < 0.01)
    (met,) = [axes[j.other] for j in joins if j.one == party and axes[j.other].measured]
    assert met.thickness == pytest.approx(0.18)
