from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pye57
import pytest
import shapely
from buildings import building

from scan2bim.cli import main
from scan2bim.exporters.ifc import export
from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d
from scan2bim.simulate.areas import Area, free_floors
from scan2bim.simulate.effects import World
from scan2bim.simulate.ifc_mesh import solid_patches
from scan2bim.truth.ifc import IfcReading, read_ifc
from scan2bim.truth.io import read_truth
from scan2bim.truth.values import DoorTruth, SpaceTruth, Truth

try:
    load_open3d()
except MissingLibraryError as error:
    pytest.skip(f"simulate needs open3d: {error}", allow_module_level=True)


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ifc") / "house.ifc"
    export(building(), path)
    return path


def scanned(house: Path, folder: Path, *more: str) -> Truth:
    assert main(["simulate", str(house), "-o", str(folder), "--resolution", "2.5", "--quiet", *more]) == 0
    return read_truth(folder / "truth.json")


@pytest.fixture(scope="module")
def mixed(house: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Truth]:
    folder = tmp_path_factory.mktemp("mixed") / "scans"
    return folder, scanned(house, folder, "--doors", "mixed", "--clutter", "0.1", "--seed", "3")


def points_of(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    file = pye57.E57(str(path))
    data = file.read_scan(0, ignore_missing_fields=True)
    file.close()
    return np.column_stack([data[f"cartesian{axis}"] for axis in "XYZ"])


def test_each_station_gives_a_scan_with_its_pose_and_every_room_has_one(mixed: tuple[Path, Truth]) -> None:
    folder, truth = mixed
    assert sorted(p.stem for p in folder.glob("*.e57")) == [s.name for s in truth.stations]
    assert {s.room for s in truth.stations} == {s.name for s in truth.spaces}
    for station in truth.stations:
        file = pye57.E57(str(folder / f"{station.name}.e57"))
        assert math.dist(file.get_header(0).translation, station.position) < 0.01
        file.close()
    assert not list(folder.glob("*.part"))


def test_the_points_lie_on_the_models_floors_and_walls(mixed: tuple[Path, Truth]) -> None:
    folder, truth = mixed
    points = points_of(folder / f"{truth.stations[0].name}.e57")
    space = next(s for s in truth.spaces if s.name == truth.stations[0].room)
    assert (np.abs(points[:, 2] - space.base) < 0.01).sum() > 200
    assert (np.abs(points[:, 2] - space.base - space.height) < 0.03).sum() > 200


def test_doors_stand_in_different_states_and_the_truth_says_which(mixed: tuple[Path, Truth]) -> None:
    _, truth = mixed
    assert {"closed"} < {door.state for door in truth.doors}
    for door in truth.doors:
        assert door.hinge != "unknown"
        assert door.swing != "unknown"
        assert door.angle is not None
        assert (door.angle == 0.0) == (door.state == "closed")
        assert door.occlusion is not None


def test_an_open_leaf_is_scanned_where_the_truth_has_it(house: Path, tmp_path: Path) -> None:
    truth = scanned(house, tmp_path / "open", "--doors", "open", "--resolution", "1.0")
    points = np.concatenate([points_of(path) for path in (tmp_path / "open").glob("*.e57")])
    opened = [d for d in truth.doors if d.state == "open" and d.leaves == 1]
    assert opened
    assert sum(_on_leaf(door, points) > 12 for door in opened) >= 0.7 * len(opened)


def _on_leaf(door: DoorTruth, points: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> int:
    """Points within 8 cm of the leaf's plane, over its middle half."""
    start, end = (np.array(c[:2]) for c in door.corners[:2])
    along = (end - start) / door.width
    left = np.array([-along[1], along[0]])
    hinge, towards = (start, along) if door.hinge == "start" else (end, -along)
    side = left if door.swing == "left" else -left
    assert door.angle is not None
    leaf = math.cos(door.angle) * towards + math.sin(door.angle) * side
    # The leaf hangs at the face on its swing side: up to half a wall from the opening's middle plane.
    local = points[:, :2] - hinge
    x, y = local @ leaf, local @ np.array([-leaf[1], leaf[0]])
    z = points[:, 2] - door.corners[0][2]
    return int(((x > 0.25 * door.width) & (x < 0.75 * door.width) & (np.abs(y) < 0.2) & (z > 0.3) & (z < 1.8)).sum())


def test_the_same_seed_gives_the_same_scans(house: Path, mixed: tuple[Path, Truth], tmp_path: Path) -> None:
    folder, _ = mixed
    scanned(house, tmp_path / "again", "--doors", "mixed", "--clutter", "0.1", "--seed", "3")
    for path in sorted(folder.iterdir()):
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()


def test_given_stations_are_used_and_bad_lists_refused(
    house: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    inside = building().scans[0].position
    assert inside is not None
    table = tmp_path / "stations.csv"
    table.write_text("name, x, y, z\nhall,{},{},{}\n".format(*inside))
    truth = scanned(house, tmp_path / "one", "--stations", str(table))
    assert [s.name for s in truth.stations] == ["hall"]
    for content, words in (
        ("x;y;z\n1;2;3\n", "names x, y, z"),
        ("x,y,z\n1,two,3\n", "line 2: expected numbers"),
        ("x,y,z\n9999,0,1\n", "lies outside"),
        ("name,x,y,z\na,{0},{1},{2}\na,{0},{1},{2}\n".format(*inside), "all different"),
    ):
        table.write_text(content)
        assert main(["simulate", str(house), "-o", str(tmp_path / "x"), "--stations", str(table), "--quiet"]) in (3, 4)
        assert words in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_scans_are_not_mixed_with_those_that_are_there(
    house: Path, mixed: tuple[Path, Truth], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", str(house), "-o", str(mixed[0])]) == 2
    assert "holds scans already" in capsys.readouterr().err


def test_bad_options_are_refused(house: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for wrong in (["--clutter", "2"], ["--resolution", "nan"], ["--seed", "-1"], ["--doors", "ajar"]):
        with pytest.raises(SystemExit) as stopped:
            main(["simulate", str(house), "-o", "x", *wrong])
        assert stopped.value.code == 2
    capsys.readouterr()


def most_of(space: SpaceTruth, area: Area) -> bool:
    """Whether the area covers most of the space."""
    return area.outline.intersection(shapely.Polygon(space.outline)).area > 0.5 * space.area


def test_a_model_without_spaces_is_scanned_from_its_free_floors(house: Path, tmp_path: Path) -> None:
    reading: IfcReading = read_ifc(house)
    world = World(solid_patches(reading, doors=True))
    found = free_floors(reading.truth.storeys[:1], world)
    rooms = [s for s in reading.truth.spaces if s.storey == reading.truth.storeys[0].name]
    parts = {room.name.split(" [")[0]: [i for i, a in enumerate(found) if most_of(room, a)] for room in rooms}
    assert all(len(numbers) == 1 for numbers in parts.values())
    # Doors are closed: the living room is apart from what lies beyond its thin wall.
    assert parts["Living room"][0] not in (*parts["Hall"], *parts["Küche"])
    assert {round(a.floor, 3) for a in found} == {0.0}
    assert sum(a.outline.area for a in found) == pytest.approx(0.85 * sum(s.area for s in rooms), rel=0.12)
    file = reading.model.file
    for space in list(file.by_type("IfcSpace")):
        file.remove(space)
    file.write(str(tmp_path / "bare.ifc"))
    truth = scanned(tmp_path / "bare.ifc", tmp_path / "bare")
    assert truth.spaces == ()
    assert len(truth.stations) >= 4


def test_the_result_can_be_read_by_programs(house: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scanned(house, tmp_path / "a", "--json", "--clutter", "0.2")
    found = json.loads(capsys.readouterr().out)
    assert found["scans"] == len(found["files"]) - 1
    assert found["doors"] == found["doors_closed"] > 0
    assert "hide" in found["notes"][0]
