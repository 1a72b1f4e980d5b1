"""LAS, LAZ and COPC files written with laspy come back as they were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from readers.writers import Cloud, cloud, laspy, write_copc, write_las

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.readers import read_chunks, read_headers, sample_points


def read_all(path: Path, chunk_points: int = 128) -> tuple[ScanHeader, list[Chunk]]:
    (header,) = read_headers(path)
    return header, list(read_chunks(header, chunk_points))


def check(header: ScanHeader, chunks: list[Chunk], points: Cloud, colour: bool = True) -> None:
    assert header.points == len(points.xyz) == sum(len(chunk.xyz) for chunk in chunks)
    assert max(len(chunk.xyz) for chunk in chunks) <= 128
    assert np.array_equal(np.concatenate([chunk.xyz for chunk in chunks]) + header.origin, points.xyz)
    assert header.has_colour == colour
    if colour:
        assert np.array_equal(np.concatenate([chunk.rgb for chunk in chunks if chunk.rgb is not None]), points.rgb)
    intensity = np.concatenate([chunk.intensity for chunk in chunks if chunk.intensity is not None])
    assert np.allclose(intensity, points.intensity, atol=1e-4)


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize(("form", "version"), [(0, "1.2"), (2, "1.2"), (3, "1.3"), (6, "1.4"), (7, "1.4"), (8, "1.4")])
def test_points_of_every_usual_format_come_back(tmp_path: Path, suffix: str, form: int, version: str) -> None:
    points = cloud()
    header, chunks = read_all(write_las(tmp_path / f"a.{suffix}", points, form, version))
    check(header, chunks, points, form in (2, 3, 7, 8))
    assert header.lower is not None and np.array_equal(header.lower, points.xyz.min(axis=0))
    assert header.sources == () and chunks[0].source is None


def test_copc_with_chunks_of_differing_sizes_comes_back(tmp_path: Path) -> None:
    points = cloud()
    check(*read_all(write_copc(tmp_path / "a.copc.laz", points)), points)


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_stations_are_told_apart_by_point_source_id(tmp_path: Path, suffix: str) -> None:
    sources = np.repeat([3, 1, 700], [200, 200, 100]).astype(np.uint16)
    header, chunks = read_all(write_las(tmp_path / f"a.{suffix}", cloud(), sources=sources))
    assert header.sources == (1, 3, 700)
    assert np.array_equal(np.concatenate([chunk.source for chunk in chunks if chunk.source is not None]), sources)


def test_colours_of_eight_bits_in_sixteen_are_recognised_and_black_is_no_colour(tmp_path: Path) -> None:
    points = cloud()
    check(*read_all(write_las(tmp_path / "a.laz", points, colour_step=1)), points)
    header, _ = read_all(write_las(tmp_path / "b.laz", points, colour_step=0))
    assert not header.has_colour and "no colour" in header.notes[0]


def test_large_coordinates_keep_their_digits_by_the_origin(tmp_path: Path) -> None:
    points = cloud(shift=(500_000, 5_400_000, 300))
    header, chunks = read_all(write_las(tmp_path / "a.laz", points))
    assert chunks[0].xyz.dtype == np.float32 and np.abs(chunks[0].xyz).max() < 1000
    check(header, chunks, points)


def test_crs_and_unit_come_from_wkt_and_from_geotiff_keys(tmp_path: Path) -> None:
    wkt = (
        'COMPD_CS["both",PROJCS["NAD83 / Texas",GEOGCS["NAD83",UNIT["degree",0.0174]],'
        'UNIT["US survey foot",0.3048006096],'
        'AUTHORITY["EPSG","2277"]],VERT_CS["NAVD88",UNIT["US survey foot",0.3048006096]]]'
    )
    record = laspy.VLR("LASF_Projection", 2112, "wkt", wkt.encode() + b"\0")
    (header,) = read_headers(write_las(tmp_path / "a.laz", cloud(), vlrs=[record]))
    assert header.crs == "NAD83 / Texas (EPSG:2277)"
    assert header.unit == pytest.approx(0.3048006, abs=1e-7)
    keys = np.array([1, 1, 0, 2, 3072, 0, 1, 25832, 3076, 0, 1, 9001], np.uint16).tobytes()
    record = laspy.VLR("LASF_Projection", 34735, "keys", keys)
    (header,) = read_headers(write_las(tmp_path / "b.las", cloud(), 2, "1.2", vlrs=[record]))
    assert (header.crs, header.unit) == ("EPSG:25832", 1.0)


def test_bounds_that_the_points_contradict_are_not_used(tmp_path: Path) -> None:
    raw = bytearray(write_las(tmp_path / "a.las", cloud()).read_bytes())
    raw[179:227] = bytes(48)
    (tmp_path / "b.las").write_bytes(raw)
    (header,) = read_headers(tmp_path / "b.las")
    assert header.lower is None and "not used" in header.notes[0]


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_a_sample_is_spread_over_the_file(tmp_path: Path, suffix: str) -> None:
    points = cloud(160_000)
    points.xyz[:, 0] = np.arange(160_000) / 256
    (header,) = read_headers(write_las(tmp_path / f"a.{suffix}", points))
    sample = sample_points(header, 4000)
    x = np.sort(sample.xyz[:, 0] + header.origin[0]) * 256
    assert len(x) <= 4000 and x[0] < 1000 and x[-1] > 140_000
    assert sample.rgb is not None and len(sample.rgb) == len(x)


def test_extra_bytes_are_passed_over(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.add_extra_dim(laspy.ExtraBytesParams("height above ground", "f8"))
    header.scales = np.full(3, 1 / 256)
    las, points = laspy.LasData(header), cloud()
    las.x, las.y, las.z = points.xyz.T
    for suffix in ("las", "laz"):
        las.write(str(tmp_path / f"a.{suffix}"))
        read, chunks = read_all(tmp_path / f"a.{suffix}")
        assert np.array_equal(np.concatenate([chunk.xyz for chunk in chunks]), points.xyz)
        assert not read.has_colour and not read.has_intensity
