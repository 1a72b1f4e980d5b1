"""The same building, turned, moved or scanned in another order, is the same building."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from modelled import Modelled, Scan, merged_scan, model_of, modelled, scan_of
from numpy.typing import NDArray
from synthetic import scanned, two_rooms

from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Placement, Scene
from scan2bim.structure.shapes import WallShape

F64 = NDArray[np.float64]
SPEC = ScannerSpec(step=math.radians(0.8))


def in_scene(points: F64, model: Modelled, placement: Placement) -> F64:
    """Local plan coordinates (n, 2) in the scene's own frame."""
    xyz = np.column_stack([points, np.zeros(len(points))]) + model.shift - np.array(placement.offset)
    return (xyz @ placement.rotation())[:, :2]


def lines(model: Modelled, placement: Placement) -> F64:
    """Walls as (n, 5): ends in the scene's frame, the smaller first, and thickness; sorted."""

    def line(wall: WallShape) -> list[float]:
        ends = in_scene(np.array([wall.start, wall.end]), model, placement).tolist()
        first, last = sorted(ends, key=lambda p: (round(p[0], 1), round(p[1], 1)))
        return [*first, *last, wall.thickness]

    found = np.array([line(wall) for wall in model.walls])
    return found[np.lexsort(found.round(1).T)]


def assert_same(
    model: Modelled, placement: Placement, other: Modelled, other_placement: Placement, *, doors: bool = True
) -> None:
    """The same walls and spaces, and as many ``doors``: those want stations to be told from gaps."""
    a, b = lines(model, placement), lines(other, other_placement)
    assert a.shape == b.shape
    assert np.abs(a - b).max() < 0.01
    areas = [sorted(p.area for p in m.spaces) for m in (model, other)]
    np.testing.assert_allclose(*areas, rtol=0.01)
    if doors:
        assert len({sum(o.kind == "door" for o in m.openings) for m in (model, other)}) == 1


def moved(yaw: float, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scene:
    return dataclasses.replace(two_rooms(), placement=Placement(yaw, offset))


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.floats(-math.pi, math.pi))
def test_a_turned_building_has_the_same_walls(yaw: float) -> None:
    scene = moved(yaw)
    found = model_of([scan_of(sweep) for sweep in scanned.__wrapped__(scene, SPEC).sweeps])
    assert_same(modelled(moved(0.4), SPEC), Placement(0.4), found, scene.placement)


@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.floats(2e5, 8e5), st.floats(1e5, 9e6), st.floats(-400, 3000))
def test_a_building_far_from_the_origin_has_the_same_walls(east: float, north: float, height: float) -> None:
    scene = moved(0.4, (east, north, height))
    found = model_of([scan_of(sweep) for sweep in scanned.__wrapped__(scene, SPEC).sweeps])
    assert_same(modelled(moved(0.4), SPEC), Placement(0.4), found, scene.placement)
    (storey,) = found.structure.storeys
    assert abs(storey.floor + found.shift[2] - height) < 0.01


def test_the_order_of_the_stations_does_not_matter() -> None:
    sweeps = scanned(moved(0.4), SPEC).sweeps
    found = model_of([scan_of(sweep) for sweep in reversed(sweeps)])
    assert_same(modelled(moved(0.4), SPEC), Placement(0.4), found, Placement(0.4))


def test_a_quarter_of_the_points_gives_the_same_walls() -> None:
    random = np.random.default_rng(3)
    spec = dataclasses.replace(SPEC, step=SPEC.step / 2)
    scans = [scan_of(sweep) for sweep in scanned(moved(0.4), spec).sweeps]

    def thinned(scan: Scan) -> Scan:
        kept = np.sort(random.permutation(len(scan.chunk.xyz))[::4])
        chunk = dataclasses.replace(
            scan.chunk, xyz=scan.chunk.xyz[kept], rgb=scan.chunk.rgb[kept], intensity=scan.chunk.intensity[kept]
        )
        return Scan(dataclasses.replace(scan.header, points=len(kept)), chunk)

    found = model_of([thinned(scan) for scan in scans])
    assert_same(model_of(scans), Placement(0.4), found, Placement(0.4))


def test_one_file_without_stations_gives_the_same_walls() -> None:
    points = scanned(moved(0.4), SPEC).points()
    assert_same(
        modelled(moved(0.4), SPEC), Placement(0.4), model_of([merged_scan(points)]), Placement(0.4), doors=False
    )


def test_the_same_scans_give_the_same_result_to_the_last_digit() -> None:
    again = model_of([scan_of(sweep) for sweep in scanned(moved(0.4), SPEC).sweeps])
    first = modelled(moved(0.4), SPEC)
    assert again.structure == first.structure
    assert again.openings == first.openings
    assert again.building == first.building


def test_millimetres_with_y_up_give_the_same_walls_as_metres_with_z_up() -> None:
    sweeps = scanned(moved(0.4), SPEC).sweeps
    points = np.concatenate([sweep.world() for sweep in sweeps])
    plain = model_of([merged_scan(points)])
    tilted = model_of([merged_scan(points[:, [0, 2, 1]] * [1, 1, -1] * 1000)])
    assert (tilted.frame.unit, tilted.frame.up) == (0.001, "y")
    assert_same(plain, Placement(0.4), tilted, Placement(0.4))
