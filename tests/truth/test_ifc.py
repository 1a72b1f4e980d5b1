from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from buildings import HEIGHT, building

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Covering, Dimension, Door, Window
from scan2bim.simulate.scenes import two_rooms
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.ifc import IfcReading, read_ifc, read_spaces
from scan2bim.truth.io import read_truth, write_truth
from scan2bim.truth.values import OpeningTruth


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> IfcReading:
    path = tmp_path_factory.mktemp("ifc") / "house.ifc"
    export(building(), path)
    return read_ifc(path)


def named(openings: tuple[OpeningTruth, ...], name: str) -> OpeningTruth:
    return next(one for one in openings if one.name.startswith(f"{name} ["))


def test_every_wall_space_storey_and_opening_is_read(house: IfcReading) -> None:
    model = building()
    walls = [w for s in model.storeys for w in s.walls]
    fills = [o.fill for w in walls for o in w.openings]
    truth = house.truth
    assert len(truth.walls) == len(walls)
    assert len(truth.doors) == sum(isinstance(f, Door) for f in fills)
    assert len(truth.windows) == sum(isinstance(f, Window) for f in fills)
    assert len(truth.openings) == sum(f is None for f in fills)
    assert len(truth.spaces) == sum(len(s.spaces) for s in model.storeys)
    assert [s.elevation for s in truth.storeys] == pytest.approx([s.elevation.value for s in model.storeys])
    assert truth.storeys[0].height == pytest.approx(HEIGHT)


def test_walls_have_their_axes_and_thicknesses(house: IfcReading) -> None:
    model = next(w for w in building().storeys[0].walls if w.id == "wall-g-middle")
    read = next(w for w in house.truth.walls if w.name.startswith(model.name))
    assert read.thickness == pytest.approx(model.thickness.value, abs=1e-6)
    assert np.linalg.norm(np.subtract(read.end, read.start)) == pytest.approx(7.7, abs=0.31)
    along = np.subtract(model.end, model.start) / 8.0
    for point in (read.start, read.end):
        apart = np.subtract(point, model.start)
        assert abs(along[0] * apart[1] - along[1] * apart[0]) < 1e-6


def test_openings_have_their_corners_in_the_middle_of_the_wall(house: IfcReading) -> None:
    wall = next(w for w in building().storeys[0].walls if w.id == "wall-g-middle")
    opening = wall.openings[0]
    read = next(d for d in house.truth.doors if d.width == pytest.approx(0.9) and "g-middle" in d.wall)
    along = np.subtract(wall.end, wall.start) / 8.0
    expected = np.array(wall.start) + along * opening.offset.value
    ends = [np.array(c[:2]) for c in read.corners[:2]]
    assert min(float(np.linalg.norm(expected - end)) for end in ends) < 1e-6
    assert read.corners[2][2] - read.corners[0][2] == pytest.approx(opening.height.value)


def test_doors_have_the_hinge_swing_state_and_confidence_that_the_model_states(house: IfcReading) -> None:
    for storey in building().storeys:
        for wall in storey.walls:
            for opening in wall.openings:
                door = opening.fill
                if not isinstance(door, Door):
                    continue
                read = next(d for d in house.truth.doors if d.name.startswith(f"{door.name} ["))
                runs = np.subtract(read.corners[1][:2], read.corners[0][:2])
                same_way = float(runs @ np.subtract(wall.end, wall.start)) > 0
                assert read.state == ("unknown" if door.state == "unknown" else door.state)
                assert read.confidence == pytest.approx(door.confidence)
                if "unknown" in (door.hinge_side, door.swing_side):
                    continue
                flipped = {"start": "end", "end": "start", "left": "right", "right": "left"}
                assert read.hinge == (door.hinge_side if same_way else flipped[door.hinge_side])
                assert read.swing == (door.swing_side if same_way else flipped[door.swing_side])


def test_spaces_have_their_areas_and_holes(house: IfcReading) -> None:
    hall = next(s for s in house.truth.spaces if s.name.startswith("Hall"))
    assert hall.area == pytest.approx(5.79 * 3.79, abs=0.01)
    attic = next(s for s in house.truth.spaces if s.name.startswith("Attic"))
    assert len(attic.holes) == 1


def test_a_suspended_ceiling_ends_a_space_that_the_model_draws_up_to_the_slab(tmp_path: Path) -> None:
    storey, *_ = building().storeys
    hall = next(s for s in storey.spaces if s.name.startswith("Hall"))
    ceiling = Covering(
        id="hung", name="hung", confidence=1.0, outline=hall.outline, top=Dimension(value=2.22, source="measured"),
        thickness=Dimension(value=0.02, source="assumed"),
    )  # fmt: skip
    model = building()
    model = model.model_copy(update={"storeys": (storey.model_copy(update={"coverings": (ceiling,)}),)})
    export(model, tmp_path / "hung.ifc")
    heights = {s.name.split(" [")[0]: s.height for s in read_spaces(tmp_path / "hung.ifc")}
    assert heights[hall.name] == pytest.approx(2.2, abs=1e-3)
    assert all(z == pytest.approx(HEIGHT, abs=1e-3) for name, z in heights.items() if name != hall.name)


def test_a_file_that_is_no_ifc_or_cut_off_is_refused_by_name(tmp_path: Path, house: IfcReading) -> None:
    cut = house.model.path.read_bytes()[:50_000]
    rubbish = b"ISO-10303-21;\nHEADER;\nrubbish\nEND-ISO-10303-21;"
    for content in (b"", b"# not IFC\n", cut, rubbish):
        path = tmp_path / "bad.ifc"
        path.write_bytes(content)
        with pytest.raises(DamagedFileError, match=r"bad\.ifc"):
            read_ifc(path)
    with pytest.raises(InputError, match=r"none\.ifc"):
        read_ifc(tmp_path / "none.ifc")


def test_the_truth_reads_back_and_unknown_keys_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "truth.json"
    truth = truth_of(two_rooms(0.4))
    write_truth(path, truth)
    back = read_truth(path)
    assert [d.name for d in back.doors] == [d.name for d in truth.doors]
    assert back.doors[0].corners[2] == pytest.approx(truth.doors[0].corners[2], abs=1e-5)
    document = json.loads(path.read_text())
    document["doors"][0]["colour"] = "red"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"doors\.0\.colour"):
        read_truth(path)
    path.write_text('{"format": "other"}')
    with pytest.raises(InputError, match="scan2bim truth 2"):
        read_truth(path)
