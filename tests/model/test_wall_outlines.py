from __future__ import annotations

import math

import pytest
import shapely
from buildings import building, wall

from scan2bim.model.elements import Join, Point2, Wall
from scan2bim.model.queries import point_on_wall
from scan2bim.model.wall_outlines import outline_area, wall_outlines


def join(other: str, at: str, other_at: str) -> Join:
    return Join(wall=f"wall-{other}", at=at, other_at=other_at, kind="T" if "path" in (at, other_at) else "L")


def in_plan(walls: list[Wall]) -> list[shapely.Polygon]:
    outlines = wall_outlines(walls)
    return [shapely.Polygon([point_on_wall(w, x, y, 0)[:2] for x, y in outlines[w.id]]) for w in walls]


def overlap(one: shapely.Polygon, two: shapely.Polygon) -> float:
    return one.intersection(two).area


def corner(angle: float, first: float = 0.3, second: float = 0.1) -> list[Wall]:
    end = (4 * math.cos(angle), 4 * math.sin(angle))
    return [
        wall("a", (4.0, 0.0), (0.0, 0.0), first, 0.0, joins=(join("b", "end", "start"),)),
        wall("b", (0.0, 0.0), end, second, 0.0),
    ]


def test_a_wall_that_joins_nothing_is_a_rectangle():
    (area,) = in_plan([wall("a", (1.0, 1.0), (4.0, 5.0), 0.2, 0.0)])
    assert area.area == pytest.approx(5 * 0.2, abs=1e-6)


@pytest.mark.parametrize("degrees", [45, 60, 90, 120, 150, -60, -90, -135])
def test_two_ends_are_mitred_without_gap_or_overlap(degrees):
    one, two = in_plan(corner(math.radians(degrees)))
    assert overlap(one, two) == pytest.approx(0.0, abs=1e-9)
    both = shapely.union_all([one, two.buffer(1e-7)])
    assert isinstance(both, shapely.Polygon)
    assert len(both.interiors) == 0
    assert len(both.simplify(1e-5).exterior.coords) == 7


def test_a_right_corner_of_unlike_walls_is_filled_to_its_outer_edge():
    one, two = in_plan(corner(math.pi / 2))
    assert one.area + two.area == pytest.approx(4.05 * 0.3 + 3.85 * 0.1, abs=1e-6)


def test_a_sharp_corner_grows_no_spike():
    for area in in_plan(corner(math.radians(8), 0.2, 0.2)):
        assert area.bounds[2] - area.bounds[0] < 4.5
        assert area.is_valid


@pytest.mark.parametrize("degrees", [0, 1, 180, 181])
def test_walls_that_go_on_from_each_other_are_cut_straight(degrees):
    for area in in_plan(corner(math.radians(degrees))):
        assert len(area.exterior.coords) == 5


@pytest.mark.parametrize("end", [(2.0, 3.0), (4.0, 3.0), (0.5, -3.0)])
def test_a_wall_is_butted_against_one_that_runs_through(end: Point2):
    through = wall("a", (0.0, 0.0), (4.0, 0.0), 0.3, 0.0)
    branch = wall("b", end, (2.0, 0.0), 0.1, 0.0, joins=(join("a", "end", "path"),))
    one, two = in_plan([through, branch])
    assert one.area == pytest.approx(4 * 0.3, abs=1e-5)
    assert overlap(one, two) == pytest.approx(0.0, abs=1e-6)
    assert one.distance(two) == pytest.approx(0.0, abs=1e-6)
    assert isinstance(shapely.union_all([one, two.buffer(1e-5)]), shapely.Polygon)


def test_a_join_named_by_either_wall_counts_for_both():
    named = corner(math.pi / 2)
    other = [
        named[0].model_copy(update={"joins": ()}),
        named[1].model_copy(update={"joins": (join("a", "start", "end"),)}),
    ]
    assert wall_outlines(named) == wall_outlines(other)


@pytest.mark.parametrize("directions", [(0, 90, 180), (0, 120, 240), (10, 100, 190, 280), (0, 45, 100, 170, 260)])
def test_many_ends_in_one_point_share_it_without_gap_or_overlap(directions):
    names = [f"w{d}" for d in directions]
    walls = [
        wall(
            name,
            (0.0, 0.0),
            (5 * math.cos(math.radians(d)), 5 * math.sin(math.radians(d))),
            0.1 + 0.05 * i,
            0.0,
            joins=tuple(join(other, "start", "start") for other in names if other != name),
        )
        for i, (name, d) in enumerate(zip(names, directions, strict=True))
    ]
    areas = in_plan(walls)
    for i, one in enumerate(areas):
        assert one.is_valid
        for two in areas[:i]:
            assert overlap(one, two) < 1e-6
    whole = shapely.union_all([area.buffer(1e-6, join_style="mitre") for area in areas])
    assert isinstance(whole, shapely.Polygon)
    assert len(whole.interiors) == 0


def test_outlines_run_counter_clockwise():
    for storey in building().storeys:
        for outline in wall_outlines(storey.walls).values():
            assert outline_area(outline) > 0


def test_joins_to_oneself_or_to_nowhere_are_ignored():
    host = wall("a", (0.0, 0.0), (4.0, 0.0), 0.2, 0.0, joins=(join("a", "end", "start"), join("z", "start", "end")))
    assert outline_area(wall_outlines([host])["wall-a"]) == pytest.approx(0.8, abs=1e-6)


def test_a_short_wall_between_thick_ones_keeps_its_order_of_corners():
    thick = wall("a", (0.0, -3.0), (0.0, 3.0), 0.6, 0.0)
    short = wall("b", (0.0, 0.0), (0.4, 0.0), 0.1, 0.0, joins=(join("a", "start", "path"), join("c", "end", "path")))
    other = wall("c", (0.4, -3.0), (0.4, 3.0), 0.6, 0.0)
    assert outline_area(wall_outlines([thick, short, other])["wall-b"]) > 0
