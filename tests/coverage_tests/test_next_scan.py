"""Where to scan next: places that would see what is missing, and do."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import shapely
from modelled import Modelled, model_of, modelled, scan_of
from numpy.typing import NDArray
from synthetic import COARSE, FINE, l_shaped, scanned, two_rooms, write_scene

from scan2bim.cli import main
from scan2bim.cloud.ingest import ingest_scan
from scan2bim.cloud.surfels import make_surfels
from scan2bim.config import ReadSettings, SurfelSettings
from scan2bim.coverage.measure import covered
from scan2bim.coverage.next_scan import plan_scans, scan_coordinates
from scan2bim.model.coverage import coverage_of
from scan2bim.model.elements import Frame
from scan2bim.model.survey_plan import Proposal, SurveyPlan
from scan2bim.report.raster import sheet_image
from scan2bim.report.survey_sheet import survey_sheet
from scan2bim.simulate.scene import Box, Scene, Station

YAW = 0.3


def with_stations(scene: Scene, *places: tuple[float, float, float]) -> Scene:
    return replace(scene, stations=tuple(Station(f"s{i}", place, 0.3) for i, place in enumerate(places)))


def in_scene(proposal: Proposal, scene: Scene) -> NDArray[np.float64]:
    """Its place in the scene's own frame."""
    return (np.array(proposal.position) - scene.placement.offset) @ scene.placement.rotation()


def true_coverage(whole: Modelled, scene: Scene, folder: Path) -> float:
    """Share of the true building's faces, those of its model from all stations, that a scene's stations see."""
    folder.mkdir()
    parts: list[Path] = []
    for i, sweep in enumerate(scanned(scene, COARSE).sweeps):
        scan, part = scan_of(sweep), folder / f"scan{i}"
        part.mkdir()
        ingest_scan(scan.header, iter([scan.chunk]), i, whole.frame, part, ReadSettings(), lambda _: None)
        parts.append(part)
    make_surfels(parts, folder, SurfelSettings(), lambda _: None)
    found = coverage_of(covered(whole.building, folder, parts))
    assert found is not None
    return found.total.seen


@pytest.fixture(scope="module")
def half() -> tuple[Scene, Modelled, SurveyPlan]:
    """The flat of two rooms, its east room never stood in: only seen through the door."""
    scene = with_stations(two_rooms(YAW), (2.2, 1.9, 1.55))
    model = model_of([scan_of(sweep) for sweep in scanned(scene, FINE).sweeps])
    return scene, model, plan_scans(model.building, model.cloud, 2)


def test_the_first_proposal_stands_in_the_room_that_nobody_stood_in(half: tuple[Scene, Modelled, SurveyPlan]) -> None:
    scene, _, plan = half
    x, y, z = in_scene(plan.proposals[0], scene)
    assert 4.3 < x < 8.2
    assert 0.2 < y < 4.1
    assert z == pytest.approx(1.55, abs=0.05)


def test_it_raises_the_coverage_more_than_places_by_chance_do(
    half: tuple[Scene, Modelled, SurveyPlan], tmp_path: Path
) -> None:
    scene, _, plan = half
    whole = modelled(two_rooms(YAW))
    first = scene.stations[0].position
    rng = np.random.default_rng(1)
    free = shapely.union_all([shapely.box(0.6, 0.6, 3.7, 2.6), shapely.box(4.7, 0.6, 7.8, 3.4)])
    tried = [p for p in rng.uniform((0.6, 0.6), (7.8, 3.4), (40, 2)).tolist() if free.contains(shapely.Point(p))][:6]
    by_chance = [
        true_coverage(whole, with_stations(scene, first, (x, y, 1.55)), tmp_path / f"chance{i}")
        for i, (x, y) in enumerate(tried)
    ]
    x, y, z = in_scene(plan.proposals[0], scene).tolist()
    proposed = true_coverage(whole, with_stations(scene, first, (x, y, z)), tmp_path / "proposed")
    assert proposed > np.mean(by_chance) + 0.03
    assert proposed > np.median(by_chance)
    assert proposed >= max(by_chance) - 0.05


def test_behind_a_screen_in_a_scanned_room_a_station_is_proposed_that_sees_what_it_hides(tmp_path: Path) -> None:
    (storey,) = two_rooms(YAW).storeys
    screen = Box("screen", (1.2, 0.9), (1.6, 0.08, 1.7))
    scene = replace(two_rooms(YAW), storeys=(replace(storey, boxes=(*storey.boxes, screen)),))
    model = modelled(scene)
    plan = plan_scans(model.building, model.cloud, 1)
    best = plan.proposals[0]
    x, y, _ = in_scene(best, scene)
    assert x < 3.7
    assert y < 1.5, "not on the side that it was seen from"
    assert best.gain > 2.0
    assert best.unknown == 0.0
    assert any(sight.words.startswith("Wall ") for sight in best.sees)
    z = in_scene(best, scene)[2]
    before = true_coverage(model, scene, tmp_path / "before")
    after = true_coverage(
        model, replace(scene, stations=(*scene.stations, Station("new", (x, y, z)))), tmp_path / "after"
    )
    area = coverage_of(model.building)
    assert area is not None
    assert (after - before) * area.total.area > 0.5 * (best.gain - best.unknown)


def test_nothing_is_proposed_where_everything_was_seen() -> None:
    scene = replace(
        with_stations(two_rooms(YAW), *((x, y, 1.55) for x in (0.7, 3.3, 5.0, 7.6) for y in (0.7, 3.3))),
        storeys=tuple(replace(s, boxes=()) for s in two_rooms().storeys),
    )
    model = modelled(scene)
    assert plan_scans(model.building, model.cloud, 3).proposals == ()


def test_nothing_is_proposed_out_of_doors_even_if_no_scanner_tells_of_pulses_that_did_not_return() -> None:
    (storey,) = two_rooms(YAW).storeys
    south, *walls = storey.walls
    open_entrance = replace(south, doors=(replace(south.doors[0], angle=1.6),))
    ground = Box("ground", (4.2, -4.4), (16.0, 8.0, 0.1), base=-0.1)
    tree = Box("tree", (2.0, -6.0), (0.4, 0.4, 4.0))
    scene = replace(
        with_stations(two_rooms(YAW), *((x, y, 1.55) for x in (0.9, 3.3, 5.0, 7.6) for y in (0.7, 3.3))),
        storeys=(replace(storey, walls=(open_entrance, *walls), boxes=(ground, tree)),),
    )
    sweeps = [replace(sweep, miss_directions=np.zeros((0, 3))) for sweep in scanned(scene, FINE).sweeps]
    model = model_of([scan_of(sweep) for sweep in sweeps])
    assert all(proposal.space is not None for proposal in plan_scans(model.building, model.cloud, 3).proposals)


def test_proposals_keep_clear_of_walls_and_furniture() -> None:
    scene = l_shaped(YAW)
    model = model_of([scan_of(sweep) for sweep in scanned(replace(scene, stations=scene.stations[:2]), FINE).sweeps])
    plan = plan_scans(model.building, model.cloud, 4)
    things = [shapely.box(b.centre[0] - b.size[0] / 2, b.centre[1] - b.size[1] / 2, b.centre[0] + b.size[0] / 2,
                          b.centre[1] + b.size[1] / 2) for b in scene.storeys[0].boxes if not b.yaw]  # fmt: skip
    walls = [shapely.LineString([w.start, w.end]).buffer(w.thickness / 2) for w in scene.storeys[0].walls]
    assert plan.proposals
    for proposal in plan.proposals:
        place = shapely.Point(in_scene(proposal, scene)[:2])
        assert min(place.distance(wall) for wall in walls) > 0.25
        assert min((place.distance(thing) for thing in things), default=1.0) > 0.2 or proposal.space is None


def test_positions_are_those_of_the_scans_files() -> None:
    frame = Frame(unit=0.001, up="y", shift=(1000.0, 2000.0, 0.0))
    assert scan_coordinates(np.array([1.0, 2.0, 3.0]), frame) == pytest.approx((1_001_000.0, 3000.0, -2_002_000.0))


def test_the_plan_is_drawn(half: tuple[Scene, Modelled, SurveyPlan]) -> None:
    _, model, plan = half
    image = sheet_image(survey_sheet(model.building, plan))
    for colour in ((214, 20, 30), (0, 110, 60)):
        assert (image == colour).all(2).sum() > 50


def test_the_command_reads_scans_a_work_folder_and_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_scene(tmp_path / "scans", with_stations(two_rooms(YAW), (2.2, 1.9, 1.55)), FINE)
    out = tmp_path / "next.json"
    assert (
        main(["next-scan", str(tmp_path / "scans"), "-o", str(out), "-o", str(out.with_suffix(".png")), "--quiet"]) == 0
    )
    text = capsys.readouterr().out
    plan = SurveyPlan.model_validate_json(out.read_text(), strict=True)
    assert plan.proposals[0].storey_name in text and f"{plan.proposals[0].gain:.1f} m2" in text
    picture = cv2.imread(str(out.with_suffix(".png")))
    assert picture is not None and picture.shape[0] > 300
    work = tmp_path / ".next.scan2bim-work"
    for path in (work, tmp_path / "next.json"):
        again = tmp_path / "again.json"
        assert main(["next-scan", str(path), "-o", str(again), "--json", "--count", "1"]) == 0
        printed = json.loads(capsys.readouterr().out)
        assert printed["proposals"][0] == json.loads(out.read_text())["proposals"][0]


@pytest.mark.parametrize(("name", "said"), [("plan.txt", "ending in .json"), ("plan.json", "work folder")])
def test_what_it_cannot_do_is_said(name: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.json").write_text("{}")
    assert main(["next-scan", str(tmp_path / "model.json"), "-o", str(tmp_path / name), "--quiet"]) == 2
    assert said in capsys.readouterr().err
