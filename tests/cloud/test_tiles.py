from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scan2bim.cloud.tiles import STEPS, TILE, TileIndex, TileWriter, read_tile
from scan2bim.errors import InputError

F32 = NDArray[np.float32]


def write(folder: Path, chunks: list[F32], seed: int = 0) -> TileIndex:
    """Chunks of points with the number of each, over all chunks, in its colour and station."""
    folder.mkdir(parents=True, exist_ok=True)
    done = 0
    with TileWriter(folder) as writer:
        for chunk in chunks:
            number = np.arange(done, done + len(chunk))
            rgb = np.stack([number & 255, number >> 8 & 255, number >> 16 & 255], 1).astype(np.uint8)
            writer.add(chunk, rgb, (number % 251).astype(np.uint8), (number % 65_521).astype(np.uint16))
            done += len(chunk)
    return TileIndex.load(folder)


def read_all(index: TileIndex) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.void]]:
    """Number (n,) and place (n, 3) of every point of all tiles, and its record."""
    tiles = np.unique(index.runs["tile"], axis=0)
    parts = [(tile, read_tile(index, tile)) for tile in tiles]
    records = np.concatenate([p for _, p in parts])
    place = np.concatenate([
        tile * TILE + (np.stack([p["x"], p["y"], p["z"]], 1) + 0.5) * (TILE / STEPS) for tile, p in parts
    ])  # fmt: skip
    number = records["r"].astype(np.int64) | records["g"].astype(np.int64) << 8 | records["b"].astype(np.int64) << 16
    return number, place, records


def points(count: int, extent: float, seed: int = 0) -> F32:
    return np.random.default_rng(seed).uniform(-extent, extent, (count, 3)).astype(np.float32)


@pytest.mark.parametrize("extent", [3.0, 40.0, 900.0])
def test_points_come_back_within_a_fifth_of_a_millimetre_each_once(tmp_path: Path, extent: float) -> None:
    given_points = points(2_000, extent)
    number, place, _ = read_all(write(tmp_path, [given_points]))
    np.testing.assert_array_equal(np.sort(number), np.arange(2_000))
    assert np.abs(place - given_points[number]).max() < 0.0002


def test_points_of_several_chunks_lie_together_in_their_tile(tmp_path: Path) -> None:
    chunks = [points(n, 20.0, seed) for seed, n in enumerate((1, 5_000, 0, 777))]
    everything = np.concatenate(chunks)
    number, place, _ = read_all(write(tmp_path, chunks))
    np.testing.assert_array_equal(np.sort(number), np.arange(len(everything)))
    assert np.abs(place - everything[number]).max() < 0.0002


def test_intensity_and_station_stay_with_their_point(tmp_path: Path) -> None:
    number, _, records = read_all(write(tmp_path, [points(10_000, 30.0)]))
    np.testing.assert_array_equal(records["i"], number % 251)
    np.testing.assert_array_equal(records["station"], number % 65_521)


def test_the_order_of_the_points_does_not_matter(tmp_path: Path) -> None:
    sorted_points = points(5_000, 20.0)
    sorted_points = sorted_points[np.lexsort(sorted_points.T)]
    shuffled = np.random.default_rng(1).permutation(sorted_points)
    _, first, _ = read_all(write(tmp_path / "a", [sorted_points]))
    _, second, _ = read_all(write(tmp_path / "b", [shuffled]))
    np.testing.assert_array_equal(first[np.lexsort(first.T)], second[np.lexsort(second.T)])


def test_points_on_the_borders_of_tiles_belong_to_exactly_one(tmp_path: Path) -> None:
    edges = np.array(
        [-16.0, -8.0, -1e-6, 0.0, 1e-6, 8.0, np.nextafter(np.float32(8.0), np.float32(0.0)), 16.0], np.float32
    )
    corners = np.stack(np.meshgrid(edges, edges, edges), -1).reshape(-1, 3)
    number, place, _ = read_all(write(tmp_path, [corners]))
    np.testing.assert_array_equal(np.sort(number), np.arange(len(corners)))
    assert np.abs(place - corners[number]).max() < 0.0002


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.lists(st.tuples(*[st.floats(-500, 500, width=32)] * 3), max_size=40), st.integers(1, 7))
def test_any_points_in_any_chunks_come_back(
    tmp_path_factory: pytest.TempPathFactory, values: list[tuple[float, float, float]], size: int
) -> None:
    all_points = np.array(values, np.float32).reshape(-1, 3)
    chunks = [all_points[i : i + size] for i in range(0, len(all_points), size)]
    index = write(tmp_path_factory.mktemp("any"), chunks)
    assert int(index.runs["count"].sum()) == len(all_points)
    if len(all_points):
        number, place, _ = read_all(index)
        np.testing.assert_array_equal(np.sort(number), np.arange(len(all_points)))
        assert np.abs(place - all_points[number]).max() < 0.0002


def test_a_tile_without_points_is_empty(tmp_path: Path) -> None:
    index = write(tmp_path, [points(100, 3.0)])
    assert len(read_tile(index, np.array([50, 50, 50], np.int32))) == 0


def test_a_scan_without_points_leaves_an_empty_index(tmp_path: Path) -> None:
    assert len(write(tmp_path, []).runs) == 0


def test_points_spread_over_too_many_tiles_are_refused_with_advice(tmp_path: Path) -> None:
    far = (np.arange(70_000, dtype=np.float32)[:, None] * np.array([16.0, 0.0, 0.0], np.float32)).astype(np.float32)
    with pytest.raises(InputError, match="--unit"):
        write(tmp_path, [far])


def test_a_disk_that_fills_up_within_the_last_chunk_is_an_error(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
        with pytest.raises(OSError, match="large"):
            write(tmp_path, [points(10_000, 5.0)])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
