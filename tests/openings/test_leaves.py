"""Leaves of open doors, and what stands where they end."""

from __future__ import annotations

import numpy as np

from scan2bim.openings.leaves import find_leaf, reach_up
from scan2bim.structure.shapes import WallShape

WALL = WallShape((0, 0), (4, 0), 0.2, 0.002, 0, 2.5, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))
OFFSET, WIDTH, HEAD, ANGLE = 1.0, 0.9, 2.0, np.radians(64)


def on_leaf(start: float, end: float, top: float) -> np.ndarray:
    """(n, 3) points on both faces, 4 cm apart, from start to end along the line of a leaf hung at the opening's start,
    from the floor to a top.
    """
    along, up, off = np.meshgrid(np.arange(start, end, 0.04), np.arange(0.05, top, 0.04), [-0.02, 0.02])
    x = along * np.cos(ANGLE) - off * np.sin(ANGLE)
    y = along * np.sin(ANGLE) + off * np.cos(ANGLE)
    return np.column_stack([OFFSET + x.ravel(), 0.1 + y.ravel(), up.ravel()])


def share(*beyond: np.ndarray) -> float:
    """That is seen of the leaf, whose hinged end something hides."""
    leaf = find_leaf(WALL, OFFSET, WIDTH, HEAD, np.concatenate([on_leaf(0.2, WIDTH, HEAD), *beyond]))
    assert leaf is not None
    assert (leaf.hinge, leaf.side) == ("start", "left")
    assert abs(leaf.angle - ANGLE) < np.radians(2)
    return leaf.share


def test_low_furniture_where_a_leaf_ends_takes_nothing_off_it() -> None:
    assert share(on_leaf(WIDTH + 0.05, WIDTH + 0.4, 0.8)) == share()


def test_what_goes_on_upright_is_less_like_a_leaf() -> None:
    assert share(on_leaf(WIDTH, WIDTH + 0.5, HEAD)) < share()


def test_a_leaf_of_a_tall_opening_goes_up_and_furniture_does_not() -> None:
    tall, low = on_leaf(0.05, WIDTH, 3.0), on_leaf(0.05, WIDTH, 2.0)
    for points, least, most in ((tall, 0.8, 1.1), (low, 0.0, 0.1)):
        leaf = find_leaf(WALL, OFFSET, WIDTH, 3.1, points)
        assert leaf is not None
        assert least <= reach_up(WALL, OFFSET, WIDTH, 2.9, leaf, points) <= most
