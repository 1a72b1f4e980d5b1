from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import TypeAdapter

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.ingest import ScanSummary, ingest_scan
from scan2bim.cloud.lattice import Lattice
from scan2bim.cloud.scan import Chunk, Pose, ScanHeader
from scan2bim.cloud.surfels import PLAN, TALL, Surfels, make_surfels
from scan2bim.cloud.tiles import TileWriter
from scan2bim.config import ReadSettings, SurfelSettings

F32 = NDArray[np.float32]
OBLIQUE = (Lattice(0.4, (0.013, 0.031), 0.017), Lattice(-2.3, (0.4, -7.02), 0.05))


def merged(folder: Path, scans: list[F32], order: list[int] | None = None) -> Surfels:
    """Surfels of scans whose points have the scan's number as colour and station."""
    parts: list[Path] = []
    for number in order or range(len(scans)):
        part = folder / f"scan{number}"
        part.mkdir(parents=True)
        n = len(scans[number])
        with TileWriter(part) as writer:
            writer.add(
                scans[number],
                np.full((n, 3), 40 * number, np.uint8),
                np.zeros(n, np.uint8),
                np.full(n, number, np.uint16),
            )
        summary = ScanSummary(number, "scan", n, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), None, True)
        (part / "summary.json").write_bytes(TypeAdapter(ScanSummary).dump_json(summary))
        parts.append(part)
    told: list[float] = []
    make_surfels(parts, folder, SurfelSettings(), told.append)
    assert told == sorted(told)
    return Surfels.load(folder)


def cloud(seed: int, count: int = 30_000) -> F32:
    """Points in 12 x 12 x 3 m that cross the borders of tiles, several in a voxel, none on the border of one."""
    rng = np.random.default_rng(seed)
    places = np.floor(rng.uniform(-6, 6, (count // 4, 3)) * [1, 1, 0.25] / 0.1) * 0.1 + 0.02
    return np.repeat(places, 4, axis=0).astype(np.float32) + rng.uniform(0, 0.02, (count, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def scans() -> list[F32]:
    return [cloud(seed) for seed in range(3)]


def test_every_point_counts_once_and_the_mean_is_that_of_the_points(tmp_path: Path, scans: list[F32]) -> None:
    surfels = merged(tmp_path, scans)
    points = np.concatenate(scans).astype(np.float64)
    assert int(surfels.count.sum()) == len(points)
    mean = np.average(surfels.xyz.astype(np.float64), axis=0, weights=surfels.count)
    np.testing.assert_allclose(mean, points.mean(0), atol=1e-4)


def test_a_surfel_is_the_mean_of_the_points_of_its_voxel(tmp_path: Path) -> None:
    inside = np.array([[0.01, 0.02, 0.03], [0.03, 0.04, 0.05], [0.02, 0.03, 0.07]], np.float32)
    surfels = merged(tmp_path, [inside, np.array([[-0.01, -0.02, -0.03]], np.float32)])
    assert sorted(surfels.count.tolist()) == [1, 3]
    full = surfels.pick(surfels.count == 3)
    np.testing.assert_allclose(full.xyz[0], inside.mean(0), atol=2e-4)
    assert full.spread[0] == pytest.approx(inside[:, 2].std(), abs=3e-4)
    np.testing.assert_allclose(surfels.pick(surfels.count == 1).xyz[0], [-0.01, -0.02, -0.03], atol=2e-4)


def test_no_two_surfels_share_a_voxel(tmp_path: Path, scans: list[F32]) -> None:
    surfels = merged(tmp_path, scans)
    cell = np.floor(surfels.xyz.astype(np.float64) / [PLAN, PLAN, TALL]).astype(np.int64)
    assert len(np.unique(cell, axis=0)) == len(surfels)


def test_surfels_do_not_depend_on_the_order_of_the_scans(tmp_path: Path, scans: list[F32]) -> None:
    first = merged(tmp_path / "a", scans)
    second = merged(tmp_path / "b", scans, [2, 0, 1])
    np.testing.assert_array_equal(first.count, second.count)
    np.testing.assert_allclose(first.xyz, second.xyz, atol=1e-6)
    np.testing.assert_allclose(first.rgb.astype(int), second.rgb, atol=1)


def test_surfels_do_not_depend_on_the_order_of_the_points(tmp_path: Path, scans: list[F32]) -> None:
    shuffled = [np.random.default_rng(5).permutation(scans[0])]
    first, second = merged(tmp_path / "a", scans[:1]), merged(tmp_path / "b", shuffled)
    np.testing.assert_array_equal(first.count, second.count)
    np.testing.assert_allclose(first.xyz, second.xyz, atol=1e-6)


def test_a_surfel_has_the_mean_colour_and_one_of_its_stations(tmp_path: Path) -> None:
    point = np.array([[1.02, 1.02, 1.02]], np.float32)
    surfels = merged(tmp_path, [point, point, point])
    assert surfels.rgb[0].tolist() == [40, 40, 40]
    assert surfels.station[0] in {0, 1, 2}
    assert surfels.count[0] == 3


def test_surfels_that_hang_alone_before_what_their_station_saw_are_not_trusted(tmp_path: Path) -> None:
    """A wall 3 m before a scanner, and one point half-way to it."""
    y, z = np.meshgrid(np.arange(-1.5, 1.5, 0.01), np.arange(-1.0, 1.0, 0.01))
    wall = np.column_stack([np.full(y.size, 3.0), y.ravel(), z.ravel()])
    clear = np.hypot(wall[:, 1], wall[:, 2]) > 0.03
    chunk = Chunk(np.concatenate([wall[clear], [[1.5, 0.0, 0.0]]]).astype(np.float32))
    header = ScanHeader(Path("a.e57"), 0, "a", len(chunk.xyz), np.zeros(3), Pose(np.eye(3), np.zeros(3)))
    ingest_scan(header, iter([chunk]), 0, SurveyFrame(), tmp_path, ReadSettings(), lambda _: None)
    make_surfels([tmp_path], tmp_path, SurfelSettings(), lambda _: None)
    doubtful, trusted = (Surfels.load(tmp_path, trusted=kind) for kind in (False, True))
    np.testing.assert_allclose(doubtful.xyz, [[1.5, 0.0, 0.0]], atol=1e-3)
    assert len(trusted) + 1 == len(Surfels.load(tmp_path))


@pytest.mark.parametrize("lattice", [Lattice(), *OBLIQUE])
def test_a_surfel_is_a_whole_voxel_of_the_lattice_also_across_the_sides_of_tiles(
    tmp_path: Path, lattice: Lattice
) -> None:
    points = cloud(3)
    merged(tmp_path, [points])
    make_surfels([tmp_path / "scan0"], tmp_path, SurfelSettings(), lambda _: None, lattice)
    surfels = Surfels.load(tmp_path)
    assert Lattice.load(tmp_path) == lattice
    wanted, found = (
        np.floor((lattice.own(xyz.astype(np.float64)) - [0, 0, lattice.level]) / [PLAN, PLAN, TALL]).astype(np.int64)
        for xyz in (points, surfels.xyz)
    )
    assert int(surfels.count.sum()) == len(points)
    cells = {tuple(cell) for cell in np.unique(wanted, axis=0).tolist()}
    assert len(found) == pytest.approx(len(cells), rel=0.01)  # points are kept to a tenth of a millimetre
    assert np.mean([tuple(cell) in cells for cell in found.tolist()]) > 0.99


def test_the_station_of_a_surfel_is_that_which_saw_it_most_whatever_the_order(tmp_path: Path) -> None:
    point = np.array([[1.02, 1.02, 1.02]], np.float32)
    scans = [np.repeat(point, times, axis=0) for times in (2, 5, 3)]
    for order in ([0, 1, 2], [1, 0, 2], [2, 0, 1], [0, 2, 1]):
        surfels = merged(tmp_path / "".join(map(str, order)), scans, order)
        assert surfels.station.tolist() == [1]
