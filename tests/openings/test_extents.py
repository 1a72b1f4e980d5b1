"""How far a closed door reaches, on painted faces whose truth is exact: what pixels say against what lines say."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.openings.closed.extents import fitted
from scan2bim.openings.closed.rectangles import Face, Rectangle, contrasted
from scan2bim.openings.orthoimage import Orthoimage

DOOR = Rectangle(1.5, 2.4, 2.1)
LENGTH = 4.0


def painted(
    door: Rectangle = DOOR,
    cupboard: tuple[float, float, float] | None = None,
    shade: float | None = None,
    wall: float = 0.0,
    phase: float = 0.0,
) -> list[Face]:
    """A face of 4 x 2.6 m with a leaf 30 mm behind a wall that stands ``wall`` before the fitted plane; a cupboard from
    left to right and up to a height 30 mm before it; another station's light and registration from ``shade`` on; all
    of it moved along the raster by ``phase`` of a pixel.
    """
    rng = np.random.default_rng(5)
    along, up = np.meshgrid((np.arange(400) + 0.5 - phase) * 0.01, (np.arange(260) + 0.5) * 0.01)
    depth, tone = np.full(along.shape, wall), np.full(along.shape, 0.8)
    inside = (along > door.left) & (along < door.right) & (up < door.top)
    depth[inside] -= 0.03
    tone[inside] -= 0.3
    if shade is not None:
        tone[along > shade] -= 0.15
        depth[along > shade] -= 0.006
    if cupboard is not None:
        before = (along > cupboard[0]) & (along < cupboard[1]) & (up < cupboard[2])
        depth[before], tone[before] = wall + 0.03, 0.3
    rgb = (tone[..., None] + rng.normal(0, 0.01, (*tone.shape, 3))).astype(np.float32)
    noisy = (depth + rng.normal(0, 0.002, depth.shape)).astype(np.float32)
    count = (rng.random(depth.shape) < 0.6).astype(np.uint16)
    coarse = np.zeros((52, 80), np.uint8)
    return contrasted([Orthoimage("left", count, rgb, noisy, np.ones(depth.shape, bool), coarse + 1, coarse, coarse)])


def found(faces: list[Face], start: Rectangle) -> tuple[float, float, float]:
    box = fitted(faces, start, 0.0, LENGTH)
    return box.left, box.right, box.top


@pytest.mark.parametrize("start", [Rectangle(1.5, 2.15, 2.1), Rectangle(1.2, 2.4, 2.0), Rectangle(1.65, 2.6, 2.1)])
def test_a_door_reaches_as_far_as_its_leaf_wherever_the_candidates_lines_were(start: Rectangle) -> None:
    assert found(painted(), start) == pytest.approx((1.5, 2.4, 2.1), abs=0.02)


def test_the_edge_of_a_cupboard_before_a_leaf_is_not_its_side() -> None:
    faces = painted(cupboard=(2.15, 2.9, 1.8))
    assert found(faces, Rectangle(1.5, 2.15, 2.1)) == pytest.approx((1.5, 2.4, 2.1), abs=0.03)


def test_where_another_stations_light_begins_is_not_a_side() -> None:
    faces = painted(shade=1.8)
    assert found(faces, Rectangle(1.8, 2.4, 2.1)) == pytest.approx((1.5, 2.4, 2.1), abs=0.03)


def test_a_wide_leaf_that_has_drawn_the_fitted_plane_to_itself_is_told_from_the_wall_all_the_same() -> None:
    wide = Rectangle(1.2, 3.0, 2.1)
    assert found(painted(wide, wall=0.028), Rectangle(1.2, 3.3, 2.1)) == pytest.approx((1.2, 3.0, 2.1), abs=0.02)


def test_a_door_stays_where_it_is_when_the_raster_is_moved() -> None:
    boxes = [found(painted(phase=p), Rectangle(1.5, 2.15, 2.0)) for p in (0.0, 0.25, 0.5, 0.75)]
    assert np.ptp(boxes, axis=0).max() < 0.015


def test_a_door_does_not_reach_into_the_next_one() -> None:
    assert fitted(painted(), DOOR, 0.0, 2.2).right <= 2.2
