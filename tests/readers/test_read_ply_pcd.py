"""PLY and PCD in every encoding come back as they were."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from readers.writers import Cloud, cloud, lzf_literals, lzf_runs, pcd_fields, ply_columns, write_pcd, write_ply

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers import read_chunks, read_headers, sample_points

ENCODINGS = ["ascii", "binary_little_endian", "binary_big_endian"]


def read_all(path: Path, chunk_points: int = 128) -> tuple[ScanHeader, list[Chunk]]:
    (header,) = read_headers(path)
    return header, list(read_chunks(header, chunk_points))


def check(header: ScanHeader, chunks: list[Chunk], points: Cloud) -> None:
    assert header.points == len(points.xyz) == sum(len(chunk.xyz) for chunk in chunks)
    assert max(len(chunk.xyz) for chunk in chunks) <= 128
    assert np.array_equal(np.concatenate([chunk.xyz for chunk in chunks]) + header.origin, points.xyz)
    assert np.array_equal(np.concatenate([chunk.rgb for chunk in chunks if chunk.rgb is not None]), points.rgb)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_ply_vertices_come_back_and_faces_are_passed_over(tmp_path: Path, encoding: str, kind: str) -> None:
    points = cloud()
    tail = b"3 0 1 2\n" if encoding == "ascii" else struct.pack("<B3i", 3, 0, 1, 2)
    check(*read_all(write_ply(tmp_path / "a.ply", ply_columns(points, kind), encoding, tail=tail)), points)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_properties_stand_in_any_order(tmp_path: Path, encoding: str) -> None:
    points = cloud()
    columns = [*reversed(ply_columns(points)), ("scalar_intensity", "f4", points.intensity)]
    header, chunks = read_all(write_ply(tmp_path / "a.ply", columns, encoding))
    check(header, chunks, points)
    assert np.allclose(
        np.concatenate([chunk.intensity for chunk in chunks if chunk.intensity is not None]), points.intensity
    )


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_elements_before_the_vertices_are_skipped_and_lists_there_refused(tmp_path: Path, encoding: str) -> None:
    points = cloud()
    head = b"1 2\n3 4\n" if encoding == "ascii" else bytes(10)
    before = "element camera 2\nproperty uchar a\nproperty float b\n"
    check(*read_all(write_ply(tmp_path / "a.ply", ply_columns(points), encoding, before=before, head=head)), points)
    if encoding != "ascii":
        before = "element face 1\nproperty list uchar int vertex_indices\n"
        with pytest.raises(DamagedFileError, match="lists"):
            read_headers(write_ply(tmp_path / "b.ply", ply_columns(points), encoding, before=before))


def test_ply_colours_of_sixteen_bits_and_of_fractions_become_bytes(tmp_path: Path) -> None:
    points = cloud()
    for kind, scale in (("u2", 257.0), ("f4", 1 / 255)):
        columns = ply_columns(points)[:3]
        columns += [(name, kind, points.rgb[:, i] * scale) for i, name in enumerate(("red", "green", "blue"))]
        check(*read_all(write_ply(tmp_path / "a.ply", columns, "binary_little_endian")), points)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_large_coordinates_of_ply_keep_their_digits_by_the_origin(tmp_path: Path, encoding: str) -> None:
    points = cloud(shift=(500_000, 5_400_000, 300))
    header, chunks = read_all(write_ply(tmp_path / "a.ply", ply_columns(points, "f8"), encoding))
    assert np.abs(chunks[0].xyz).max() < 1000
    check(header, chunks, points)


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize("colour", ["f4", "u4"])
def test_pcd_points_and_packed_colours_come_back(tmp_path: Path, data: str, colour: str) -> None:
    points = cloud()
    header, chunks = read_all(write_pcd(tmp_path / "a.pcd", pcd_fields(points, colour), data))
    check(header, chunks, points)
    assert header.pose is None
    intensity = np.concatenate([chunk.intensity for chunk in chunks if chunk.intensity is not None])
    assert np.allclose(intensity, points.intensity, atol=1e-6)
    assert len(sample_points(header, 50).xyz) == 50


def test_pcd_compressed_data_larger_than_a_block_come_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scan2bim.readers.lzf._BLOCK", 10_000)
    points = cloud(5000)
    points.xyz[1000:3000] = 1.5
    for pack in (lzf_literals, lzf_runs):
        (header,) = read_headers(write_pcd(tmp_path / "a.pcd", pcd_fields(points), "binary_compressed", pack=pack))
        xyz = np.concatenate([chunk.xyz for chunk in read_chunks(header)])
        assert np.array_equal(xyz, points.xyz)


def test_pcd_viewpoint_is_the_pose_and_an_organised_cloud_has_a_grid(tmp_path: Path) -> None:
    turn = np.sqrt(0.5)
    path = write_pcd(
        tmp_path / "a.pcd", pcd_fields(cloud(60)), "binary", viewpoint=f"1 2 3 {turn} 0 0 {turn}", height=6
    )
    (header,) = read_headers(path)
    assert header.pose is not None and np.allclose(header.pose.translation, [1, 2, 3])
    assert np.allclose(header.pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert (header.columns, header.rows) == (10, 6)


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_pcd_points_that_are_no_numbers_are_dropped_and_counted(tmp_path: Path, data: str) -> None:
    points = cloud(40)
    points.xyz[::4, 0] = np.nan
    _, chunks = read_all(write_pcd(tmp_path / "a.pcd", pcd_fields(points), data))
    assert len(chunks[0].xyz) == 30 and chunks[0].dropped == 10
    assert np.array_equal(chunks[0].rgb, points.rgb[np.arange(40) % 4 != 0])
