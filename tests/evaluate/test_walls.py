"""Measures of walls on known answers: corners and boxes of the challenge, faces, which walls are right."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from scan2bim.evaluate.corners import met_at_axes, score_boxes
from scan2bim.evaluate.faces import right_walls, score_faces
from scan2bim.evaluate.frames import moved
from scan2bim.evaluate.reliability import pooled, reliability
from scan2bim.evaluate.report import score
from scan2bim.simulate.scenes import rotated_flat
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.io import read_truth, write_truth
from scan2bim.truth.values import SpaceTruth, StoreyTruth, Truth, WallTruth

GROUND = (StoreyTruth(name="ground", elevation=0.0),)
NOBODY = frozenset[str]()


def wall(start: tuple[float, float], end: tuple[float, float], **more) -> WallTruth:
    known = {"name": f"{start} {end}", "storey": "", "thickness": 0.2, "base": 0.0, "height": 2.5}
    return WallTruth(start=start, end=end, **{**known, **more})


def shifted(walls: list[WallTruth], x: float = 0.0, y: float = 0.0, z: float = 0.0) -> list[WallTruth]:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return list(moved(Truth(scene="", walls=tuple(walls)), matrix).walls)


def square() -> tuple[list[WallTruth], list[SpaceTruth]]:
    """Four walls of 20 cm round a room of 4 m by 4 m, their axes meeting at the corners."""
    at = [(0.0, 0.0), (4.2, 0.0), (4.2, 4.2), (0.0, 4.2)]
    walls = [wall(a, b) for a, b in pairwise([*at, at[0]])]
    inside = ((0.1, 0.1), (4.1, 0.1), (4.1, 4.1), (0.1, 4.1))
    return walls, [SpaceTruth(name="room", storey="", outline=inside, area=16.0, base=0.0, height=2.5)]


@pytest.mark.parametrize("yaw", [0.0, 0.4, math.pi / 4, -math.pi / 4])
def test_corners_lie_across_walls_of_any_direction_and_distance_is_that_in_space(yaw: float) -> None:
    """Neither of which holds in the challenge's published code."""
    one = [wall((0.0, 0.0), (3 * math.cos(yaw), 3 * math.sin(yaw)), thickness=0.4)]
    thinner = [one[0].model_copy(update={"thickness": 0.26})]  # 7 cm at each corner, across the wall
    found = score_boxes(one, thinner, GROUND, NOBODY)
    assert [s.f1 for s in found.space] == [0.0, 1.0, 1.0]
    assert found.plan_iou == pytest.approx(0.26 / 0.4)
    aside = score_boxes(one, shifted(one, 0.09, 0.09, 0.09), GROUND, NOBODY)  # 9 cm along each axis: 15.6 cm
    assert [s.f1 for s in aside.space] == [0.0, 0.0, 1.0]
    assert [s.f1 for s in aside.plan] == [0.0, 0.0, 1.0]


def test_a_wall_that_ends_lower_has_half_of_its_corners_in_space_and_all_in_plan() -> None:
    walls, _ = square()
    lower = [w.model_copy(update={"height": 2.2}) for w in walls]
    found = score_boxes(walls, lower, GROUND, NOBODY)
    assert [s.f1 for s in found.space] == [0.5, 0.5, 0.5]
    assert [s.f1 for s in found.plan] == [1.0, 1.0, 1.0]
    assert (found.iou, found.plan_iou) == (pytest.approx(2.2 / 2.5), pytest.approx(1.0))


def test_missing_false_and_unseen_walls_count_as_the_challenge_counts_them() -> None:
    walls, _ = square()
    far = wall((20.0, 0.0), (24.0, 0.0))
    fewer = score_boxes(walls, walls[:3], GROUND, NOBODY)
    assert (fewer.space[0].precision, fewer.space[0].recall, fewer.iou) == (1.0, 0.75, pytest.approx(0.75))
    more = score_boxes(walls, [*walls, far], GROUND, NOBODY)
    assert (more.space[0].precision, more.space[0].recall, more.iou) == (0.8, 1.0, pytest.approx(1.0))
    unseen = score_boxes([*walls, far], walls, GROUND, frozenset([far.name]))
    assert (unseen.space[0].f1, unseen.iou) == (1.0, pytest.approx(1.0))
    known = score_boxes([*walls, far], [*walls, far], GROUND, frozenset([far.name]))
    assert known.space[0].f1 == 1.0
    nothing = score_boxes(walls, [], GROUND, NOBODY)
    assert ([s.f1 for s in nothing.space], nothing.iou) == ([0.0, 0.0, 0.0], 0.0)


def test_storeys_count_alike_however_many_walls_they_have() -> None:
    walls, _ = square()
    upper = [wall((0.0, 0.0), (4.0, 0.0), base=3.0)]
    levels = (*GROUND, StoreyTruth(name="upper", elevation=3.0))
    found = score_boxes([*walls, *upper], walls, levels, NOBODY)
    assert found.space[0].f1 == pytest.approx(0.5)


def test_ends_in_another_wall_are_drawn_to_its_axis_and_free_ends_stay() -> None:
    butt = [wall((0.0, 0.0), (4.0, 0.0)), wall((2.0, 0.1), (2.0, 3.0)), wall((3.9, -0.1), (3.9, -2.0), base=2.5)]
    got = met_at_axes(butt)
    assert got[1].start == pytest.approx((2.0, 0.0))
    assert got[1].end == pytest.approx((2.0, 3.0))
    assert [got[0].start, got[0].end, got[2].start] == [butt[0].start, butt[0].end, butt[2].start]


def test_faces_are_measured_where_they_look_into_rooms() -> None:
    walls, rooms = square()
    assumed = [w.model_copy(update={"thickness": 0.3}) for w in walls]  # 5 cm too far in, and out where nobody sees
    found = score_faces(walls, assumed, rooms)
    assert (found.found, found.position_error, found.thickness_error) == (1.0, pytest.approx(0.05), None)
    between = [wall((0.0, 0.0), (4.0, 0.0))]
    halves = [
        SpaceTruth(name=n, storey="", outline=((0, a), (4, a), (4, b), (0, b)), area=1, base=0, height=2.5)
        for n, a, b in (("left", 0.1, 3.0), ("right", -3.0, -0.1))
    ]
    off = shifted([between[0].model_copy(update={"thickness": 0.17})], y=0.01)
    both = score_faces(between, off, halves)
    assert (both.position_error, both.thickness_error) == (pytest.approx(0.015, abs=0.011), pytest.approx(0.03))
    assert score_faces(between, shifted(between, z=3.0), halves).found == 0.0
    turned = wall((2.0, -2.0), (2.0, 2.0))
    assert score_faces(between, [turned], halves).found == 0.0


def test_a_wall_is_right_by_what_it_shows_to_rooms() -> None:
    walls, rooms = square()
    thick = walls[0].model_copy(update={"thickness": 0.5, "start": (0.0, -0.15), "end": (4.2, -0.15)})
    wardrobe = wall((1.0, 0.7), (3.0, 0.7))
    long = walls[2].model_copy(update={"start": (9.0, 4.2)})  # goes on for more than twice its length
    got = right_walls([thick, wardrobe, walls[1], long], rooms, walls)
    assert got.tolist() == [True, False, True, True]
    assert right_walls([long], [], walls).tolist() == [False]


def test_the_evaluation_of_a_truth_by_itself_is_perfect_and_of_walls_says_how_sure_they_were(tmp_path) -> None:
    truth = truth_of(rotated_flat())
    sure = truth.model_copy(update={"walls": tuple(w.model_copy(update={"confidence": 0.9}) for w in truth.walls)})
    found = score(sure, truth, "", "", "")
    assert [s.f1 for s in (*found.boxes.space, *found.boxes.plan)] == [1.0] * 6
    assert (found.boxes.iou, found.faces.found) == (pytest.approx(1.0), 1.0)
    assert (found.faces.position_error, found.faces.thickness_error) == (pytest.approx(0), pytest.approx(0))
    assert found.wall_reliability is not None
    assert found.wall_reliability.expected_calibration_error == pytest.approx(0.1)
    write_truth(tmp_path / "truth.json", sure)
    assert {w.confidence for w in read_truth(tmp_path / "truth.json").walls} == {None}


def test_reliabilities_of_several_models_are_pooled_by_number() -> None:
    one, other = reliability([0.95] * 3, [True] * 3), reliability([0.92, 0.15], [False, False])
    both = pooled([one, None, other])
    assert both is not None
    assert [(b.count, b.right) for b in both.bins] == [(1, 0.0), (4, 0.75)]
    whole = reliability([0.95] * 3 + [0.92, 0.15], [True] * 3 + [False] * 2)
    assert whole is not None
    assert both.expected_calibration_error == pytest.approx(whole.expected_calibration_error)
    assert pooled([None]) is None
