from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pye57
import pytest

import scan2bim
from scan2bim.simulate.scenes import rotated_flat
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.io import write_truth

FLAT = Path(scan2bim.__file__).parent.parent / "samples" / "flat"
STATIONS = sorted(FLAT.glob("*.e57"))


@pytest.fixture(scope="module")
def truth() -> dict[str, Any]:
    return json.loads((FLAT / "truth.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def points() -> np.ndarray[Any, np.dtype[np.float64]]:
    """All points of the sample in its common frame, (n, 3)."""
    scans: list[Any] = []
    for path in STATIONS:
        file = pye57.E57(str(path))
        data = file.read_scan(0)
        scans.append(np.column_stack([data[f"cartesian{axis}"] for axis in "XYZ"]))
        file.close()
    return np.concatenate(scans)


def test_the_sample_stays_below_six_megabytes() -> None:
    assert sum(path.stat().st_size for path in FLAT.iterdir()) < 6e6


def test_the_sample_has_one_file_a_station_with_pose_colour_and_intensity(truth: dict[str, Any]) -> None:
    assert [path.stem for path in STATIONS] == [station["name"] for station in truth["stations"]]
    for path, station in zip(STATIONS, truth["stations"], strict=True):
        file = pye57.E57(str(path))
        header = file.get_header(0)
        assert file.scan_count == 1
        assert header.has_pose()
        assert math.dist(header.translation, station["position"]) < 0.01
        fields = set(header.point_fields)
        assert {"colorRed", "intensity", "rowIndex", "columnIndex", "cartesianInvalidState"} <= fields
        assert 55_000 < header.point_count < 80_000
        file.close()


def test_the_sample_truth_is_that_of_its_scene(tmp_path: Path, truth: dict[str, Any]) -> None:
    write_truth(tmp_path / "truth.json", truth_of(rotated_flat()))
    assert json.loads((tmp_path / "truth.json").read_text(encoding="utf-8")) == truth


def test_the_sample_is_turned_against_the_axes_and_has_doors_in_every_state(truth: dict[str, Any]) -> None:
    assert math.degrees(truth["yaw"]) % 90 == pytest.approx(23.7, abs=1e-3)
    assert {door["state"] for door in truth["doors"]} == {"open", "ajar", "closed", "passage"}
    assert {door["recess"] for door in truth["doors"] if door["state"] == "closed"} >= {0.0, 0.12}
    assert len(truth["spaces"]) == 6


def test_the_floor_of_the_sample_is_where_truth_has_it(points: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    heights = points[np.abs(points[:, 2]) < 0.02, 2]
    assert len(heights) > 10_000
    assert abs(float(np.median(heights))) < 0.002


def test_walls_of_the_sample_are_where_truth_has_them(
    points: np.ndarray[Any, np.dtype[np.float64]], truth: dict[str, Any]
) -> None:
    high = points[(points[:, 2] > 2.2) & (points[:, 2] < 2.5), :2]
    for wall in truth["walls"]:
        start, end = np.array(wall["start"]), np.array(wall["end"])
        length = math.dist(start, end)
        along = (end - start) / length
        local = high - start
        x, y = local @ along, local @ np.array([-along[1], along[0]])
        near = (x > 0.4) & (x < length - 0.4) & (np.abs(y - wall["thickness"] / 2) < 0.01)
        assert near.sum() > 100, wall["name"]
        assert abs(float(np.median(y[near])) - wall["thickness"] / 2) < 0.003, wall["name"]
