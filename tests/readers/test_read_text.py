"""XYZ and its kin, PTS and PTX: separators, headers, meanings of columns, several scans, poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from readers.writers import Cloud, cloud, ptx_text, text_rows, write_pts, write_text

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers import read_chunks, read_headers, sample_points


def read_all(path: Path, index: int = 0, chunk_points: int = 128) -> tuple[ScanHeader, list[Chunk]]:
    header = read_headers(path)[index]
    return header, list(read_chunks(header, chunk_points))


def check(header: ScanHeader, chunks: list[Chunk], points: Cloud, what: str = "xyzirgb") -> None:
    assert header.points == len(points.xyz) == sum(len(chunk.xyz) for chunk in chunks)
    assert max(len(chunk.xyz) for chunk in chunks) <= 128
    assert np.array_equal(np.concatenate([chunk.xyz for chunk in chunks]) + header.origin, points.xyz)
    assert header.has_colour == ("rgb" in what) and header.has_intensity == ("i" in what)
    if "rgb" in what:
        assert np.array_equal(np.concatenate([chunk.rgb for chunk in chunks if chunk.rgb is not None]), points.rgb)
    if "i" in what:
        intensity = np.concatenate([chunk.intensity for chunk in chunks if chunk.intensity is not None])
        assert np.allclose(intensity, points.intensity, atol=1e-6)


@pytest.mark.parametrize("what", ["xyz", "xyzi", "xyzrgb", "xyzirgb"])
@pytest.mark.parametrize("separator", [" ", ",", ";", "\t", ", ", "   "])
def test_columns_are_found_by_their_values_whatever_separates_them(tmp_path: Path, what: str, separator: str) -> None:
    points = cloud()
    check(*read_all(write_text(tmp_path / "a.xyz", points, what=what, separator=separator)), points, what)


@pytest.mark.parametrize(
    "how",
    [
        {"head": "//X,Y,Z,Intensity,R,G,B\n", "separator": ","},
        {"head": "# made by a program\nx y z intensity red green blue\n"},
        {"head": "\ufeffX;Y;Z;Scalar_Intensity;R;G;B\n", "separator": ";"},
        {"head": "500\n"},
        {"end": "\r\n"},
        {"end": "\r"},
        {"end": " \n"},
        {"end": "\n\n# a comment\n"},
        {"separator": ";", "decimal": ","},
        {"separator": " ", "decimal": ","},
    ],
)
def test_heads_line_ends_comments_and_decimal_commas_are_understood(tmp_path: Path, how: dict[str, Any]) -> None:
    points = cloud()
    header, chunks = read_all(write_text(tmp_path / "a.txt", points, **how))
    if "comment" in how.get("end", ""):
        header = read_headers(write_text(tmp_path / "b.txt", points))[0]
    check(header, chunks, points)


def test_names_settle_an_unusual_order(tmp_path: Path) -> None:
    points = cloud(50)
    rows = [
        f"{i},{r} {g} {b},{z} {y} {x}"
        for i, (r, g, b), (x, y, z) in zip(range(50), points.rgb, points.xyz, strict=True)
    ]
    (tmp_path / "a.csv").write_text("id,red green blue,Z [m] Y [m] X [m]\n" + "\n".join(rows))
    check(*read_all(tmp_path / "a.csv"), points, "xyzrgb")


def test_normals_are_not_taken_for_colours_and_fractions_are(tmp_path: Path) -> None:
    points = cloud(50)
    normals = np.linspace(-1, 1, 50)
    (tmp_path / "a.xyz").write_text(
        "".join(f"{x} {y} {z} {n} {n} {n}\n" for (x, y, z), n in zip(points.xyz, normals, strict=True))
    )
    check(*read_all(tmp_path / "a.xyz"), points, "xyz")
    rows = zip(points.xyz, points.rgb / 255, strict=True)
    (tmp_path / "b.xyz").write_text("".join(f"{x} {y} {z} {r} {g} {b}\n" for (x, y, z), (r, g, b) in rows))
    check(*read_all(tmp_path / "b.xyz"), points, "xyzrgb")


def test_numbers_of_every_spelling_are_read(tmp_path: Path) -> None:
    words = [
        "1",
        "-1.5",
        "+2.",
        ".25",
        "-.5e1",
        "1E-3",
        "12345678.123456789",
        "0.1",
        "1.7976931348623157e2",
        "5D2",
        "nan",
        "-inf",
        "1.#QNAN",
    ]
    (tmp_path / "a.xyz").write_text("".join(f"{word} 2 3\n" for word in words))
    header = read_headers(tmp_path / "a.xyz")[0]
    (chunk,) = read_chunks(header)
    expected = [float(word.replace("D", "e")) for word in words[:-3]]
    assert np.allclose(chunk.xyz[:, 0] + header.origin[0], expected, rtol=1e-7) and chunk.dropped == 3


def test_large_coordinates_keep_their_digits_by_the_origin(tmp_path: Path) -> None:
    points = cloud(shift=(500_000, 5_400_000, 300))
    header, chunks = read_all(write_text(tmp_path / "a.xyz", points))
    assert np.abs(chunks[0].xyz).max() < 1000
    check(header, chunks, points)


def test_a_line_that_is_no_point_is_named_by_its_number(tmp_path: Path) -> None:
    rows = text_rows(cloud(300), what="xyz")
    rows[200] = "1.0 2.0"
    (tmp_path / "a.xyz").write_text("\n".join(rows))
    header = read_headers(tmp_path / "a.xyz")[0]
    with pytest.raises(DamagedFileError, match=r"line 201 should hold 3 numbers, holds '1\.0 2\.0'"):
        list(read_chunks(header))


def test_a_sample_is_spread_over_the_file(tmp_path: Path) -> None:
    points = cloud(60_000)
    points.xyz[:, 0] = np.arange(60_000)
    header = read_headers(write_text(tmp_path / "a.xyz", points, what="xyz"))[0]
    x = sample_points(header, 4000).xyz[:, 0] + header.origin[0]
    assert len(x) <= 4000 and x.min() < 1000 and x.max() > 50_000


@pytest.mark.parametrize("what", ["xyz", "xyzi", "xyzrgb", "xyzirgb"])
def test_pts_blocks_are_scans(tmp_path: Path, what: str) -> None:
    first, second = cloud(300, seed=1), cloud(200, seed=2)
    path = write_pts(tmp_path / "a.pts", [first, second], what)
    assert [header.points for header in read_headers(path)] == [300, 200]
    check(*read_all(path, 0), first, what)
    check(*read_all(path, 1), second, what)


def test_pts_without_a_count_is_read_as_plain_text(tmp_path: Path) -> None:
    points = cloud()
    check(*read_all(write_text(tmp_path / "a.pts", points)), points)


def test_pts_intensities_of_leica_are_stretched(tmp_path: Path) -> None:
    values = np.linspace(-2000, 2000, 50).astype(int)
    (tmp_path / "a.pts").write_text("50\n" + "".join(f"{value} 1 2 {value} 9 9 9\n" for value in values))
    _, chunks = read_all(tmp_path / "a.pts")
    assert np.allclose(chunks[0].intensity, (values + 2048) / 4095)


def turned(angle: float, shift: tuple[float, float, float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = shift
    return matrix


def test_ptx_scans_have_poses_grids_and_no_returns(tmp_path: Path) -> None:
    first, second = cloud(60, seed=1), cloud(20, seed=2)
    first.xyz[::6] = 0
    matrix = turned(0.3, (5, 6, 7))
    text = ptx_text(first, 10, 6, matrix, (5, 6, 7)) + ptx_text(second, 4, 5, turned(-1, (1, 2, 3)), (1, 2, 3))
    (tmp_path / "a.ptx").write_text(text)
    header, chunks = read_all(tmp_path / "a.ptx")
    assert header.pose is not None and np.allclose(header.pose.rotation, matrix[:3, :3])
    assert np.allclose(header.pose.translation, [5, 6, 7]) and (header.columns, header.rows) == (10, 6)
    kept = first.xyz.any(axis=1)
    assert np.array_equal(chunks[0].xyz, first.xyz[kept]) and np.array_equal(chunks[0].rgb, first.rgb[kept])
    assert chunks[0].dropped == 10
    header, chunks = read_all(tmp_path / "a.ptx", 1)
    check(header, chunks, second)


def test_ptx_in_the_common_frame_is_taken_back_to_its_scanner(tmp_path: Path) -> None:
    points = cloud(20, shift=(3000, 2000, 0))
    (tmp_path / "a.ptx").write_text(ptx_text(points, 4, 5, np.eye(4), (3000, 2000, 1.5)))
    header, chunks = read_all(tmp_path / "a.ptx")
    assert header.pose is not None and np.allclose(header.pose.translation, [3000, 2000, 1.5])
    common = (chunks[0].xyz + header.origin) @ header.pose.rotation.T + header.pose.translation
    assert np.abs(common - points.xyz).max() < 1e-6 and np.abs(chunks[0].xyz).max() < 10


def test_ptx_with_a_matrix_that_is_no_motion_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.ptx").write_text(ptx_text(cloud(20), 4, 5, np.diag([2.0, 2, 2, 1]), (0, 0, 0)))
    with pytest.raises(DamagedFileError, match="no rotation"):
        read_headers(tmp_path / "a.ptx")
