"""Bonsai draws doors and windows again from its own property sets: from ours it draws what is in the file."""

from __future__ import annotations

import json
import re
from pathlib import Path

import ifcopenshell
import ifcopenshell.util.element as util
import numpy as np
import pytest
from buildings import building
from ifcopenshell.api.geometry import add_door_representation, add_window_representation

from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export

_OPEN: list[ifcopenshell.file] = []


@pytest.fixture(scope="module", params=["IFC2X3", "IFC4", "IFC4X3_ADD2"])
def house(request, tmp_path_factory) -> ifcopenshell.file:
    path: Path = tmp_path_factory.mktemp("bonsai") / "house.ifc"
    export(building(), path, ExportSettings(ifc_version=request.param))
    _OPEN.append(ifcopenshell.open(str(path)))
    return _OPEN[-1]


def library_names(values: dict[str, object]) -> dict[str, object]:
    """As the library's drawing functions call them."""
    named = {"".join(word.capitalize() for word in key.split("_")): value for key, value in values.items()}
    return {re.sub("Ratio$", "", key): value for key, value in named.items()}


def numbers(representation: ifcopenshell.entity_instance) -> np.ndarray:
    """Every length of a representation's solids, in order."""
    found: list[float] = []
    for item in representation.Items:
        for part in representation.file.traverse(item):
            for value in part:
                if isinstance(value, float):
                    found.append(value)
                elif isinstance(value, tuple):
                    found += np.ravel([v for v in value if isinstance(v, (float, tuple))]).tolist()
    return np.array(found)


def test_a_door_drawn_anew_from_bonsai_s_data_is_the_same(house):
    types = {util.get_type(door).id(): util.get_type(door) for door in house.by_type("IfcDoor")}
    edited = [kind for kind in types.values() if util.get_pset(kind, "BBIM_Door")]
    assert len(edited) >= 2
    for kind in edited:
        data = json.loads(util.get_pset(kind, "BBIM_Door", "Data"))
        (body, *_) = [m.MappedRepresentation for m in kind.RepresentationMaps]
        drawn = add_door_representation(
            house,
            context=body.ContextOfItems,
            overall_height=data["overall_height"],
            overall_width=data["overall_width"],
            operation_type=data["door_type"],
            lining_properties=library_names(data["lining_properties"]),
            panel_properties=library_names(data["panel_properties"]),
        )
        assert np.allclose(numbers(drawn), numbers(body))


def test_a_window_drawn_anew_from_bonsai_s_data_is_the_same(house):
    types = {util.get_type(window).id(): util.get_type(window) for window in house.by_type("IfcWindow")}
    assert types
    for kind in types.values():
        data = json.loads(util.get_pset(kind, "BBIM_Window", "Data"))
        panel = library_names(data["panel_properties"])
        body = kind.RepresentationMaps[0].MappedRepresentation
        drawn = add_window_representation(
            house,
            context=body.ContextOfItems,
            overall_height=data["overall_height"],
            overall_width=data["overall_width"],
            partition_type=data["window_type"],
            lining_properties=library_names(data["lining_properties"]),
            panel_properties=[{name: values[k] for name, values in panel.items()} for k in range(3)],
        )
        assert np.allclose(numbers(drawn), numbers(body))
