from __future__ import annotations

import ifcopenshell
import ifcopenshell.api.geometry
import ifcopenshell.util.element as util
import ifcopenshell.util.representation
import numpy as np
import pytest
from buildings import box, building, door, opening, space, turned, wall, window
from ifc_help import entity, one_storey, points, volume, whole, written

from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Join
from scan2bim.model.queries import opening_corners, openings_of, wall_length, walls_of


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> ifcopenshell.file:
    return whole(tmp_path_factory.mktemp("ifc"))


def test_openings_cut_their_walls_by_their_volume(house):
    for _, host in walls_of(building()):
        found = entity(house, host.id)
        void = sum(o.width.value * o.height.value for o in host.openings) * host.thickness.value
        assert volume(found, openings=False) - volume(found) == pytest.approx(void, abs=1e-4), host.name


def test_every_opening_lies_where_the_model_has_it(house):
    for hosted in openings_of(building()):
        found = points(entity(house, hosted.opening.id))
        for left in (-0.5, 0.5):
            for corner in opening_corners(hosted.wall, hosted.opening, left * hosted.wall.thickness.value):
                assert np.abs(found - corner).sum(axis=1).min() < 1e-4, hosted.opening.name


def test_an_opening_is_one_rectangle_swept_across_the_wall(house):
    for void in house.by_type("IfcOpeningElement"):
        (solid,) = void.Representation.Representations[0].Items
        assert solid.is_a("IfcExtrudedAreaSolid")
        assert solid.SweptArea.is_a("IfcRectangleProfileDef")
        assert void.ObjectPlacement.PlacementRelTo == void.VoidsElements[0].RelatingBuildingElement.ObjectPlacement


def test_openings_without_a_fill_stay_bare(house):
    bare = [void for void in house.by_type("IfcOpeningElement") if not void.HasFillings]
    assert [void.Name for void in bare] == ["Opening g9"]


def test_the_axis_is_the_models_centre_line(house):
    for _, host in walls_of(building()):
        found = entity(house, host.id)
        axis = ifcopenshell.util.representation.get_representation(found, "Plan", "Axis", "GRAPH_VIEW")
        first, last = (p.Coordinates for p in axis.Items[0].Points)
        assert first == (0.0, 0.0)
        assert last == pytest.approx((wall_length(host), 0.0), abs=1e-6)


def test_layers_and_body_agree_in_thickness(house):
    for _, host in walls_of(building()):
        usage = util.get_material(entity(house, host.id), should_inherit=False)
        (layer,) = usage.ForLayerSet.MaterialLayers
        assert usage.is_a("IfcMaterialLayerSetUsage")
        assert usage.OffsetFromReferenceLine == -layer.LayerThickness / 2
        assert layer.LayerThickness == host.thickness.value


def test_walls_of_one_thickness_share_a_type(house):
    assert {t.Name: len(util.get_types(t)) for t in house.by_type("IfcWallType")} == {
        "Wall 120 mm": 2,
        "Wall 150 mm": 3,
        "Wall 300 mm": 8,
    }


def test_each_join_is_written_once(house):
    joins = house.by_type("IfcRelConnectsPathElements")
    pairs = {
        frozenset(((j.RelatingElement, j.RelatingConnectionType), (j.RelatedElement, j.RelatedConnectionType)))
        for j in joins
    }
    assert len(pairs) == len(joins) == 4 + 4 + 4 + 3 + 3
    kinds = {(j.Description, "ATPATH" in (j.RelatingConnectionType, j.RelatedConnectionType)) for j in joins}
    assert kinds == {("MITRE", False), ("BUTT", True)}


def test_walls_that_cross_are_joined_in_their_middles(tmp_path):
    cross = Join(wall="wall-b", at="path", other_at="path", kind="X")
    walls = (
        wall("a", (0.0, 2.0), (4.0, 2.0), 0.2, 0.0, joins=(cross,)),
        wall("b", (2.0, 0.0), (2.0, 4.0), 0.2, 0.0),
    )
    (join,) = written(one_storey(*walls), tmp_path).by_type("IfcRelConnectsPathElements")
    assert (join.RelatingConnectionType, join.RelatedConnectionType) == ("ATPATH", "ATPATH")


def test_an_editor_that_joins_the_walls_anew_changes_nothing(tmp_path):
    file = whole(tmp_path)
    ground = [w for w in file.by_type("IfcWall") if w.Name.startswith("Wall g")]
    before = {w.Name: (volume(w), points(w).min(axis=0), points(w).max(axis=0)) for w in ground}
    for found in ground:
        ifcopenshell.api.geometry.regenerate_wall_representation(file, found, height=2.6)
    for found in ground:
        size, low, high = before[found.Name]
        assert volume(found) == pytest.approx(size, abs=1e-4)
        assert points(found).min(axis=0) == pytest.approx(low, abs=1e-4)
        assert points(found).max(axis=0) == pytest.approx(high, abs=1e-4)


def test_joined_walls_fill_their_corner_once(house):
    outer = [entity(house, f"wall-u-{side}") for side in ("south", "east", "north", "west")]
    ring = 10.3 * 8.3 - 9.7 * 7.7
    assert sum(volume(found, openings=False) for found in outer) == pytest.approx(ring * 2.6, abs=1e-4)


def test_quantities_are_those_of_the_geometry(house):
    for found in house.by_type("IfcWall"):
        quantities = util.get_psets(found, qtos_only=True)["Qto_WallBaseQuantities"]
        assert quantities["NetVolume"] == pytest.approx(volume(found), abs=1e-4)
        assert quantities["GrossVolume"] == pytest.approx(volume(found, openings=False), abs=1e-4)


def test_openings_that_overlap_or_stick_out_count_once_and_within(tmp_path):
    openings = (opening("a", 1.0, 1.0, 0.0, 2.0, None), opening("b", 1.5, 1.0, -0.5, 2.5, None))
    host = wall("w", (0.0, 0.0), (4.0, 0.0), 0.2, 0.0, openings=openings)
    found = entity(written(one_storey(host), tmp_path), "wall-w")
    quantities = util.get_psets(found, qtos_only=True)["Qto_WallBaseQuantities"]
    assert quantities["NetSideArea"] == pytest.approx(4 * 2.6 - 1.5 * 2.0)
    assert quantities["NetVolume"] == pytest.approx(volume(found), abs=1e-4)


def test_a_thickness_between_millimetres_is_rounded_in_body_and_layers_and_kept_in_the_evidence(tmp_path):
    host = wall("w", (0.0, 0.0), (4.0, 0.0), 0.2374, 0.0)
    file = written(one_storey(host), tmp_path)
    found = entity(file, "wall-w")
    assert volume(found) == pytest.approx(4 * 2.6 * 0.237, abs=1e-4)
    assert file.by_type("IfcMaterialLayer")[0].LayerThickness == 0.237
    assert util.get_pset(found, "S2B_Evidence")["Thickness"] == 0.2374


def test_a_turned_wall_stands_in_its_direction(tmp_path):
    host = wall("w", (1.0, 2.0), (5.0, 2.0), 0.2, 0.0)
    found = points(entity(written(one_storey(host), tmp_path), "wall-w"))
    for corner in ((1.0, 1.9), (5.0, 1.9), (5.0, 2.1), (1.0, 2.1)):
        assert np.abs(found[:, :2] - turned(*corner)).sum(axis=1).min() < 1e-4


def test_export_writes_to_the_very_path_given(tmp_path):
    path = tmp_path / ".hidden tmp.part"
    export(building(), path)
    assert path.read_bytes().startswith(b"ISO-10303-21;")


def test_spaces_are_bounded_by_the_walls_and_fills_beside_them(tmp_path):
    openings = (door("d", 1.0), window("w", 5.0))
    host = wall("w", (0.0, 0.0), (8.0, 0.0), 0.2, 0.0, openings=openings)
    host = host.model_copy(update={"left_spaces": ("space-a", "space-b"), "right_spaces": ("space-none",)})
    spaces = (
        space("a", "A", box(0.1, 0.1, 3.0, 3.0), 0.0, 8.41),
        space("b", "B", box(3.2, 0.1, 7.9, 3.0), 0.0, 13.63),
    )
    file = written(one_storey(host, spaces=spaces), tmp_path)
    found = [b for b in file.by_type("IfcRelSpaceBoundary") if not b.RelatedBuildingElement.is_a("IfcVirtualElement")]
    pairs = {(b.RelatingSpace.Name, b.RelatedBuildingElement.Name) for b in found}
    assert pairs == {("A", "Wall w"), ("A", "Door d"), ("B", "Wall w"), ("B", "Window w")}
