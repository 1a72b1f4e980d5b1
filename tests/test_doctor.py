"""The check of the installation, and the loading of open3d."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import pytest

from scan2bim import doctor, numbacache
from scan2bim.cli import main
from scan2bim.doctor import Check, Need
from scan2bim.errors import UsageError
from scan2bim.geometry import raycasting
from scan2bim.geometry.raycasting import LIBRARIES, MissingLibraryError, load_open3d
from scan2bim.pipeline import convert
from scan2bim.planning import Request
from scan2bim.progress import Reporter
from scan2bim.views import make_view


def test_every_declared_package_is_looked_at() -> None:
    names = {need.name for need in doctor.requirements()}
    assert {"numpy", "ifcopenshell", "usd-core", "open3d", "laspy", "pydantic"} <= names
    assert "pytest" not in names, "extras are nobody's need"


def test_here_every_package_is_fine() -> None:
    needs = [need for need in doctor.requirements() if need.name in ("numpy", "pydantic", "rich", "shapely")]
    assert [doctor.check_package(need).state for need in needs] == ["ok"] * 4


def test_a_missing_package_is_a_fault_and_says_how_to_install_it() -> None:
    check = doctor.check_package(Need("no-such-thing", "1.0", "no-such-thing>=1.0"))
    assert (check.state, "pip install 'no-such-thing>=1.0'" in check.text) == ("fault", True)


def test_a_package_that_is_too_old_is_a_fault() -> None:
    check = doctor.check_package(Need("numpy", "999.0", "numpy>=999.0"))
    assert check.state == "fault"
    assert "expected 999.0 or later" in check.text


def test_a_package_that_cannot_be_imported_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(name: str) -> ModuleType:
        raise OSError("libfoo.so.1: cannot open shared object file")

    monkeypatch.setattr(importlib, "import_module", refuse)
    check = doctor.check_package(Need("numpy", "", "numpy"))
    assert check.state == "fault"
    assert "libfoo.so.1" in check.text


def test_open3d_is_no_fault_when_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", unknown)
    assert doctor.check_package(Need("open3d", "0.19", "open3d>=0.19")).state == "remark"
    assert doctor.check_package(Need("numpy", "1.26", "numpy>=1.26")).state == "fault"


@pytest.mark.parametrize(
    ("missing", "package"), [("libEGL.so.1", "libegl1"), ("libGL.so.1", "libgl1"), ("libX11.so.6", "libx11-6")]
)
def test_a_missing_library_is_named_with_the_package_that_brings_it(
    monkeypatch: pytest.MonkeyPatch, missing: str, package: str
) -> None:
    def refuse(name: str) -> ModuleType:
        raise OSError(f"{missing}: cannot open shared object file")

    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(raycasting, "_loads", lambda library: library != missing)
    monkeypatch.setattr(raycasting.importlib, "import_module", refuse)
    with pytest.raises(MissingLibraryError, match=f"{missing}.*sudo apt-get install {package}"):
        load_open3d()
    check = doctor.check_open3d()
    assert check.state == "remark"
    assert package in check.text


def test_libusb_comes_from_its_python_package_where_the_system_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []

    def load(name: str, mode: int = 0) -> object:
        if name == "libusb-1.0.so.0":
            raise OSError(name)
        loaded.append(name)
        return object()

    monkeypatch.setattr(raycasting.ctypes, "CDLL", load)
    assert raycasting.provide_libusb()
    assert len(loaded) == 1
    assert "libusb" in loaded[0]


def test_libraries_are_named_by_what_the_loader_looks_for() -> None:
    assert all(".so." in library and package.startswith("lib") for library, package in LIBRARIES.items())


def test_convert_works_with_remarks_and_not_with_faults() -> None:
    assert doctor.works([Check("a", "ok", ""), Check("b", "remark", "")])
    assert not doctor.works([Check("a", "ok", ""), Check("b", "fault", "")])


def test_the_place_of_numbas_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(numbacache.VARIABLE, raising=False)
    assert numbacache.numba_cache_folder() is not None
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert numbacache.numba_cache_folder() is None
    assert doctor.check_numba_cache().state == "remark"
    monkeypatch.setenv(numbacache.VARIABLE, "")
    passing = numbacache.ensure_numba_cache(tmp_path)
    assert passing.is_dir()
    assert passing != tmp_path
    monkeypatch.setattr(os, "access", lambda path, mode: str(path).startswith(str(tmp_path)))
    assert numbacache.ensure_numba_cache(tmp_path / "numba") == tmp_path / "numba"
    assert os.environ[numbacache.VARIABLE] == str(tmp_path / "numba")


@pytest.mark.parametrize("command", ["convert", "info", "verify", "next_scan"])
def test_commands_do_not_load_numba_before_it_has_its_place(command: str) -> None:
    code = f"import sys, scan2bim.commands.{command}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_conversion_gives_numba_its_place_before_it_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Path | None] = []

    def refuse(request: Request) -> NoReturn:
        assert asked == [request.work / "numba"]
        raise UsageError("refused")

    monkeypatch.setattr("scan2bim.pipeline.ensure_numba_cache", asked.append)
    monkeypatch.setattr("scan2bim.pipeline.checked_inputs", refuse)
    with pytest.raises(UsageError, match="refused"):
        convert(Request((), (), tmp_path, "x"), Reporter(make_view("quiet")))


def test_little_disk_is_a_remark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor.check_disk(tmp_path).state in ("ok", "remark")
    monkeypatch.setattr(doctor.shutil, "disk_usage", lambda place: type("Usage", (), {"free": 1e6}))
    assert doctor.check_disk(tmp_path).state == "remark"


def test_the_command_prints_its_checks_and_its_verdict(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    checks: list[Any] = [Check("Python", "ok", "3.11"), Check("disk", "remark", "small")]
    monkeypatch.setattr("scan2bim.commands.doctor.examine", lambda: tuple(checks))
    assert main(["doctor"]) == 0
    assert "convert works. Things to note: 1." in capsys.readouterr().out
    checks.append(Check("numpy", "fault", "not installed"))
    assert main(["doctor"]) == 1
    assert "FAIL  numpy: not installed" in capsys.readouterr().out
    assert main(["doctor", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["works"] is False
