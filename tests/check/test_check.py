from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Literal

import ifcopenshell
import pytest
from check import mutated_openings, mutated_places, mutated_values, mutated_walls
from check.mutations import door
from every_shape import every_shape

from scan2bim.check.model import model_of
from scan2bim.check.run import check_file, check_model
from scan2bim.cli import main
from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export

MUTATIONS = {
    name: function
    for part in (mutated_openings, mutated_walls, mutated_places, mutated_values)
    for name, function in inspect.getmembers(part, inspect.isfunction)
    if function.__module__ == part.__name__
}
_OPEN: list[ifcopenshell.file] = []


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("check") / "sound.ifc"
    export(every_shape(), path)
    return path


@pytest.mark.parametrize("version", ["IFC2X3", "IFC4", "IFC4X3_ADD2"])
def test_nothing_is_found_in_a_sound_file(tmp_path: Path, version: Literal["IFC2X3", "IFC4", "IFC4X3_ADD2"]) -> None:
    path = tmp_path / "sound.ifc"
    export(every_shape(), path, ExportSettings(ifc_version=version))
    report = check_file(path)
    assert (report.findings, report.schema) == ((), version)
    assert report.elements >= 50


def test_there_are_forty_kinds_of_damage_at_least() -> None:
    assert len(MUTATIONS) >= 40


@pytest.mark.parametrize("name", MUTATIONS)
def test_damage_is_found(sound: Path, name: str) -> None:
    damaged = ifcopenshell.open(str(sound))
    _OPEN.append(damaged)
    MUTATIONS[name](damaged)
    found = check_model(model_of(sound, damaged)).findings
    assert MUTATIONS[name].__doc__ in {finding.check for finding in found}, [(f.check, f.name) for f in found]


def test_a_finding_names_the_element_what_and_how_much(sound: Path) -> None:
    damaged = ifcopenshell.open(str(sound))
    _OPEN.append(damaged)
    MUTATIONS["door_beside_its_opening"](damaged)
    (found,) = [f for f in check_model(model_of(sound, damaged)).findings if f.check == "filling not in its opening"]
    assert (found.guid, found.name) == (door(damaged).GlobalId, "Measured door")
    assert found.amount == pytest.approx(0.6, abs=0.01)
    assert found.unit == "m"


def test_the_command_tells_by_exit_code_text_and_json(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(sound)]) == 0
    assert "nothing found" in capsys.readouterr().out
    damaged = ifcopenshell.open(str(sound))
    MUTATIONS["elevation_wrong"](damaged)
    damaged.write(str(tmp_path / "damaged.ifc"))
    assert main(["check", str(tmp_path / "damaged.ifc"), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert [f["check"] for f in report["findings"]] == ["elevation unlike the placement"]
    assert report["findings"][0]["amount"] == pytest.approx(0.5)


def test_what_is_no_ifc_file_is_an_input_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "no.ifc"
    path.write_text("not a file")
    assert main(["check", str(path)]) == 3
    assert str(path) in capsys.readouterr().err
