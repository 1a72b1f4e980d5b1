"""IndoorGML holds the graph of ways and the rooms' bodies; every reference in it leads somewhere."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from buildings import building
from every_shape import every_shape

from scan2bim.exporters.indoor_gml import CORE, GML, XLINK, export
from scan2bim.exporters.space_graph import space_graph
from scan2bim.geometry.meshes import mesh_volume
from scan2bim.model.ceilings import space_body
from scan2bim.model.elements import Building
from scan2bim.model.ids import ifc_guid

NAMES = {"core": CORE, "gml": GML}
ID, HREF = f"{{{GML}}}id", f"{{{XLINK}}}href"
HOUSES = {"house": building(), "every shape": every_shape()}


@pytest.fixture(scope="module", params=list(HOUSES))
def house(request: pytest.FixtureRequest) -> Building:
    return HOUSES[request.param]


@pytest.fixture(scope="module")
def root(house: Building, tmp_path_factory: pytest.TempPathFactory) -> ET.Element:
    path = tmp_path_factory.mktemp("gml") / "house.gml"
    export(house, path)
    return ET.parse(path).getroot()


def positions(element: ET.Element) -> np.ndarray:
    text = "".join(element.itertext()).split()
    return np.array(text, float).reshape(-1, 3)


def guid_of(element: ET.Element) -> str | None:
    return element.findtext("core:externalReference/core:externalObject/core:name", None, NAMES)


def test_identifiers_are_unique_and_references_lead_to_the_right_kind(root: ET.Element):
    by_id = {found.get(ID): found.tag for found in root.iter() if found.get(ID)}
    assert len(by_id) == sum(found.get(ID) is not None for found in root.iter())
    leads = {
        (holder.tag.split("}")[1], link.tag.split("}")[1], by_id[link.get(HREF, "")[1:]].split("}")[1])
        for holder in root.iter()
        for link in holder
        if link.get(HREF)
    }
    assert leads == {
        ("CellSpace", "duality", "State"),
        ("State", "duality", "CellSpace"),
        ("State", "connects", "Transition"),
        ("Transition", "connects", "State"),
        ("Transition", "duality", "CellSpaceBoundary"),
        ("CellSpaceBoundary", "duality", "Transition"),
        ("CellSpace", "partialboundedBy", "CellSpaceBoundary"),
    }


def test_the_transitions_are_the_ways_of_the_graph(house: Building, root: ET.Element):
    cells = {f"#{cell.get(ID)}": guid_of(cell) for cell in root.iter(f"{{{CORE}}}CellSpace")}
    states = {
        f"#{state.get(ID)}": cells[link.get(HREF, "")]
        for state in root.iter(f"{{{CORE}}}State")
        for link in state.findall("core:duality", NAMES)
    }
    found = Counter(
        frozenset(states[link.get(HREF, "")] for link in way.findall("core:connects", NAMES))
        for way in root.iter(f"{{{CORE}}}Transition")
    )
    edges = [edge for edge in space_graph(house, ()).edges if edge.spaces[0] != edge.spaces[1]]
    assert found == Counter(frozenset(None if s is None else ifc_guid(s) for s in edge.spaces) for edge in edges)
    assert sum(cells[key] is None for key in cells) == 1, "the outside"


def test_cells_are_closed_solids_of_the_rooms_volumes_in_the_scans_coordinates(house: Building, root: ET.Element):
    spaces = {ifc_guid(space.id): space for storey in house.storeys for space in storey.spaces}
    for cell in root.iter(f"{{{CORE}}}CellSpace"):
        space = spaces.get(guid_of(cell) or "")
        if space is None:
            continue
        rings = [positions(line) - house.frame.shift for line in cell.iter(f"{{{GML}}}LinearRing")]
        assert all((ring[0] == ring[-1]).all() for ring in rings)
        sides = Counter(
            (tuple(a), tuple(b)) for ring in rings for a, b in pairwise(np.round(ring, 3).tolist())
        )
        assert all(sides[b, a] == count for (a, b), count in sides.items()), space.name
        volume = sum(
            float(np.dot(ring[0], np.cross(ring[k], ring[k + 1]))) / 6 for ring in rings for k in range(1, len(ring) - 2)
        )
        assert volume == pytest.approx(mesh_volume(space_body(space)), rel=1e-3), space.name


def test_a_door_is_the_upright_rectangle_between_two_rooms(root: ET.Element):
    gates = list(root.iter(f"{{{CORE}}}CellSpaceBoundary"))
    assert len(gates) >= 3
    for gate in gates:
        (ring,) = (positions(line) for line in gate.iter(f"{{{GML}}}LinearRing"))
        assert ring.shape == (5, 3)
        assert np.ptp(ring[:, 2]) > 1.5
        assert ring[0, :2] == pytest.approx(ring[3, :2], abs=1e-4)


def test_a_rerun_writes_the_same_bytes_and_an_empty_building_has_the_outside_alone(tmp_path: Path):
    for name in ("a.gml", "b.gml"):
        export(building(), tmp_path / name)
    assert (tmp_path / "a.gml").read_bytes() == (tmp_path / "b.gml").read_bytes()
    export(Building(id="none at all", name="None"), tmp_path / "c.gml")
    root = ET.parse(tmp_path / "c.gml").getroot()
    assert [found.get(ID) for found in root.iter(f"{{{CORE}}}State")] == ["state-outside"]
