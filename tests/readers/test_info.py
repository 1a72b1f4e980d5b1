"""What ``info`` says of scans: sums, bounds, stations, density, problems."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from readers.writers import cloud, e57_scan, write_e57, write_las, write_text

from scan2bim.errors import InputError
from scan2bim.readers.info import as_json, describe, render, surface_density


def test_scans_of_several_files_are_summed_up(tmp_path: Path) -> None:
    pose = {"rotation": (1, 0, 0, 0), "translation": (100, 0, 0)}
    write_e57(tmp_path / "a.e57", [e57_scan(cloud(300), name="hall", **pose)])
    write_las(tmp_path / "b.laz", cloud(500), sources=np.repeat([1, 2], 250))
    report = describe([tmp_path], unit="metres", up="z")
    assert (report.files, report.points, report.positions) == (2, 800, 1)
    hall, merged = report.scans
    assert hall.position == (100, 0, 0) and hall.lower is not None and hall.lower[0] == pytest.approx(95, abs=0.1)
    assert merged.stations == 2 and merged.colour and merged.intensity and not merged.bounds_sampled
    text = render(report)
    assert "hall" in text and "100.00 0.00 0.00" in text and "2 by id" in text and "Unit: metres. Up: z." in text
    assert json.loads(as_json(report))["scans"][0]["name"] == "hall"


def test_bounds_that_no_header_states_are_those_of_a_sample(tmp_path: Path) -> None:
    points = cloud(400)
    (scan,) = describe([write_text(tmp_path / "a.xyz", points)]).scans
    assert scan.bounds_sampled and scan.lower is not None
    assert np.allclose(scan.lower, points.xyz.min(axis=0), atol=1e-4)


def test_a_file_that_cannot_be_read_is_a_problem_beside_the_others_and_an_error_alone(tmp_path: Path) -> None:
    write_text(tmp_path / "a.xyz", cloud(20))
    (tmp_path / "b.e57").write_bytes(b"ASTM-E57")
    report = describe([tmp_path])
    assert report.files == 2 and "b.e57" in report.problems[0] and "NOT READABLE" in render(report)
    with pytest.raises(InputError, match=r"b\.e57"):
        describe([tmp_path / "b.e57"])


def test_density_of_a_known_surface_is_right_within_a_third() -> None:
    rng = np.random.default_rng(1)
    floor = np.column_stack([rng.uniform(0, 40, (20_000, 2)), np.zeros(20_000)])
    assert surface_density(floor, 16_000_000) == pytest.approx(10_000, rel=0.33)


def test_points_without_a_valid_one_are_described_without_bounds(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("nan nan nan\n" * 20)
    (scan,) = describe([tmp_path / "a.xyz"]).scans
    assert scan.lower is None and scan.density is None
    assert "unknown" in render(describe([tmp_path / "a.xyz"]))
