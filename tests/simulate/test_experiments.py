from __future__ import annotations

import math

import numpy as np
import pytest

from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d
from scan2bim.simulate.cases import CASES, case, occlusion_of
from scan2bim.simulate.effects import World
from scan2bim.simulate.hall import DOORS, MOST_HIDDEN, hall
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.office import office
from scan2bim.simulate.scene import DoorSpec, Scene
from scan2bim.simulate.truth import truth_of
from scan2bim.simulate.variation import SHALLOWEST, dress
from scan2bim.simulate.visibility import with_occlusion
from scan2bim.truth.values import Truth

try:
    load_open3d()
except MissingLibraryError as error:
    pytest.skip(f"placing by chance takes too long without open3d: {error}", allow_module_level=True)


def looked_at(scene: Scene) -> Truth:
    return with_occlusion(truth_of(scene), scene, World(build_mesh(scene)))


@pytest.fixture(scope="module")
def paper_hall() -> tuple[Scene, Truth]:
    scene = hall(3)
    return scene, looked_at(scene)


@pytest.fixture(scope="module")
def paper_office() -> tuple[Scene, Truth]:
    scene = office(3)
    return scene, looked_at(scene)


def test_the_hall_has_the_size_elements_and_doors_that_the_paper_states(paper_hall: tuple[Scene, Truth]) -> None:
    scene, truth = paper_hall
    columns = [box for box in scene.storeys[0].boxes if box.name.startswith("column")]
    assert len(truth.walls) + len(columns) == 29
    assert len(truth.doors) == 18
    assert {door.state for door in truth.doors} == {"closed"}
    (space,) = truth.spaces
    # Turned back, within half a wall's thickness on each side.
    c, s = math.cos(-truth.yaw), math.sin(-truth.yaw)
    plan = np.array(space.outline) @ np.array([[c, -s], [s, c]]).T
    assert np.ptp(plan, axis=0) == pytest.approx([34.0, 8.0], abs=0.25)


def test_the_doors_of_the_hall_are_as_large_as_the_papers(paper_hall: tuple[Scene, Truth]) -> None:
    _, truth = paper_hall
    for name, areas in DOORS.items():
        mine = sorted(door.width * door.height for door in truth.doors if door.wall == name)
        assert mine == pytest.approx(sorted(areas), rel=0.05)


def test_some_doors_of_the_hall_are_flush_and_nearly_of_the_walls_colour(paper_hall: tuple[Scene, Truth]) -> None:
    _, truth = paper_hall
    assert sum(d.recess == 0.0 and d.contrast is not None and 0.0 < d.contrast < 0.1 for d in truth.doors) >= 3


def test_the_hall_hides_up_to_what_the_paper_states_and_of_no_door_more_than_its_method_permits(
    paper_hall: tuple[Scene, Truth],
) -> None:
    _, truth = paper_hall
    hosts = {door.wall for door in truth.doors}
    hidden = [wall.occlusion for wall in truth.walls if wall.name in hosts and wall.occlusion is not None]
    assert 0.2 < max(hidden) < MOST_HIDDEN + 0.05
    assert max(door.occlusion or 0.0 for door in truth.doors) <= 0.3


def test_the_office_has_the_rooms_doors_windows_and_occlusion_that_the_paper_states(
    paper_office: tuple[Scene, Truth],
) -> None:
    scene, truth = paper_office
    assert (len(truth.spaces), len(truth.doors), len(truth.windows)) == (5, 6, 9)
    assert {station.room for station in truth.stations} == {space.name for space in truth.spaces}
    assert all(all(door.spaces) for door in truth.doors)
    assert {door.state for door in truth.doors} == {"open", "closed"}
    hidden = [wall.occlusion for wall in truth.walls if wall.occlusion is not None]
    assert float(np.mean(hidden)) == pytest.approx(0.14, abs=0.03)
    assert sum(box.name.startswith("pilaster") for box in scene.storeys[0].boxes) == 11


def test_the_same_seed_gives_the_same_scene_and_another_one_another() -> None:
    assert case(5) == case(5)
    assert case(5) != case(5, seed=1)


def test_the_sweep_hides_from_nothing_to_half_of_the_doors_wall() -> None:
    wanted = [occlusion_of(number) for number in range(CASES)]
    assert CASES >= 40
    assert (wanted[0], wanted[-1]) == (0.0, 0.5)
    for number in (0, 22, 38):
        truth = looked_at(case(number))
        assert truth.walls[0].occlusion == pytest.approx(wanted[number], abs=0.08)


@pytest.mark.parametrize("thickness", [0.05, 0.07, 0.074, 0.12])
def test_a_leaf_hangs_in_a_wall_however_thin_it_is(thickness: float) -> None:
    rng = np.random.default_rng(1)
    recesses = [dress(DoorSpec("door", 0.5), (200, 200, 200), thickness, rng).recess for _ in range(40)]
    assert min(recesses) >= 0.0
    assert max(recesses) <= max(thickness - 0.07, SHALLOWEST)
