from __future__ import annotations

import numpy as np
import pytest

from scan2bim.openings.within import STRETCH, stretch_bounds, within


@pytest.mark.parametrize("count", [0, 1, STRETCH, 5 * STRETCH + 7])
def test_the_points_of_a_rectangle_are_those_between_its_sides(count: int) -> None:
    draw = np.random.default_rng(count)
    along = np.sort(draw.random(count, np.float32)) * 8  # a scanner's sweeps, one beside the other
    up = draw.random(count, np.float32) * 3
    bounds = stretch_bounds(along, up)
    for left, right, bottom, top in ((1.0, 2.5, 0.5, 2.0), (-np.inf, np.inf, -np.inf, np.inf), (3.0, 3.0, 0.0, 3.0)):
        box = np.array([left, right, bottom, top], np.float32)
        inside = (along > box[0]) & (along < box[1]) & (up > box[2]) & (up < box[3])
        np.testing.assert_array_equal(within(along, up, bounds, box), np.flatnonzero(inside))
