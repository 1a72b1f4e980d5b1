from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from scan2bim.cloud.frame import SurveyFrame, Up, up_rotation
from scan2bim.cloud.scan import Pose, ScanHeader

AXES: tuple[Up, ...] = get_args(Up)


def header(pose: Pose | None = None, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> ScanHeader:
    return ScanHeader(Path("a.e57"), 0, "a", 10, np.array(origin), pose)


@pytest.mark.parametrize("up", AXES)
def test_the_axis_that_points_up_becomes_z_by_a_proper_rotation(up: Up) -> None:
    rotation = up_rotation(up)
    axis = np.eye(3)["xyz".index(up[-1])] * (-1.0 if up.startswith("-") else 1.0)
    np.testing.assert_array_equal(rotation @ axis, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_point_goes_through_origin_pose_unit_up_and_shift_in_this_order() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    pose = Pose(turn, np.array([1000.0, 2000.0, 3000.0]))
    scan = header(pose, (10.0, 20.0, 30.0))
    frame = SurveyFrame(0.001, "y", (1.0, 0.5, 2.0))
    matrix, offset = frame.of_scan(scan)
    point = np.array([1.0, 2.0, 3.0])
    common = turn @ (scan.origin + point) + pose.translation
    expected = 0.001 * up_rotation("y") @ common - np.array(frame.shift)
    np.testing.assert_allclose(matrix @ point + offset, expected, atol=1e-12)


def test_without_a_pose_only_the_origin_is_put_back() -> None:
    matrix, offset = SurveyFrame(shift=(500_000.0, 0.0, 0.0)).of_scan(header(origin=(500_010.0, 4.0, 5.0)))
    np.testing.assert_allclose(matrix @ np.array([1.0, 2.0, 3.0]) + offset, [11.0, 6.0, 8.0])


def test_the_scanner_stands_where_its_pose_says() -> None:
    pose = Pose(np.eye(3), np.array([3.0, 4.0, 5.0]))
    np.testing.assert_allclose(SurveyFrame(1.0, "-z", (1.0, 1.0, 1.0)).position_of(header(pose)), [2.0, -5.0, -6.0])


def test_the_position_of_a_scan_without_pose_is_refused() -> None:
    with pytest.raises(ValueError, match="no pose"):
        SurveyFrame().position_of(header())


def test_json_keeps_every_digit() -> None:
    frame = SurveyFrame(1200 / 3937, "-x", (500_123.1, 1e-9, -4.0), "EPSG:25832", ("a note", "another"))
    assert SurveyFrame.from_json(frame.to_json()) == frame
