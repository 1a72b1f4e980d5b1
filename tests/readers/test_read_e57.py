"""E57 files written with libE57 come back as they were, in every variant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from readers.writers import E57Scan, cloud, e57_scan, pye57, real, scaled, whole, write_e57

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers import read_chunks, read_headers, sample_points

TURN = (np.cos(0.3), 0.0, 0.0, np.sin(0.3))
SHIFT = (10.0, -4.0, 1.5)


def read_all(path: Path, index: int = 0, chunk_points: int = 128) -> tuple[ScanHeader, list[Chunk]]:
    header = read_headers(path)[index]
    return header, list(read_chunks(header, chunk_points))


def joined(chunks: list[Chunk], name: str) -> np.ndarray:
    return np.concatenate([getattr(chunk, name) for chunk in chunks])


def test_cartesian_points_colours_and_intensities_come_back_in_bounded_chunks(tmp_path: Path) -> None:
    points = cloud()
    header, chunks = read_all(write_e57(tmp_path / "a.e57", [e57_scan(points)]))
    assert header.points == 500
    assert max(len(chunk.xyz) for chunk in chunks) <= 128
    assert np.array_equal(joined(chunks, "xyz"), points.xyz)
    assert np.array_equal(joined(chunks, "rgb"), points.rgb)
    assert np.allclose(joined(chunks, "intensity"), points.intensity, atol=1e-6)


def test_files_of_pye57s_own_writer_come_back_with_pose_and_bounds(tmp_path: Path) -> None:
    points = cloud()
    data = {f"cartesian{axis}": points.xyz[:, column] for column, axis in enumerate("XYZ")}
    writer = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    writer.write_scan_raw(data, name="hall", rotation=np.array(TURN), translation=np.array(SHIFT))
    writer.close()
    header, chunks = read_all(tmp_path / "a.e57")
    assert header.pose is not None and header.name == "hall"
    common = joined(chunks, "xyz") @ header.pose.rotation.T + header.pose.translation
    truth = pye57.E57(str(tmp_path / "a.e57")).read_scan(0, ignore_missing_fields=True)
    assert np.allclose(common, np.stack([truth[f"cartesian{axis}"] for axis in "XYZ"], axis=1), atol=1e-5)
    assert header.lower is not None and header.upper is not None
    assert (common >= header.lower - 1e-3).all() and (common <= header.upper + 1e-3).all()


def test_a_pose_that_is_absent_is_unknown_and_an_identity_is_known(tmp_path: Path) -> None:
    scans = [e57_scan(cloud()), e57_scan(cloud(), rotation=(1, 0, 0, 0), translation=(0, 0, 0))]
    absent, identity = read_headers(write_e57(tmp_path / "a.e57", scans))
    assert absent.pose is None
    assert identity.pose is not None and np.array_equal(identity.pose.rotation, np.eye(3))


def test_several_scans_of_a_file_are_read_each_on_its_own(tmp_path: Path) -> None:
    first, second = cloud(300, seed=1), cloud(200, seed=2)
    path = write_e57(tmp_path / "a.e57", [e57_scan(first, name="one"), e57_scan(second, name="two")])
    assert [(header.name, header.points) for header in read_headers(path)] == [("one", 300), ("two", 200)]
    assert np.array_equal(joined(read_all(path, 1)[1], "xyz"), second.xyz)


def test_spherical_coordinates_become_cartesian_and_states_become_misses(tmp_path: Path) -> None:
    ranges, azimuth = np.array([2.0, 3.0, 0.0, 5.0]), np.array([0.0, np.pi / 2, np.pi, 0.1])
    elevation, state = np.array([0.0, 0.5, 0.0, 0.2]), np.array([0, 0, 1, 2], np.uint8)
    fields = [("sphericalRange", real(), ranges), ("sphericalAzimuth", real(), azimuth)]
    fields += [("sphericalElevation", real(), elevation), ("sphericalInvalidState", whole(0, 2), state)]
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [E57Scan(fields)]))
    expected = [[2, 0, 0], [0, 3 * np.cos(0.5), 3 * np.sin(0.5)]]
    assert np.allclose(joined(chunks, "xyz"), expected, atol=1e-6)
    assert np.allclose(joined(chunks, "misses"), [[-1, 0, 0]], atol=1e-6)
    assert sum(chunk.dropped for chunk in chunks) == 1


def test_cartesian_directions_without_range_become_unit_misses(tmp_path: Path) -> None:
    points = cloud(6)
    points.xyz[0], points.xyz[1], points.xyz[2] = (0, 0, 4), (0, 0, 0), (np.nan, 0, 0)
    state = np.array([1, 1, 1, 2, 0, 0], np.uint8)
    scan = e57_scan(points)
    scan.fields.append(("cartesianInvalidState", whole(0, 2), state))
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [scan]))
    assert np.array_equal(chunks[0].xyz, points.xyz[4:]) and np.array_equal(chunks[0].rgb, points.rgb[4:])
    assert np.array_equal(chunks[0].misses, [[0, 0, 1]])
    assert chunks[0].dropped == 3


@pytest.mark.parametrize(
    ("maker", "scale"),
    [
        (whole(0, 255), 1),
        (whole(0, 65535), 257),
        (real(single=True, low=0, high=1), 1 / 255),
        (scaled(0, 65535, 1 / 65535), 1 / 255),
    ],
)
def test_colours_of_any_type_are_stretched_to_bytes(tmp_path: Path, maker: object, scale: float) -> None:
    points = cloud()
    scan = e57_scan(points)
    values = points.rgb.astype(float) * scale
    kind = np.uint8 if scale == 1 else np.uint16 if scale == 257 else np.float64
    scan.fields[3:6] = [
        (f"color{name}", maker, values[:, column].astype(kind)) for column, name in enumerate(("Red", "Green", "Blue"))
    ]
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [scan]))
    assert np.array_equal(joined(chunks, "rgb"), points.rgb)


def test_stated_limits_of_colour_and_intensity_are_what_they_are_stretched_by(tmp_path: Path) -> None:
    points = cloud()
    scan = e57_scan(points)
    limits = {
        f"color{name}{end}": 0 if end == "Minimum" else 1023
        for name in ("Red", "Green", "Blue")
        for end in ("Minimum", "Maximum")
    }
    scan.limits = {"colorLimits": limits, "intensityLimits": {"intensityMinimum": -2048, "intensityMaximum": 2047}}
    scan.fields[3:6] = [
        (f"color{name}", whole(0, 1023), points.rgb[:, i].astype(np.uint16) * 4)
        for i, name in enumerate(("Red", "Green", "Blue"))
    ]
    scan.fields[6] = ("intensity", whole(-2048, 2047), np.round(points.intensity * 4095 - 2048).astype(np.int16))
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [scan]))
    assert np.abs(joined(chunks, "rgb").astype(int) - points.rgb).max() <= 1
    assert np.allclose(joined(chunks, "intensity"), points.intensity, atol=2e-4)


def test_scaled_integers_and_single_floats_keep_their_coordinates(tmp_path: Path) -> None:
    points = cloud()
    for maker, kind in ((scaled(-100000, 100000, 1 / 256), np.float64), (real(single=True), np.float32)):
        scan = E57Scan([(f"cartesian{axis}", maker, points.xyz[:, i].astype(kind)) for i, axis in enumerate("XYZ")])
        header, chunks = read_all(write_e57(tmp_path / "a.e57", [scan]))
        assert not header.has_colour and chunks[0].rgb is None and chunks[0].intensity is None
        assert np.allclose(joined(chunks, "xyz"), points.xyz, atol=1e-6)


def test_large_coordinates_keep_their_digits_by_the_origin(tmp_path: Path) -> None:
    points = cloud(shift=(500_000, 5_400_000, 300))
    header, chunks = read_all(write_e57(tmp_path / "a.e57", [e57_scan(points)]))
    assert chunks[0].xyz.dtype == np.float32
    assert np.abs(joined(chunks, "xyz") + header.origin - points.xyz).max() < 1e-4


def test_fields_of_extensions_and_unknown_ones_are_ignored(tmp_path: Path) -> None:
    points = cloud()
    scan = e57_scan(points)
    scan.fields.append(("nor:normalX", real(single=True), points.intensity.astype(np.float32)))
    scan.fields.append(("timeStamp", real(), points.intensity))
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [scan], extension=True))
    assert np.array_equal(joined(chunks, "xyz"), points.xyz)


def test_structured_scans_state_their_grid(tmp_path: Path) -> None:
    points = cloud(60)
    scan = e57_scan(points)
    grid = np.arange(60)
    scan.fields += [
        ("rowIndex", whole(0, 9), (grid % 10).astype(np.uint16)),
        ("columnIndex", whole(0, 5), (grid // 10).astype(np.uint16)),
    ]
    header = read_headers(write_e57(tmp_path / "a.e57", [scan]))[0]
    assert (header.columns, header.rows) == (6, 10)
    scan.limits = {"indexBounds": {"rowMinimum": 0, "rowMaximum": 59, "columnMinimum": 0, "columnMaximum": 0}}
    header = read_headers(write_e57(tmp_path / "b.e57", [scan]))[0]
    assert (header.columns, header.rows) == (None, None)


def test_points_in_the_scanners_centre_are_no_points(tmp_path: Path) -> None:
    points = cloud(10)
    points.xyz[3] = 0
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [e57_scan(points, rotation=TURN, translation=SHIFT)]))
    assert len(chunks[0].xyz) == 9 and chunks[0].dropped == 1


def test_values_that_are_not_finite_or_absurd_are_dropped_and_counted(tmp_path: Path) -> None:
    points = cloud(10)
    points.xyz[0, 0], points.xyz[1, 1], points.xyz[2, 2] = np.nan, np.inf, 1e300
    _, chunks = read_all(write_e57(tmp_path / "a.e57", [e57_scan(points)]))
    assert np.array_equal(chunks[0].xyz, points.xyz[3:]) and chunks[0].dropped == 3


def test_an_empty_scan_beside_a_full_one_is_noted_and_alone_is_refused(tmp_path: Path) -> None:
    path = write_e57(tmp_path / "a.e57", [e57_scan(cloud(0)), e57_scan(cloud(5))])
    empty, full = read_headers(path)
    assert empty.points == 0 and "no points" in empty.notes[0] and full.points == 5
    assert list(read_chunks(empty)) == []
    with pytest.raises(DamagedFileError, match="no points"):
        read_headers(write_e57(tmp_path / "b.e57", [e57_scan(cloud(0))]))


def test_a_sample_is_thinned_from_the_start_of_the_scan(tmp_path: Path) -> None:
    header = read_headers(write_e57(tmp_path / "a.e57", [e57_scan(cloud(5000))]))[0]
    sample = sample_points(header, 100)
    assert sample.xyz.shape == (100, 3) and sample.rgb is not None and sample.intensity is not None


def test_the_name_of_the_coordinate_reference_system_is_given(tmp_path: Path) -> None:
    geographic = 'GEOGCS["ETRS89",AUTHORITY["EPSG","4258"]]'
    wkt = f'PROJCS["ETRS89 / UTM zone 32N",{geographic},UNIT["metre",1],AUTHORITY["EPSG","25832"]]'
    header = read_headers(write_e57(tmp_path / "a.e57", [e57_scan(cloud())], metadata=wkt))[0]
    assert header.crs == "ETRS89 / UTM zone 32N (EPSG:25832)"
