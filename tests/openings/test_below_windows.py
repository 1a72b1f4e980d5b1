"""Closed doors that are windows with furniture below them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.openings.closed.below_windows import without_windows
from scan2bim.openings.closed.rectangles import Face, contrasted
from scan2bim.openings.orthoimage import Orthoimage
from scan2bim.openings.shapes import OpeningShape

WINDOW = OpeningShape(
    0, 0, "window", "unknown", 1.5, 0.9, 0.9, 1.2, 0.004, 0.004, 0.1, 2, True, 99, (0,), 0.9, sides=4
)  # fmt: skip
DOOR = replace(WINDOW, kind="door", state="closed", sill=0.0, height=2.1, sides=0)


def faces(panel: float, seen: bool) -> list[Face]:
    """A face of 4 x 2.6 m with the window, whose leaf goes on ``panel`` behind the wall below, if that was ``seen``."""
    rng = np.random.default_rng(3)
    shape = (260, 400)
    rgb = np.full((*shape, 3), 0.8, np.float32) + rng.normal(0, 0.01, (*shape, 3)).astype(np.float32)
    depth = rng.normal(0, 0.002, shape).astype(np.float32)
    depth[90:210, 150:240] -= 0.1
    depth[:90, 150:240] -= panel
    count = (rng.random(shape) < 0.6).astype(np.uint16)
    count[:80] *= seen
    coarse = np.zeros((52, 80), np.uint8)
    image = Orthoimage("left", count, np.clip(rgb, 0, 1), depth, np.ones(shape, bool), coarse + 1, coarse, coarse)
    return contrasted([image])


@pytest.mark.parametrize(("panel", "seen"), [(0.0, True), (0.0, False)])
def test_a_door_in_the_place_of_a_window_with_wall_below_it_is_none(panel: float, seen: bool) -> None:
    assert without_windows([DOOR], [WINDOW], faces(panel, seen)) == []


def test_a_leaf_with_a_pane_goes_on_below_it() -> None:
    assert without_windows([DOOR], [WINDOW], faces(0.02, True)) == [DOOR]


@pytest.mark.parametrize(
    "window",
    [replace(WINDOW, offset=1.6, width=0.7), replace(WINDOW, sides=3), replace(WINDOW, hidden=(0.0, 0.0, 0.3, 0.0))],
    ids=["a pane within a leaf", "no wall on one side", "a sill that was not seen"],
)
def test_other_windows_leave_a_door(window: OpeningShape) -> None:
    assert without_windows([DOOR], [window], faces(0.0, False)) == [DOOR]


def test_a_curtain_may_hide_a_side_of_the_window() -> None:
    hidden = replace(WINDOW, width=0.7, sides=3, hidden=(0.0, 0.3, 0.0, 0.0))
    assert without_windows([DOOR], [hidden], faces(0.0, False)) == []
