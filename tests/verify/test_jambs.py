"""What sides of openings and detected openings tell of drawn ones."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.verify.detected import Detected
from scan2bim.verify.jambs import detected_change, outline_change
from scan2bim.verify.outlines import Outline, Side
from scan2bim.verify.patches import Gap

GAP = Gap("gap", "wall", None, np.array([4.0, 4.0, 1.0]), np.array([1.0, 0.0]), 0.7, 2.0, -0.06, 0.06, None)


def detected(start: float, end: float, kind: str = "door") -> Detected:
    """Whose sides lie metres outwards of the drawn ones."""
    middle = GAP.middle + np.array([(end - start) / 2, 0.0, 0.0])
    return Detected("x", kind, middle, GAP.along, GAP.width + start + end, GAP.height, 0.95, "closed")  # pyright: ignore


def test_a_surely_detected_window_that_reaches_farther_on_one_side_is_wider() -> None:
    told = detected_change(GAP, detected(0.19, -0.01, "window"))
    assert told.width == pytest.approx(0.19)
    assert told.shift == pytest.approx(-0.095)


@pytest.mark.parametrize(("start", "end", "kind"), [(0.19, 0.0, "door"), (0.19, 0.12, "window"), (0.08, 0.0, "window")])
def test_trims_round_doors_linings_and_windows_in_line_make_no_opening_wider(
    start: float, end: float, kind: str
) -> None:
    assert not detected_change(GAP, detected(start, end, kind)).width


def test_a_window_as_wide_as_drawn_but_farther_along_was_moved_one_that_a_curtain_narrows_was_not() -> None:
    assert detected_change(GAP, detected(0.24, -0.24, "window")).shift == pytest.approx(-0.24)
    assert detected_change(GAP, detected(0.0, -0.24, "window")).shift == 0.0


def test_a_frame_flush_with_the_wall_hides_both_sides_alike_though_no_wall_was_seen_beside_it() -> None:
    start = Side(-0.15, -0.15, 0.05, hollow=False)
    end = Side(-0.13, -0.12, 0.0, hollow=True)
    told = outline_change(Outline(start, end, 100.0), 0.01, None)
    assert told.width == pytest.approx(0.18)
