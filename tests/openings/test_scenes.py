"""The openings of whole scenes: ray-cast scans on one side, the exact truth on the other."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from modelled import Modelled, modelled, rectangle_of, rectangle_overlap
from numpy.typing import NDArray
from synthetic import Scanned, l_shaped, rotated_flat, scanned, two_rooms, two_storeys

from scan2bim.openings.shapes import OpeningShape, load_openings, save_openings
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Box, DoorSpec, Scene
from scan2bim.truth.values import DoorTruth, WindowTruth

F64 = NDArray[np.float64]
SPEC = ScannerSpec(step=math.radians(0.7))
STREET = (
    Box("street", (4.0, 2.0), (40.0, 40.0, 0.1), base=-0.4),
    Box("house to the south", (4.0, -7.0), (30.0, 0.5, 7.0), base=-0.3),
    Box("house to the north", (4.0, 13.0), (30.0, 0.5, 7.0), base=-0.3),
    Box("house to the west", (-7.0, 4.0), (0.5, 30.0, 7.0), base=-0.3),
)
"""What one sees through the windows."""


def with_street(scene: Scene) -> Scene:
    (storey,) = scene.storeys
    return dataclasses.replace(scene, storeys=(dataclasses.replace(storey, boxes=(*storey.boxes, *STREET)),))


def with_middle_door(door: DoorSpec, yaw: float = 0.4) -> Scene:
    """``two_rooms`` with another door in the wall between them."""
    scene = two_rooms(yaw)
    (storey,) = scene.storeys
    walls = tuple(dataclasses.replace(w, doors=(door,)) if w.name == "middle wall" else w for w in storey.walls)
    return dataclasses.replace(scene, storeys=(dataclasses.replace(storey, walls=walls),))


SCENES: dict[str, Scene] = {
    "two rooms": two_rooms(0.4),
    "L": l_shaped(),
    "two storeys": two_storeys(0.4),
    "flat": rotated_flat(),
}
STREETS: dict[str, Scene] = {"two rooms": with_street(two_rooms(0.4)), "L": with_street(l_shaped(0.2))}


@pytest.fixture(params=list(SCENES), scope="module")
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def truth(name: str) -> Scanned:
    return scanned(SCENES[name], SPEC)


@pytest.fixture(scope="module")
def model(name: str) -> Modelled:
    return modelled(SCENES[name], SPEC)


def best(true: DoorTruth | WindowTruth, model: Modelled) -> tuple[float, OpeningShape | None]:
    """The found opening that overlaps most with a true one, and how much."""
    corners = np.array(true.corners)
    scored = [(rectangle_overlap(corners, rectangle_of(o, model)), o) for o in model.openings]
    return max(scored, key=lambda pair: pair[0], default=(0.0, None))


def test_every_open_door_is_found_in_its_wall(model: Modelled, truth: Scanned) -> None:
    for door in (d for d in truth.truth.doors if d.state == "open"):
        score, found = best(door, model)
        assert score > 0.8, door.name
        assert found is not None
        assert (found.kind, found.state) == ("door", "open"), door.name
        assert found.sill == 0.0


def test_doors_ajar_and_passages_are_found_as_openings(model: Modelled, truth: Scanned) -> None:
    for door in (d for d in truth.truth.doors if d.state in {"ajar", "passage"}):
        score, found = best(door, model)
        assert score > 0.8, door.name
        assert found is not None
        assert found.kind in {"door", "passage"}
        assert found.state != "closed"


def test_every_closed_door_is_found_closed(model: Modelled, truth: Scanned) -> None:
    for door in (d for d in truth.truth.doors if d.state == "closed"):
        score, found = best(door, model)
        assert score > 0.7, door.name
        assert found is not None
        assert (found.kind, found.state) == ("door", "closed"), door.name


def test_every_opening_that_is_found_exists(model: Modelled, truth: Scanned) -> None:
    corners = [np.array(t.corners) for t in (*truth.truth.doors, *truth.truth.windows)]
    for opening in model.openings:
        found = rectangle_of(opening, model)
        # A window behind furniture may be found smaller than it is; sizes have tests of their own.
        assert max(rectangle_overlap(c, found) for c in corners) > 0.3, opening


def test_widths_and_heights_with_both_jambs_seen_are_measured_to_three_centimetres(
    model: Modelled, truth: Scanned
) -> None:
    for door in (d for d in truth.truth.doors if d.state == "open"):
        _, found = best(door, model)
        assert found is not None
        assert found.width == pytest.approx(door.width, abs=0.03 if found.jambs == 2 else 0.06)
        assert found.height == pytest.approx(door.height, abs=0.03)


def test_openings_lie_within_their_walls_and_do_not_overlap(model: Modelled) -> None:
    for i, opening in enumerate(model.openings):
        wall = model.structure.storeys[opening.storey].walls[opening.wall]
        assert -0.01 < opening.offset < opening.offset + opening.width < math.dist(wall.start, wall.end) + 0.01
        assert opening.sill + opening.height <= wall.top - wall.base + 1e-3
        for other in model.openings[i + 1 :]:
            if (other.storey, other.wall) == (opening.storey, opening.wall):
                assert rectangle_overlap(rectangle_of(opening, model), rectangle_of(other, model)) == 0.0


def test_evidence_names_stations_that_stand_there(model: Modelled) -> None:
    for opening in model.openings:
        assert set(opening.stations) <= set(model.cloud.panoramas)
        assert opening.stations
        assert opening.state == "closed" or 0.3 < opening.looked_through <= 1.0
        assert 0.0 < opening.confidence < 1.0


def test_openings_survive_being_saved(model: Modelled, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("openings") / "openings.json"
    save_openings(model.openings, path)
    assert load_openings(path) == model.openings


@pytest.mark.parametrize("name_of_street", list(STREETS))
def test_windows_with_a_street_behind_them_are_found_as_windows(name_of_street: str) -> None:
    scene = STREETS[name_of_street]
    truth, model = scanned(scene, SPEC), modelled(scene, SPEC)
    for window in truth.truth.windows:
        score, found = best(window, model)
        assert score > 0.7, window.name
        assert found is not None
        assert found.kind == "window"
    assert sum(o.kind == "window" for o in model.openings) == len(truth.truth.windows)


def test_a_street_behind_the_windows_changes_nothing_inside() -> None:
    for name, scene in STREETS.items():
        truth, model = scanned(scene, SPEC), modelled(scene, SPEC)
        assert len(model.structure.storeys) == 1
        assert sorted(p.area for p in model.spaces) == pytest.approx(
            sorted(s.area for s in truth.truth.spaces), rel=0.02
        )
        assert len(model.walls) == len(truth.truth.walls), name


def test_sill_and_head_of_windows_are_right_within_2_centimetres() -> None:
    for scene in STREETS.values():
        truth, model = scanned(scene, SPEC), modelled(scene, SPEC)
        for window in truth.truth.windows:
            _, found = best(window, model)
            assert found is not None
            assert found.sill == pytest.approx(window.sill, abs=0.02), window.name
            assert found.sill + found.height == pytest.approx(window.sill + window.height, abs=0.02), window.name
            assert found.width == pytest.approx(window.width, abs=0.02), window.name


def test_windows_with_nothing_behind_them_are_found() -> None:
    truth, model = scanned(SCENES["two rooms"], SPEC), modelled(SCENES["two rooms"], SPEC)
    assert [best(window, model)[0] > 0.7 for window in truth.truth.windows] == [True, True]


def test_an_opening_up_to_the_ceiling_is_a_passage() -> None:
    gap = DoorSpec("gap", offset=1.5, width=1.1, height=2.5, leaf=False, casing=0.0)
    truth, model = scanned(with_middle_door(gap), SPEC), modelled(with_middle_door(gap), SPEC)
    score, found = best(next(d for d in truth.truth.doors if d.name == "gap"), model)
    assert score > 0.8
    assert found is not None
    assert found.kind == "passage"
    assert len(model.spaces) == 2


def test_an_opening_without_a_leaf_is_a_passage() -> None:
    truth, model = scanned(SCENES["L"], SPEC), modelled(SCENES["L"], SPEC)
    _, found = best(next(d for d in truth.truth.doors if d.state == "passage"), model)
    assert found is not None
    assert found.kind == "passage"


@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("recess", [0.0, 0.04])
def test_a_closed_door_between_rooms_is_no_opening(swing: str, recess: float) -> None:
    door = DoorSpec("middle door", offset=1.5, recess=recess, swing=swing)
    model = modelled(with_middle_door(door), SPEC)
    assert not [o for o in model.openings if o.kind != "window" and o.state != "closed"]
    assert len(model.spaces) == 2


def test_a_wide_double_door_is_one_door() -> None:
    door = DoorSpec("middle door", offset=1.2, width=1.8, angle=math.radians(90))
    truth, model = scanned(with_middle_door(door), SPEC), modelled(with_middle_door(door), SPEC)
    score, found = best(truth.truth.doors[1], model)
    assert score > 0.8
    assert found is not None
    assert found.kind == "door"
    assert [o.kind for o in model.openings if o.kind != "window" and o.state != "closed"] == ["door"]


def test_the_leaf_of_an_open_door_tells_its_angle_hinge_and_swing() -> None:
    seen = 0
    other = {"start": "end", "end": "start", "left": "right", "right": "left"}
    for hinge, swing, degrees in itertools.product(("start", "end"), ("left", "right"), (45, 90, 110)):
        door = DoorSpec("middle door", offset=1.5, angle=math.radians(degrees), hinge=hinge, swing=swing)
        truth, model = scanned(with_middle_door(door), SPEC), modelled(with_middle_door(door), SPEC)
        _, found = best(truth.truth.doors[1], model)
        assert found is not None
        if found.angle is None:
            assert (found.hinge, found.swing) == ("unknown", "unknown")
            continue
        seen += 1
        assert abs(math.degrees(found.angle) - degrees) <= 3
        wall = model.structure.storeys[0].walls[found.wall]
        corners = truth.truth.doors[1].corners
        same = float(np.subtract(wall.end, wall.start) @ np.subtract(corners[1][:2], corners[0][:2])) > 0
        assert found.hinge == (hinge if same else other[hinge])
        assert found.swing == (swing if same else other[swing])
    # A leaf that stands edge-on to both stations is not seen.
    assert seen >= 10
