"""Linings round windows that lie flush with the wall, on painted faces whose truth is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.openings.linings import with_lining, with_usual_linings
from scan2bim.openings.orthoimage import PIXEL, Orthoimage
from scan2bim.openings.shapes import OpeningShape

CLEAR = OpeningShape(
    0, 0, "window", "unknown", 1.0, 0.9, 1.2, 1.1, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.9, sides=4
)  # fmt: skip
WIDTH = 0.04
ROUND = (WIDTH, WIDTH, WIDTH, WIDTH)


def painted(lining: tuple[float, float, float, float], step: float = -0.4) -> Orthoimage:
    """A face of 4 x 2.6 m round ``CLEAR``, with strips beside its left, right, lower and upper side."""
    rng = np.random.default_rng(3)
    shape = (260, 400)
    rgb = np.full((*shape, 3), 0.7, np.float32) + rng.normal(0, 0.01, (*shape, 3)).astype(np.float32)
    up, along = ((np.arange(n) + 0.5) * PIXEL for n in shape)
    left, right, bottom, top = 1.0, 2.2, 0.9, 2.0
    wide = (along > left - lining[0]) & (along < right + lining[1])
    tall = (up > bottom - lining[2]) & (up < top + lining[3])
    rgb[np.ix_(tall, wide)] += step
    count = np.ones(shape, np.uint16)
    count[np.ix_((up > bottom) & (up < top), (along > left) & (along < right))] = 0
    depth = rng.normal(0, 0.002, shape).astype(np.float32)
    coarse = np.zeros((52, 80), np.uint8)
    return Orthoimage("left", count, np.clip(rgb, 0, 1), depth, count > 0, coarse + 1, coarse, coarse)


def sides(opening: OpeningShape) -> tuple[float, float, float, float]:
    return opening.offset, opening.offset + opening.width, opening.sill, opening.sill + opening.height


def test_an_opening_ends_where_its_lining_does() -> None:
    found = with_lining(CLEAR, [painted(ROUND)])
    assert sides(found) == pytest.approx((0.96, 2.24, 0.86, 2.04), abs=0.006)
    assert found.lining == pytest.approx(WIDTH, abs=0.006)
    assert found.width_sigma is not None
    assert found.width_sigma > 0.004


def test_a_lining_of_nearly_the_walls_colour_counts_on_three_sides() -> None:
    assert with_lining(CLEAR, [painted(ROUND, 0.05)]).lining == pytest.approx(WIDTH, abs=0.006)
    assert with_lining(CLEAR, [painted((WIDTH, 0, WIDTH, 0), 0.05)]) == CLEAR


def test_a_strip_on_one_side_is_no_lining() -> None:
    assert with_lining(CLEAR, [painted((WIDTH, 0, 0, 0))]) == CLEAR


def test_strips_of_different_widths_are_no_lining() -> None:
    assert with_lining(CLEAR, [painted((0.03, 0.08, 0, 0))]) == CLEAR


def test_a_side_that_is_hidden_stays_and_a_window_on_the_floor_too() -> None:
    hidden = replace(CLEAR, hidden=(0.3, 0.0, 0.0, 0.0))
    assert with_lining(hidden, [painted(ROUND)]).offset == CLEAR.offset
    low = replace(CLEAR, sill=0.0, height=2.0)
    assert with_lining(low, [painted(ROUND)]).sill == 0.0


def test_windows_of_one_make_have_one_lining() -> None:
    shown = with_lining(CLEAR, [painted(ROUND)])
    *_, last = with_usual_linings([shown, shown, shown, CLEAR])
    assert sides(last) == pytest.approx(sides(shown), abs=1e-6)
    assert last.lining is None


@pytest.mark.parametrize(("shown", "plain"), [(2, 1), (3, 6)])
def test_few_linings_say_nothing_of_the_other_windows(shown: int, plain: int) -> None:
    lined = with_lining(CLEAR, [painted(ROUND)])
    assert with_usual_linings([lined] * shown + [CLEAR] * plain) == [lined] * shown + [CLEAR] * plain


def test_doors_are_left_as_they_are() -> None:
    door = replace(CLEAR, kind="door")
    assert with_lining(door, [painted(ROUND)]) == door
