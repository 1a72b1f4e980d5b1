"""Curtains before a wall are no faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.structure.curtains import without_curtains
from scan2bim.structure.fits import Face

WALL = Face(np.zeros(2), np.array([0.0, 1.0]), -3.0, 3.0, np.arange(9), 0.002, 4.5, True)
"""A wall along x, its room towards y, with a window in it."""


def before(
    distance: float, rms: float, along: float = 0.0, turned: float = 0.0, seen: float = 0.6, sided: bool = True
) -> Face:
    """A short face, metres before the wall, its middle ``along`` it, ``turned`` by radians."""
    normal = np.array([np.sin(turned), np.cos(turned)])
    return Face(np.array([along, distance]), normal, -seen / 2, seen / 2, np.arange(9), rms, seen, sided)


@pytest.mark.parametrize("turned", [0.0, 0.2, -0.2])
def test_folds_close_before_a_straight_wall_are_a_curtain(turned: float) -> None:
    assert without_curtains([WALL, before(0.1, 0.010, turned=turned)]) == [WALL]


@pytest.mark.parametrize(
    "other",
    [
        before(0.1, 0.002),
        before(0.6, 0.010),
        before(-0.15, 0.010),
        before(0.1, 0.010, along=3.2),
        before(0.1, 0.010, turned=np.pi / 2),
        before(0.1, 0.010, seen=3.0),
        before(0.1, 0.010, sided=False),
    ],
    ids=["a pier", "farther off", "behind it", "beyond its end", "square to it", "as long", "from no side"],
)
def test_what_is_straight_or_stands_elsewhere_is_none(other: Face) -> None:
    assert without_curtains([WALL, other]) == [WALL, other]


def test_where_walls_are_as_rough_nothing_is_told() -> None:
    rough = replace(WALL, rms=0.008)
    assert len(without_curtains([rough, before(0.1, 0.010)])) == 2
