"""What the scans saw of the whole building, as properties in IFC and as a sheet of the quantities."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import ifcopenshell.util.element as util
import openpyxl
import pytest
from buildings import building

from scan2bim.exporters import ifc, quantities
from scan2bim.model.elements import Building, FaceView


@pytest.fixture
def house() -> Building:
    """The hand-made building with one face of its first wall seen to three quarters."""
    whole, view = building(), FaceView(side="left", area=10.0, seen=0.75, occluded=0.2, unseen=0.05)
    ground = whole.storeys[0]
    wall = ground.walls[0]
    evidence = wall.evidence.model_copy(update={"faces": (view,)})
    seen = wall.model_copy(update={"left_spaces": (ground.spaces[0].id,), "evidence": evidence})
    ground = ground.model_copy(update={"walls": (seen, *ground.walls[1:])})
    return whole.model_copy(update={"storeys": (ground, *whole.storeys[1:])})


def test_the_ifc_building_tells_how_much_of_it_was_seen(house: Building, tmp_path: Path) -> None:
    ifc.export(house, tmp_path / "house.ifc")
    file = ifcopenshell.file.from_string((tmp_path / "house.ifc").read_text())
    (found,) = file.by_type("IfcBuilding")
    told = util.get_pset(found, "S2B_Coverage")
    assert told is not None
    assert (told["Area"], told["Seen"], told["Occluded"], told["Unseen"]) == (10.0, 0.75, 0.2, 0.05)
    assert (told["WallsArea"], told["WallsSeen"], told["FloorsArea"]) == (10.0, 0.75, 0.0)


def test_a_building_of_which_it_is_not_known_has_no_such_properties(tmp_path: Path) -> None:
    ifc.export(building(), tmp_path / "house.ifc")
    assert "S2B_Coverage" not in (tmp_path / "house.ifc").read_text()


def test_the_coverage_has_a_sheet_of_its_own(house: Building, tmp_path: Path) -> None:
    quantities.export(house, tmp_path / "house.xlsx")
    heading, *rows = openpyxl.load_workbook(tmp_path / "house.xlsx")["Coverage"].iter_rows(values_only=True)
    assert heading == ("faces of", "area [m²]", "seen", "hidden by things", "never seen")
    assert rows[0] == ("all", 10, 0.75, 0.2, 0.05)
    assert rows[1] == ("walls", 10, 0.75, 0.2, 0.05)
