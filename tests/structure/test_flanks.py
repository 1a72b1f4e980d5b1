"""Where windows may stand beside a pier: in its line, as far as nothing stands before that."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.structure.fits import Face
from scan2bim.structure.fronts import FLANK, flanks

PIER = Face(np.zeros(2), np.array([0.0, 1.0]), -0.5, 0.5, np.arange(9), 0.002, 1.0, True)
"""A pier along x, its room towards y."""


def side(x: float, start: float, end: float) -> Face:
    """A face across the pier's line."""
    middle = (start + end) / 2
    half = (end - start) / 2
    return Face(np.array([x, middle]), np.array([1.0, 0.0]), -half, half, np.arange(9), 0.002, 1.0, True)


def reach(*others: Face) -> list[tuple[float, float]]:
    """From where to where the stretches beside the pier go."""
    return [(round(f.low, 3), round(f.high, 3)) for f in flanks(PIER, [PIER, *others])]


def test_a_window_may_stand_on_both_sides_of_a_pier() -> None:
    assert reach() == [(-0.5 - FLANK, -0.5), (0.5, 0.5 + FLANK)]


def test_a_wall_across_the_line_ends_it_and_the_reveals_of_a_window_do_not() -> None:
    assert reach(side(2.0, 0.0, 3.0), side(1.5, -0.3, 0.0)) == [(-0.5 - FLANK, -0.5), (0.5, 2.0)]


@pytest.mark.parametrize("other", [side(0.5, 0.0, 3.0), side(0.7, -1.0, 3.0)])
def test_where_a_wall_stands_right_beside_it_there_is_no_room_for_one(other: Face) -> None:
    assert reach(other) == [(-0.5 - FLANK, -0.5)]
