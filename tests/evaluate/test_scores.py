from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from buildings import building

from scan2bim.cli import main
from scan2bim.evaluate.areas import BETAS, area_measures, f_beta
from scan2bim.evaluate.frames import moved
from scan2bim.evaluate.matching import overlap, pair
from scan2bim.evaluate.openings import asked_for, score_doors, score_openings
from scan2bim.evaluate.reliability import reliability
from scan2bim.evaluate.report import evaluate, in_words, score
from scan2bim.evaluate.rooms import score_spaces, score_walls
from scan2bim.exporters.ifc import export
from scan2bim.simulate.scenes import rotated_flat
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.ifc import read_ifc
from scan2bim.truth.io import write_truth
from scan2bim.truth.values import DoorTruth, OpeningTruth, Truth


def door(x: float = 1.0, width: float = 1.0, height: float = 2.0, *, y: float = 0.0, **more) -> DoorTruth:
    """In a wall along x."""
    corners = ((x, y, 0.0), (x + width, y, 0.0), (x + width, y, height), (x, y, height))
    known = {"name": f"door at {x}", "storey": "", "wall": "w", "sill": 0.0, "state": "closed", **more}
    return DoorTruth(corners=corners, width=width, height=height, **known)


def turned(one: DoorTruth, **more) -> DoorTruth:
    """The same rectangle, the wall running the other way."""
    a, b, c, d = one.corners
    return one.model_copy(update={"corners": (b, a, d, c), **more})


def test_the_papers_measures_are_those_of_its_equations() -> None:
    # Found 10 cm too far right and 20 cm too high: 0.9 x 2.0 m are right.
    found = overlap(door(), door(1.1, 1.0, 2.2))
    assert found is not None
    got = area_measures(found)
    tp, fp, fn = 1.8, 2.2 - 1.8, 2.0 - 1.8
    assert got.precision == pytest.approx(tp / (tp + fp))
    assert got.recall == pytest.approx(tp / (tp + fn))
    assert got.absolute_error == pytest.approx(fp + fn)
    assert got.relative_error == pytest.approx((fp + fn) / (fp + tp))
    assert f_beta(0.5, 1.0, 1.0) == pytest.approx(2 / 3)
    assert f_beta(0.5, 1.0, 3.0) == pytest.approx(10 * 0.5 / (9 * 0.5 + 1))
    assert (BETAS[0], BETAS[len(BETAS) // 2], BETAS[-1]) == (pytest.approx(1 / 3, abs=1e-4), 1.0, 3.0)


def test_an_opening_in_another_wall_is_another_opening() -> None:
    assert overlap(door(), door(y=0.2)) is not None
    assert overlap(door(), door(y=0.3)) is None
    across = door().model_copy(update={"corners": ((1.5, -0.5, 0), (1.5, 0.5, 0), (1.5, 0.5, 2), (1.5, -0.5, 2))})
    assert overlap(door(), across) is None


def test_pairs_are_one_to_one_and_overlap_most() -> None:
    true = [door(1.0), door(2.2)]
    predicted = [door(2.1), door(1.05), door(1.2)]
    assert [(p.true, p.predicted) for p in pair(true, predicted, 0.5)] == [(0, 1), (1, 0)]


def test_detection_counts_missed_and_false_openings() -> None:
    scores = score_openings([door(1.0), door(3.0), door(5.0)], [door(1.0), door(5.3), door(8.0)])
    assert (scores.at_50.found, scores.at_50.true, scores.at_50.predicted) == (2, 3, 3)
    assert scores.at_75.found == 1
    assert scores.at_50.f1 == pytest.approx(2 / 3)
    assert scores.false == ("door at 8.0",)
    assert [one.found_as for one in scores.each] == ["door at 1.0", "", "door at 5.3"]
    assert scores.errors is not None
    assert scores.errors.along == pytest.approx(0.15)


def test_doors_are_scored_by_state_and_passages_are_neither_right_nor_wrong() -> None:
    true = [door(1.0), door(3.0, state="open"), door(5.0, state="ajar"), door(7.0, state="passage")]
    predicted = [door(1.0), door(3.0, state="closed"), door(5.0, state="open"), door(7.0, state="open"), door(9.0)]
    scores = score_doors(true, predicted, [])
    assert (scores.at_50.found, scores.at_50.true, scores.at_50.predicted) == (3, 3, 4)
    assert (scores.closed.found, scores.closed.true, scores.closed.right, scores.closed.predicted) == (1, 1, 2, 3)
    assert (scores.open.found, scores.open.true, scores.open.right, scores.open.predicted) == (2, 2, 1, 1)
    assert (scores.state.right, scores.state.stated, scores.state.of) == (2, 3, 3)
    assert (scores.passages, scores.passages_as_doors, scores.passages_found) == (1, 1, 0)
    assert score_doors(true, [], [door(7.0)]).passages_found == 1


def test_hinge_and_swing_are_right_however_the_wall_runs() -> None:
    true = [door(1.0, hinge="start", swing="left"), door(3.0, hinge="end", swing="right")]
    same = [turned(true[0], hinge="end", swing="right"), turned(true[1], hinge="end", swing="unknown")]
    scores = score_doors(true, same, [])
    assert (scores.hinge.right, scores.hinge.stated) == (1, 2)
    assert (scores.swing.right, scores.swing.stated, scores.swing.of) == (1, 1, 2)


def test_doors_that_are_hidden_much_are_left_out_of_the_visible_ones() -> None:
    true = [door(1.0, occlusion=0.1), door(3.0, occlusion=0.5), door(5.0, occlusion=0.3)]
    visible = score_openings(true, [door(1.0), door(3.0)]).visible
    assert visible is not None
    assert (visible.found, visible.true, visible.predicted) == (1, 2, 1)


def test_what_nobody_saw_and_what_lies_in_a_glazed_front_counts_neither_way() -> None:
    true = [door(1.0), door(3.0, occlusion=0.9), door(9.0, occlusion=0.9)]
    front = door(5.0, 3.0, 2.5)
    asked, counted = asked_for(true, [door(1.0), door(3.0), door(5.5), door(12.0)], [front])
    assert [one.name for one in asked] == ["door at 1.0"]
    assert [one.name for one in counted] == ["door at 1.0", "door at 12.0"]


def test_calibration_error_is_the_mean_gap_weighted_by_number() -> None:
    found = reliability([0.95] * 8 + [0.55] * 2, [True] * 6 + [False] * 2 + [True] * 2)
    assert found is not None
    assert found.expected_calibration_error == pytest.approx(0.8 * abs(0.95 - 0.75) + 0.2 * abs(0.55 - 1.0))
    assert [b.count for b in found.bins] == [2, 8]
    assert reliability([1.0], [True]) is not None
    assert reliability([], []) is None


def test_a_truth_against_itself_is_all_right_and_an_empty_model_all_wrong() -> None:
    truth = truth_of(rotated_flat())
    passages = [d for d in truth.doors if d.state == "passage"]
    perfect = truth.model_copy(
        update={
            "doors": tuple(d for d in truth.doors if d.state != "passage"),
            "openings": tuple(OpeningTruth(**{k: getattr(d, k) for k in OpeningTruth.model_fields}) for d in passages),
        }
    )
    found = score(perfect, truth, "", "", "")
    assert (found.doors.at_75.f1, found.windows.at_75.f1, found.spaces.detection.f1) == (1.0, 1.0, 1.0)
    assert (found.walls.completeness_5cm, found.walls.correctness_5cm, found.walls.thickness_error) == (1.0, 1.0, 0.0)
    assert found.doors.mean is not None
    assert found.doors.mean.relative_error == pytest.approx(0.0, abs=1e-9)
    assert found.doors.passages_found == len(passages) == 1
    nothing = score(Truth(scene=""), truth, "", "", "")
    assert (nothing.doors.at_50.recall, nothing.doors.at_50.precision, nothing.walls.completeness_5cm) == (
        0.0,
        None,
        0.0,
    )
    assert "doors missed: " in in_words(nothing)


def test_walls_and_spaces_elsewhere_are_not_those_of_the_truth() -> None:
    truth = truth_of(rotated_flat())
    shift = np.eye(4)
    shift[:3, 3] = (0.03, 0.0, 0.0)
    near = moved(truth, shift)
    assert score_walls(truth.walls, near.walls).completeness_5cm == pytest.approx(1.0, abs=0.02)
    shift[:3, 3] = (0.0, 0.0, 3.0)
    far = moved(truth, shift)
    assert score_walls(truth.walls, far.walls).completeness_5cm == 0.0
    assert score_spaces(truth.spaces, far.spaces).detection.found == 0


def test_spaces_without_a_station_are_not_asked_for() -> None:
    truth = truth_of(rotated_flat())
    some = {space.name for space in truth.spaces[:2]}
    found = score_spaces(truth.spaces, truth.spaces[1:4], some).detection
    assert (found.found, found.true, found.predicted) == (1, 2, 1)


def test_a_model_is_scored_where_its_map_conversion_puts_it(tmp_path: Path) -> None:
    """The model's own frame is 500 km from the scans': the exporter writes that as a map conversion."""
    house = building()
    export(house, tmp_path / "house.ifc")
    local = evaluate(tmp_path / "house.ifc", tmp_path / "house.ifc")
    assert (local.frame, local.doors.at_75.f1) == ("as it stands", 1.0)
    shift = np.eye(4)
    shift[:3, 3] = house.frame.shift
    write_truth(tmp_path / "truth.json", moved(read_ifc(tmp_path / "house.ifc").truth, shift))
    mapped = evaluate(tmp_path / "house.ifc", tmp_path / "truth.json")
    assert (mapped.frame, mapped.doors.at_75.f1, mapped.windows.at_75.f1) == ("by its map conversion", 1.0, 1.0)
    assert mapped.spaces.detection.f1 == 1.0


def test_the_command_prints_words_or_json_and_refuses_what_is_no_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "house.ifc")
    export(building(), tmp_path / "house.ifc")
    assert main(["evaluate", path, path]) == 0
    assert "doors, IoU 0.5" in capsys.readouterr().out
    assert main(["evaluate", path, path, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["doors"]["at_50"]["found"] > 0
    assert main(["evaluate", path, str(tmp_path / "truth.txt")]) == 2
    assert "expected the truth as .json" in capsys.readouterr().err
    assert main(["evaluate", str(tmp_path / "none.ifc"), path]) == 3
