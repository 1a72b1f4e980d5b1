"""No two walls that run alike stand in one place, and no space in a wall."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from scan2bim.structure.axes import Axis, AxisJoin
from scan2bim.structure.overlaps import Bodies, clear_of, parted, parted_again, reaching

BOTH = (frozenset({0}), frozenset({1}))
LEFT = (frozenset({0}), frozenset())
RIGHT = (frozenset(), frozenset({0}))


def axis(start, end, thickness=0.1, beside=BOTH, degrees=0.0) -> Axis:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[c, s], [-s, c]])
    return Axis(np.array(start) @ turn, np.array(end) @ turn, thickness, beside == BOTH, *beside)


def body(wall: Axis) -> shapely.Polygon:
    return shapely.buffer(shapely.LineString([wall.start, wall.end]), wall.thickness / 2, cap_style="flat")


def shared(walls: list[Axis]) -> float:
    bodies = [body(wall) for wall in walls]
    return sum(a.intersection(b).area for i, a in enumerate(bodies) for b in bodies[:i])


@pytest.mark.parametrize("degrees", [0.0, 33.0, 200.0])
@pytest.mark.parametrize("back", [False, True])
def test_a_thick_short_wall_over_a_thin_long_one_becomes_a_pier_beside_it(degrees, back):
    ends = [(2.0, 0.25), (2.8, 0.25)]
    long, thick = axis((0, 0), (5, 0), 0.1, BOTH, degrees), axis(*(ends[::-1] if back else ends), 0.6, BOTH, degrees)
    walls = parted([thick, long])
    assert shared(walls) < 1e-6
    assert (walls[0].thickness, walls[0].length) == pytest.approx((0.5, 0.8))
    assert walls[1] is long
    assert body(walls[0]).area + body(long).area == pytest.approx(0.5 * 0.8 + 0.5)
    assert body(walls[0]).difference(body(thick)).area < 1e-6
    # it has lost the space on the side where the long wall stands: below it, its own left if it runs back
    assert (walls[0].left, walls[0].right) == ((frozenset(), BOTH[1]) if back else (BOTH[0], frozenset()))


def test_the_longer_wall_shortens_one_in_its_line():
    walls = parted([axis((0, 0), (4, 0), 0.6), axis((3.6, -0.1), (4.5, -0.1), 0.4, RIGHT)])
    assert shared(walls) < 1e-6
    assert (walls[1].length, walls[1].thickness) == pytest.approx((0.5, 0.4))


def test_a_wall_whose_face_lies_in_another_is_none():
    long = axis((0, 0), (4, 0), 0.3)
    assert parted([long, axis((1, 0.1), (2, 0.1), 0.3, RIGHT)]) == [long]
    assert len(parted([long, axis((1, 0.1), (2, 0.1), 0.3, LEFT)])) == 2


def test_walls_that_cross_or_only_touch_stay_as_they_are():
    walls = [axis((0, 0), (4, 0)), axis((2, -1), (2, 2)), axis((0, 0.11), (3, 0.11)), axis((4, 0), (6, 0))]
    assert parted(walls) == walls


def test_a_pier_is_one_wall_whether_it_is_taken_by_its_front_or_by_its_sides():
    front, sides = axis((0, 0), (0.63, 0), 0.19, LEFT), axis((0.315, -0.09), (0.315, 0.09), 0.63)
    assert parted([sides, front]) == [front]


def test_a_wall_drawn_on_to_its_joint_takes_the_place_of_a_shorter_one():
    walls = [axis((0, 0), (4, 0), 0.6), axis((3.8, 0.1), (4.9, 0.1), 0.4, LEFT), axis((4, -2), (4, 0))]
    joins = [AxisJoin(0, "end", 2, "end"), AxisJoin(2, "end", 0, "end")]
    new, kept = parted_again(walls, joins)
    assert shared([new[0], new[1]]) < 1e-6
    assert new[0] is walls[0]
    inside = [walls[1].__class__(np.array([1.0, 0.0]), np.array([1.5, 0.0]), 0.2, False, *LEFT), walls[0], walls[2]]
    fewer, renumbered = parted_again(inside, [AxisJoin(1, "end", 2, "end")])
    assert (fewer, renumbered) == ([walls[0], walls[2]], [AxisJoin(0, "end", 1, "end")])
    assert kept == joins


def test_a_step_in_the_corner_of_joined_walls_is_none():
    corner = [axis((0, 0), (4, 0), 0.6), axis((4, 0), (4, 3), 0.7)]
    joins = [AxisJoin(0, "end", 1, "start"), AxisJoin(1, "start", 0, "end")]
    assert parted_again([*corner, axis((4.0, 0.5), (4.4, 0.5), 0.4, RIGHT)], joins) == (corner, joins)
    assert len(parted_again([*corner, axis((4.2, 0.5), (4.9, 0.5), 0.4, RIGHT)], joins)[0]) == 3


@pytest.mark.parametrize(("gap", "length"), [(0.08, 2.08), (0.3, 2.0), (0.0, 2.0)])
def test_a_free_end_just_short_of_a_wall_reaches_it(gap, length):
    walls = [axis((0, 0), (2, 0)), axis((2 + gap, -0.1), (3, -0.1), 0.4)]
    assert reaching(walls, [])[0].length == pytest.approx(length)


@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_spaces_end_where_walls_begin(degrees):
    room = rotate(shapely.box(0, 0, 4, 3), degrees, origin=(0, 0))
    wall = axis((0, 3), (4, 3), 0.1, BOTH, degrees)
    clear = clear_of(room, Bodies.of([wall]))
    assert clear.area == pytest.approx(4 * 2.95)
    assert len(clear.exterior.coords) == 5
    assert clear_of(room, Bodies.of([axis((0, 3.045), (4, 3.045), 0.1, BOTH, degrees)])) is room
    assert clear_of(room, Bodies.of([axis((1, 1), (2, 1), 0.1, BOTH, degrees)])) is room
