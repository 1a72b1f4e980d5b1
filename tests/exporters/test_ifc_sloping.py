"""Spaces under a roof meet the delivery contract like all others, though they have no one height."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element as util
import pytest
from buildings import measured
from every_shape import room

import scan2bim
from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export
from scan2bim.exporters.ifc_schema import Version
from scan2bim.model.elements import Building, Storey

CONTRACT = Path(scan2bim.__file__).parent / "schemas" / "delivery.ids"
ATTIC = (
    ((0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 2.0, 3.0), (0.0, 2.0, 3.0)),
    ((0.0, 2.0, 3.0), (4.0, 2.0, 3.0), (4.0, 4.0, 1.0), (0.0, 4.0, 1.0)),
)


@pytest.mark.parametrize("version", ["IFC4", "IFC4X3_ADD2"])
def test_a_space_under_a_roof_has_a_volume_in_place_of_a_height(tmp_path: Path, version: Version):
    outline = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    attic = room("attic", "Attic", outline, 0.0, height=3.0).model_copy(update={"ceiling": ATTIC, "volume": 32.0})
    storey = Storey(id="s", name="S", elevation=measured(0.0), spaces=(attic,))
    export(Building(id="b", name="B", storeys=(storey,)), tmp_path / "b.ifc", ExportSettings(ifc_version=version))
    file = ifcopenshell.open(str(tmp_path / "b.ifc"))
    space: Any = file.by_type("IfcSpace")[0]
    found = util.get_pset(space, "Qto_SpaceBaseQuantities")
    assert found is not None and "Height" not in found
    assert found["NetVolume"] == 32.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from ifctester import ids

        contract = ids.open(str(CONTRACT), validate=True)
        contract.validate(file)
    assert [s.name for s in contract.specifications if s.status is False] == []
