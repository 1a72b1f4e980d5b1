from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely import box

from scan2bim.cloud.panorama import Panorama
from scan2bim.structure.axes import Axis
from scan2bim.structure.crossings import Crossings, agreed, seen_through
from scan2bim.structure.thicknesses import OUTER, SoleFace, StoreyFaces, one_faced

F64 = NDArray[np.float64]
EDGE = 256
OUTSIDE = 6.0


def directions() -> F64:
    """Unit vectors (6, EDGE, EDGE, 3) of a panorama's cells."""
    c = (2 * np.arange(EDGE) + 1) / EDGE - 1
    u, v = np.meshgrid(c, c, indexing="ij")
    one = np.ones_like(u)
    sides = [(one, u, v), (-one, u, v), (u, one, v), (u, -one, v), (u, v, one), (u, v, -one)]
    d = np.stack([np.stack(side, -1) for side in sides])
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def seen_from(place: tuple[float, float, float], thickness: float, frame: float = 0.0) -> Panorama:
    """Panorama of a room before the wall y = 0 with a window, 2 to 3.2 m along and 0.9 to 2.2 m up, in which a frame
    ``frame`` metres wide stands 10 cm behind the face; outside is a wall.
    """
    d = directions()
    x, y, z = (d[..., k] for k in range(3))
    with np.errstate(divide="ignore", invalid="ignore"):

        def at(depth: float) -> tuple[F64, F64, F64]:
            way = np.where(y > 0, (depth - place[1]) / y, np.inf)
            return way, place[0] + way * x, place[2] + way * z

        def inside(depth: float, margin: float = 0.0) -> NDArray[np.bool_]:
            _, a, b = at(depth)
            return (a > 2 + margin) & (a < 3.2 - margin) & (b > 0.9 + margin) & (b < 2.2 - margin)

        sides = [(2 - place[0]) / x, (3.2 - place[0]) / x, (0.9 - place[2]) / z, (2.2 - place[2]) / z]
        reveal = np.min([np.where(side > at(0.0)[0], side, np.inf) for side in sides], 0)
        far = np.where(inside(thickness), at(OUTSIDE)[0], reveal)
        far = np.where(inside(0.1, frame) | ~inside(0.1), far, at(0.1)[0])
        ranges = np.where(y > 0, np.where(inside(0.0), far, at(0.0)[0]), 5.0)
    return Panorama(np.array(place), np.where(np.isfinite(ranges), ranges, 0.0).astype(np.float32))


def rays(thickness: float, frame: float = 0.0) -> tuple[Crossings, ...]:
    wall = Axis(np.array([0.0, 0.15]), np.array([6.0, 0.15]), 0.3, False, frozenset(), frozenset({0}))
    places = ((2.0, -1.5, 1.5), (4.0, -1.8, 1.6), (1.0, -3.0, 1.5))
    return seen_through(wall, 0.0, 2.6, [seen_from(place, thickness, frame) for place in places]).jambs


@pytest.mark.parametrize("thickness", [0.15, 0.2, 0.36, 0.49])
def test_rays_through_a_window_tell_the_thickness_of_its_wall(thickness: float) -> None:
    jambs = rays(thickness)
    low, likely, high = agreed(jambs)
    assert len(jambs) == 2
    assert low - 0.005 < thickness < high + 0.005 < low + 0.04
    assert likely == pytest.approx(thickness, abs=0.015)


def test_a_frame_that_hides_the_reveal_leaves_bounds() -> None:
    low, _, high = agreed(rays(0.2, frame=0.08))
    assert low - 0.005 < 0.2 < high + 0.005


def test_a_wall_without_openings_tells_nothing() -> None:
    wall = Axis(np.array([0.0, 0.15]), np.array([1.8, 0.15]), 0.3, False, frozenset(), frozenset({0}))
    assert not seen_through(wall, 0.0, 2.6, [seen_from((1.0, -2.0, 1.5), 0.2)]).jambs
    assert agreed([]) == (0.0, np.inf, np.inf)


def told(low: float, high: float) -> Crossings:
    """A jamb on which rays end up to one depth and which they pass from another on."""
    depths = (np.arange(160) + 0.5) * 0.005
    return Crossings(np.where(depths < low, 50.0, 0.0), np.where(depths > high, 50.0, 0.0))


def test_what_most_jambs_allow_is_agreed() -> None:
    low, likely, high = agreed([told(0.28, 0.34), told(0.26, 0.31), told(0.10, 0.40), told(0.05, 0.08)])
    assert 0.25 < low < likely < high < 0.335
    assert agreed([told(0.05, 0.08), told(0.28, 0.34)]) == (0.0, np.inf, np.inf)


def test_frames_that_hide_reveals_do_not_make_a_wall_thin() -> None:
    framed, bare = [told(0.08, 0.11), told(0.09, 0.12), told(0.085, 0.115)], [told(0.185, 0.21), told(0.19, 0.22)]
    low, likely, high = agreed([*framed, *bare])
    assert 0.18 < low < likely < high < 0.225
    assert agreed([*framed, told(0.5, 0.54)])[2] < 0.13


HALL = box(0, 0, 6, 4)
FIRST, SECOND = np.array([[0.0, 0.0], [6.0, 0.0]]), np.array([[6.0, 0.0], [6.0, 4.0]])


def test_the_usual_thickness_counts_where_rays_allow_it() -> None:
    faces = [SoleFace(FIRST, (told(0.275, 0.32),)), SoleFace(SECOND, (told(0.24, 0.31),))]
    (walls,) = one_faced([StoreyFaces([HALL], [], faces)], OUTER)
    assert walls.outer == OUTER
    thickness, sigma = walls.behind(FIRST)
    assert thickness == OUTER and sigma == pytest.approx(0.01, abs=0.005)


def test_walls_that_tell_nothing_are_as_thick_as_the_others() -> None:
    faces = [SoleFace(FIRST, rays(0.36)), SoleFace(SECOND, ())]
    (walls,) = one_faced([StoreyFaces([HALL], [], faces)], OUTER)
    usual, sigma = walls.behind(np.array([[1.0, 0.0], [2.0, 0.0]]))
    assert usual == pytest.approx(0.36, abs=0.015) and sigma is not None
    assert walls.behind(np.array([[6.0, 1.0], [6.0, 2.0]])) == (usual, None)
    (blind,) = one_faced([StoreyFaces([HALL], [], faces[1:])], OUTER)
    assert blind.behind(SECOND) == (OUTER, None)


def test_a_wall_that_is_built_otherwise_keeps_its_own_thickness() -> None:
    faces = [SoleFace(FIRST, rays(0.36)), SoleFace(SECOND, rays(0.2))]
    (walls,) = one_faced([StoreyFaces([HALL], [], faces)], OUTER)
    assert walls.behind(FIRST)[0] == pytest.approx(0.36, abs=0.015)
    assert walls.behind(SECOND)[0] == pytest.approx(0.2, abs=0.015)


def test_a_wall_to_a_room_that_nobody_entered_is_as_thick_as_the_partitions() -> None:
    partition = Axis(np.array([6.06, 0.0]), np.array([6.06, 4.0]), 0.12, True, frozenset({0}), frozenset({1}))
    spaces = [HALL, box(6.12, 0, 9, 4), box(0, 8, 9, 12), box(-4, 0, -0.12, 12)]
    (walls,) = one_faced([StoreyFaces(spaces, [partition], [])], OUTER)
    to_unknown, out = np.array([[6.0, 4.0], [0.0, 4.0]]), np.array([[0.0, 0.0], [6.0, 0.0]])
    assert walls.behind(to_unknown) == (0.12, None)
    assert walls.behind(out) == (OUTER, None)


def test_thicknesses_that_few_jambs_bound_loosely_are_the_likely_one() -> None:
    faces = [SoleFace(FIRST, (told(0.36, 0.52), told(0.30, 0.50)))]
    (walls,) = one_faced([StoreyFaces([HALL], [], faces)], 0.4)
    assert walls.outer != 0.4
    assert walls.outer == pytest.approx(0.43, abs=0.02)
    assert walls.behind(FIRST)[1] is None


def test_a_storey_is_built_as_its_building_unless_its_jambs_exclude_that_by_far() -> None:
    lower = StoreyFaces([HALL], [], [SoleFace(FIRST, (told(0.395, 0.425), told(0.39, 0.43)))])
    nearly, otherwise = ([SoleFace(FIRST, (told(low, 0.8), told(low, 0.8)))] for low in (0.43, 0.55))
    same = [walls.outer for walls in one_faced([lower, StoreyFaces([HALL], [], nearly)], 0.3)]
    assert same[0] == same[1]
    other = [walls.outer for walls in one_faced([lower, lower, StoreyFaces([HALL], [], otherwise)], 0.3)]
    assert other[0] == other[1] < other[2]


def test_one_sided_rays_tell_another_thickness_by_more_than_a_frame_alone() -> None:
    usual = (told(0.395, 0.425), told(0.39, 0.43), told(0.395, 0.43))
    for low, same in ((0.45, True), (0.50, False)):
        faces = [SoleFace(FIRST, usual), SoleFace(SECOND, (told(low, 0.8),))]
        (walls,) = one_faced([StoreyFaces([HALL], [], faces)], OUTER)
        assert (walls.behind(SECOND)[0] == walls.behind(FIRST)[0]) == same


def test_a_court_that_windows_look_into_is_no_part_of_the_storey() -> None:
    wings = [HALL, box(0, 4.3, 2, 9), box(4, 4.3, 6, 9), box(0, 9.3, 6, 12)]
    into_court = np.array([[2.0, 4.3], [2.0, 9.0]])
    partition = Axis(np.array([3.0, 0.0]), np.array([3.0, 4.0]), 0.12, True, frozenset({0}), frozenset({1}))
    (blind,) = one_faced([StoreyFaces(wings, [partition], [SoleFace(into_court, ())])], OUTER)
    assert blind.behind(into_court) == (0.12, None)
    other, south = np.array([[4.0, 9.0], [4.0, 4.3]]), np.array([[4.0, 4.0], [2.0, 4.0]])
    windowed = [SoleFace(into_court, (), sill=True), SoleFace(other, (), sill=True)]
    (seen,) = one_faced([StoreyFaces(wings, [partition], windowed)], OUTER)
    assert seen.behind(into_court) == (OUTER, None)
    assert seen.behind(south) == (OUTER, None)
    (room,) = one_faced([StoreyFaces(wings, [partition], [windowed[0], SoleFace(other, ())])], OUTER)
    assert room.behind(other) == (0.12, None)


def test_a_wall_is_thinner_than_the_others_only_if_several_jambs_say_so_and_none_says_otherwise() -> None:
    framed, bare = told(0.09, 0.12), told(0.19, 0.22)
    usual = (told(0.19, 0.215), told(0.185, 0.21), told(0.19, 0.22))
    for jambs, thin in (((framed,), False), ((framed, framed, framed, bare), False), ((framed, framed), True)):
        (walls,) = one_faced([StoreyFaces([HALL], [], [SoleFace(FIRST, usual), SoleFace(SECOND, jambs)])], OUTER)
        assert (walls.behind(SECOND)[0] < 0.13) == thin


def test_a_storey_of_which_most_jambs_tell_the_thickness_of_the_building_has_it() -> None:
    """Two jambs that are misled alike by what stands before them do not make a storey thicker."""
    lower = [SoleFace(FIRST, (told(0.41, 0.43), told(0.415, 0.435), told(0.41, 0.44)) * 2)]
    upper = [
        SoleFace(FIRST, (told(0.48, 0.5), told(0.485, 0.51), told(0.41, 0.435), told(0.4, 0.43), told(0.41, 0.44)))
    ]
    walls = one_faced([StoreyFaces([HALL], [], lower), StoreyFaces([HALL], [], upper)], OUTER)
    assert walls[1].outer == walls[0].outer == pytest.approx(0.425, abs=0.01)
