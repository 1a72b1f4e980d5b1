"""The points near walls, sorted by wall."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scan2bim.cloud.tiles import TileWriter
from scan2bim.openings import near_points
from scan2bim.openings.near_points import WallPoints, points_by_wall
from scan2bim.structure.shapes import WallShape

NOISE = 0.005


def wall(start: tuple[float, float], end: tuple[float, float]) -> WallShape:
    return WallShape(start, end, 0.2, 0.002, 0.0, 2.5, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))


WALLS = (wall((1.0, 1.0), (6.0, 1.0)), wall((6.0, 1.0), (6.0, 12.0)))
"""The second reaches into the next tile."""


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Points on the left face of both walls, and as many in the middle of the room."""
    rng = np.random.default_rng(4)
    n = 3000
    faces = [w.place(rng.uniform(0, w.length, n), 0.1) for w in WALLS]
    plan = np.concatenate([*faces, rng.uniform((3.0, 4.0), (4.0, 5.0), (n, 2))]) + rng.uniform(
        -NOISE, NOISE, (3 * n, 2)
    )
    xyz = np.column_stack([plan, rng.uniform(0.1, 2.4, len(plan))]).astype(np.float32)
    grey, station = np.zeros(len(xyz), np.uint8), np.arange(len(xyz), dtype=np.uint16) % 5
    folder = tmp_path / "scan"
    folder.mkdir()
    with TileWriter(folder) as writer:
        writer.add(xyz, np.repeat(grey[:, None], 3, 1), grey, station)
    return folder


def sums(found: dict[int, WallPoints]) -> list[float]:
    return [float(p.along.sum() + p.across.sum() + p.up.sum() + p.station.sum()) for _, p in sorted(found.items())]


def test_each_wall_gets_the_points_on_its_faces_and_no_others(scan: Path, tmp_path: Path) -> None:
    found = dict(points_by_wall([scan], WALLS, tmp_path))
    for k, points in found.items():
        on_face = np.abs(points.across - 0.1) < NOISE + 0.001
        assert on_face.sum() == pytest.approx(3000, abs=60)
        assert len(points.along) < 3300  # those of the other wall beside the corner, too
        assert points.along.min() > 0.0 and points.along.max() < WALLS[k].length
        assert points.up.min() > 0.09 and points.up.max() < 2.41


def test_what_waits_in_memory_and_what_waits_in_a_file_are_the_same(
    scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_memory = dict(points_by_wall([scan], WALLS, tmp_path))
    monkeypatch.setattr(near_points, "WAITING", 0)
    in_a_file = dict(points_by_wall([scan], WALLS, tmp_path))
    for k, points in in_memory.items():
        assert np.array_equal(points.along, in_a_file[k].along)
        assert np.array_equal(points.station, in_a_file[k].station)


def test_a_wall_without_points_comes_too(scan: Path, tmp_path: Path) -> None:
    far = wall((100.0, 1.0), (106.0, 1.0))
    found = dict(points_by_wall([scan], [*WALLS, far], tmp_path))
    assert sorted(found) == [0, 1, 2] and len(found[2].along) == 0


def test_two_runs_in_one_folder_do_not_disturb_each_other_and_leave_nothing(scan: Path, tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    alone = sums(dict(points_by_wall([scan], WALLS, folder)))
    first, second = points_by_wall([scan], WALLS, folder), points_by_wall([scan], WALLS[::-1], folder)
    both = list(zip(first, second, strict=True))
    assert sums(dict(a for a, _ in both)) == alone
    assert sums({1 - k: points for k, points in (b for _, b in both)}) == pytest.approx(alone, rel=1e-5)
    assert not list(folder.iterdir())
