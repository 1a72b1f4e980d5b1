"""Heads of doors, from corner to corner, above furniture."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.openings.closed.corners import rectangles_below
from scan2bim.openings.closed.rectangles import Face, contrasted
from scan2bim.openings.orthoimage import Orthoimage

ROWS, WIDTH = (175, 252), (55, 260)


def face(step: float, hidden: slice = slice(0, 0), along: slice = slice(0, 400)) -> Face:
    """A face of 4 x 2.6 m with a leaf from 1.5 to 2.4 m, 2.1 m high, ``step`` behind it; below 1.8 m all is hidden, and
    what ``hidden`` rows are ``along`` the wall.
    """
    rng = np.random.default_rng(5)
    shape = (260, 400)
    depth = rng.normal(0, 0.002, shape).astype(np.float32)
    depth[:210, 150:240] -= step
    rgb = (0.8 + rng.normal(0, 0.01, (*shape, 3))).astype(np.float32)
    count = (rng.random(shape) < 0.6).astype(np.uint16)
    count[:180] = 0
    count[hidden, along] = 0
    coarse = np.zeros((52, 80), np.uint8)
    image = Orthoimage("left", count, rgb, depth, count > 0, coarse + 1, coarse, coarse)
    return contrasted([image])[0]


@pytest.mark.parametrize("hidden", [slice(0, 0), slice(200, 220)])
def test_a_head_with_both_corners_is_a_candidate_though_all_below_and_a_part_of_it_is_hidden(hidden: slice) -> None:
    found = face(0.03, hidden, slice(180, 200))
    best = rectangles_below(found.heads, [found.sides], ROWS, WIDTH)[0]
    assert best[:3] == pytest.approx((150, 240, 210), abs=3)


def test_a_head_of_which_a_corner_is_hidden_is_none() -> None:
    found = face(0.03, slice(170, 225), slice(210, 400))
    assert not len(rectangles_below(found.heads, [found.sides], ROWS, WIDTH))


def test_an_even_wall_has_no_heads() -> None:
    found = face(0.0)
    assert not len(rectangles_below(found.heads, [found.sides], ROWS, WIDTH))
