"""Maps, door poses and the graph of spaces: what a robot reads agrees with the model."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from buildings import building, door, turned, wall
from PIL import Image

from scan2bim.exporters.navigation import export
from scan2bim.exporters.space_graph import SpaceGraph
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import doors_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("nav")
    export(building(), folder / "Haus [1].nav.json")
    return folder


@pytest.fixture(scope="module")
def graph(folder):
    return json.loads((folder / "Haus [1].nav.json").read_text())


class MapServer:
    """A map read as the ROS map_server reads it: a pixel by world coordinates of its place."""

    def __init__(self, yaml) -> None:
        lines = dict(line.split(": ", 1) for line in yaml.read_text().splitlines())
        self.image = np.array(Image.open(yaml.parent / lines["image"]))
        self.resolution = float(lines["resolution"])
        self.origin = json.loads(lines["origin"])
        assert (lines["negate"], lines["mode"]) == ("0", "trinary")
        self._thresholds = float(lines["occupied_thresh"]), float(lines["free_thresh"])

    def at(self, x: float, y: float) -> str:
        column = math.floor((x - self.origin[0]) / self.resolution)
        row = len(self.image) - 1 - math.floor((y - self.origin[1]) / self.resolution)
        darkness = (255 - self.image[row, column]) / 255
        occupied, free = self._thresholds
        return "occupied" if darkness > occupied else "free" if darkness < free else "unknown"


def test_a_map_shows_walls_ways_and_what_is_unknown(folder, graph):
    ground = MapServer(folder / graph["maps"][0]["yaml"])
    for x, y, state in (
        (3.0, 2.0, "free"),
        (6.0, 3.0, "occupied"),
        (6.0, 1.65, "free"),
        (0.0, 5.0, "occupied"),
        (7.9, -0.05, "occupied"),
        (-0.6, 4.0, "unknown"),
        (7.95, 4.15, "occupied"),
        (4.1, 4.0, "free"),
    ):
        assert ground.at(*turned(x, y)) == state, (x, y)


def test_the_graph_joins_the_rooms_that_doors_join(graph):
    names = {space["id"]: space["name"] for space in graph["spaces"]}
    ground = {door["id"] for door in graph["doors"] if door["storey"] == "storey-0"}
    found = {
        edge["via"]: {names.get(s) for s in edge["spaces"]} for edge in graph["edges"] if edge["via"] in ground
    }
    assert found["door-g2"] == {"Hall", "Living room"}
    assert found["door-g3"] == {"Küche", "Living room"}
    assert found["opening-g9"] == found["door-g4"] == {"Hall", "Küche"}
    assert found["door-g1"] == {"Hall", None}


def test_a_stair_leads_to_the_space_above_or_nowhere_known(graph):
    (stair,) = (edge for edge in graph["edges"] if edge["kind"] == "stair")
    assert stair["via"] == "stair-1"
    assert stair["spaces"][0] == "space-g3"


def test_each_door_has_its_pose(graph):
    poses = {pose["id"]: pose for pose in graph["doors"]}
    assert {d.id for _, d in doors_of(building())} < set(poses)
    pose = poses["door-g2"]
    assert pose["position"][:2] == pytest.approx(turned(6.0, 1.65), abs=1e-3)
    assert pose["yaw"] == pytest.approx(math.radians(110), abs=1e-5)
    assert pose["guid"] == ifc_guid("door-g2")
    assert pose["hinges"][0] == pytest.approx(turned(6.06, 1.204), abs=1e-3)
    assert pose["angles"] == pytest.approx([-1.4])
    left, right = (point[:2] for point in pose["approach"])
    assert left == pytest.approx(turned(6.0 - 0.66, 1.65), abs=1e-3)
    assert right == pytest.approx(turned(6.0 + 0.66, 1.65), abs=1e-3)


def test_a_window_and_what_one_cannot_step_over_are_no_ways(tmp_path, graph):
    assert not [pose for pose in graph["doors"] if pose["id"].startswith("window")]
    high = door("h", 1.0).model_copy(update={"sill": door("h", 1.0).sill.model_copy(update={"value": 0.4})})
    storey = building().storeys[0].model_copy(update={"walls": (wall("x", (0, 0), (4, 0), 0.2, 0.0, openings=(high,)),)})
    export(building().model_copy(update={"storeys": (storey,)}), tmp_path / "x.nav.json")
    assert json.loads((tmp_path / "x.nav.json").read_text())["doors"] == []


def test_the_graph_keeps_to_its_form_and_a_rerun_to_its_bytes(folder, tmp_path):
    text = (folder / "Haus [1].nav.json").read_text()
    assert SpaceGraph.model_validate_json(text).version == "1.0"
    export(building(), tmp_path / "Haus [1].nav.json")
    for file in tmp_path.rglob("*.*"):
        if file.is_file():
            assert file.read_bytes() == (folder / file.relative_to(tmp_path)).read_bytes()


def test_an_empty_building_has_an_empty_graph(tmp_path):
    storey = building().storeys[0].model_copy(update={"walls": (), "spaces": (), "columns": (), "stairs": ()})
    export(building().model_copy(update={"storeys": (storey,)}), tmp_path / "x.nav.json")
    assert json.loads((tmp_path / "x.nav.json").read_text())["edges"] == []
