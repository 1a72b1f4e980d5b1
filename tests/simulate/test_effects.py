from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic import COARSE, two_rooms

from scan2bim.simulate.appearance import Camera
from scan2bim.simulate.effects import Glass, World, mix_pixels
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.parts import leaves_of
from scan2bim.simulate.raycast import Caster
from scan2bim.simulate.scanner import Sweep, cast, true_ranges
from scan2bim.simulate.scene import DoorSpec, Room, Scene, Station, StoreySpec, WallSpec, WindowSpec


def room(*, door: DoorSpec | None = None, pane: bool = False, finish: str = "plain") -> Scene:
    """4 x 4 m inside, a window to the south, a door to the north, the scanner in the middle."""
    ring = [(0.0, 0.0), (4.2, 0.0), (4.2, 4.2), (0.0, 4.2)]
    walls = [
        WallSpec(f"wall {i}", a, ring[(i + 1) % 4], 0.2, True, finish=finish, left_colour=(200, 200, 200))
        for i, a in enumerate(ring)
    ]
    walls[0] = dataclasses.replace(walls[0], windows=(WindowSpec("window", 1.4, pane=pane, width=1.4),))
    if door is not None:
        walls[2] = dataclasses.replace(walls[2], doors=(door,))
    storey = StoreySpec("ground floor", tuple(walls), (Room("room", (2.0, 2.0)),))
    return Scene("room", (storey,), (Station("middle", (2.1, 2.1, 1.4)),))


def on_window(sweep: Sweep) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Points in the plane of the pane, within the frame."""
    x, y, z = sweep.world().T
    return (np.abs(y) < 0.03) & (x > 1.5) & (x < 2.7) & (z > 1.0) & (z < 2.1)


def test_a_pane_returns_some_rays_lets_most_pass_and_mirrors_a_few() -> None:
    scene = room(pane=True)
    clear = cast(scene, scene.stations[0], COARSE, 1)
    spec = dataclasses.replace(COARSE, glass=Glass(returned=0.4, mirrored=0.1))
    glazed = cast(scene, scene.stations[0], spec, 1)
    assert on_window(clear).sum() == 0
    assert 20 < on_window(glazed).sum() < 0.4 * len(clear.miss_directions)
    ghosts = glazed.world()[:, 1] < -0.5
    assert 5 < ghosts.sum() < on_window(glazed).sum()


def test_a_mirrored_ray_is_as_long_as_its_way() -> None:
    scene = room(pane=True)
    spec = dataclasses.replace(COARSE, noise=0.0, glass=Glass(returned=0.0, mirrored=1.0))
    world = cast(scene, scene.stations[0], spec, 1).world()
    ghosts = world[(world[:, 1] < -1.0) & (np.abs(world[:, 0] - 2.1) < 1.0) & (world[:, 2] > 0.2) & (world[:, 2] < 2.2)]
    # The north wall's inner face, 4.1 m before the pane, appears 4.1 m behind it.
    assert len(ghosts) > 20
    assert float(np.median(ghosts[:, 1])) == pytest.approx(-4.1, abs=1e-5)


def test_single_rays_meet_the_same_with_and_without_open3d() -> None:
    patches = build_mesh(two_rooms(0.4))
    rng = np.random.default_rng(1)
    origins = np.column_stack([rng.uniform(0.5, 3.0, 300), rng.uniform(0.5, 3.0, 300), rng.uniform(0.3, 2.2, 300)])
    directions = rng.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    a, b = (Caster(patches, name).rays(origins, directions) for name in ("auto", "numpy"))
    same = np.isclose(a.range, b.range, atol=1e-4) | (np.isinf(a.range) & np.isinf(b.range))
    assert same.mean() > 0.99


def test_mixed_pixels_lie_between_the_ranges_at_a_depth_edge_only() -> None:
    ranges = np.tile([2.0] * 10 + [3.0] * 10, 30)
    mixed = mix_pixels(ranges, (30, 20), 0.5, np.random.default_rng(1))
    changed = np.flatnonzero(mixed != ranges)
    assert set(changed % 20) == {9}
    assert 8 <= len(changed) <= 22
    assert ((mixed[changed] > 2.0) & (mixed[changed] < 3.0)).all()


def test_dark_and_slanting_surfaces_lose_rays_and_white_ones_hardly_any() -> None:
    scene = room()
    station = scene.stations[0]
    spec = dataclasses.replace(COARSE, dropout=0.01)
    usual, lossy = cast(scene, station, COARSE, 1), cast(scene, station, spec, 1)
    share = 1 - len(lossy.xyz) / len(usual.xyz)
    assert 0.005 < share < 0.05


def test_noise_grows_at_a_slant() -> None:
    scene = room()
    spec = dataclasses.replace(COARSE, growth=1.0, noise=0.003)
    sweep = cast(scene, scene.stations[0], spec, 1)
    error = np.linalg.norm(sweep.xyz, axis=1) - _true(scene, spec.step)
    z = sweep.world()[:, 2]
    # The floor 1.4 m below, straight down and at 75 degrees and more from the vertical.
    flat = np.hypot(sweep.xyz[:, 0], sweep.xyz[:, 1])
    floor = np.abs(z) < 0.02
    near, far = error[floor & (flat < 1.2)], error[floor & (flat > 1.9)]
    assert far.std() > 1.15 * near.std()


def _true(scene: Scene, step: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    found = true_ranges(scene, scene.stations[0], dataclasses.replace(COARSE, step=step), "auto").range
    return found[np.isfinite(found)]


@pytest.mark.parametrize("finish", ["paint", "wood", "cloth", "print"])
def test_a_finish_varies_a_surface_round_its_colour_and_the_same_from_everywhere(finish: str) -> None:
    camera = Camera(exposure=0.0, noise=0.0)
    plain, varied = (room(finish=f) for f in ("plain", finish))
    spec = dataclasses.replace(COARSE, camera=camera)
    a, b = (cast(scene, scene.stations[0], spec, 1) for scene in (plain, varied))
    wall = a.patch == b.patch
    difference = b.rgb[wall].astype(float) - a.rgb[wall]
    changed = np.abs(difference).max(axis=1) > 0
    assert changed.mean() > 0.2
    if finish != "print":
        assert abs(float(difference[changed].mean())) < 6.0
    again = cast(varied, varied.stations[0], spec, 2)
    np.testing.assert_array_equal(again.rgb, b.rgb)


def test_leaves_leave_the_gaps_and_meet_in_the_middle() -> None:
    door = DoorSpec("door", 1.0, 1.6, 2.1, leaves=2, gap=0.003)
    first, second = leaves_of(door)
    assert first.offset == pytest.approx(1.003)
    assert second.offset - (first.offset + first.width) == pytest.approx(0.003)
    assert second.offset + second.width == pytest.approx(2.597)
    assert (first.hinge, second.hinge) == ("start", "end")
    assert first.sill + first.height == pytest.approx(2.097)


def test_nothing_is_seen_through_the_gaps_of_a_closed_door() -> None:
    scene = room(door=DoorSpec("door", 1.5, 1.0, 2.1, gap=0.003, casing=0.0))
    world = World(build_mesh(scene))
    # The door's wall runs from (4.2, 4.2) westwards: jambs at x = 2.7 and 1.7. Straight into the gaps of 3 mm.
    for x in (2.6985, 1.7015):
        hits = world.solid(np.array([x, 2.1, 1.4]), np.array([[0.0, 1.0, 0.0]]))
        assert hits.range[0] == pytest.approx(4.1 + 0.04 - 2.1, abs=1e-5)
    # Beside them leaf and wall, flush.
    for x in (2.69, 2.71):
        hits = world.solid(np.array([x, 2.1, 1.4]), np.array([[0.0, 1.0, 0.0]]))
        assert hits.range[0] == pytest.approx(4.1 - 2.1, abs=1e-5)
