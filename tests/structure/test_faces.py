from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, plan, room, surfels_of, turned, upright

from scan2bim.structure.faces import Face, find_faces, main_direction
from scan2bim.structure.plan import Plan, plan_of
from scan2bim.structure.storeys import find_storeys, layers_of

F64 = NDArray[np.float64]
YAWS = [0.0, 0.3, np.pi / 4, 1.2]
Line = tuple[tuple[float, float], tuple[float, float]]


def two_rooms(thickness: float, yaw: float) -> tuple[Plan, dict[str, tuple[F64, F64, F64]]]:
    """Two rooms of 4 x 3 m with a partition between them; faces of the partition: ends (2,), and normal to the air."""
    x = 4.0 + thickness
    found = plan([room(0, 0, 4, 3), room(x, 0, x + 4, 3)], [(2, 1.5), (x + 2, 1.5)], yaw)
    ends = {"west": ((4.0, 0.0), (4.0, 3.0), (-1.0, 0.0)), "east": ((x, 0.0), (x, 3.0), (1.0, 0.0))}
    return found, {name: tuple(turned(np.array([[*p, 0.0] for p in line]), yaw)[:, :2]) for name, line in ends.items()}


def distance(face: Face, a: F64, b: F64) -> float:
    """Largest distance, metres, of the ends of a line from the face's line."""
    return float(np.abs((np.array([a, b]) - face.centre) @ face.normal).max())


def on_line(faces: tuple[Face, ...], a: F64, b: F64, within: float) -> list[Face]:
    return [f for f in faces if distance(f, a, b) < within]


@pytest.mark.parametrize("yaw", YAWS)
def test_every_wall_of_a_room_gives_one_straight_face_to_two_millimetres(yaw: float) -> None:
    faces = find_faces(plan([room(0, 0, 5, 3)], [(2, 1)], yaw))
    corners = turned(np.array([[0, 0, 0], [5, 0, 0], [5, 3, 0], [0, 3, 0]]), yaw)[:, :2]
    assert len(faces) == 4
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        (face,) = on_line(faces, a, b, 0.002)
        assert face.length == pytest.approx(float(np.linalg.norm(b - a)), abs=0.12)
        assert face.rms < 0.005


@pytest.mark.parametrize("yaw", YAWS)
def test_the_normal_of_a_face_points_to_the_air(yaw: float) -> None:
    middle = turned(np.array([[2.5, 1.5, 0.0]]), yaw)[0, :2]
    for face in find_faces(plan([room(0, 0, 5, 3)], [(2, 1)], yaw)):
        assert (middle - face.centre) @ face.normal > 1.0
        assert face.sided


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize("thickness", [0.06, 0.08, 0.10, 0.12])
def test_a_thin_partition_gives_both_of_its_faces(thickness: float, yaw: float) -> None:
    found, sides = two_rooms(thickness, yaw)
    faces = find_faces(found)
    for name, (a, b, normal) in sides.items():
        mine = [f for f in on_line(faces, a, b, 0.003) if f.normal @ normal > 0.99]
        assert len(mine) == 1, name


@pytest.mark.parametrize("yaw", YAWS)
def test_a_wall_goes_on_as_one_face_across_a_door(yaw: float) -> None:
    walls = [upright((2.0, 0.0), (2.0, 1.0), 0.0, 2.5), upright((2.0, 1.9), (2.0, 4.0), 0.0, 2.5)]
    lintel = upright((2.0, 1.0), (2.0, 1.9), 2.05, 2.5)
    other = upright((2.1, 0.0), (2.1, 4.0), 0.0, 2.5)
    parts = [*room(0, 0, 2, 4)[:2], *room(0, 0, 2, 4)[2:3], *room(0, 0, 2, 4)[4:], *walls, lintel]
    faces = find_faces(plan([parts, [other]], [(1, 2), (4, 2)], yaw))
    a, b = turned(np.array([[2.0, 0.0, 0.0], [2.0, 4.0, 0.0]]), yaw)[:, :2]
    (face,) = on_line(faces, a, b, 0.003)
    assert face.length == pytest.approx(4.0, abs=0.12)


@pytest.mark.parametrize("top", [0.75, 1.4, 2.0])
@pytest.mark.parametrize("yaw", YAWS[:2])
def test_furniture_that_stays_below_the_ceiling_gives_no_face(top: float, yaw: float) -> None:
    corners: list[tuple[float, float]] = [(2.0, 1.0), (3.6, 1.0), (3.6, 1.6), (2.0, 1.6)]
    sides = [upright(corners[i], corners[(i + 1) % 4], 0.0, top) for i in range(4)]
    parts = [*room(0, 0, 5, 4), level(2.0, 1.0, 3.6, 1.6, top), *sides]
    assert len(find_faces(plan([parts], [(1, 3)], yaw))) == 4


def test_the_main_direction_is_that_of_the_walls() -> None:
    for yaw in YAWS[1:]:
        found = main_direction(find_faces(plan([room(0, 0, 5, 3)], [(2, 1)], yaw)))
        assert math.remainder(found - yaw, math.pi / 2) == pytest.approx(0.0, abs=0.002)


def test_without_faces_there_is_a_main_direction_all_the_same() -> None:
    assert main_direction([]) == 0.0


@pytest.mark.parametrize("yaw", YAWS[:2])
def test_faces_have_a_front_also_where_no_station_is_known(yaw: float) -> None:
    surfels = surfels_of(turned(np.concatenate(room(0, 0, 5, 3)), yaw))
    layers = layers_of(surfels)
    nowhere = np.full((1, 3), np.nan)
    faces = find_faces(plan_of(find_storeys(surfels, layers, nowhere)[0], surfels, layers, nowhere))
    middle = turned(np.array([[2.5, 1.5, 0.0]]), yaw)[0, :2]
    assert len(faces) == 4
    for face in faces:
        assert (middle - face.centre) @ face.normal > 1.0


@pytest.mark.parametrize("recess", [0.025, 0.03, 0.04])
def test_a_door_leaf_behind_the_wall_does_not_turn_the_wall(recess: float) -> None:
    floor, ceiling, *walls = room(0, 0, 5, 3)
    wall = [upright((0, 3), (1, 3), 0, 2.5), upright((1, 3), (2.6, 3), 2.1, 2.5), upright((2.6, 3), (5, 3), 0, 2.5)]
    leaf = upright((1, 3 + recess), (2.6, 3 + recess), 0, 2.1)
    faces = find_faces(plan([[floor, ceiling, *walls[:2], walls[3], *wall, leaf]], [(2, 1)], 0.3))
    a, b = turned(np.array([[0, 3, 0], [5, 3, 0]]), 0.3)[:, :2]
    near = [f for f in faces if distance(f, a, b) < 0.1]
    assert all(abs(float((b - a) @ f.normal)) < 0.005 for f in near)
    assert max(f.length for f in near) == pytest.approx(5.0, abs=0.12)


def beside_a_nook(soffit: float) -> list[F64]:
    """A room of 6 x 3 m whose far wall stands back by 40 cm over 2 m, where a board 1.9 m tall stands in line."""
    floor, ceiling, *walls = room(0, 0, 6, 3)
    beside = [upright((0, 3), (2, 3), 0, 2.5), upright((4, 3), (6, 3), 0, 2.5), upright((2, 3), (4, 3), 0, 1.9)]
    nook = [upright((2, 3.4), (4, 3.4), 1.0, soffit), level(2, 3, 4, 3.4, soffit), level(2, 3, 4, 3.4, 0)]
    return [floor, ceiling, *walls[:2], walls[3], *beside, *nook]


@pytest.mark.parametrize("yaw", YAWS)
def test_what_stands_before_a_nook_in_line_with_the_wall_is_not_the_wall(yaw: float) -> None:
    faces = find_faces(plan([beside_a_nook(2.5)], [(3, 1)], yaw))
    (a, b), (c, d) = (turned(np.array([[2, y, 0], [4, y, 0]]), yaw)[:, :2] for y in (3.4, 3.0))
    assert len(on_line(faces, a, b, 0.005)) == 1
    before = on_line(faces, c, d, 0.005)
    middle = (c + d) / 2
    assert len(before) == 2
    assert all(not f.low < (middle - f.centre) @ f.direction < f.high for f in before)


@pytest.mark.parametrize("yaw", YAWS)
def test_a_wall_below_a_window_is_the_wall_and_what_stands_back_above_it_is_not(yaw: float) -> None:
    faces = find_faces(plan([beside_a_nook(2.3)], [(3, 1)], yaw))
    (a, b), (c, d) = (turned(np.array([[2, y, 0], [4, y, 0]]), yaw)[:, :2] for y in (3.4, 3.0))
    assert not on_line(faces, a, b, 0.005)
    assert len(on_line(faces, c, d, 0.005)) == 1


def window_row() -> list[F64]:
    """A room 14 m long with a row of windows, 13 cm back in its wall, over a parapet and under a lintel of 30 cm."""
    parts = [level(0, 0, 14, 3, 0), level(0, 0, 14, 3, 2.5), upright((0, 0), (14, 0), 0, 2.5)]
    parts += [upright((0, 3), (0, 0), 0, 2.5), upright((14, 0), (14, 3), 0, 2.5)]
    parts += [upright((0, 3), (14, 3), 0, 0.9), upright((0, 3), (14, 3), 2.2, 2.5)]
    for x in range(0, 14, 2):
        parts += [upright((x + 0.3, 3.13), (x + 2, 3.13), 0.9, 2.2), level(x + 0.3, 3, x + 2, 3.13, 2.2)]
        parts.append(upright((x, 3), (x + 0.3, 3), 0.9, 2.2))
    return parts


@pytest.mark.parametrize("yaw", YAWS)
def test_the_lintel_over_windows_is_part_of_the_wall_and_their_panes_are_not(yaw: float) -> None:
    faces = find_faces(plan([window_row()], [(7, 1)], yaw))
    (a, b), (c, d) = (turned(np.array([[0.5, y, 0], [13.5, y, 0]]), yaw)[:, :2] for y in (3.13, 3.0))
    assert not on_line(faces, a, b, 0.005)
    assert sum(f.tall for f in on_line(faces, c, d, 0.005)) > 7.0


def over_sills(hidden: int = 0) -> list[F64]:
    """A room 9 m long with windows up to the ceiling, 15 cm back in its wall over a parapet that shelves hide: of the
    piers between them less is seen than of the panes and frames. The shelves also hide the foot of some piers.
    """
    parts = [level(0, 0, 9, 3, 0), level(0, 0, 9, 3, 2.5), upright((0, 0), (9, 0), 0, 2.5)]
    parts += [upright((0, 3), (0, 0), 0, 2.5), upright((9, 0), (9, 3), 0, 2.5)]
    for x in range(0, 9, 3):
        parts += [upright((x + 0.5, 3.15), (x + 3, 3.15), 1.0, 2.42), level(x + 0.5, 3, x + 3, 3.15, 2.42)]
        foot = 1.0 if x < 3 * hidden else 0.0
        parts += [upright((x, 3), (x + 0.5, 3), foot, 2.5), upright((x + 0.5, 2.7), (x + 3, 2.7), 0, 0.9)]
    return parts


@pytest.mark.parametrize(("yaw", "hidden"), [*((yaw, 0) for yaw in YAWS), (0.0, 2)])
def test_what_shows_over_sills_alone_is_no_wall_however_long_it_is(yaw: float, hidden: int) -> None:
    faces = find_faces(plan([over_sills(hidden)], [(4.5, 1)], yaw))
    (a, b), (c, d) = (turned(np.array([[0.5, y, 0], [8.5, y, 0]]), yaw)[:, :2] for y in (3.15, 3.0))
    assert not on_line(faces, a, b, 0.005)
    assert on_line(faces, c, d, 0.005)


def beside_two_nooks() -> list[F64]:
    """A room of 6 x 3 m with two nooks of 1 m in its far wall, 40 cm deep, behind boards 1.9 m tall; of the 2 m between
    them nothing was seen.
    """
    floor, ceiling, *walls = room(0, 0, 6, 3)
    parts = [floor, ceiling, *walls[:2], walls[3], upright((0, 3), (1, 3), 0, 2.5), upright((5, 3), (6, 3), 0, 2.5)]
    for x in (1, 4):
        parts += [upright((x, 3), (x + 1, 3), 0, 1.9), upright((x, 3.4), (x + 1, 3.4), 1.0, 2.5)]
        parts += [level(x, 3, x + 1, 3.4, 2.5), level(x, 3, x + 1, 3.4, 0)]
    return parts


@pytest.mark.parametrize("yaw", YAWS)
def test_backs_of_nooks_in_one_line_are_wall_though_nothing_was_seen_between_them(yaw: float) -> None:
    faces = find_faces(plan([beside_two_nooks()], [(3, 1)], yaw))
    a, b = turned(np.array([[1, 3.4, 0], [5, 3.4, 0]]), yaw)[:, :2]
    assert on_line(faces, a, b, 0.005)
