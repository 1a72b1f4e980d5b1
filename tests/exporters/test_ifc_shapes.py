"""Every shape that the model can hold, in every version of IFC."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element as util
import ifcopenshell.util.shape
import ifcopenshell.validate
import numpy as np
import pytest
from buildings import building
from every_shape import every_shape, straight
from ifc_help import entity, one_storey, points, volume, written

from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Building
from scan2bim.model.queries import wall_arc, wall_length

VERSIONS = ("IFC2X3", "IFC4", "IFC4X3_ADD2")
KERNELS = ("opencascade", "cgal")
_OPEN: list[ifcopenshell.file] = []


def exported(house: Building, folder: Path, version: str = "IFC4") -> ifcopenshell.file:
    path = folder / f"{version}.ifc"
    export(house, path, ExportSettings(ifc_version=version))
    _OPEN.append(ifcopenshell.open(str(path)))
    return _OPEN[-1]


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> ifcopenshell.file:
    return exported(every_shape(), tmp_path_factory.mktemp("shapes"))


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("make", [every_shape, building])
def test_each_version_is_valid_by_schema_and_rules(tmp_path, version, make):
    file = exported(make(), tmp_path, version)
    assert file.schema_identifier == version
    log = ifcopenshell.validate.json_logger()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        ifcopenshell.validate.validate(file, log, express_rules=True)
    assert log.statements == []


@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_holds_the_same_bodies(house, tmp_path, version):
    file = exported(every_shape(), tmp_path, version)
    for wall in house.by_type("IfcWall"):
        assert volume(file.by_guid(wall.GlobalId)) == pytest.approx(volume(wall), rel=1e-6), wall.Name
    assert {e.GlobalId for e in house.by_type("IfcElement")} == {e.GlobalId for e in file.by_type("IfcElement")}


def test_net_volumes_agree_within_a_thousandth_between_two_kernels_and_the_quantities(house):
    settings = ifcopenshell.geom.settings()
    for kind, name in (
        ("IfcWall", "Qto_WallBaseQuantities"),
        ("IfcSlab", "Qto_SlabBaseQuantities"),
        ("IfcStairFlight", "Qto_StairFlightBaseQuantities"),
        ("IfcBeam", "Qto_BeamBaseQuantities"),
    ):
        for element in house.by_type(kind):
            stated = util.get_pset(element, name, "NetVolume")
            if stated is None:
                assert element.PredefinedType == "LANDING"
                continue
            for kernel in KERNELS:
                shape = ifcopenshell.geom.create_shape(settings, element, geometry_library=kernel)
                found = ifcopenshell.util.shape.get_volume(shape.geometry)
                assert found == pytest.approx(stated, rel=1e-3), (element.Name, kernel)


def test_the_arc_of_a_curved_wall_passes_its_ends_and_has_the_bulge_of_the_model(house):
    model = next(wall for wall in every_shape().storeys[0].walls if wall.bulge)
    found = entity(house, model.id)
    axis = next(r for r in found.Representation.Representations if r.RepresentationIdentifier == "Axis").Items[0]
    assert axis.is_a("IfcTrimmedCurve")
    settings = ifcopenshell.geom.settings()
    settings.set("dimensionality", ifcopenshell.ifcopenshell_wrapper.CURVES_SURFACES_AND_SOLIDS)
    line = np.array(ifcopenshell.geom.create_shape(settings, axis).verts).reshape(-1, 3)[:, :2]
    ends = np.array([(0.0, 0.0), (math.dist(model.start, model.end), 0.0)])
    assert np.abs(line[[0, -1]] - ends).max() < 1e-4
    # to the right of the chord, by the sagitta
    assert line[:, 1].min() == pytest.approx(-0.2 * 8.0 / 2, abs=0.01)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(wall_length(model), rel=1e-3)


def test_the_faces_of_a_curved_wall_are_half_its_thickness_from_the_arc(house):
    model = next(wall for wall in every_shape().storeys[0].walls if wall.bulge)
    found = points(entity(house, model.id), openings=False)[:, :2]
    along = [wall_arc(model).nearest(x, y) for x, y in found]
    on_axis = wall_arc(model).place(np.array(along), np.zeros(len(along)))
    assert np.abs(np.linalg.norm(found - on_axis, axis=1) - model.thickness.value / 2).max() < 1e-4


def test_a_slanted_wall_leans_to_its_left_and_keeps_its_thickness(tmp_path):
    lean = 0.2
    file = written(one_storey(straight("a", (0.0, 0.0), (4.0, 0.0), 0.3, lean=lean)), tmp_path)
    found = points(entity(file, "wall-a"))
    top = found[found[:, 2] > 2.5]
    assert top[:, 1].mean() == pytest.approx(2.6 * math.tan(lean), abs=1e-3)
    assert np.ptp(top[:, 1]) * math.cos(lean) == pytest.approx(0.3, abs=1e-4)


def test_openings_of_every_wall_pierce_it(house):
    for wall in every_shape().storeys[0].walls:
        found = entity(house, wall.id)
        gross, net = volume(found, openings=False), volume(found)
        expected = sum(
            o.width.value * o.height.value * (wall.thickness.value if o.depth is None else o.depth.value)
            for o in wall.openings
        )
        assert gross - net == pytest.approx(expected, rel=0.02), wall.name


def test_a_niche_is_a_recess_that_stops_within_the_wall(house):
    recesses = [o for o in house.by_type("IfcOpeningElement") if o.PredefinedType == "RECESS"]
    assert sorted(o.Name for o in recesses) == ["Opening niche-arc", "Opening niche-back"]
    back = points(entity(house, "opening-niche-back"))
    # in the north wall, whose left (inner) face is at y = 5.82
    assert (back[:, 1].min(), back[:, 1].max()) == pytest.approx((5.82, 5.94), abs=1e-4)


def test_a_gable_wall_ends_under_its_profile(house):
    found = points(entity(house, "wall-u-east"), openings=False)
    assert found[:, 2].max() == pytest.approx(2.8 + 3.6, abs=1e-3)
    middle = found[np.abs(found[:, 1] - 3.0) < 1e-3]
    assert len(middle)
    wall = entity(house, "wall-u-east")
    body = next(r for r in wall.Representation.Representations if r.RepresentationIdentifier == "Body")
    assert body.RepresentationType == "Clipping"


def test_roof_planes_are_slabs_of_one_roof_in_their_own_planes(house):
    (roof,) = house.by_type("IfcRoof")
    parts = util.get_parts(roof)
    assert [util.get_predefined_type(part) for part in parts] == ["ROOF", "ROOF"]
    low = points(parts[0])
    for corner in every_shape().storeys[1].roofs[0].outline:
        assert np.abs(low - np.array(corner)).sum(axis=1).min() < 1e-4
    assert np.unique(np.round(low[:, :2], 3), axis=0).shape == (4, 2)
    assert volume(parts[0]) == pytest.approx(util.get_pset(parts[0], "Qto_SlabBaseQuantities", "NetVolume"), rel=1e-3)
    assert util.get_pset(parts[0], "Pset_SlabCommon", "PitchAngle") == pytest.approx(math.atan2(2.2, 3.0), abs=1e-6)
    assert util.get_container(roof, should_get_direct=True).Name == "Upper floor"


def test_a_stair_has_flights_with_their_steps_and_the_landing_between(house):
    (stair,) = house.by_type("IfcStair")
    flights = [part for part in util.get_parts(stair) if part.is_a("IfcStairFlight")]
    landings = [part for part in util.get_parts(stair) if part.is_a("IfcSlab")]
    assert stair.PredefinedType == "HALF_TURN_STAIR"
    assert len(flights), len(landings) == (2, 1)
    for flight, base in zip(flights, (0.0, 1.4), strict=True):
        levels = np.unique(np.round(points(flight)[:, 2], 4))
        for step in range(1, 8):
            assert np.abs(levels - (base + step * 0.175)).min() < 1e-4
        assert util.get_pset(flight, "Pset_StairFlightCommon", "TreadLength") == pytest.approx(0.2)
    assert points(landings[0])[:, 2].max() == pytest.approx(1.4)


def test_a_beam_runs_along_its_outline_between_its_heights(house):
    found = points(entity(house, "beam"))
    assert found.min(axis=0) == pytest.approx((5.4, 0.1, 2.3), abs=1e-4)
    assert found.max(axis=0) == pytest.approx((5.6, 4.0, 2.6), abs=1e-4)
    assert util.get_type(entity(house, "beam")).Name == "Beam 200 x 300 mm"


def test_frames_are_as_measured(house):
    door, window = entity(house, "door-measured"), entity(house, "window-measured")
    lining, panel, _ = util.get_type(door).HasPropertySets
    assert (lining.LiningDepth, lining.LiningThickness) == (0.1, 0.06)
    assert (lining.ThresholdDepth, lining.ThresholdThickness) == (0.1, 0.02)
    assert panel.PanelDepth == pytest.approx(0.045)
    assert util.get_pset(door, "S2B_Evidence", "Recess") == 0.06
    # lining 0.1 m deep in a wall of 0.12 m: it cannot start where the leaf does, 0.06 m behind the left face
    for depth in (2.46, 2.56, 2.5, 2.545):  # of the lining, then of the leaf
        assert np.abs(points(door)[:, 0] - depth).min() < 1e-3
    frame = points(window)
    # the pane lies 0.15 m behind the right, outer face of the east wall, at x = 8.18
    assert (frame[:, 0].min(), frame[:, 0].max()) == pytest.approx((7.99, 8.07), abs=1e-3)


def test_the_newest_version_has_frames_and_uncertainty_as_property_sets(tmp_path):
    file = exported(every_shape(), tmp_path, "IFC4X3_ADD2")
    door = entity(file, "door-measured")
    assert util.get_pset(util.get_type(door), "Pset_DoorLiningProperties", "LiningDepth") == 0.1
    assert util.get_pset(entity(file, "wall-east"), "Pset_Uncertainty", "OrthogonalUncertainty") == 0.002
    assert len(file.by_type("IfcMapConversion")) == 2
    assert len(file.by_type("IfcDoorLiningProperties")) == 0


def test_the_oldest_version_keeps_the_place_on_the_map(tmp_path):
    file = exported(every_shape(), tmp_path, "IFC2X3")
    (site,) = file.by_type("IfcSite")
    assert util.get_pset(site, "ePSet_MapConversion", "Eastings") == 500_000.0
    assert util.get_pset(site, "ePSet_ProjectedCRS", "Name") == "EPSG:25832"


def test_what_was_seen_of_each_face_and_its_accuracy_are_in_the_evidence(house):
    found = util.get_pset(entity(house, "wall-east"), "S2B_Evidence")
    assert (found["LeftFaceSeen"], found["LeftFacePoints"], found["RightFaceUnseen"]) == (0.8, 8000, 1.0)
    assert found["LOA"] == "LOA30"
    assert found["ThicknessSource"] == "measured"


def test_elements_are_classified(house):
    for kind, code in (("IfcWall", "EF_25_10"), ("IfcDoor", "EF_25_30"), ("IfcRoof", "EF_30_10")):
        for element in house.by_type(kind):
            (link,) = [r for r in element.HasAssociations if r.is_a("IfcRelAssociatesClassification")]
            assert link.RelatingClassification.Identification == code
