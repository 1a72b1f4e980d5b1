"""Curved walls: faces on circles, spaces that follow them, walls between them and their joins, openings in them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from scan2bim.geometry.arcs import Arc
from scan2bim.structure.arcs import Bend, bent_to, find_bends
from scan2bim.structure.columns import Columns, Grid
from scan2bim.structure.faces import find_faces
from scan2bim.structure.fits import Face
from scan2bim.structure.plan import Plan
from scan2bim.structure.shapes import WallShape
from scan2bim.structure.storeys import StoreyLevels
from scan2bim.structure.walls import find_walls

F64 = NDArray[np.float64]
CLEAR = 2.6


def plan_with(xy: F64, towards: F64, noise: float = 0.003) -> Plan:
    """The plan of a storey of which only upright columns at places (n, 2) were seen, looking (n, 2) from there."""
    rng = np.random.default_rng(3)
    xy = xy + rng.normal(0, noise, xy.shape)
    grid = Grid(np.zeros(2), np.full((260, 260), CLEAR), 0.0)
    pixel = grid.pixel_of(xy)
    _, first = np.unique(pixel, axis=0, return_index=True)
    n = len(first)
    ones = np.ones(n, np.int64)
    columns = Columns(
        pixel[first], xy[first], 25 * ones, 4 * ones, 9 * ones, np.zeros(n), towards[first], 99 * ones,
        ones.astype(np.uint16), np.full((n, 3), 200.0),
    )  # fmt: skip
    flat, mask = np.full((260, 260), CLEAR, np.float32), np.ones((260, 260), np.uint8)
    where = np.zeros((260, 260, 2), np.float32)
    levels = StoreyLevels(0.0, 0.001, CLEAR, CLEAR, 60.0)
    return Plan(levels, grid, mask, mask, flat, where, flat, mask * 0, mask * 0, columns, mask * 0, flat)


def round_face(radius: float, first: float, last: float, inside: bool, centre: tuple[float, float] = (6.0, 6.0)):
    angle = np.arange(first, last, 0.02 / radius)
    ray = np.stack([np.cos(angle), np.sin(angle)], 1)
    return np.array(centre) + radius * ray, -ray if inside else ray


@pytest.mark.parametrize(("radius", "inside"), [(1.2, True), (3.0, True), (3.0, False), (5.5, True)])
def test_a_round_face_is_found_with_its_circle_and_its_air(radius: float, inside: bool) -> None:
    places, views = round_face(radius, 0.3, 0.3 + min(2.0, 6.0 / radius), inside)
    plan = plan_with(places, views)
    (bend,) = find_bends(plan, find_faces(plan))
    assert bend.radius == pytest.approx(radius, rel=0.01)
    assert bend.centre == pytest.approx(np.array([6.0, 6.0]), abs=0.01 * radius + 0.01)
    assert bend.inside == inside
    assert bend.length == pytest.approx(min(2.0 * radius, 6.0) + 0.5, abs=0.15)


def test_a_round_face_goes_on_across_a_door() -> None:
    one, view_one = round_face(3.0, 0.2, 0.9, True)
    two, view_two = round_face(3.0, 1.2, 1.9, True)
    plan = plan_with(np.vstack([one, two]), np.vstack([view_one, view_two]))
    (bend,) = find_bends(plan, find_faces(plan))
    assert bend.sweep == pytest.approx(1.7 + 0.5 / 3.0, abs=0.05)


@pytest.mark.parametrize(("half", "number"), [(2.5, 0), (1.3, 1)])
def test_what_bulges_from_a_straight_wall_that_goes_on_beside_it_is_not_round(half: float, number: int) -> None:
    places, views = round_face(3.0, math.pi / 2 - 0.35, math.pi / 2 + 0.35, False)
    plan = plan_with(places, views)
    line = np.array([6.0, places[:, 1].min() - 0.02])
    wall = Face(line, np.array([0.0, 1.0]), -half, half, np.arange(9), 0.003, half, True)
    pieces = find_faces(plan)
    assert len(find_bends(plan, pieces)) == 1
    assert len(find_bends(plan, [*pieces, wall])) == number


def test_the_faces_of_a_polygon_and_the_corners_of_a_room_are_not_round() -> None:
    corners = 6.0 + 3.0 * np.array([[math.cos(a), math.sin(a)] for a in np.arange(8) * math.pi / 4])
    t = np.arange(0.02, 0.98, 0.01)[:, None]
    places = np.vstack([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])
    plan = plan_with(places, (6.0 - places) / np.linalg.norm(6.0 - places, axis=1, keepdims=True))
    assert find_bends(plan, find_faces(plan)) == []


T = np.arange(0.0, 2 * np.pi, np.pi / 12)
RIGHT = Bend(np.array([0.0, 0.0]), 3.0, -1.2, 2.4, True, 0.003)
BACK = Bend(np.array([0.0, 0.0]), 3.12, -1.2, 2.4, False, 0.003)


def halves() -> tuple[Polygon, Polygon]:
    """Two rooms with a wall of 12 cm between them, curved, as straight chords give them."""
    inner, outer = (Polygon(r * np.stack([np.cos(T), np.sin(T)], 1)) for r in (3.02, 3.14))
    whole = box(-1.0, -2.8, 6.0, 2.8)
    left, right = whole.intersection(inner), whole.difference(outer)
    (apse,) = [p for p in shapely.get_parts(left) if isinstance(p, Polygon)]
    hall = max(shapely.get_parts(right), key=lambda p: p.area)
    assert isinstance(hall, Polygon)
    return apse, hall


def test_a_space_follows_the_round_face_that_it_lies_along() -> None:
    left, _ = halves()
    bent = bent_to(left, [RIGHT])
    around = shapely.Point(0, 0).buffer(3.0, quad_segs=200)
    expected = box(-1.0, -2.8, 6.0, 2.8).intersection(around)
    assert bent.symmetric_difference(expected).area < 0.02
    assert bent_to(box(10, 10, 14, 14), [RIGHT]).equals(box(10, 10, 14, 14))


def _one(*parts: Polygon) -> Polygon:
    whole = shapely.union_all(parts)
    assert isinstance(whole, Polygon)
    return whole


def test_a_bay_at_a_window_is_cut_off_and_the_room_behind_is_not() -> None:
    left, right = halves()
    bay = _one(left, box(2.8, -0.6, 3.3, 0.6))
    assert bent_to(bay, [RIGHT]).symmetric_difference(bent_to(left, [RIGHT])).area < 0.02
    through = _one(left, box(2.8, -0.6, 3.3, 0.6), right)
    assert bent_to(through, [RIGHT]).area > through.area - 0.4


def test_the_wall_between_two_round_faces_is_an_arc_of_measured_thickness() -> None:
    rooms = [bent_to(room, [RIGHT, BACK]) for room in halves()]
    axes, joins = find_walls(rooms, bends=[RIGHT, BACK])
    (curved,) = [a for a in axes if a.bulge]
    assert curved.measured
    assert curved.thickness == pytest.approx(0.12, abs=0.002)
    assert 1 / abs(curved.arc.curvature) == pytest.approx(3.06, abs=0.01)
    assert (set(curved.left), set(curved.right)) == ({0}, {1})
    number = next(k for k, a in enumerate(axes) if a.bulge)
    assert sorted(j.at for j in joins if j.one == number) == ["end", "start"]
    assert all(j.other_at == "path" for j in joins if j.one == number)


def test_places_on_a_curved_wall_are_measured_along_its_arc() -> None:
    wall = WallShape(
        (8.0, 0.0), (8.0, 6.0), 0.3, None, 0.0, 2.7, True, (0,), (), 0.001, 100, 1.0, 1, (0,), (200, 200, 200),
        bulge=0.5774,
    )  # fmt: skip
    along, left = np.array([0.5, 3.0, 6.5]), 0.15
    found, across = wall.locate(wall.place(along, left))
    assert found == pytest.approx(along)
    assert across == pytest.approx([left] * 3)
    assert wall.length == pytest.approx(Arc(6.0, 0.5774).length)
    flat = wall.straight_at(3.0)
    assert flat.place(np.array([3.0]))[0] == pytest.approx(wall.place(np.array([3.0]))[0])
    assert np.linalg.norm(flat.place(np.array([3.2])) - wall.place(np.array([3.2]))) < 0.007
