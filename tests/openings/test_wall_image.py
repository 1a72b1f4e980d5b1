from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, turned, upright

from scan2bim.cloud.panorama import Panorama, add_hits
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.wall_image import PIXEL, WallImage, wall_image
from scan2bim.structure.shapes import WallShape

F64 = NDArray[np.float64]
LENGTH, HEIGHT, THICKNESS = 4.0, 2.5, 0.1
EYE = (2.0, 2.0, 1.5)
ABSENT = np.full((3, 3), np.nan)
"""Positions of stations 0 to 2, which are not known."""
LEFT, RIGHT, HEAD = 1.5, 2.5, 2.0
"""The doorway in the wall, metres along it and up."""
DENSE = 4
"""Times as many points along each axis on what a scanner stands near to."""


def wall(yaw: float) -> WallShape:
    """A wall along x from the origin, turned; the air with the station is on its left."""
    start, end = (tuple(p) for p in turned(np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]]), yaw)[:, :2].tolist())
    grey = (200, 200, 200)
    return WallShape(
        start, end, THICKNESS, 0.002, 0.0, HEIGHT, True, (0,), (1,), 0.002, 1000, 1.0, 2, (0,), grey
    )  # fmt: skip


def scene(blocked: bool = False, behind: bool = True) -> F64:
    """The wall's near face with a doorway, floor and wall behind it; ``blocked``: a cupboard before all of it."""
    face = upright((0.0, THICKNESS / 2), (LENGTH, THICKNESS / 2), 0.0, HEIGHT)
    hole = (face[:, 0] > LEFT) & (face[:, 0] < RIGHT) & (face[:, 2] < HEAD)
    parts = [face[~hole]]
    if behind:
        parts += [upright((-2.0, -2.0), (6.0, -2.0), 0.0, HEIGHT), level(-2.0, -2.0, 6.0, -0.2, 0.0)]
    if blocked:
        parts.append(upright((0.0, 0.8), (LENGTH, 0.8), 0.0, HEIGHT))
    return np.concatenate(parts)


def image(points: F64, yaw: float = 0.0, eye: tuple[float, float, float] = EYE) -> WallImage:
    points = turned(points, yaw)
    position = turned(np.array([eye]), yaw)[0]
    ranges = np.zeros((6, 48, 48), np.float32)
    add_hits(points.astype(np.float32), position.astype(np.float32), ranges)
    return wall_image(
        wall(yaw), near(wall(yaw), points), {3: Panorama(position, ranges)}, np.vstack([ABSENT, position])
    )


def near(wall: WallShape, points: F64) -> WallPoints:
    """Points in the wall's own coordinates, seen from station 3."""
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / np.linalg.norm(end - start)
    along, up = (points[:, :2] - start) @ direction, points[:, 2] - wall.base
    across = (points[:, :2] - start) @ np.array([-direction[1], direction[0]])
    close = np.abs(across) < wall.thickness / 2 + 0.12
    along, across, up = (a[close].astype(np.float32) for a in (along, across, up))
    count = int(close.sum())
    return WallPoints(along, across, up, np.zeros((count, 3), np.uint8), np.full(count, 3, np.uint16))


def part(mask: NDArray[np.generic], left: float, right: float, low: float, high: float) -> NDArray[np.generic]:
    return mask[round(low / PIXEL) : round(high / PIXEL), round(left / PIXEL) : round(right / PIXEL)]


@pytest.mark.parametrize("yaw", [0.0, 0.5, 2.3])
def test_the_doorway_was_looked_through_and_the_wall_beside_it_has_a_face(yaw: float) -> None:
    found = image(scene(), yaw)
    assert found.face.shape == found.through.shape == (round(HEIGHT / PIXEL), round(LENGTH / PIXEL))
    through = found.through > 0
    assert part(through, LEFT + 0.15, RIGHT - 0.15, 0.3, HEAD - 0.15).mean() > 0.9
    assert not part(through, 0.1, LEFT - 0.15, 0.1, HEIGHT - 0.1).any()
    assert not part(through, LEFT, RIGHT, HEAD + 0.15, HEIGHT - 0.1).any()
    assert part(found.face, 0.1, LEFT - 0.1, 0.1, HEIGHT - 0.1).mean() > 0.3
    assert not part(found.face, LEFT + 0.1, RIGHT - 0.1, 0.1, HEAD - 0.1).any()
    assert not found.faces[1].any()


def test_the_station_that_looked_through_is_named() -> None:
    found = image(scene())
    assert list(found.lookers) == [3]
    assert part(found.lookers[3], LEFT + 0.2, RIGHT - 0.2, 0.4, HEAD - 0.2).mean() > 0.9


def test_behind_a_cupboard_nothing_was_looked_through() -> None:
    assert not image(scene(blocked=True)).through.any()


def test_with_nothing_behind_the_doorway_nothing_is_said_of_it() -> None:
    found = image(scene(behind=False))
    assert not part(found.face, LEFT + 0.1, RIGHT - 0.1, 0.1, HEAD - 0.1).any()
    assert not found.through.any()


def test_a_station_of_another_storey_is_not_asked() -> None:
    assert not image(scene(), eye=(2.0, 2.0, 5.5)).lookers


def test_a_leaf_at_the_far_side_of_a_thick_wall_was_not_looked_through_at_a_slant() -> None:
    thick = dataclasses.replace(wall(0.0), thickness=0.4)
    position = np.array([2.0 + 3.5, 1.2, 1.5])
    leaf = upright((LEFT, -0.17), (RIGHT, -0.17), 0.0, HEAD)
    ranges = np.zeros((6, 48, 48), np.float32)
    add_hits(leaf.astype(np.float32), position.astype(np.float32), ranges)
    stations = np.vstack([ABSENT, position])
    assert not wall_image(thick, near(thick, leaf), {3: Panorama(position, ranges)}, stations).through.any()


def test_points_within_the_wall_lie_behind_its_face_by_their_depth() -> None:
    reveal = upright((LEFT, -0.03), (LEFT, 0.03), 0.0, HEAD)
    found = image(np.concatenate([scene(), reveal]), 0.5)
    behind = ~found.on_face
    assert behind.sum() > 10
    assert np.abs(found.along[behind] - LEFT).max() < 0.02
    assert found.depth[behind].max() == pytest.approx(0.08, abs=0.01)
    assert part(found.behind[0], LEFT - 0.05, LEFT + 0.05, 0.1, HEAD - 0.1).any()


@pytest.mark.parametrize("known", [True, False])
def test_the_far_face_of_a_wall_is_its_own_side_where_the_station_stands_there_or_is_unknown(known: bool) -> None:
    far = upright((0.0, -THICKNESS / 2), (LENGTH, -THICKNESS / 2), 0.0, HEIGHT)
    station = np.array([2.0, -2.0, 1.5]) if known else np.full(3, np.nan)
    found = wall_image(wall(0.0), near(wall(0.0), far), {}, np.vstack([ABSENT, station]))
    assert found.faces[1].any()
    assert not found.faces[0].any()
    assert found.on_face.all()


def test_a_curtain_close_before_the_wall_is_not_its_face() -> None:
    curtain = upright((LEFT, THICKNESS / 2 + 0.05), (RIGHT, THICKNESS / 2 + 0.05), 0.0, HEAD)
    found = image(curtain)
    assert not found.face.any()
    assert not found.behind.any()


def test_where_the_thickness_is_assumed_nothing_is_said_of_the_far_face() -> None:
    far = upright((0.0, -THICKNESS / 2 + 0.05), (LENGTH, -THICKNESS / 2 + 0.05), 0.0, HEIGHT)
    outer = dataclasses.replace(wall(0.0), right=(), thickness_sigma=None)
    stations = np.vstack([ABSENT, np.array([2.0, -2.0, 1.5])])
    found = wall_image(outer, near(outer, far), {}, stations)
    assert not found.faces.any()
    assert not found.behind.any()


def doorway(depth: float) -> F64:
    """Jambs and head of the doorway, ``depth`` metres from the near face on, and rooms on both sides; what ends within
    the wall is closed behind.
    """
    near_face, far = THICKNESS / 2, THICKNESS / 2 - depth
    ends = [((x * DENSE, far * DENSE), (x * DENSE, near_face * DENSE)) for x in (LEFT, RIGHT)]
    sides = [upright(a, b, 0.0, HEAD * DENSE) for a, b in ends]
    head = level(DENSE * LEFT, DENSE * far, DENSE * RIGHT, DENSE * near_face, DENSE * HEAD)
    parts = [part / DENSE for part in (*sides, head)]
    parts += [level(-2.0, near_face, 6.0, 3.0, z) for z in (0.0, HEIGHT)]
    if depth < THICKNESS:
        return np.concatenate([*parts, upright((LEFT, far), (RIGHT, far), 0.0, HEAD)])
    return np.concatenate([*parts, *(level(-2.0, -3.0, 6.0, far, z) for z in (0.0, HEIGHT))])


@pytest.mark.parametrize("yaw", [0.0, 0.5])
def test_a_station_in_a_doorway_sees_past_the_middle_of_the_wall_up_to_the_jambs(yaw: float) -> None:
    through = image(doorway(THICKNESS), yaw, (2.0, 0.01, 1.5)).through > 0
    assert part(through, LEFT + 0.15, RIGHT - 0.15, 0.9, HEAD - 0.15).mean() > 0.8
    assert not part(through, 0.1, LEFT - 0.1, 0.1, HEIGHT - 0.1).any()
    assert not part(through, LEFT, RIGHT, HEAD + 0.1, HEIGHT - 0.1).any()


def test_a_station_in_a_niche_looks_through_nothing() -> None:
    assert not image(doorway(0.08), 0.0, (2.0, 0.01, 1.5)).through.any()


@pytest.mark.parametrize(("beyond", "kept"), [(0.0, True), (-0.05, False)])
def test_an_outer_face_counts_only_where_the_thickness_puts_it(beyond: float, kept: bool) -> None:
    outer = dataclasses.replace(wall(0.0), right=())
    far = THICKNESS / 2 + beyond
    points = np.concatenate([scene(behind=False), upright((0.0, -far), (LENGTH, -far), 0.0, HEIGHT)])
    seen = near(outer, points)
    station = np.where(seen.across < 0, 4, 3).astype(np.uint16)
    stations = np.vstack([ABSENT, EYE, (2.0, -2.0, 1.5)])
    found = wall_image(outer, dataclasses.replace(seen, station=station), {}, stations)
    assert bool(found.faces[1].any() or found.behind[1].any()) == kept
