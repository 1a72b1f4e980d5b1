"""Frames of open doors, seen from all sides, and doorways without any, on made points and painted faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.openings.closed.edges import LAP
from scan2bim.openings.closed.rectangles import Face, Rectangle, contrasted
from scan2bim.openings.door_frames import with_frame
from scan2bim.openings.door_linings import faint_lining, is_plain, seen_lining
from scan2bim.openings.door_trims import trim_setbacks
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.orthoimage import Orthoimage
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

HALF = 0.1
WALL = WallShape((0, 0), (4, 0), 2 * HALF, 0.002, 0, 2.6, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))
BOX = Rectangle(1.5, 2.3, 2.0)
CLEAR = BOX.left, BOX.right, BOX.top
DOOR = OpeningShape(
    0, 0, "door", "open", BOX.left, 0.0, BOX.width, BOX.top, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.9, sides=3
)
F64 = NDArray[np.float64]


def points(setback: float | None, *, leaf: float = 0.0, frame: float = 0.0) -> WallPoints:
    """Points of both faces round a clear opening: its reveals, the wall, and trims 7 cm wide that begin ``setback``
    metres from it, if any; a ``leaf`` of some metres that stands open hides the right jamb, and a ``frame`` stands out
    of the reveals into the opening.
    """
    rng = np.random.default_rng(7)
    parts: list[F64] = []
    for side in range(3):
        hidden = leaf if side == 1 else 0.0
        for sign in (1, -1):
            front = rng.uniform(hidden, 0.25, 4000)
            trim = np.zeros(len(front), bool)
            if setback is not None:
                trim = (front > hidden + setback) & (front < hidden + setback + 0.07)
            depth = HALF + np.where(trim, 0.012, 0.0) + rng.normal(0, 0.001, len(front))
            parts.append(_at(side, front, sign * depth, rng))
        reveal = rng.normal(0, 0.001, 2000), rng.uniform(-HALF, HALF, 2000)
        parts.append(_at(side, *reveal, rng))
        if frame and side < 2:
            parts.append(_at(side, rng.uniform(-frame, 0, 2000), rng.uniform(0, 0.04, 2000), rng))
    xyz = np.concatenate(parts).astype(np.float32)
    return WallPoints(xyz[:, 0], xyz[:, 1], xyz[:, 2], np.zeros((len(xyz), 3), np.uint8), np.zeros(len(xyz), np.uint16))


def _at(side: int, outwards: F64, across: F64, rng: np.random.Generator) -> F64:
    if side == 2:
        return np.column_stack([rng.uniform(BOX.left, BOX.right, len(across)), across, BOX.top + outwards])
    along = BOX.left - outwards if side == 0 else BOX.right + outwards
    return np.column_stack([along, across, rng.uniform(0, BOX.top, len(across))])


def image(
    lining: float, tint: float, sides: tuple[int, ...] = (0, 1, 2), leaf: float = 0.0, noise: float = 0.01
) -> Orthoimage:
    """A face with an open door within a flush lining of a width on some sides; a ``leaf`` hides the right jamb."""
    rng = np.random.default_rng(5)
    shape = (260, 400)
    up, along = ((np.arange(n) + 0.5) / 100 for n in shape)
    rgb = np.full((*shape, 3), 0.7, np.float32) + rng.normal(0, noise, (*shape, 3)).astype(np.float32)
    known = np.ones(shape, bool)
    known[np.ix_(up < BOX.top, (along > BOX.left) & (along < BOX.right + leaf))] = False
    low, high = up < BOX.top + lining, up > BOX.top
    strips = (
        np.ix_(low, (along > BOX.left - lining) & (along < BOX.left)),
        np.ix_(low, (along > BOX.right + leaf) & (along < BOX.right + leaf + lining)),
        np.ix_(low & high, (along > BOX.left) & (along < BOX.right)),
    )
    for side in sides:
        rgb[strips[side]] += tint
    depth = rng.normal(0, 0.001, shape).astype(np.float32)
    coarse = np.zeros((52, 80), np.uint8)
    return Orthoimage("left", known.astype(np.uint16), rgb, depth, known, coarse + 1, coarse, coarse)


def framed(door: OpeningShape, faces: list[Face], near: WallPoints) -> list[float]:
    """How far outwards a door's left, right and upper side were moved."""
    found = with_frame(door, WALL, faces, near)
    end = found.offset + found.width
    return [door.offset - found.offset, end - door.offset - door.width, found.height - door.height]


def test_trims_that_stand_back_from_the_clear_width_show_the_lining_that_they_lap_over() -> None:
    assert trim_setbacks(points(0.015), BOX, HALF) == pytest.approx([0.015] * 3, abs=0.004)
    plain = contrasted([image(0.0, 0.0)])
    assert framed(DOOR, plain, points(0.015)) == pytest.approx([0.015 + LAP] * 3, abs=0.005)


def test_a_wall_without_trims_shows_none() -> None:
    assert trim_setbacks(points(None), BOX, HALF) is None


def test_trims_that_lap_over_the_walls_own_reveal_do_not_move_it() -> None:
    assert framed(replace(DOOR, angle=1.2), contrasted([image(0.0, 0.0)]), points(-0.03)) == [0.0, 0.0, 0.0]


def test_behind_a_leaf_that_hides_its_jamb_the_trim_is_farther_off() -> None:
    near, faces = points(0.015, leaf=0.045), contrasted([image(0.0, 0.0, leaf=0.045)])
    swung = replace(DOOR, angle=1.6, hinge="end", swing="left")
    assert framed(swung, faces, near) == pytest.approx([0.04, 0.085, 0.04], abs=0.006)
    other = replace(swung, hinge="start")
    assert framed(other, faces, near)[1] == pytest.approx(0.04, abs=0.006)


def test_a_lining_ends_on_each_side_where_its_colour_does() -> None:
    lining = seen_lining([image(0.05, -0.2)], CLEAR)
    assert lining is not None and lining.sides == pytest.approx((0.05, 0.05, 0.05), abs=0.006)
    lining = seen_lining([image(0.05, -0.2, (0, 2))], CLEAR)
    assert lining is not None and lining.sides == pytest.approx((0.05, 0.0, 0.05), abs=0.006)
    lining = seen_lining([image(0.05, -0.2, leaf=0.04)], CLEAR)
    assert lining is not None and lining.sides == pytest.approx((0.05, 0.09, 0.05), abs=0.006)


def test_a_lining_of_nearly_the_walls_colour_shows_on_both_faces_together() -> None:
    faint = [image(0.05, 0.013, noise=0.02), image(0.05, 0.013, noise=0.02)]
    assert seen_lining(faint, CLEAR) is None
    lining = faint_lining(faint, CLEAR)
    assert lining is not None and lining.width == pytest.approx(0.05, abs=0.012)
    assert faint_lining([image(0.0, 0.0, noise=0.02)] * 2, CLEAR) is None


def test_a_doorway_without_leaf_and_frame_is_a_passage() -> None:
    faces = contrasted([image(0.0, 0.0)])
    assert with_frame(DOOR, WALL, faces, points(None)).kind == "passage"
    flat = replace(DOOR, angle=2.8, hinge="start", swing="left", leaves=1)
    found = with_frame(flat, WALL, faces, points(None))
    assert (found.kind, found.angle, found.hinge) == ("passage", None, "unknown")


@pytest.mark.parametrize("what", ["leaf", "lining", "trim", "frame within the reveal"])
def test_one_with_any_of_these_stays_a_door(what: str) -> None:
    door = replace(DOOR, angle=1.2, hinge="start", swing="left") if what == "leaf" else DOOR
    faces = contrasted([image(0.05 * (what == "lining"), -0.2)])
    near = points(0.015 if what == "trim" else None, frame=0.04 * (what == "frame within the reveal"))
    assert with_frame(door, WALL, faces, near).kind == "door"


def test_a_wall_is_plain_where_no_lining_shows() -> None:
    assert is_plain([image(0.0, 0.0)], CLEAR)
    assert not is_plain([image(0.05, -0.2)], CLEAR)
