from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.ingest import ENOUGH, SPARSE, ScanSummary, ingest_scan
from scan2bim.cloud.panorama import NO_RETURN, Panorama
from scan2bim.cloud.scan import Chunk, Pose, ScanHeader
from scan2bim.cloud.tiles import POINT, SAMPLE, TileIndex
from scan2bim.config import ReadSettings

POSE = Pose(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([10.0, 20.0, 1.5]))


def ingested(
    folder: Path, chunks: list[Chunk], pose: Pose | None = POSE, frame: SurveyFrame | None = None
) -> list[float]:
    """Ingest as station 5; what progress was told."""
    told: list[float] = []
    header = ScanHeader(Path("a.e57"), 0, "a", sum(len(c.xyz) for c in chunks), np.zeros(3), pose, has_colour=True)
    ingest_scan(header, iter(chunks), 5, frame or SurveyFrame(), folder, ReadSettings(), told.append)
    return told


def some_points(count: int = 5_000) -> NDArray[np.float64]:
    return np.random.default_rng(0).uniform(-4, 4, (count, 3))


def records(folder: Path) -> NDArray[np.void]:
    return np.fromfile(TileIndex.load(folder).path, POINT)


def test_the_summary_holds_counts_bounds_and_position_in_the_local_frame(tmp_path: Path) -> None:
    points = some_points()
    ingested(tmp_path, [Chunk(points[:3000], dropped=7), Chunk(points[3000:], dropped=1)])
    summary = ScanSummary.load(tmp_path)
    local = points @ POSE.rotation.T + POSE.translation
    assert (summary.station, summary.name, summary.points, summary.dropped) == (5, "a", 5_000, 8)
    np.testing.assert_allclose(summary.lower, local.min(0), atol=1e-5)
    np.testing.assert_allclose(summary.upper, local.max(0), atol=1e-5)
    assert summary.position == (10.0, 20.0, 1.5)


def test_every_point_is_kept_with_its_station(tmp_path: Path) -> None:
    told = ingested(tmp_path, [Chunk(some_points())])
    assert len(records(tmp_path)) == 5_000
    assert set(records(tmp_path)["station"].tolist()) == {5}
    assert told == sorted(told) and told[-1] == 1.0


def test_large_coordinates_keep_their_millimetres(tmp_path: Path) -> None:
    pose = Pose(np.eye(3), np.array([500_123.4567, 5_400_321.1234, 312.0]))
    point = np.array([[1.2345, -2.3456, 0.4567]])
    ingested(tmp_path, [Chunk(point)], pose, SurveyFrame(shift=(500_123.0, 5_400_321.0, 312.0)))
    np.testing.assert_allclose(ScanSummary.load(tmp_path).lower, point[0] + [0.4567, 0.1234, 0.0], atol=2e-4)


def test_the_panorama_remembers_ranges_and_pulses_without_return(tmp_path: Path) -> None:
    north, up = np.array([[3.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]], np.float32)
    ingested(tmp_path, [Chunk(north, misses=up)])
    panorama = Panorama.load(tmp_path / "panorama.npy")
    np.testing.assert_array_equal(panorama.position, POSE.translation)
    assert (panorama.ranges > 0).sum() == 1
    assert panorama.ranges.max() == pytest.approx(3.0, abs=0.002)
    assert (panorama.ranges == NO_RETURN).sum() == 1


def test_without_a_pose_there_is_no_position_and_no_panorama(tmp_path: Path) -> None:
    ingested(tmp_path, [Chunk(some_points())], None)
    assert ScanSummary.load(tmp_path).position is None
    assert not (tmp_path / "panorama.npy").exists()


def test_colour_is_kept_and_else_taken_from_intensity_and_else_grey(tmp_path: Path) -> None:
    point = np.array([[1.0, 1.0, 1.0]])
    cases = {
        "colour": (Chunk(point, rgb=np.array([[10, 20, 30]], np.uint8)), (10, 20, 30)),
        "intensity": (Chunk(point, intensity=np.array([0.2], np.float32)), (51, 51, 51)),
        "nothing": (Chunk(point), (128, 128, 128)),
    }
    for name, (chunk, expected) in cases.items():
        (tmp_path / name).mkdir()
        ingested(tmp_path / name, [chunk])
        record = records(tmp_path / name)[0]
        assert (record["r"], record["g"], record["b"]) == expected, name


def test_a_scan_without_points_leaves_readable_results(tmp_path: Path) -> None:
    ingested(tmp_path, [])
    assert ScanSummary.load(tmp_path).points == 0
    assert len(TileIndex.load(tmp_path).runs) == 0


def test_ingesting_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        ingested(tmp_path / name, [Chunk(some_points()), Chunk(some_points(100))])
    for first in sorted(path for path in (tmp_path / "a").rglob("*") if path.is_file()):
        assert first.read_bytes() == (tmp_path / "b" / first.relative_to(tmp_path / "a")).read_bytes(), first.name


@pytest.mark.parametrize(("count", "step"), [(5_000, 1), (2 * ENOUGH, 2), (20 * ENOUGH, SPARSE)])
def test_a_scan_has_a_sample_of_its_points_all_of_a_small_one(tmp_path: Path, count: int, step: int) -> None:
    ingested(tmp_path, [Chunk(some_points(count))])
    every, some = records(tmp_path), records(tmp_path / SAMPLE)
    assert len(some) == -(-count // step)
    assert np.isin(some.view("V12"), every.view("V12")).all()
