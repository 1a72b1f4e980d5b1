"""From names to files: folders, patterns, natural order, closed formats, wrong names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from readers.writers import cloud, e57_scan, ply_columns, write_e57, write_las, write_ply, write_pts, write_text

from scan2bim.errors import ClosedFormatError, DamagedFileError, InputError
from scan2bim.readers import find_inputs, one_a_kind, read_chunks, read_headers
from scan2bim.readers.formats import CLOSED


def test_a_folder_is_searched_through_and_sorted_naturally(tmp_path: Path) -> None:
    names = ["scan10.xyz", "scan2.xyz", "b/scan1.E57", "notes.md", ".hidden/scan3.xyz", "readme.txt", "points.txt"]
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("Dear reader, see below" if name == "readme.txt" else "1 2 3\n4 5 6\n")
    found = [str(path.relative_to(tmp_path)) for path in find_inputs([tmp_path])]
    assert found == ["b/scan1.E57", "points.txt", "scan2.xyz", "scan10.xyz"]


def test_patterns_files_and_folders_are_joined_and_each_file_is_there_once(tmp_path: Path) -> None:
    for index in (1, 2, 11):
        write_text(tmp_path / f"scan{index}.xyz", cloud(5))
    found = find_inputs([str(tmp_path / "scan11.xyz"), f"{tmp_path}/scan*.xyz", tmp_path])
    assert [path.name for path in found] == ["scan11.xyz", "scan1.xyz", "scan2.xyz"]


@pytest.mark.parametrize("name", ["gone.e57", "gone*.e57", "gone/"])
def test_what_is_not_there_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="gone"):
        find_inputs([tmp_path / name])


def test_a_folder_that_may_not_be_read_is_not_called_empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(folder: Path) -> None:
        raise PermissionError(13, "Permission denied", str(folder))

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(InputError, match=r"cannot be opened: Permission denied\."):
        find_inputs([tmp_path])


def test_an_empty_folder_and_no_paths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no point cloud found"):
        find_inputs([tmp_path])
    with pytest.raises(InputError, match="no scans"):
        find_inputs([])


@pytest.mark.parametrize("suffix", sorted(CLOSED))
def test_closed_formats_are_refused_with_the_way_out(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"hall{suffix.upper()}"
    path.write_bytes(b"whatever")
    with pytest.raises(ClosedFormatError) as caught:
        find_inputs([path])
    assert caught.value.advice and caught.value.exit_code == 3
    with pytest.raises(ClosedFormatError):
        read_headers(path)


def test_a_folder_of_closed_scans_is_refused_and_among_readable_ones_each_kind_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("one.fls", "two.fls", "hall.rcp"):
        (tmp_path / "sub" / name).write_bytes(b"x")
    with pytest.raises(ClosedFormatError, match="3 such files"):
        find_inputs([tmp_path])
    write_text(tmp_path / "a.xyz", cloud(5))
    (tmp_path / "model.rvt").write_bytes(b"x")
    (tmp_path / "archive.zip").write_bytes(b"x")
    errors: list[InputError] = []
    for path in find_inputs([tmp_path]):
        try:
            assert read_headers(path)[0].path.name == "a.xyz"
        except ClosedFormatError as error:
            errors.append(error)
    assert len(errors) == 3
    recap, faro = one_a_kind(errors)
    assert "ReCap" in str(recap)
    assert "2 such files" in str(faro)


def test_a_file_is_read_as_what_it_holds_whatever_its_name(tmp_path: Path) -> None:
    points = cloud(50)
    files = {
        "LAS": write_las(tmp_path / "a.las", points),
        "E57": write_e57(tmp_path / "a.e57", [e57_scan(points)]),
        "PLY": write_ply(tmp_path / "a.ply", ply_columns(points), "ascii"),
        "PTS": write_pts(tmp_path / "a.pts", [points]),
    }
    for form, path in files.items():
        wrong = path.rename(tmp_path / f"{form}.{'pcd' if form == 'E57' else 'e57'}")
        (header,) = read_headers(wrong)
        assert f"holds {form}" in header.notes[0]
        xyz = np.concatenate([chunk.xyz for chunk in read_chunks(header)]) + header.origin
        assert np.array_equal(xyz, points.xyz)


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        (b"", "empty"),
        (b"PK\x03\x04" + bytes(100), "zip"),
        (b"\x1f\x8b" + bytes(100), "gzip"),
        (b"<html>not found</html>", "HTML"),
        (b"version https://git-lfs.github.com/spec/v1\noid", "Git LFS"),
        (b"\xff\xfe1\x00 \x002\x00", "UTF-16"),
        (bytes(5000), "begins with"),
        (b"Dear reader, this is a letter.\n", "begins with"),
    ],
)
def test_what_is_no_scan_is_told_what_it_is(tmp_path: Path, content: bytes, hint: str) -> None:
    (tmp_path / "a.e57").write_bytes(content)
    with pytest.raises(DamagedFileError, match=hint):
        read_headers(tmp_path / "a.e57")


def test_a_folder_in_place_of_a_file_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="folder"):
        read_headers(tmp_path)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("notes.foo", "x\n", "expected a point cloud .*e57"),
        ("truth.json", '{\n  "a": 1\n}', "this is a JSON file"),
    ],
)
def test_what_is_no_point_cloud_by_name_and_content_is_told_what_is_read(
    name: str, text: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(DamagedFileError, match=said):
        read_headers(tmp_path / name)


def test_points_under_an_unknown_suffix_are_read(tmp_path: Path) -> None:
    (tmp_path / "scan.foo").write_text("x y z\n1 2 3\n4 5 6\n")
    assert read_headers(tmp_path / "scan.foo")
