"""The benchmark commands' own sums, on known answers."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # the commands are scripts and import each other as such

import ablation
import clouds
import cost
import decode
import document
import experiments
import invariance
import numpy as np
import shapely
import tower
from bench import OpenDoors
from bench_truth import bench_truth
from made_up_ifc import write_ifc
from made_up_plans import make_building
from measure import Cost, measure

from scan2bim.evaluate.report import score
from scan2bim.truth.ifc import read_ifc
from scan2bim.truth.values import DoorTruth, Truth

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


def test_an_ablation_adds_up_its_scenes() -> None:
    one = ablation.Count(1, 2, 3, 4, 1, 3, (0.8, 0.9, 0.9, 1.0))
    none = ablation.Count(0, 1, 0, 0, 0, 0, ())
    text = ablation.report({"all": [one, none], "nothing": [none]}, ["a", "b"])
    assert "| all | 1 of 3 | 3 of 4 | 1 | 0.67 | 0.75 | 0.90 |" in text
    assert "| nothing | 0 of 1 | 0 of 0 | 0 | 0.00 | – | – |" in text


def test_experiments_stand_beside_the_papers_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiments, "IMAGES", tmp_path)
    doors = tuple(_hall_door(i, name) for i, (name, *_) in enumerate(experiments.PAPER_TABLE))
    truth, model = Truth(scene="hall", doors=doors), Truth(scene="model", doors=doors[:17])
    scores = score(model, truth, "", "", "")
    runs = [experiments.Run(kind, 101, "full", scores, "") for kind in ("office", "hall", "sweep")]
    text = experiments.report([*runs, experiments.Run("hall", 102, "full", None, "it broke")], 2, 101)
    assert "| hall, full | 1 | 17 of 18 | 0 | 1.0000 | 1.0000 |" in text
    assert "| wall 12 door 1 | 0.9945 | 0.9952 | 0.0388 | 0.0103 | 0 of 1 | – |" in text
    assert "| 10% to 20% | 18 | 17 |" in text
    assert "17 of 18 doors with at most 30 % of their outline hidden found" in text
    assert "hall 102 (full): it broke" in text
    assert {path.name for path in tmp_path.iterdir()} == {f"experiments_{n}.svg" for n in ("7b", "7c", "sweep")}


def test_the_papers_table_has_the_means_that_the_paper_states() -> None:
    columns = list(zip(*(row[1:] for row in experiments.PAPER_TABLE), strict=True))
    assert [sum(c) / 18 for c in columns] == pytest.approx(experiments.PAPER_HALL, abs=6e-4)


def _hall_door(i: int, name: str) -> DoorTruth:
    corners = ((2.0 * i, 0.0, 0.0), (2.0 * i + 1, 0.0, 0.0), (2.0 * i + 1, 0.0, 2.0), (2.0 * i, 0.0, 2.0))
    known = {"storey": "", "wall": "w", "sill": 0.0, "state": "closed", "occlusion": 0.15}
    return DoorTruth(name=name, corners=corners, width=1.0, height=2.0, **known)


def test_a_benchs_truth_becomes_ours(tmp_path: Path) -> None:
    opening = {
        "guid": "d",
        "storey": None,
        "host_wall": "w",
        "corners": [[0, 0, 0], [1, 0, 0], [1, 0, 2], [0, 0, 2]],
        "width": 1.0,
        "height": 2.0,
        "sill": 0.0,
        "visible": 0.75,
        "observable": True,
    }
    door = {**opening, "state": "open", "angle": 90.0, "hinge": "u1", "leaves": 1, "opens_to": [0.0, 1.0]}
    wall = {"guid": "w", "storey": "", "z0": 0.0, "height": 3.0, "exposed_m2": 8.0, "seen_m2": 6.0, "curtain": False}
    line = {"centreline": [[[0, 0], [4, 0], 0.2], [[4, 0], [4, 3], 0.2]], "observable": True}
    square = [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]
    known: dict[str, Any] = {
        "storeys": [{"guid": "s", "occupied": True, "floor": 0.02}, {"guid": "r", "occupied": False, "floor": None}],
        "walls": [{**wall, **line}, {**wall, **line, "guid": "c", "curtain": True}],
        "doors": [door],
        "windows": [],
        "openings": [{**opening, "observable": False}],
        "spaces": [{"guid": "a", "storey": "s", "polygons": [square], "z0": 0.0, "height": 2.6}],
        "stations": [{"name": "scan_000", "pos": [1.0, 1.0, 1.5], "room": "a"}],
    }
    (tmp_path / "truth.json").write_text(json.dumps(known))
    truth = bench_truth(tmp_path / "truth.json")
    assert [(w.name, w.occlusion) for w in truth.walls] == [("w", 0.25), ("w 1", 0.25), ("c", 1.0), ("c 1", 1.0)]
    (found,) = truth.doors
    assert (found.hinge, found.swing, found.state, found.occlusion) == ("end", "left", "open", 0.25)
    assert found.angle == pytest.approx(1.5708, abs=1e-4)
    assert (truth.openings[0].occlusion, truth.spaces[0].area, len(truth.storeys)) == (1.0, 4.0, 1)


def test_a_model_brought_back_is_the_same_and_other_walls_are_counted() -> None:
    ends = np.array([[[0.0, 0.0], [4.0, 0.0]], [[4.0, 0.0], [4.0, 3.0]], [[4.0, 3.0], [0.0, 3.0]]])
    room = shapely.box(0, 0, 4, 3)
    plan = invariance.Plan(ends, np.full(3, 0.2), np.zeros(3), ((room, 0.0),))
    shift = np.array([1000.0, 2000.0, 5.0])
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    turned = ends[::-1, ::-1] @ turn.T + shift[:2]
    away = invariance.Plan(
        turned, np.full(3, 0.2), np.full(3, 5.0), ((shapely.transform(room, lambda p: p @ turn.T + shift[:2]), 5.0),)
    )
    back = invariance.brought_back(away, float(np.arctan2(0.6, 0.8)), shift)
    assert invariance.agreement(plan, back) == invariance.Agreement((3, 3), 3, 1.0, (1, 1), 1)
    shorter = ends.copy()
    shorter[0, 1, 0] = 2.0
    thicker = invariance.Plan(shorter, np.array([0.2, 0.22, 0.2]), np.zeros(3), ())
    found = invariance.agreement(plan, thicker)
    assert (found.same, found.length, found.spaces) == (1, pytest.approx(6 / 11, abs=0.01), (1, 0))


def test_a_station_is_written_as_it_was_read(tmp_path: Path) -> None:
    station = invariance.station_of(SAMPLE / "station_1.e57")
    invariance.write_station(station, tmp_path / "again.e57")
    again = invariance.station_of(tmp_path / "again.e57")
    assert np.abs(again.world() - station.world()).max() < 1e-4
    assert again.records.keys() == station.records.keys()


@pytest.mark.parametrize("seed", [3, 1002])
def test_a_made_up_building_is_drawn_as_planned(seed: int, tmp_path: Path) -> None:
    building = make_building(seed)
    write_ifc(building, tmp_path / "model.ifc", np.random.default_rng(seed))
    drawn = read_ifc(tmp_path / "model.ifc").truth
    holes = [hole for level in building.levels for wall in level.walls for hole in wall.holes]
    assert len(drawn.storeys) == len(building.levels)
    assert len(drawn.doors) == sum(hole.kind == "door" for hole in holes)
    assert len(drawn.windows) == sum(hole.kind == "window" for hole in holes)
    assert sum(space.area for space in drawn.spaces) == pytest.approx(
        sum(room.area for level in building.levels for room, _ in level.rooms), rel=1e-3
    )
    for level in building.levels:  # no two rooms overlap, and doors suffice to reach them all
        rooms = [room for room, _ in level.rooms]
        assert shapely.union_all(rooms).area == pytest.approx(sum(room.area for room in rooms))
        assert sum(hole.kind != "window" for wall in level.walls for hole in wall.holes) >= len(rooms) - 1
