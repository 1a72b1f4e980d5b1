"""The benchmark commands' own sums, on known answers."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # the commands are scripts and import each other as such

import clouds
import cost
import decode
import document
import tower
from bench import OpenDoors
from measure import Cost, measure

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "flat"


def test_a_command_rewrites_its_own_section_and_leaves_the_other(tmp_path: Path) -> None:
    path = tmp_path / "results.md"
    document.write_section("results", "first", path)
    document.write_section("cost", "dear", path)
    before = path.read_text()
    document.write_section("results", "second", path)
    assert path.read_text() == before.replace("first", "second")


def test_a_command_is_measured_with_all_its_processes() -> None:
    child = "import time; a = bytearray(80_000_000); t = time.process_time()\nwhile time.process_time() < t + 0.3: pass"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}]); sys.exit(3)"
    took = measure([sys.executable, "-c", parent])
    assert took.code == 3
    assert 0.3 <= took.cpu < 3
    assert 80e6 < took.memory < 300e6


def test_a_closed_door_counts_neither_way_among_open_doors() -> None:
    doors = OpenDoors(found=4, truth=5, false=2)
    assert (doors.recall, doors.precision, doors.f1) == (
        pytest.approx(4 / 5),
        pytest.approx(4 / 6),
        pytest.approx(8 / 11),
    )
    assert OpenDoors(0, 0, 3).f1 is None


def test_a_rough_truth_is_found_by_the_name_of_its_file(tmp_path: Path) -> None:
    storeys = [{"openings_range": [3, 5], "windows_range": [1, 2]}, {"openings_range": [10, 20]}]
    truth: dict[str, Any] = {"file": "potree_recnUabphYLem9jen.laz (lower)", "storeys": storeys}
    (tmp_path / "house.truth.json").write_text(json.dumps(truth))
    lower = clouds.rough_truth(Path("somebody+recnUabphYLem9jen.laz"), [tmp_path])
    assert lower.counts == {
        "storeys": clouds.Range(1, 1),
        "windows": clouds.Range(1, 2),
        "openings": clouds.Range(3, 5),
    }
    assert clouds.rough_truth(Path("other.laz"), [tmp_path]).counts == {}


def test_places_of_a_turned_frame_are_turned_back_and_met_once_each(tmp_path: Path) -> None:
    doors = [{"x": 0.0, "y": 10.0}, {"x": 0.0, "y": 10.3}]
    (tmp_path / "cloud.truth.json").write_text(json.dumps({"truth_frame": "x'=cos90*x-sin90*y", "doors": doors}))
    (listed,) = clouds.rough_truth(Path("cloud.laz"), [tmp_path]).listed
    assert listed.places[0] == pytest.approx((10.0, 0.0))
    assert clouds.places_met(listed.places, [(10.1, 0.0)]) == 1
    assert clouds.places_met(listed.places, [(10.1, 0.0), (10.2, 0.1)]) == 2


def test_the_growth_exponent_is_that_of_a_power_law() -> None:
    runs = [cost.Compared("x", n, Cost(1.0, 2.0 * n**1.2, 1.0, 0), 1.0, {}) for n in (1000, 10_000)]
    assert cost.exponent(runs[0], runs[1]) == pytest.approx(1.2)


def test_the_yardstick_decodes_every_record() -> None:
    from scan2bim.readers.e57 import read_headers

    path = SAMPLE / "station_1.e57"
    assert decode.decode_e57(path) == sum(header.points for header in read_headers(path))


def test_flats_stand_in_rows_on_storeys_without_gaps() -> None:
    assert tower.places(20)[-1] == tower.Place(4, 3)
    assert {place.above for place in tower.places(2)} == {0, 1}
    assert all(len(set(tower.places(n))) == n for n in cost.SIZES)
