from __future__ import annotations

import numpy as np
import pytest

from scan2bim.geometry.space_index import SpaceIndex


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("reach", [0.1, 0.35, 2.0])
def test_the_nearest_within_reach_come_first(dimensions: int, reach: float) -> None:
    draw = np.random.default_rng(dimensions)
    points, places = draw.random((400, dimensions)) * 3, draw.random((200, dimensions)) * 4 - 0.5
    away = np.linalg.norm(places[:, None] - points, axis=2)
    order = np.argsort(away, axis=1)[:, :5]
    expected = np.where(np.take_along_axis(away, order, 1) < reach, order, -1)
    np.testing.assert_array_equal(SpaceIndex(points).nearest(places, 5, reach), expected)


def test_points_that_spread_far_are_found_too() -> None:
    points = np.array([[0.0, 0.0, 0.0], [5e4, 5e4, 100.0]])
    found = SpaceIndex(points).nearest(points + 0.05, 2, 0.2)
    np.testing.assert_array_equal(found, [[0, -1], [1, -1]])


def test_nothing_is_found_among_no_points() -> None:
    assert SpaceIndex(np.zeros((0, 3))).nearest(np.zeros((2, 3)), 3, 1.0).tolist() == [[-1] * 3] * 2
