"""The semantic model of whole scenes: made of what the stages found, with names, ids and evidence."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest
from modelled import Modelled, merged_scan, model_of, modelled, scan_of
from synthetic import Scanned, rotated_flat, scanned, two_rooms, two_storeys

from scan2bim.errors import PrecheckError
from scan2bim.model.elements import Building, Dimension, Door, Element, Opening, Window
from scan2bim.model.io import dump_building, load_building
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Scene

SPEC = ScannerSpec(step=math.radians(0.7))
SCENES: dict[str, Scene] = {"two storeys": two_storeys(0.4), "flat": rotated_flat()}


@pytest.fixture(params=list(SCENES), scope="module")
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def truth(name: str) -> Scanned:
    return scanned(SCENES[name], SPEC)


@pytest.fixture(scope="module")
def model(name: str) -> Modelled:
    return modelled(SCENES[name], SPEC)


@pytest.fixture(scope="module")
def building(model: Modelled) -> Building:
    return model.building


def elements(building: Building) -> list[Element]:
    """All elements: of storeys, of walls, of openings."""
    found: list[Element] = []
    for storey in building.storeys:
        found += [*storey.walls, *storey.spaces, *storey.slabs, *storey.coverings, *storey.columns, *storey.stairs]
    openings = [o for s in building.storeys for w in s.walls for o in w.openings]
    return [*found, *openings, *(o.fill for o in openings if o.fill is not None)]


def dimensions(element: Element) -> list[Dimension]:
    return [value for _, value in element if isinstance(value, Dimension)]


def test_everything_that_was_found_is_in_the_model(building: Building, model: Modelled) -> None:
    assert len(building.storeys) == len(model.structure.storeys)
    for storey, shape in zip(building.storeys, model.structure.storeys, strict=True):
        assert (len(storey.walls), len(storey.spaces)) == (len(shape.walls), len(shape.spaces))
    assert sum(len(w.openings) for s in building.storeys for w in s.walls) == len(model.openings)


def test_storeys_have_their_true_elevation_and_height(building: Building, truth: Scanned) -> None:
    for storey, true in zip(building.storeys, truth.truth.storeys, strict=True):
        assert storey.elevation.value == pytest.approx(true.elevation, abs=0.01)
        assert storey.height is not None
        assert storey.height.value == pytest.approx(true.height, abs=0.01)


def test_ids_and_names_are_unique(building: Building) -> None:
    ids = [e.id for e in elements(building)] + [s.id for s in building.storeys] + [s.id for s in building.scans]
    assert len(set(ids)) == len(ids)
    by_kind = itertools.groupby(sorted((type(e).__name__, e.name) for e in elements(building)))
    assert all(len(list(same)) == 1 for _, same in by_kind)


def test_the_same_scans_give_the_same_ids_and_another_order_the_same_ids_of_the_rooms() -> None:
    sweeps = scanned(two_rooms(0.4), SPEC).sweeps
    first, again = (model_of([scan_of(sweep) for sweep in sweeps]).building for _ in range(2))
    assert first == again
    turned = model_of([scan_of(sweep) for sweep in reversed(sweeps)]).building
    assert {s.id for s in turned.storeys} == {s.id for s in first.storeys}
    assert {s.id for s in turned.scans} == {s.id for s in first.scans}


def test_the_model_survives_json_without_loss(building: Building, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_text(dump_building(building), encoding="utf-8")
    assert load_building(path) == building


def test_every_element_tells_its_evidence_in_words(building: Building) -> None:
    for element in elements(building):
        assert element.evidence.sentence, element.name
        assert 0.0 < element.confidence < 1.0, element.name


def test_evidence_names_scans_of_the_building(building: Building) -> None:
    known = {scan.id for scan in building.scans}
    for element in elements(building):
        assert set(element.evidence.scans) <= known
    for storey in building.storeys:
        for wall in storey.walls:
            assert wall.evidence.scans
            assert wall.evidence.points > 100


def test_scans_keep_name_file_points_and_position(building: Building, truth: Scanned) -> None:
    assert [s.name for s in building.scans] == [s.name for s in truth.sweeps]
    for source, sweep in zip(building.scans, truth.sweeps, strict=True):
        assert source.file == f"{sweep.name}.e57"
        assert source.points == len(sweep.xyz)
        assert source.position == pytest.approx(tuple(sweep.translation), abs=1e-5)


def test_a_thickness_is_measured_where_both_faces_were_seen_and_else_assumed(building: Building) -> None:
    sources = set[str]()
    for storey in building.storeys:
        for wall in storey.walls:
            between = bool(wall.left_spaces and wall.right_spaces)
            assert wall.thickness.source == ("measured" if between else "assumed")
            assert wall.evidence.faces_seen == (2 if between else 1)
            assert wall.external is (None if between else True)
            assert ("thickness assumed" in wall.evidence.sentence) is not between
            sources.add(wall.thickness.source)
    assert sources == {"measured", "assumed"}


def test_only_what_was_measured_has_a_sigma(building: Building) -> None:
    for element in elements(building):
        for dimension in dimensions(element):
            assert (dimension.sigma is not None) == (dimension.source == "measured"), element.name


def test_spaces_lie_beside_walls_and_walls_name_them(building: Building) -> None:
    for storey in building.storeys:
        known = {space.id for space in storey.spaces}
        beside = {i for wall in storey.walls for i in (*wall.left_spaces, *wall.right_spaces)}
        assert beside == known
        for wall in storey.walls:
            assert not set(wall.left_spaces) & set(wall.right_spaces)


def test_walls_join_walls_of_their_storey(building: Building) -> None:
    for storey in building.storeys:
        known = {wall.id for wall in storey.walls}
        for wall in storey.walls:
            assert wall.joins
            for join in wall.joins:
                assert join.wall in known - {wall.id}
                assert join.kind == ("T" if join.other_at == "path" else "L")


def test_doors_hang_in_openings_with_their_state(building: Building, truth: Scanned) -> None:
    doors = [o.fill for s in building.storeys for w in s.walls for o in w.openings if isinstance(o.fill, Door)]
    true = [d for d in truth.truth.doors if d.state in ("open", "closed")]
    assert len(true) <= len(doors)
    for door in doors:
        said = "sides and head" if door.state == "closed" else "looked through"
        assert said in door.evidence.sentence


def test_openings_lie_within_their_wall(building: Building) -> None:
    for storey in building.storeys:
        for wall in storey.walls:
            length = math.dist(wall.start, wall.end)
            for opening in wall.openings:
                assert opening.offset.value + opening.width.value < length + 0.01
                assert opening.sill.value + opening.height.value <= wall.height.value + 0.01


def test_a_space_has_its_area_and_volume(building: Building, truth: Scanned) -> None:
    spaces = [space for storey in building.storeys for space in storey.spaces]
    assert sorted(s.area for s in spaces) == pytest.approx(sorted(s.area for s in truth.truth.spaces), rel=0.02)
    for space in spaces:
        assert space.volume == pytest.approx(space.area * space.height.value, rel=1e-3)
        assert space.height.source == "measured"


def test_every_space_with_a_seen_ceiling_has_a_covering_there(building: Building, truth: Scanned) -> None:
    for storey, true in zip(building.storeys, truth.truth.storeys, strict=True):
        assert len(storey.coverings) == len(storey.spaces)
        for covering in storey.coverings:
            assert covering.top.value - covering.thickness.value == pytest.approx(
                true.elevation + true.height, abs=0.01
            )


def test_a_floor_slab_carries_each_storey_and_its_thickness_is_measured_between_two(building: Building) -> None:
    for number, storey in enumerate(building.storeys):
        assert storey.slabs
        for slab in storey.slabs:
            assert slab.top.value == pytest.approx(storey.elevation.value, abs=1e-3)
            assert slab.use == ("FLOOR" if number else "BASESLAB")
            assert slab.thickness.source == ("measured" if number else "assumed")
            if number:
                assert slab.thickness.value == pytest.approx(0.25, abs=0.01)


def test_windows_and_doors_are_fills_of_their_kind() -> None:
    kinds = {"door": Door, "window": Window, "passage": type(None)}
    for scene in SCENES.values():
        model = modelled(scene, SPEC)
        openings = _openings(model.building)
        assert [type(o.fill) for o in openings] == [kinds[o.kind] for o in model.openings]


def test_a_building_without_ceiling_says_so_and_assumes_heights() -> None:
    points = scanned(two_rooms(0.4), SPEC).points()
    model = model_of([merged_scan(points[points[:, 2] < 2.3])])
    (storey,) = model.building.storeys
    assert storey.height is None
    assert any("no ceiling was seen" in note for note in model.building.notes)
    assert len(storey.spaces) == 2
    assert {space.height.source for space in storey.spaces} == {"assumed"}
    assert not storey.coverings


def test_a_cloud_without_a_floor_to_stand_on_is_refused() -> None:
    points = scanned(two_rooms(0.4), SPEC).points()
    with pytest.raises(PrecheckError, match="No floor was found"):
        model_of([merged_scan(points[points[:, 2] > 0.3])])


def _openings(building: Building) -> list[Opening]:
    return [o for storey in building.storeys for wall in storey.walls for o in wall.openings]
