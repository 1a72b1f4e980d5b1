from __future__ import annotations

import ifcopenshell
import ifcopenshell.util.element as util
import ifcopenshell.util.placement
import numpy as np
import pytest
from buildings import building, door, measured, turned, wall, window
from ifc_help import entity, one_storey, points, whole, written

from scan2bim.exporters.ifc import export
from scan2bim.exporters.ifc_fill_types import DOOR_OPERATIONS, WINDOW_PARTITIONINGS
from scan2bim.exporters.ifc_fills import door_operation
from scan2bim.model.elements import Door, Opening
from scan2bim.model.queries import doors_of, openings_of

LEFT = turned(0.0, 1.0)
"""Unit vector to the left of a wall along x."""


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> ifcopenshell.file:
    return whole(tmp_path_factory.mktemp("ifc"))


def host(*openings: Opening, thickness: float = 0.2):
    return wall("host", (0.0, 0.0), (8.0, 0.0), thickness, 0.0, openings=openings)


def test_every_fill_is_in_an_opening_of_its_wall_and_placed_by_it(house):
    for fill in (*house.by_type("IfcDoor"), *house.by_type("IfcWindow")):
        (relation,) = fill.FillsVoids
        void = relation.RelatingOpeningElement
        assert void.VoidsElements[0].RelatingBuildingElement.is_a("IfcWall")
        assert fill.ObjectPlacement.PlacementRelTo == void.ObjectPlacement


def test_every_fill_stays_within_its_opening(house):
    for hosted in openings_of(building()):
        if hosted.opening.fill is None:
            continue
        outer, inner = points(entity(house, hosted.opening.id)), points(entity(house, hosted.opening.fill.id))
        slack = 0.05  # handles stand out from the leaf
        assert (inner.min(axis=0) >= outer.min(axis=0) - slack).all()
        assert (inner.max(axis=0) <= outer.max(axis=0) + slack).all()


def test_overall_sizes_are_the_openings(house):
    for hosted in openings_of(building()):
        if hosted.opening.fill is not None:
            found = entity(house, hosted.opening.fill.id)
            assert (found.OverallWidth, found.OverallHeight) == (
                hosted.opening.width.value,
                hosted.opening.height.value,
            )


@pytest.mark.parametrize(
    ("hinge", "swing", "operation", "turned_about"),
    [
        ("start", "left", "SINGLE_SWING_LEFT", False),
        ("end", "left", "SINGLE_SWING_RIGHT", False),
        ("start", "right", "SINGLE_SWING_RIGHT", True),
        ("end", "right", "SINGLE_SWING_LEFT", True),
    ],
)
def test_hinge_and_swing_make_operation_and_placement(tmp_path, hinge, swing, operation, turned_about):
    opening = door("d", 2.0, 1.0, hinge_side=hinge, swing_side=swing)
    assert door_operation(opening.fill) == (operation, turned_about)
    file = written(one_storey(host(opening)), tmp_path)
    found = entity(file, "door-d")
    assert util.get_type(found).OperationType == operation
    matrix = ifcopenshell.util.placement.get_local_placement(found.ObjectPlacement)
    assert matrix[:2, 1] @ LEFT == pytest.approx(1.0 if swing == "left" else -1.0)
    hinge_in_door = 0.0 if operation.endswith("LEFT") else 1.0
    place = (matrix @ np.array([hinge_in_door, 0.0, 0.0, 1.0]))[:2] @ turned(1.0, 0.0)
    assert place == pytest.approx(2.0 if hinge == "start" else 3.0, abs=1e-6)


@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("hinge", ["start", "end"])
@pytest.mark.parametrize("thickness", [0.05, 0.12, 0.45])
def test_the_leaf_is_flush_with_the_face_that_it_swings_to_and_has_its_handle_off_the_hinge(
    tmp_path, hinge, swing, thickness
):
    opening = door("d", 2.0, 1.0, hinge_side=hinge, swing_side=swing)
    file = written(one_storey(host(opening, thickness=thickness)), tmp_path)
    found = points(entity(file, "door-d"))
    along, across = found[:, :2] @ turned(1.0, 0.0), found[:, :2] @ LEFT
    frame = (found[:, 2] > 2.04) | (found[:, 2] < 0.01)  # lining and leaf, without the handles
    side = 1.0 if swing == "left" else -1.0
    assert (side * across[frame]).max() == pytest.approx(thickness / 2, abs=1e-5)
    handle = (found[:, 2] > 0.9) & (found[:, 2] < 1.1)
    assert along[handle].mean() > 2.5 if hinge == "start" else along[handle].mean() < 2.5


@pytest.mark.parametrize("known", [{}, {"hinge_side": "start"}, {"swing_side": "left"}, {"swing_side": "right"}])
def test_what_is_not_known_is_not_guessed(tmp_path, known):
    file = written(one_storey(host(door("d", 2.0, **known))), tmp_path)
    kind = util.get_type(entity(file, "door-d"))
    assert kind.OperationType == "NOTDEFINED"
    assert len(kind.RepresentationMaps) == 1  # no swing drawn in plan
    assert util.get_pset(entity(file, "door-d"), "S2B_Evidence")["HingeSide"] == known.get("hinge_side", "unknown")


def test_an_operation_that_was_found_is_kept():
    for operation in DOOR_OPERATIONS:
        found = Door(id="d", name="d", confidence=1, operation=operation, swing_side="right")
        assert door_operation(found) == (operation, True)


@pytest.mark.parametrize("operation", DOOR_OPERATIONS)
def test_doors_of_every_operation_can_be_drawn(tmp_path, operation):
    openings = (door("d", 1.0, 1.6, operation=operation), door("e", 4.0, 0.3, operation=operation))
    file = written(one_storey(host(*openings, thickness=0.06)), tmp_path)
    for name in ("door-d", "door-e"):
        assert util.get_type(entity(file, name)).OperationType == operation
        assert len(points(entity(file, name))) > 0


@pytest.mark.parametrize("partitioning", WINDOW_PARTITIONINGS)
def test_windows_of_every_partitioning_can_be_drawn_within_their_opening(tmp_path, partitioning):
    openings = (window("a", 1.0, 2.0), window("b", 4.0, 0.15, height=0.2))
    openings = tuple(
        o.model_copy(update={"fill": o.fill.model_copy(update={"partitioning": partitioning})}) for o in openings
    )
    file = written(one_storey(host(*openings)), tmp_path)
    for o in openings:
        assert util.get_type(entity(file, o.fill.id)).PartitioningType == partitioning
        outer, inner = points(entity(file, o.id)), points(entity(file, o.fill.id))
        assert (inner.min(axis=0) >= outer.min(axis=0) - 1e-4).all()
        assert (inner.max(axis=0) <= outer.max(axis=0) + 1e-4).all()


def test_an_operation_or_partitioning_that_ifc_does_not_know_is_said_and_not_written(tmp_path):
    strange = window("a", 5.0)
    strange = strange.model_copy(update={"fill": strange.fill.model_copy(update={"partitioning": "ROUND"})})
    path = tmp_path / "house.ifc"
    notes = export(one_storey(host(door("d", 1.0, operation="PORTCULLIS"), strange)), path)
    assert sum("written as NOTDEFINED" in note for note in notes) == 2


def test_doors_of_one_size_operation_and_colour_share_a_type(tmp_path):
    openings = (door("a", 1.0), door("b", 3.0), door("c", 5.0, 1.01))
    file = written(one_storey(host(*openings)), tmp_path)
    assert sorted(len(util.get_types(t)) for t in file.by_type("IfcDoorType")) == [1, 2]


def test_a_low_hatch_is_drawn_without_a_handle_in_the_air(tmp_path):
    hatch = door("d", 1.0).model_copy(update={"height": measured(0.7)})
    found = points(entity(written(one_storey(host(hatch)), tmp_path), "door-d"))
    assert found[:, 2].max() == pytest.approx(0.7)


def test_panes_are_glass(house):
    styles = {style.Name: style.Styles[0].Transparency for style in house.by_type("IfcSurfaceStyle")}
    assert any("glass" in name and clear > 0.5 for name, clear in styles.items())


def test_open_doors_keep_their_angle_in_the_evidence(house):
    for _, found in doors_of(building()):
        if found.angle:
            assert util.get_pset(entity(house, found.id), "S2B_Evidence")["LeafAngle"] == found.angle
