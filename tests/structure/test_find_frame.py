from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import room, turned

from scan2bim.cloud.frame import SurveyFrame, up_rotation
from scan2bim.cloud.scan import Chunk, Pose, ScanHeader
from scan2bim.config import UNITS, FrameSettings
from scan2bim.errors import PrecheckError
from scan2bim.structure.frame import find_frame

F64 = NDArray[np.float64]
FOOT = UNITS["ft"]


@pytest.fixture(scope="module")
def building() -> F64:
    """Two rooms of 2.5 m height in metres, z up."""
    points = np.concatenate([*room(0.0, 0.0, 6.0, 5.0), *room(6.1, 0.0, 11.0, 5.0)])
    return turned(np.random.default_rng(0).choice(points, 40_000, replace=False), 0.3)


def frame_of(
    points: F64, name: str = "a.xyz", settings: FrameSettings | None = None, unit: float | None = None
) -> SurveyFrame:
    header = ScanHeader(Path(name), 0, "a", len(points), points.mean(0), unit=unit)
    return find_frame([header], [Chunk(points - points.mean(0))], settings or FrameSettings())


def test_metres_with_z_up_need_no_remark_and_no_shift(building: F64) -> None:
    assert frame_of(building) == SurveyFrame()


@pytest.mark.parametrize(("name", "word"), [("mm", "millimetres"), ("cm", "centimetres"), ("ft", "feet")])
def test_the_unit_is_found_from_the_height_of_the_storey_and_told(building: F64, name: str, word: str) -> None:
    frame = frame_of(building / UNITS[name])
    assert frame.unit == pytest.approx(UNITS[name])
    assert any(word in note for note in frame.notes)


def test_what_the_file_states_of_its_unit_counts(building: F64) -> None:
    assert frame_of(building, unit=FOOT).unit == FOOT


def test_settings_overrule_file_and_finding(building: F64) -> None:
    assert frame_of(building * 1000, settings=FrameSettings(unit="cm")).unit == 0.01
    assert frame_of(building, unit=FOOT, settings=FrameSettings(unit="m")).unit == 1.0
    assert frame_of(building, settings=FrameSettings(up="-x")).up == "-x"


@pytest.mark.parametrize("up", ["x", "y"])
def test_an_up_axis_other_than_z_is_found_and_told(building: F64, up: Literal["x", "y"]) -> None:
    frame = frame_of(building @ up_rotation(up))
    assert frame.up == up
    assert any("up" in note for note in frame.notes)


def test_millimetres_with_y_up_are_both_found(building: F64) -> None:
    frame = frame_of(building @ up_rotation("y") * 1000)
    assert (frame.up, frame.unit) == ("y", 0.001)


def test_scanners_with_poses_stand_upright(building: F64) -> None:
    header = ScanHeader(Path("a.e57"), 0, "a", len(building), np.zeros(3), Pose(np.eye(3), np.zeros(3)))
    assert find_frame([header], [Chunk(building @ up_rotation("y"))], FrameSettings()).up == "z"


def test_large_coordinates_are_shifted_by_whole_hundreds_of_metres_to_near_the_origin(building: F64) -> None:
    moved = building + np.array([500_123.4, 5_400_321.7, 312.0])
    frame = frame_of(moved)
    assert frame.shift == (500_100.0, 5_400_300.0, 0.0)
    assert any("large" in note for note in frame.notes)
    local = moved * frame.unit - np.array(frame.shift)
    assert np.abs(local[:, :2]).max() < 70


def test_two_surveys_of_a_building_have_one_shift(building: F64) -> None:
    moved = building + np.array([500_123.4, 5_400_321.7, 312.0])
    part = moved[moved[:, 0] < np.median(moved[:, 0])]
    assert frame_of(moved).shift == frame_of(part).shift


def test_the_shift_is_in_metres_whatever_the_unit(building: F64) -> None:
    moved = (building + np.array([500_123.4, 5_400_321.7, 312.0])) * 1000
    frame = frame_of(moved)
    assert frame.unit == 0.001
    assert np.abs(moved[:, :2] * 0.001 - np.array(frame.shift[:2])).max() < 70


def test_every_scan_has_its_say_by_its_pose(building: F64) -> None:
    far = Pose(np.eye(3), np.array([2_000.0, 0.0, 0.0]))
    headers = [
        ScanHeader(Path(f"{i}.e57"), i, str(i), len(building), np.zeros(3), far, crs=crs)
        for i, crs in ((0, None), (1, "EPSG:25832"))
    ]
    frame = find_frame(headers, [Chunk(building)] * 2, FrameSettings())
    assert frame.shift[0] == 2_000.0
    assert frame.crs == "EPSG:25832"


def test_scans_without_points_are_refused() -> None:
    header = ScanHeader(Path("a.xyz"), 0, "a", 0, np.zeros(3))
    with pytest.raises(PrecheckError, match="No scan of 1 holds a valid point"):
        find_frame([header], [Chunk(np.zeros((0, 3)))], FrameSettings())
    with pytest.raises(PrecheckError, match="No scan"):
        find_frame([], [], FrameSettings())


def test_points_all_in_one_place_are_refused() -> None:
    with pytest.raises(PrecheckError, match="one place"):
        frame_of(np.full((50, 3), 4.0))


@pytest.mark.parametrize(("places", "told"), [([0.0, 0.0, 4.0], True), ([0.0, 2.0, 4.0], False), ([0.0], False)])
def test_scans_that_state_one_position_are_told(building: F64, places: list[float], told: bool) -> None:
    headers = [
        ScanHeader(Path("a.e57"), i, f"s{i}", len(building), np.zeros(3), Pose(np.eye(3), np.array([x, 0.0, 0.0])))
        for i, x in enumerate(places)
    ]
    notes = find_frame(headers, [Chunk(building)] * len(headers), FrameSettings()).notes
    assert [note for note in notes if "same scanner position" in note] == [
        note for note in notes if told and note.startswith("2 scans state")
    ]
    assert bool(notes) == told
