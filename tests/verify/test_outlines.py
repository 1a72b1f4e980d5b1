"""What the points along a wall tell of an opening's sides."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.cloud.tiles import POINT, STEPS, TILE
from scan2bim.verify.compare import Owned
from scan2bim.verify.jambs import Change, outline_change
from scan2bim.verify.outlines import Outline, Profiles, find_outline
from scan2bim.verify.patches import Gap

WIDTH, HEIGHT, HALF = 0.9, 2.0, 0.06
GAP = Gap("gap", "wall", None, np.array([4.0, 4.0, 1.0]), np.array([1.0, 0.0]), WIDTH, HEIGHT, -HALF, HALF, None)


def scanned(start: float, end: float, frame: float = 0.0) -> np.ndarray:
    """(n, 3) points of a wall with an opening from start to end (metres from the drawn middle): both faces, which a
    frame is flush with, and bare reveals.
    """
    rng = np.random.default_rng(0)
    along, up = rng.uniform(-1.4, 1.4, 20_000), rng.uniform(-1.0, 1.0, 20_000)
    kept = (along < start + frame) | (along > end - frame)
    side = rng.choice([-HALF, HALF], int(kept.sum()))
    faces = np.column_stack([along[kept], side + rng.normal(0, 0.002, len(side)), up[kept]])
    jambs = rng.choice([start + frame, end - frame], 2000) + rng.normal(0, 0.002, 2000)
    reveals = np.column_stack([jambs, rng.uniform(-HALF, HALF, 2000), rng.uniform(-1.0, 1.0, 2000)])
    return np.concatenate([faces, reveals]) + GAP.middle


def change(start: float, end: float, frame: float = 0.0, more: np.ndarray | None = None) -> Change:
    outline = found(
        seen(scanned(start, end, frame) if more is None else np.concatenate([scanned(start, end, frame), more]))
    )
    assert outline is not None
    return outline_change(outline, 0.01, None)


def seen(points: np.ndarray) -> Profiles:
    profiles = Profiles([GAP])
    records = np.zeros(len(points), POINT)
    for axis, name in enumerate("xyz"):
        records[name] = points[:, axis] / TILE * STEPS
    profiles(Owned(np.zeros(3), records, np.zeros(len(points), np.int32)))
    return profiles


def found(profiles: Profiles) -> Outline | None:
    return find_outline(profiles, 0, (np.array([-HALF, 0.0]), np.array([HALF, 0.0])), [0.0], None)


@pytest.mark.parametrize("frame", [0.0, 0.04])
def test_an_opening_built_as_drawn_has_not_changed_whatever_its_frame(frame: float) -> None:
    assert change(-WIDTH / 2, WIDTH / 2, frame) == Change(0.0, 0.0)


@pytest.mark.parametrize("frame", [0.0, 0.04])
@pytest.mark.parametrize("shift", [0.11, -0.3])
def test_a_shift_is_told_to_3_mm_whatever_the_frame(shift: float, frame: float) -> None:
    found = change(shift - WIDTH / 2, shift + WIDTH / 2, frame)
    assert found.width == 0.0
    assert found.shift == pytest.approx(shift, abs=0.003)


@pytest.mark.parametrize("wider", [0.15, -0.25])
def test_an_opening_wider_or_narrower_on_one_side_is_told_as_resized(wider: float) -> None:
    found = change(-WIDTH / 2, WIDTH / 2 + wider)
    assert found.width == pytest.approx(wider, abs=0.003)
    assert found.shift == pytest.approx(wider / 2, abs=0.003)


def test_reveals_behind_a_lining_on_one_side_tell_the_shift() -> None:
    shift, lining = -0.31, 0.05
    start, end = shift - WIDTH / 2, shift + WIDTH / 2
    rng = np.random.default_rng(2)
    along, depth, up = rng.uniform(end - lining, end, 4000), rng.uniform(0.0, HALF, 4000), rng.uniform(-1.0, 1.0, 4000)
    front = np.column_stack([along, np.full(4000, HALF), up])
    inner = np.column_stack([np.full(4000, end - lining), depth, up])
    told = change(start, end, more=np.concatenate([front, inner]) + GAP.middle)
    assert told.width == 0.0
    assert told.shift == pytest.approx(shift, abs=0.003)


@pytest.mark.parametrize("shift", [0.25, -0.25])
def test_a_door_that_is_closed_flush_with_one_face_is_told_by_the_other(shift: float) -> None:
    start, end = shift - WIDTH / 2, shift + WIDTH / 2
    rng = np.random.default_rng(3)
    leaf = np.column_stack([rng.uniform(start, end, 20_000), np.full(20_000, -HALF), rng.uniform(-1.0, 1.0, 20_000)])
    behind = leaf + np.array([0.0, 0.04, 0.0])
    told = change(start, end, more=np.concatenate([leaf, behind, behind]) + GAP.middle)
    assert told.width == 0.0
    assert told.shift == pytest.approx(shift, abs=0.004)


def test_an_opening_with_a_lining_flush_with_one_face_is_told_to_its_reveal() -> None:
    wider, lining = 0.15, 0.05
    end = WIDTH / 2 + wider
    rng = np.random.default_rng(4)
    along, depth, up = rng.uniform(end - lining, end, 8000), rng.uniform(0.0, HALF, 8000), rng.uniform(-1.0, 1.0, 8000)
    front = np.column_stack([along, np.full(8000, HALF), up])
    inner = np.column_stack([np.full(8000, end - lining), depth, up])
    told = change(-WIDTH / 2, end, more=np.concatenate([front, inner]) + GAP.middle)
    assert told.width == pytest.approx(wider, abs=0.003)


def test_a_gap_in_a_leaf_flush_with_both_faces_is_no_opening() -> None:
    assert found(seen(scanned(-0.02, 0.02))) is None
