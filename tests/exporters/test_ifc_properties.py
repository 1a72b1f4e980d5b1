from __future__ import annotations

import ifcopenshell
import ifcopenshell.util.element as util
import ifcopenshell.util.pset
import pytest
from buildings import building
from ifc_help import entity, volume, whole

from scan2bim.model.elements import Dimension
from scan2bim.model.queries import everything


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> ifcopenshell.file:
    return whole(tmp_path_factory.mktemp("ifc"))


def test_standard_sets_hold_what_their_templates_say(house):
    templates = ifcopenshell.util.pset.get_template("IFC4")
    definitions = [*house.by_type("IfcPropertySet"), *house.by_type("IfcElementQuantity")]
    standard = [d for d in definitions if d.Name.startswith(("Pset_", "Qto_"))]
    assert len({d.Name for d in standard}) >= 15
    for found in standard:
        template = templates.get_by_name(found.Name)
        assert template is not None, found.Name
        allowed = {p.Name: p for p in template.HasPropertyTemplates}
        members = found.Quantities if found.is_a("IfcElementQuantity") else found.HasProperties
        for member in members:
            assert member.Name in allowed, (found.Name, member.Name)
            if member.is_a("IfcPropertySingleValue"):
                assert member.NominalValue.is_a() == allowed[member.Name].PrimaryMeasureType
            elif member.is_a("IfcPhysicalSimpleQuantity"):
                kind = allowed[member.Name].TemplateType.removeprefix("Q_").capitalize()
                assert member.is_a(f"IfcQuantity{kind}")


def test_standard_sets_stand_on_the_elements_that_they_are_for(house):
    templates = ifcopenshell.util.pset.get_template("IFC4")
    for relation in house.by_type("IfcRelDefinesByProperties"):
        name = relation.RelatingPropertyDefinition.Name
        if name.startswith(("Pset_", "Qto_")):
            for product in relation.RelatedObjects:
                assert name in templates.get_applicable_names(
                    product.is_a(), "", name.startswith("Pset_"), name.startswith("Qto_")
                )


def test_own_sets_do_not_start_like_the_standards(house):
    own = {d.Name for d in house.by_type("IfcPropertySet") if not d.Name.startswith(("Pset_", "BBIM_"))}
    assert own == {"S2B_Evidence", "S2B_Frame", "S2B_Scans", "S2B_Notes"}


def test_every_element_carries_its_evidence_and_the_source_of_each_dimension(house):
    for thing in everything(building()):
        if not hasattr(thing, "confidence"):
            continue
        found = util.get_pset(entity(house, thing.id), "S2B_Evidence")
        assert found["Confidence"] == thing.confidence
        assert found["Points"] == thing.evidence.points
        for field, value in thing:
            if isinstance(value, Dimension):
                name = "".join(word.capitalize() for word in field.split("_"))
                assert found[name] == value.value
                assert found[f"{name}Source"] == value.source
                assert found.get(f"{name}Sigma") == value.sigma


def test_the_evidence_of_a_wall_is_complete(house):
    found = util.get_pset(entity(house, "wall-g-south"), "S2B_Evidence")
    assert found["RmsDeviation"] == 0.003
    assert found["Coverage"] == 0.8
    assert found["FacesSeen"] == 2
    assert found["SourceScans"] == ["Scan 1"]
    assert found["Evidence"] == "Both faces seen."
    assert (found["ThicknessSource"], found["ThicknessSigma"]) == ("measured", 0.002)
    assert util.get_pset(entity(house, "wall-g-north"), "S2B_Evidence")["ThicknessSource"] == "assumed"


def test_what_was_scanned_stands_already(house):
    for product in house.by_type("IfcWall"):
        assert util.get_pset(product, "Pset_WallCommon")["Status"] == ["EXISTING"]


def test_outside_walls_and_what_they_host_are_external(house):
    assert util.get_pset(entity(house, "wall-g-south"), "Pset_WallCommon")["IsExternal"] is True
    assert util.get_pset(entity(house, "door-g1"), "Pset_DoorCommon")["IsExternal"] is True
    assert "IsExternal" not in util.get_pset(entity(house, "wall-g-middle"), "Pset_WallCommon")


def test_scans_frame_and_notes_are_in_the_building(house):
    (found,) = house.by_type("IfcBuilding")
    sets = util.get_psets(found)
    assert "b.e57" in sets["S2B_Scans"]["Scan002"]
    assert sets["S2B_Frame"]["Shift"] == [500_000.0, 5_400_000.0, 300.0]
    assert sets["S2B_Notes"]["Note001"] == "The roof was not scanned."


def test_quantities_of_spaces_and_plates_are_those_of_the_geometry(house):
    names = {
        "IfcSlab": "Qto_SlabBaseQuantities",
        "IfcColumn": "Qto_ColumnBaseQuantities",
        "IfcOpeningElement": "Qto_OpeningElementBaseQuantities",
    }
    for ifc_class, name in names.items():
        for product in house.by_type(ifc_class):
            found = util.get_psets(product, qtos_only=True)[name]
            assert found.get("NetVolume", found.get("Volume")) == pytest.approx(volume(product), rel=1e-4)


def test_a_stair_tells_its_risers(house):
    found = util.get_pset(entity(house, "stair-1"), "Pset_StairCommon")
    assert found["NumberOfRiser"] == 16
    assert found["RiserHeight"] == pytest.approx(2.8 / 16)
