"""Of each face that bounds a space: what was seen, what was hidden, what was never looked at."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from modelled import Modelled, Scan, merged_scan, model_of, modelled, scan_of
from synthetic import FINE, scanned, two_rooms, two_storeys

from scan2bim.cloud.ingest import ingest_scan
from scan2bim.cloud.scene import load_scene
from scan2bim.cloud.surfels import make_surfels
from scan2bim.commands.summary import outcome_text
from scan2bim.config import ReadSettings, SurfelSettings
from scan2bim.coverage.measure import with_coverage
from scan2bim.model.coverage import BuildingCoverage, coverage_line, coverage_of
from scan2bim.model.elements import Building, FaceView, Wall
from scan2bim.pipeline import Outcome
from scan2bim.simulate.effects import World
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.scene import Box, Scene, Station
from scan2bim.simulate.visibility import with_occlusion


def cupboard(scene: Scene) -> Scene:
    """A cupboard of 2 x 2 m stands 0.4 m before the south wall of the west room, 0.1 m deep."""
    (storey,) = scene.storeys
    box = Box("screen", (2.2, 0.6), (2.0, 0.1, 2.0))
    return replace(scene, storeys=(replace(storey, boxes=(*storey.boxes, box)),))


def inner_views(building: Building) -> list[tuple[Wall, FaceView]]:
    return [
        (wall, view)
        for storey in building.storeys
        for wall in storey.walls
        for view in wall.evidence.faces
        if (wall.left_spaces if view.side == "left" else wall.right_spaces)
    ]


def covered(building: Building) -> BuildingCoverage:
    found = coverage_of(building)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def model() -> Modelled:
    return modelled(two_rooms(0.3))


def test_the_shares_of_each_face_add_up_to_one(model: Modelled) -> None:
    views = [view for _, view in inner_views(model.building)]
    assert len(views) == 6
    assert all(math.isclose(v.seen + v.occluded + v.unseen, 1.0, abs_tol=1e-9) for v in views)
    assert all(v.area and v.area > 0.5 and v.points > 0 and v.rms is not None and v.rms < 0.02 for v in views)


def test_what_is_hidden_of_the_walls_is_what_no_ray_reaches() -> None:
    """Against the truth: rays cast from the stations at 10 cm cells of the walls' faces."""
    scene = cupboard(two_rooms(0.3))
    truth = with_occlusion(scanned(scene, FINE).truth, scene, World(build_mesh(scene)))
    hidden: dict[str, list[tuple[float, float]]] = {}
    for wall, view in inner_views(modelled(scene).building):
        hidden.setdefault(wall.id, []).append((view.area or 0.0, view.occluded + view.unseen))
    shares = sorted(sum(a * s for a, s in rows) / sum(a for a, _ in rows) for rows in hidden.values())
    true = sorted(w.occlusion for w in truth.walls if w.occlusion is not None)
    assert len(shares) == len(true) and max(true) > 0.2
    assert np.abs(np.array(shares) - true).max() < 0.08, (shares, true)


def test_a_cupboard_before_a_wall_hides_it_and_is_not_called_unseen(model: Modelled) -> None:
    bare = max(v.occluded for _, v in inner_views(model.building))
    views = [v for _, v in inner_views(modelled(cupboard(two_rooms(0.3))).building)]
    worst = max(views, key=lambda v: v.occluded)
    assert worst.occluded > bare + 0.1
    assert worst.unseen < 0.02


def test_behind_a_corner_nobody_has_a_line_so_it_is_unseen_and_not_hidden() -> None:
    """With the east station alone the west room is seen through the door only; its walls are not hidden by things."""
    scene = two_rooms(0.3)
    both = [scan_of(sweep) for sweep in scanned(scene, FINE).sweeps]
    whole = modelled(scene)
    with_east = covered(alone(whole, both[1:]))
    assert with_east.walls.unseen > 0.25
    assert with_east.walls.occluded < covered(whole.building).walls.occluded + 0.1


def alone(whole: Modelled, scans: list[Scan]) -> Building:
    """The whole model as fewer scans see it."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        parts = [folder / f"scan{i}" for i in range(len(scans))]
        for i, (scan, part) in enumerate(zip(scans, parts, strict=True)):
            part.mkdir()
            ingest_scan(scan.header, iter([scan.chunk]), i, whole.frame, part, ReadSettings(), lambda _: None)
        make_surfels(parts, folder, SurfelSettings(), lambda _: None)
        return with_coverage(whole.building, load_scene(folder, parts), parts)


def test_outer_sides_are_told_as_never_seen_and_do_not_count(model: Modelled) -> None:
    outer = [
        view
        for wall in model.building.storeys[0].walls
        for view in wall.evidence.faces
        if not (wall.left_spaces if view.side == "left" else wall.right_spaces)
    ]
    assert outer and all(view.unseen > 0.95 for view in outer)
    assert covered(model.building).total.unseen < 0.05


def test_floors_and_ceilings_are_covered_storey_by_storey() -> None:
    building = modelled(two_storeys(0.4)).building
    found = covered(building)
    for storey in building.storeys:
        assert all(slab.evidence.faces[0].side == "top" for slab in storey.slabs)
        assert all(covering.evidence.faces[0].side == "under" for covering in storey.coverings)
    spaces = sum(space.area for storey in building.storeys for space in storey.spaces)
    assert found.floors.area == pytest.approx(spaces, rel=0.05)
    assert found.ceilings.seen > 0.95
    assert 0.6 < found.floors.seen < 1.0


def test_a_cloud_without_stations_knows_seen_and_unseen_only() -> None:
    scene = scanned(two_rooms(0.3), FINE)
    found = covered(model_of([merged_scan(scene.points(), scene.colours())]).building)
    assert found.total.occluded == 0.0
    assert found.walls.seen == pytest.approx(covered(modelled(two_rooms(0.3)).building).walls.seen, abs=0.06)


def test_the_summary_tells_the_coverage_in_one_line(model: Modelled) -> None:
    line = coverage_line(model.building)
    assert line is not None and "never seen" in line and "walls" in line
    text = outcome_text(Outcome(model.building, (), (), 2, 1000, ()))
    assert sum(part.startswith("coverage: ") for part in text.splitlines()) == 1


def test_a_station_more_raises_the_coverage(model: Modelled) -> None:
    (storey,) = two_rooms(0.3).storeys
    scene = replace(two_rooms(0.3), storeys=(storey,))
    more = replace(scene, stations=(*scene.stations, Station("corner", (0.6, 0.6, 1.55))))
    assert covered(modelled(more).building).total.seen > covered(model.building).total.seen
