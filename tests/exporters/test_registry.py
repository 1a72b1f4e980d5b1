"""Outputs appear whole or not at all, and what cannot be written is said before the long work starts."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from buildings import building

from scan2bim.errors import ResourceError, Scan2BimError, StageError, UsageError
from scan2bim.exporters import check_targets, known_suffixes, registry, write_outputs
from scan2bim.exporters.registry import safe_file_stem


class Point:
    """An entry point whose module is a function."""

    def __init__(self, name: str, export, package: str = "scan2bim") -> None:
        self.name, self.value, self._export = name, f"{package}.{name}", export
        self.dist = SimpleNamespace(name=package)

    def load(self):
        if isinstance(self._export, Exception):
            raise self._export
        return SimpleNamespace(export=self._export)


def writes(text: str, *notes: str):
    def export(_building, path: Path) -> tuple[str, ...]:
        path.write_text(text)
        return notes

    return export


def fails(error: BaseException):
    def export(_building, path: Path) -> tuple[str, ...]:
        path.write_text("half")
        raise error

    return export


@pytest.fixture
def exporters(monkeypatch):
    points = [Point("one", writes("1", "no roof")), Point("two", writes("2"))]
    monkeypatch.setattr(registry.metadata, "entry_points", lambda group: points)
    registry._warn.cache_clear()
    registry._entry_points.cache_clear()
    yield points
    registry._entry_points.cache_clear()


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_package_declares_its_exporters():
    own = {point.name for point in metadata.entry_points(group=registry.GROUP)}
    assert own >= {"ifc", "usda", "usdc", "usdz", "json", "svg", "png", "view.png"}
    assert {".ifc", ".usdz", ".json"} <= set(known_suffixes())


def test_importing_the_registry_imports_no_exporter():
    heavy = ("pxr", "ifcopenshell", "numpy", "pydantic")
    code = f"import sys, scan2bim.exporters; print([m for m in {heavy} if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


@pytest.mark.usefixtures("exporters")
def test_a_file_is_written_and_its_notes_are_given(tmp_path):
    (item,) = write_outputs(building(), [tmp_path / "new" / "house.ONE"])
    assert item.path.read_text() == "1"
    assert (item.size, item.notes) == (1, ("no roof",))
    assert names(tmp_path / "new") == ["house.ONE"]


@pytest.mark.usefixtures("exporters")
def test_a_folder_gets_all_formats_named_after_the_building(tmp_path):
    write_outputs(building(), [tmp_path])
    assert names(tmp_path) == ["Test house.one", "Test house.two"]
    write_outputs(building(), [tmp_path / "made"])
    assert names(tmp_path / "made") == ["Test house.one", "Test house.two"]


@pytest.mark.usefixtures("exporters")
@pytest.mark.parametrize("name", ["house.dwg", "house.v2"])
def test_an_unknown_suffix_names_the_known_ones(tmp_path, name):
    with pytest.raises(UsageError, match=r"\.one, \.two"):
        check_targets([tmp_path / name])


def test_of_two_known_suffixes_the_longer_counts(exporters, tmp_path):
    exporters.append(Point("view.one", writes("view")))
    one, view = write_outputs(building(), [tmp_path / "x.one", tmp_path / "x.VIEW.one"])
    assert (one.path.read_text(), view.path.read_text()) == ("1", "view")
    assert registry.suffix_of(tmp_path / "my.view.one") == ".view.one"
    assert registry.suffix_of(tmp_path / ".one") == ""


@pytest.mark.usefixtures("exporters")
def test_checking_makes_nothing(tmp_path):
    check_targets([tmp_path / "a" / "b.one", tmp_path / "c"])
    assert names(tmp_path) == []


@pytest.mark.usefixtures("exporters")
def test_what_cannot_be_written_is_said_beforehand(tmp_path):
    (tmp_path / "folder.one").mkdir()
    (tmp_path / "file").write_text("")
    for targets, problem in (
        ([], "No output"),
        ([tmp_path / "folder.one"], "a folder of this name"),
        ([tmp_path / "file" / "x.one"], "is a file"),
        ([tmp_path / "x.one", tmp_path / "x.one"], "more than once"),
    ):
        with pytest.raises(UsageError, match=problem):
            check_targets(targets)


@pytest.mark.usefixtures("exporters")
def test_an_unwritable_folder_is_said_beforehand(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    with pytest.raises(UsageError, match="cannot write in this folder"):
        check_targets([tmp_path / "x.one"])


def test_a_third_partys_broken_exporter_is_a_warning_in_a_folder_and_an_error_when_asked_for(
    exporters, tmp_path, caplog
):
    exporters.append(Point("bad", ImportError("no such library"), "foreign"))
    write_outputs(building(), [tmp_path])
    assert names(tmp_path) == ["Test house.one", "Test house.two"]
    assert "package foreign" in caplog.text
    with pytest.raises(UsageError, match="no such library"):
        check_targets([tmp_path / "x.bad"])


def test_a_third_party_can_add_a_format_but_not_take_ours(exporters, tmp_path, caplog):
    exporters[:0] = [Point("one", writes("theirs"), "aaa"), Point("three", writes("3"), "aaa")]
    one, three = write_outputs(building(), [tmp_path / "x.one", tmp_path / "x.three"])
    assert (one.path.read_text(), three.path.read_text()) == ("1", "3")
    assert "aaa.one" in caplog.text


def test_a_failed_export_leaves_nothing_half_written_and_the_others_whole(exporters, tmp_path):
    exporters[0] = Point("one", fails(RuntimeError("boom")))
    (tmp_path / "x.one").write_text("old")
    with pytest.raises(StageError, match=r"boom.*x\.two") as caught:
        write_outputs(building(), [tmp_path / "x.one", tmp_path / "x.two"])
    assert caught.value.exit_code == 5
    assert ((tmp_path / "x.one").read_text(), names(tmp_path)) == ("old", ["x.one", "x.two"])


def test_an_exporter_that_writes_nothing_is_an_error(exporters, tmp_path):
    exporters[0] = Point("one", lambda _building, _path: ())
    with pytest.raises(Scan2BimError):
        write_outputs(building(), [tmp_path / "x.one"])
    assert names(tmp_path) == []


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), MemoryError()])
def test_a_full_disk_or_memory_is_a_resource_error(exporters, tmp_path, error):
    exporters[0] = Point("one", fails(error))
    with pytest.raises(ResourceError):
        write_outputs(building(), [tmp_path / "x.one"])
    assert names(tmp_path) == []


def test_a_full_disk_is_seen_behind_a_librarys_own_error(exporters, tmp_path, monkeypatch):
    exporters[0] = Point("one", fails(RuntimeError("cannot write")))
    monkeypatch.setattr(registry, "_free_bytes", lambda _folder: 0)
    with pytest.raises(ResourceError, match="No space left"):
        write_outputs(building(), [tmp_path / "x.one"])


def test_an_interrupt_passes_through_and_leaves_nothing(exporters, tmp_path):
    exporters[0] = Point("one", fails(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        write_outputs(building(), [tmp_path / "x.one"])
    assert names(tmp_path) == []


@pytest.mark.usefixtures("exporters")
def test_what_a_killed_run_left_is_swept_away_and_a_running_ones_is_not(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for process in (dead.pid, os.getppid()):
        (tmp_path / f".x.one.{process}.part").mkdir()
    write_outputs(building(), [tmp_path / "x.one"])
    assert names(tmp_path) == [f".x.one.{os.getppid()}.part", "x.one"]


@pytest.mark.parametrize(
    ("name", "stem"),
    [("Haus 1", "Haus 1"), ("a/b\\c:d", "a_b_c_d"), ("..", "building"), ("", "building"), ("Größe", "Größe")],
)
def test_a_display_name_becomes_a_safe_file_name(name, stem):
    assert safe_file_stem(name) == stem
    assert len(safe_file_stem("ü" * 300).encode()) <= 100


def test_an_exporter_gets_what_its_function_asks_for(exporters, tmp_path):
    def with_points(_building, path: Path, points) -> tuple[str, ...]:
        path.write_text(" ".join(points()))
        return ()

    exporters[0] = Point("one", with_points)
    write_outputs(building(), [tmp_path / "x.one"], points=lambda: iter(["a", "b"]))  # pyright: ignore
    assert (tmp_path / "x.one").read_text() == "a b"


def test_a_folder_does_not_get_what_is_only_written_by_name(exporters, tmp_path):
    exporters[0].load = lambda: SimpleNamespace(export=writes("1"), ONLY_BY_NAME=True)
    write_outputs(building(), [tmp_path / "all"])
    assert names(tmp_path / "all") == ["Test house.two"]
    write_outputs(building(), [tmp_path / "x.one"])
    assert (tmp_path / "x.one").read_text() == "1"


def test_parts_beside_a_file_are_moved_with_it_and_replace_old_ones(exporters, tmp_path):
    def with_parts(_building, path: Path) -> tuple[str, ...]:
        folder = path.parent / "x_parts"
        folder.mkdir()
        (folder / "new.dat").write_text("new")
        path.write_text("main")
        return ()

    exporters[0] = Point("one", with_parts)
    (tmp_path / "x_parts").mkdir()
    (tmp_path / "x_parts" / "old.dat").write_text("old")
    write_outputs(building(), [tmp_path / "x.one"])
    assert (names(tmp_path), names(tmp_path / "x_parts")) == (["x.one", "x_parts"], ["new.dat"])
    (tmp_path / "x_parts" / "holiday.jpg").write_text("mine")
    with pytest.raises(StageError, match=r"holiday\.jpg"):
        write_outputs(building(), [tmp_path / "x.one"])
    assert "holiday.jpg" in names(tmp_path / "x_parts")
