from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pye57
import pytest
from synthetic import COARSE, rotated_flat, scanned, two_rooms, two_storeys, write_scene

from scan2bim.geometry.raycasting import MissingLibraryError
from scan2bim.simulate.e57 import RESOLUTION, write_e57
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.raycast import first_hits
from scan2bim.simulate.scanner import ScannerSpec, Sweep, cast, directions_of, true_ranges
from scan2bim.simulate.scene import Scene


@pytest.mark.parametrize("scene", [rotated_flat(), two_storeys(0.3)], ids=["flat", "two storeys"])
def test_both_casters_give_the_same_ranges(scene: Scene) -> None:
    station = scene.stations[2]
    mine = true_ranges(scene, station, COARSE, "numpy").range
    try:
        other = true_ranges(scene, station, COARSE, "open3d").range
    except MissingLibraryError as error:
        pytest.skip(f"open3d cannot be loaded here: {error}")
    same = np.isclose(mine, other, atol=1e-4, rtol=0.0, equal_nan=False) | (np.isinf(mine) & np.isinf(other))
    # Rays that graze an edge may fall to either side of it in open3d's float32.
    assert (~same).mean() < 2e-4


def test_a_ray_meets_the_nearest_patch_where_geometry_says() -> None:
    patches = build_mesh(two_rooms())
    down, east = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    hits = first_hits(patches, np.array([2.0, 2.0, 2.2]), np.stack([down, east]), "numpy")
    np.testing.assert_allclose(hits.range, [2.2, 2.15], atol=1e-12)
    assert [patches.names[patches.element[i]] for i in hits.patch] == ["floor ground floor west room", "middle wall"]


def test_the_same_seed_gives_the_same_sweep_and_another_one_another() -> None:
    scene = two_rooms()
    a, b, c = (cast(scene, scene.stations[0], COARSE, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.xyz, b.xyz)
    np.testing.assert_array_equal(a.rgb, b.rgb)
    assert not np.array_equal(a.xyz, c.xyz)


def test_range_noise_has_the_stated_deviation() -> None:
    scene = two_rooms()
    spec = dataclasses.replace(COARSE, noise=0.005)
    sweep = cast(scene, scene.stations[0], spec, 3)
    true = true_ranges(scene, scene.stations[0], spec, "auto").range
    error = np.linalg.norm(sweep.xyz, axis=1) - true[np.isfinite(true)]
    assert float(error.std()) == pytest.approx(0.005, rel=0.05)


def test_rows_run_downwards_and_columns_counter_clockwise() -> None:
    directions, row, column = directions_of(math.radians(1.0))
    assert directions[row == 0, 2].min() > directions[row == 1, 2].max()
    level = np.abs(directions[:, 2]).argmin()
    first, second = (directions[(row == row[level]) & (column == c)][0] for c in (0, 1))
    assert np.cross(first, second)[2] > 0


def test_registration_errors_move_the_written_pose_only() -> None:
    scene = two_rooms()
    rough = cast(scene, scene.stations[0], dataclasses.replace(COARSE, registration=0.01), 5)
    exact = cast(scene, scene.stations[0], COARSE, 5)
    np.testing.assert_array_equal(rough.xyz, exact.xyz)
    assert 0.001 < float(np.linalg.norm(rough.translation - exact.translation)) < 0.05


def read(path: Path) -> tuple[pye57.E57, dict[str, Any]]:
    file = pye57.E57(str(path))
    return file, file.read_scan(0, intensity=True, colors=True, row_column=True)


def in_file_order(sweep: Sweep) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.lexsort((sweep.row, sweep.column))


def test_a_written_e57_holds_the_sweep(tmp_path: Path) -> None:
    sweep = scanned(two_rooms(0.8), COARSE).sweeps[1]
    write_e57(tmp_path / "a.e57", [sweep])
    file, data = read(tmp_path / "a.e57")
    order = in_file_order(sweep)
    world = np.column_stack([data[f"cartesian{axis}"] for axis in "XYZ"])
    np.testing.assert_allclose(world, sweep.world()[order], atol=RESOLUTION)
    np.testing.assert_array_equal(data["colorGreen"], sweep.rgb[order, 1])
    np.testing.assert_array_equal(data["rowIndex"], sweep.row[order])
    np.testing.assert_allclose(data["intensity"] / 255, sweep.intensity[order], atol=0.002)
    np.testing.assert_allclose(file.get_header(0).translation, sweep.translation)
    np.testing.assert_allclose(file.get_header(0).rotation_matrix, sweep.rotation, atol=1e-12)
    file.close()


def test_misses_are_written_as_directions_without_range(tmp_path: Path) -> None:
    sweep = scanned(two_rooms(), COARSE).sweeps[0]
    write_e57(tmp_path / "a.e57", [sweep])
    file = pye57.E57(str(tmp_path / "a.e57"))
    data = file.read_scan_raw(0)
    missed = data["cartesianInvalidState"] == 1
    assert missed.sum() == len(sweep.miss_directions) > 0
    xyz = np.column_stack([data[f"cartesian{axis}"][missed] for axis in "XYZ"])
    order = np.lexsort((sweep.miss_row, sweep.miss_column))
    cosine = np.einsum("ij,ij->i", xyz / np.linalg.norm(xyz, axis=1, keepdims=True), sweep.miss_directions[order])
    assert cosine.min() > 1 - 1e-8
    file.close()


def test_writing_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_scene(tmp_path / name, two_rooms(), ScannerSpec(step=math.radians(2.0)))
    for first in sorted((tmp_path / "a").iterdir()):
        assert first.read_bytes() == (tmp_path / "b" / first.name).read_bytes()


def test_a_written_file_knows_its_bounds_in_the_common_frame(tmp_path: Path) -> None:
    sweep = scanned(two_rooms(0.8), COARSE).sweeps[1]
    write_e57(tmp_path / "a.e57", [sweep])
    file = pye57.E57(str(tmp_path / "a.e57"))
    bounds = file.get_header(0)["cartesianBounds"]
    assert bounds["xMinimum"].value() == pytest.approx(float(sweep.world()[:, 0].min()))
    file.close()
