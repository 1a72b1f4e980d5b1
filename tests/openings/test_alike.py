"""Sides that something hides are taken from like openings."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scan2bim.openings.alike import completed
from scan2bim.openings.shapes import NOT_HIDDEN, OpeningShape

WHOLE = OpeningShape(
    0, 0, "window", "unknown", 1.0, 0.9, 0.82, 0.76, 0.004, 0.004, 0.3, 2, True, 99, (0,), 0.9, sides=4
)  # fmt: skip


def hidden(opening: OpeningShape, left: float = 0.0, right: float = 0.0, lower: float = 0.0) -> OpeningShape:
    """The opening when something hides 0.3 m of it at the sides that may be farther out."""
    start = opening.offset + (0.3 if left else 0.0)
    width = opening.width - (0.3 if left else 0.0) - (0.3 if right else 0.0)
    sill = opening.sill + (0.3 if lower else 0.0)
    height = opening.height - (0.3 if lower else 0.0)
    return replace(
        opening, offset=start, width=width, sill=sill, height=height, hidden=(left, right, lower, 0.0)
    )  # fmt: skip


def test_a_hidden_jamb_is_that_of_the_window_above() -> None:
    above = replace(WHOLE, sill=1.8)
    *_, found = completed([above, hidden(WHOLE, left=0.5)])
    assert (found.offset, found.width) == (WHOLE.offset, WHOLE.width)
    assert found.width_sigma is None
    assert found.hidden == NOT_HIDDEN


def test_a_hidden_jamb_follows_from_the_width_of_a_like_window_elsewhere() -> None:
    other = replace(WHOLE, wall=3, offset=4.0)
    *_, found = completed([other, replace(other, wall=4), hidden(WHOLE, right=0.6)])
    assert found.offset == pytest.approx(WHOLE.offset)
    assert found.width == pytest.approx(WHOLE.width)


def test_a_window_of_another_height_is_not_alike() -> None:
    other = replace(WHOLE, wall=3, sill=0.2, height=2.2)
    *_, found = completed([other, hidden(WHOLE, left=0.5)])
    assert found.width == pytest.approx(0.52 + 0.5 / 3, abs=1e-3)
    assert found.width_sigma == pytest.approx(2 / 3 * 0.5 / 12**0.5, abs=1e-3)


def test_of_windows_with_one_head_those_of_about_its_height_tell_its_width() -> None:
    head = WHOLE.sill + WHOLE.height
    high = [replace(WHOLE, wall=w, sill=head - 1.3, height=1.3, width=1.2) for w in (3, 4, 5)]
    low = replace(WHOLE, wall=6, sill=head - 0.8, height=0.8)
    *_, found = completed([*high, low, hidden(WHOLE, left=0.5, right=0.5)])
    assert found.width == pytest.approx(WHOLE.width)


def test_a_hidden_jamb_is_as_far_from_the_bars_as_the_other() -> None:
    barred = replace(hidden(WHOLE, left=0.5), bars=(WHOLE.offset + WHOLE.width / 2,))
    *_, found = completed([barred])
    assert found.offset == pytest.approx(WHOLE.offset)
    assert found.width == pytest.approx(WHOLE.width)


def test_a_bar_that_puts_the_jamb_where_wall_was_seen_is_not_the_middle() -> None:
    other = replace(WHOLE, wall=3, offset=4.0)
    barred = replace(hidden(WHOLE, left=0.5), bars=(WHOLE.offset + WHOLE.width - 0.1,))
    *_, found = completed([other, barred])
    assert found.width == pytest.approx(WHOLE.width)


def test_with_both_jambs_hidden_a_window_stands_in_the_middle() -> None:
    other = replace(WHOLE, wall=3, offset=4.0)
    *_, found = completed([other, hidden(WHOLE, left=0.6, right=0.6)])
    assert found.offset == pytest.approx(WHOLE.offset)
    assert found.width == pytest.approx(WHOLE.width)


def test_a_hidden_sill_follows_from_the_height_of_a_window_as_wide() -> None:
    other = replace(WHOLE, wall=3, offset=4.0, sill=2.0)
    *_, found = completed([other, hidden(WHOLE, lower=0.7)])
    assert found.sill == pytest.approx(WHOLE.sill)
    assert found.height_sigma is None


def test_a_hidden_side_goes_no_farther_than_the_next_opening() -> None:
    beside = replace(WHOLE, offset=0.1, width=0.8, sill=0.2, height=2.2)
    *_, found = completed([beside, hidden(WHOLE, left=0.5)])
    assert found.offset > beside.offset + beside.width


def test_beside_a_narrow_pier_all_that_is_hidden_is_window() -> None:
    beside = replace(WHOLE, offset=WHOLE.offset - 1.0, width=0.9, sill=0.2, height=2.2)
    *_, found = completed([beside, hidden(WHOLE, left=0.3)])
    assert found.offset == pytest.approx(WHOLE.offset, abs=1e-3)
    assert found.width == pytest.approx(WHOLE.width, abs=1e-3)


def test_a_guessed_width_is_not_that_of_other_windows() -> None:
    guessed = replace(WHOLE, wall=3, offset=4.0, width=0.6, width_sigma=0.1)
    *_, found = completed([guessed, hidden(WHOLE, left=0.5)])
    assert found.width == pytest.approx(0.52 + 0.5 / 3, abs=1e-3)
