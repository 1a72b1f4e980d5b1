from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate
from shapely.geometry import LineString, Polygon
from surfaces import level, surfels_of

from scan2bim.structure.plan import plan_of
from scan2bim.structure.portals import split_at_portals, under_lintel
from scan2bim.structure.storeys import StoreyLevels, layers_of

YAWS = [0.0, 23.0, 45.0, 110.0]


def without(_line: LineString) -> bool:
    """No lintel hangs anywhere."""
    return False


def union(*parts: Polygon) -> Polygon:
    """One counter-clockwise polygon, as outlines of spaces are."""
    polygon = shapely.orient_polygons(shapely.union_all(parts))
    assert isinstance(polygon, Polygon)
    return polygon


def dumbbell(width: float, degrees: float = 0.0) -> Polygon:
    """Two areas of 4 x 4 m that a passage as deep as a wall joins."""
    left, right = shapely.box(0, 0, 4, 4), shapely.box(4.1, 0, 8.1, 4)
    joined = union(left, right, shapely.box(3.9, 1.0, 4.2, 1.0 + width))
    return rotate(joined, degrees, origin=(0.0, 0.0))


@pytest.mark.parametrize("degrees", YAWS)
@pytest.mark.parametrize("width", [0.9, 1.6, 2.4])
def test_a_passage_parts_an_open_plan(width: float, degrees: float) -> None:
    polygon = dumbbell(width, degrees)
    parts, cuts = split_at_portals(polygon, without)
    assert len(parts) == 2
    assert len(cuts) == 1
    assert cuts[0].length == pytest.approx(width, abs=0.01)
    assert sum(p.area for p in parts) == pytest.approx(polygon.area, abs=1e-3)
    assert parts[0].intersection(parts[1]).area < 1e-3


def test_a_plain_room_stays_whole() -> None:
    room = shapely.box(0, 0, 9, 4)
    assert split_at_portals(room, without) == ([room], [])


def test_a_wide_opening_does_not_part_a_space() -> None:
    wide = union(shapely.box(0, 0, 5, 6), shapely.box(5, 0.2, 10, 5.8))
    assert len(split_at_portals(wide, without)[0]) == 1


@pytest.mark.parametrize("degrees", YAWS)
def test_a_niche_stays_with_its_room(degrees: float) -> None:
    polygon = rotate(union(shapely.box(0, 0, 5, 4), shapely.box(5, 1, 6.2, 2.5)), degrees, origin=(0, 0))
    parts, cuts = split_at_portals(polygon, without)
    assert len(parts) == 1
    assert not cuts


def test_three_areas_in_a_row_are_three_spaces() -> None:
    row = union(*[shapely.box(4.1 * i, 0, 4.1 * i + 4, 4) for i in range(3)], shapely.box(3, 1, 9, 2))
    parts, cuts = split_at_portals(row, without)
    assert len(parts) == 3
    assert len(cuts) == 2
    assert sum(p.area for p in parts) == pytest.approx(row.area, abs=1e-3)


def test_parts_keep_their_holes() -> None:
    hollow = dumbbell(1.2).difference(shapely.box(1, 1, 1.5, 1.5))
    parts, _ = split_at_portals(union(*[p for p in shapely.get_parts(hollow) if isinstance(p, Polygon)]), without)
    assert sorted(len(p.interiors) for p in parts) == [0, 1]


def test_a_wide_passage_under_a_lintel_parts_a_space() -> None:
    hall = union(shapely.box(0, 0, 7, 1.6), shapely.box(0, 1.8, 10, 6), shapely.box(3.8, 1.5, 7, 1.9))
    assert len(split_at_portals(hall, without)[0]) == 1
    parts, (cut,) = split_at_portals(hall, lambda line: abs(line.centroid.y - 1.7) < 0.2)
    assert min(p.area for p in parts) == pytest.approx(7 * 1.6, abs=0.7)
    assert cut.length == pytest.approx(3.2, abs=0.01)


def test_a_lintel_hangs_lower_than_the_ceilings_on_both_sides() -> None:
    floor, ceiling = level(0, 0, 10, 4, 0.0), [level(0, 0, 4.9, 4, 2.5), level(5.1, 0, 10, 4, 2.5)]
    surfels = surfels_of(np.concatenate([floor, *ceiling, level(4.9, 0, 5.1, 4, 2.25)]))
    plan = plan_of(StoreyLevels(0.0, 0.002, 2.5, 2.7, 40.0), surfels, layers_of(surfels), np.array([[2.0, 2.0, 1.6]]))
    assert under_lintel(LineString([(4.9, 0.5), (4.9, 3.5)]), plan)
    assert under_lintel(LineString([(5.1, 3.5), (5.1, 0.5)]), plan)
    assert not under_lintel(LineString([(3.0, 0.5), (3.0, 3.5)]), plan)
    assert not under_lintel(LineString([(3.5, 2.0), (6.5, 2.0)]), plan)


@pytest.mark.parametrize("degrees", YAWS)
def test_corridors_in_a_ring_are_parted_from_the_halls_that_they_join(degrees: float) -> None:
    ring = shapely.box(0, 0, 20, 16).difference(shapely.box(2, 5, 18, 11)).difference(shapely.box(1.5, 6, 2, 10))
    ring = ring.difference(shapely.box(17.9, 6, 18.5, 10))  # halls of 20 x 5 m, corridors of 1.5 m at both sides
    polygon = rotate(union(ring.difference(shapely.box(1.5, 5, 2, 11)).buffer(0)), degrees, origin=(0, 0))
    parts, cuts = split_at_portals(polygon, without)
    assert len(cuts) == len(parts) == 4
    assert sorted(p.area for p in parts)[2:] == pytest.approx([100, 100], abs=2)


@pytest.mark.parametrize("degrees", YAWS)
def test_a_corridor_that_meets_another_ends_at_its_wall(degrees: float) -> None:
    crossing = union(shapely.box(0, 0, 16, 2), shapely.box(6, 1.9, 8, 10))
    parts, (cut,) = split_at_portals(rotate(crossing, degrees, origin=(0, 0)), without)
    assert sorted(p.area for p in parts) == pytest.approx([16, 32], abs=0.1)
    assert cut.length == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("degrees", YAWS)
def test_a_corridor_stays_whole_at_its_corners_and_bays(degrees: float) -> None:
    corridor = union(shapely.box(0, 0, 12, 2), shapely.box(10, 0, 12, 9), shapely.box(3, 1.9, 6, 3))
    assert len(split_at_portals(rotate(corridor, degrees, origin=(0, 0)), without)[0]) == 1
