"""Doors that were looked through: glazed leaves told from open doors, frames round them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.openings.closed.rectangles import Face, contrasted
from scan2bim.openings.closed.score import SUREST, confidence
from scan2bim.openings.door_frames import with_pane
from scan2bim.openings.orthoimage import Orthoimage
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

WALL = WallShape((0, 0), (4, 0), 0.2, 0.002, 0, 2.6, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))
DOOR = OpeningShape(0, 0, "door", "open", 1.5, 0.0, 0.9, 2.1, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.9, sides=3)


def face(panel: float, depth: float) -> Face:
    """A face with nothing in the door but a panel up to a height, ``depth`` before the wall's plane."""
    rng = np.random.default_rng(3)
    shape = (260, 400)
    values = rng.normal(0, 0.002, shape).astype(np.float32)
    known = np.ones(shape, bool)
    known[: round(DOOR.height * 100), 150:240] = False
    known[: round(panel * 100), 150:240] = True
    values[: round(panel * 100), 150:240] += depth
    rgb = np.full((*shape, 3), 0.7, np.float32)
    coarse = np.zeros((52, 80), np.uint8)
    return contrasted([Orthoimage("left", known.astype(np.uint16), rgb, values, known, coarse + 1, coarse, coarse)])[0]


def test_a_panel_below_what_was_looked_through_is_a_closed_glazed_leaf() -> None:
    found = with_pane(DOOR, WALL, [face(0.9, -0.04)])
    assert (found.state, found.glazed, found.leaves) == ("closed", True, 1)


@pytest.mark.parametrize(("panel", "depth"), [(0.2, -0.04), (0.9, 0.1), (0.0, 0.0)])
def test_what_is_low_or_stands_before_the_wall_is_none(panel: float, depth: float) -> None:
    assert with_pane(DOOR, WALL, [face(panel, depth)]) == DOOR


def test_a_leaf_that_was_seen_open_stays_so() -> None:
    swung = replace(DOOR, angle=1.2)
    assert with_pane(swung, WALL, [face(0.9, -0.04)]) == swung


def test_the_confidence_of_the_door_that_is_kept_grows_with_its_probability_and_is_never_certain() -> None:
    stated = [confidence(p) for p in (0.0, 0.2, 0.44, 0.8, 1.0)]
    assert stated == sorted(stated)
    assert (stated[0], stated[-1]) == (0.0, SUREST)
