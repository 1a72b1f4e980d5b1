"""Columns: found as what they are, and no obstacle to spaces and walls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from members import HEIGHT, YAW, post, room_of, round_post
from modelled import Modelled, modelled, overlap, true_spaces
from shapely.geometry import Point, Polygon, box
from synthetic import scanned

from scan2bim.geometry.sections import fit_circle, fit_rectangle
from scan2bim.simulate import furniture
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Box, DoorSpec, Point2, WallSpec
from scan2bim.structure.faces import Face
from scan2bim.structure.pillars import without_posts

SPEC = ScannerSpec(step=math.radians(0.5))
SQUARE, OBLIQUE, ROUND, BESIDE = (2.6, 3.2), (5.0, 4.9), (7.6, 3.0), (5.2, 1.7)
HALL = room_of(
    "columns",
    [(0.0, 0.0), (10.0, 0.0), (10.0, 7.0), (0.0, 7.0)],
    [
        post("square column", SQUARE, (0.4, 0.4)),
        post("oblique column", OBLIQUE, (0.3, 0.5), math.radians(30)),
        *round_post("round column", ROUND, 0.36),
        post("column behind a chair", BESIDE, (0.35, 0.35)),
        Box("chair", (5.75, 1.7), (0.5, 0.5, 0.9)),
        post("pipe", (1.5, 5.5), (0.07, 0.07)),
        Box("person", (8.6, 5.2), (0.45, 0.3, 1.78), yaw=0.5),
        Box("locker", (3.2, 5.4), (0.6, 0.6, 2.2)),
        *furniture.wardrobe("wardrobe", (9.5, 4.0), math.pi / 2),
    ],
    [(1.4, 1.6), (8.6, 1.3), (6.6, 5.6)],
)


@pytest.fixture(scope="module")
def hall() -> Modelled:
    return modelled(HALL, SPEC)


def placed(point: Point2) -> np.ndarray:
    return HALL.placement.points(np.array([[*point, 0.0]]))[0, :2]


@pytest.mark.parametrize(
    ("place", "size", "section"),
    [
        (SQUARE, (0.4, 0.4), "rectangular"),
        (OBLIQUE, (0.3, 0.5), "rectangular"),
        (ROUND, (0.36, 0.36), "round"),
        (BESIDE, (0.35, 0.35), "rectangular"),
    ],
)
def test_a_column_is_found_where_it_is_with_its_section(
    hall: Modelled, place: Point2, size: tuple[float, float], section: str
) -> None:
    columns = hall.structure.storeys[0].columns
    near = min(columns, key=lambda c: Polygon(c.outline).distance(Point(placed(place))))
    centre = np.array(Polygon(near.outline).centroid.coords[0])
    assert np.abs(centre - placed(place)).max() < 0.015
    assert sorted(near.size) == pytest.approx(sorted(size), abs=0.025)
    assert near.section == section
    assert near.top == pytest.approx(HEIGHT, abs=0.01)


def test_pipes_people_lockers_and_wardrobes_are_no_columns(hall: Modelled) -> None:
    assert len(hall.structure.storeys[0].columns) == 4


def test_an_oblique_column_keeps_its_direction(hall: Modelled) -> None:
    columns = hall.building.storeys[0].columns
    column = min(columns, key=lambda c: Polygon(c.outline).distance(Point(placed(OBLIQUE))))
    corners = np.array(column.outline)
    side = corners[1] - corners[0]
    off = math.remainder(math.atan2(side[1], side[0]) - math.radians(30) - YAW, math.pi / 2)
    assert abs(off) < math.radians(3)


def test_columns_neither_split_nor_pierce_the_space_nor_become_walls(hall: Modelled) -> None:
    (space,) = hall.structure.storeys[0].spaces
    (true,) = true_spaces(scanned(HALL, SPEC)).values()
    assert overlap(space.polygon, true) > 0.98
    assert not space.holes
    assert len(hall.walls) == 4


def test_the_model_says_what_was_seen_of_a_column(hall: Modelled) -> None:
    for column in hall.building.storeys[0].columns:
        assert column.height.source == "measured"
        assert column.evidence.coverage is not None
        assert column.evidence.coverage > 0.5
        assert column.evidence.scans


def test_a_pier_between_two_doors_is_wall() -> None:
    doors = tuple(DoorSpec(f"door {i}", x, 1.2, 2.05, leaf=False, casing=0.0) for i, x in enumerate((1.0, 2.55, 4.1)))
    wall = WallSpec("middle", (0.0, 4.0), (7.0, 4.0), 0.2, doors=doors)
    points = [(0.0, 0.0), (7.0, 0.0), (7.0, 8.0), (0.0, 8.0)]
    model = modelled(room_of("piers", points, [], [(3.1, 2.0), (3.1, 6.0)], wall), SPEC)
    assert not model.structure.storeys[0].columns
    assert len(model.walls) == 5


def test_a_hall_closes_where_the_wall_steps_back_unseen() -> None:
    points = [(0.0, 0.0), (14.0, 0.0), (14.0, 4.0), (5.0, 4.0), (5.0, 5.0), (0.0, 5.0)]
    scene = room_of("step", points, [], [(6.0, 1.6), (11.0, 1.7)])
    fine = ScannerSpec(step=math.radians(0.35))
    model = modelled(scene, fine)
    (true,) = true_spaces(scanned(scene, fine)).values()
    assert len(model.spaces) == 1
    assert overlap(model.spaces[0], true) > 0.95


def test_sections_are_fitted_to_half_of_their_outline() -> None:
    turn = np.linspace(0.3, 0.3 + math.pi, 20)
    circle = fit_circle(np.stack([1 + 0.2 * np.cos(turn), 2 + 0.2 * np.sin(turn)], 1), np.ones(20))
    assert circle.centre == pytest.approx([1, 2], abs=1e-6)
    assert circle.size[0] == pytest.approx(0.4)
    along = np.linspace(0, 1, 9)[:, None]
    corner = np.concatenate([along * [0.3, 0.0], along * [0.0, 0.5]])
    rectangle = fit_rectangle(corner, np.ones(18), 0.02)
    assert rectangle.centre == pytest.approx([0.15, 0.25], abs=0.02)
    assert rectangle.sides == 2


def test_the_newel_of_a_spiral_stair_is_no_wall_but_a_longer_one_in_it_is() -> None:
    up = np.array([0.0, 1.0])
    newel, between, beside = (
        Face(np.array(at), up, 0.0, length, np.zeros(0, np.int64), 0.003, length, True)
        for at, length in (((1.0, 1.0), 0.5), ((0.2, 1.0), 1.6), ((2.3, 1.0), 0.5))
    )
    assert without_posts([newel, between, beside], [box(0, 0, 2, 2)]) == [between, beside]
    assert without_posts([newel], []) == [newel]
