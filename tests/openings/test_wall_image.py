from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, surfels_of, turned, upright

from scan2bim.cloud.panorama import Panorama, add_hits
from scan2bim.openings.wall_image import PIXEL, WallImage, wall_image
from scan2bim.structure.shapes import WallShape

F64 = NDArray[np.float64]
LENGTH, HEIGHT, THICKNESS = 4.0, 2.5, 0.1
EYE = (2.0, 2.0, 1.5)
LEFT, RIGHT, HEAD = 1.5, 2.5, 2.0
"""The doorway in the wall, metres along it and up."""


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
    return wall_image(wall(yaw), surfels_of(points), {3: Panorama(position, ranges)})


def part(mask: NDArray[np.generic], left: float, right: float, low: float, high: float) -> NDArray[np.generic]:
    return mask[round(low / PIXEL) : round(high / PIXEL), round(left / PIXEL) : round(right / PIXEL)]


@pytest.mark.parametrize("yaw", [0.0, 0.5, 2.3])
def test_the_doorway_was_looked_through_and_the_wall_beside_it_has_data(yaw: float) -> None:
    found = image(scene(), yaw)
    assert found.data.shape == (round(HEIGHT / PIXEL), round(LENGTH / PIXEL))
    assert part(found.opening, LEFT + 0.15, RIGHT - 0.15, 0.3, HEAD - 0.15).mean() > 0.9
    assert not part(found.opening, 0.1, LEFT - 0.15, 0.1, HEIGHT - 0.1).any()
    assert not part(found.opening, LEFT, RIGHT, HEAD + 0.15, HEIGHT - 0.1).any()
    assert part(found.data, 0.1, LEFT - 0.1, 0.1, HEIGHT - 0.1).mean() > 0.9
    assert not part(found.data, LEFT + 0.1, RIGHT - 0.1, 0.1, HEAD - 0.1).any()


def test_the_station_that_looked_through_is_named() -> None:
    found = image(scene())
    assert list(found.lookers) == [3]
    assert part(found.lookers[3], LEFT + 0.2, RIGHT - 0.2, 0.4, HEAD - 0.2).mean() > 0.9


def test_behind_a_cupboard_nothing_was_looked_through() -> None:
    assert not image(scene(blocked=True)).opening.any()


def test_with_nothing_behind_the_doorway_nothing_is_said_of_it() -> None:
    found = image(scene(behind=False))
    assert not part(found.data, LEFT + 0.1, RIGHT - 0.1, 0.1, HEAD - 0.1).any()
    assert not found.opening.any()


def test_a_station_of_another_storey_is_not_asked() -> None:
    assert not image(scene(), eye=(2.0, 2.0, 5.5)).lookers


def test_points_within_the_wall_are_reveals_in_the_walls_own_coordinates() -> None:
    reveal = upright((LEFT, -0.03), (LEFT, 0.03), 0.0, HEAD)
    found = image(np.concatenate([scene(), reveal]), 0.5)
    assert len(found.inner) == len(found.inner_points) > 10
    assert np.abs(found.inner[:, 0] - LEFT).max() < 0.02
    assert -0.05 < found.inner[:, 1].min() < found.inner[:, 1].max() < HEAD + 0.05
    assert found.inner_points.min() >= 1
