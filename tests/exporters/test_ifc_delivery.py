"""The delivery contract: an IDS that the client's own checker reads."""

from __future__ import annotations

import warnings
from pathlib import Path

import ifcopenshell
import pytest
from every_shape import every_shape

import scan2bim
from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export

CONTRACT = Path(scan2bim.__file__).parent / "schemas" / "delivery.ids"


def failed(file: ifcopenshell.file) -> list[str]:
    """Names of the specifications that the file does not meet."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from ifctester import ids

        contract = ids.open(str(CONTRACT))
        contract.validate(file)
    assert len(contract.specifications) >= 8
    return [specification.name for specification in contract.specifications if specification.status is False]


@pytest.mark.parametrize("version", ["IFC4", "IFC4X3_ADD2"])
def test_files_meet_the_delivery_contract(tmp_path, version):
    export(every_shape(), tmp_path / "house.ifc", ExportSettings(ifc_version=version))
    assert failed(ifcopenshell.open(str(tmp_path / "house.ifc"))) == []


def test_a_door_that_fills_nothing_breaks_the_contract(tmp_path):
    export(every_shape(), tmp_path / "house.ifc")
    file = ifcopenshell.open(str(tmp_path / "house.ifc"))
    file.remove(file.by_type("IfcDoor")[0].FillsVoids[0])
    assert failed(file) == ["Doors fill an opening of a wall and are sized"]
