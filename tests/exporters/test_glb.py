"""GLB files hold the building: read by a library of others, in place, named, coloured."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
import trimesh
from buildings import building, special_storey

from scan2bim.exporters.glb import export
from scan2bim.geometry.meshes import mesh_volume
from scan2bim.model.bodies import storey_solids
from scan2bim.model.ids import ifc_guid


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "house.glb"
    notes = export(building(), path)
    assert notes == ("6 spaces: this form shows bodies only.",)
    return path


def header(path) -> dict:
    data = path.read_bytes()
    magic, version, length, size, kind = struct.unpack("<IIIII", data[:20])
    assert (magic, version, length, kind) == (0x46546C67, 2, len(data), 0x4E4F534A)
    return json.loads(data[20 : 20 + size])


def test_another_library_finds_every_body_where_the_model_has_it(path):
    scene = trimesh.load(path)
    solids = [piece.placed() for storey in building().storeys for s in storey_solids(storey) for piece in s.pieces]
    assert len(scene.geometry) == len(solids)
    low, high = scene.bounds
    points = np.concatenate([mesh.vertices for mesh in solids])
    to_y_up = points[:, [0, 2, 1]] * (1, 1, -1)
    assert low == pytest.approx(to_y_up.min(axis=0), abs=1e-4)
    assert high == pytest.approx(to_y_up.max(axis=0), abs=1e-4)
    assert scene.to_geometry().volume == pytest.approx(sum(mesh_volume(mesh) for mesh in solids), rel=1e-4)


def test_nodes_are_named_and_carry_class_and_global_id(path):
    nodes = {node.get("extras", {}).get("GlobalId"): node for node in header(path)["nodes"]}
    wall = nodes[ifc_guid("wall-g-middle")]
    assert (wall["name"], wall["extras"]["ifcClass"]) == ("Wall g-middle", "IfcWall")
    assert nodes[ifc_guid("storey-0")]["name"] == "Ground floor"


def test_glass_is_seen_through_and_the_rest_is_not(path):
    materials = header(path)["materials"]
    assert {m.get("alphaMode", "OPAQUE") for m in materials if m["name"].endswith("glass")} == {"BLEND"}
    assert {m.get("alphaMode", "OPAQUE") for m in materials if not m["name"].endswith("glass")} == {"OPAQUE"}


def test_seldom_elements_are_there_and_a_rerun_is_equal(tmp_path):
    special = building().model_copy(update={"storeys": (special_storey(),)})
    for name in ("a.glb", "b.glb"):
        export(special, tmp_path / name)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    names = {node.get("name") for node in header(tmp_path / "a.glb")["nodes"]}
    assert {"Curved", "Gable", "Beam", "Roof", "Stair"} <= names


def test_an_empty_building_is_a_valid_file(tmp_path):
    export(building().model_copy(update={"storeys": ()}), tmp_path / "x.glb")
    assert header(tmp_path / "x.glb")["nodes"][0]["name"] == "Test house"
