from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from synthetic import l_shaped, rotated_flat, scanned, two_rooms, two_storeys

from scan2bim.simulate.scene import Placement, Room, Scene, StoreySpec, WallSpec
from scan2bim.simulate.truth import truth_of

SCENES = {"two rooms": two_rooms, "L": l_shaped, "two storeys": two_storeys, "flat": rotated_flat}


@pytest.fixture(params=list(SCENES), scope="module")
def scene(request: pytest.FixtureRequest) -> Scene:
    return SCENES[request.param](math.radians(30))


def test_the_rooms_of_two_rooms_have_their_exact_size() -> None:
    assert [space.area for space in truth_of(two_rooms(0.4)).spaces] == pytest.approx([16.0, 16.0], abs=1e-5)


def test_an_l_shaped_room_has_six_corners() -> None:
    hall = truth_of(l_shaped()).spaces[0]
    assert len(hall.outline) == 6
    # 5.5925 x 3.7 m up to the passage wall, and 4.2 x 1.3 m between the south wing and the north wall.
    assert hall.area == pytest.approx(5.5925 * 3.7 + 4.2 * 1.3, abs=1e-5)


def test_every_station_stands_in_a_room(scene: Scene) -> None:
    assert all(station.room for station in truth_of(scene).stations)


def test_every_inner_door_lies_between_two_rooms_and_entrances_lead_outside(scene: Scene) -> None:
    for door in truth_of(scene).doors:
        assert (door.name == "entrance") == ("" in door.spaces), door
        assert len(set(door.spaces)) == 2


def test_openings_stay_clear_of_other_walls_and_of_each_other(scene: Scene) -> None:
    for storey in scene.storeys:
        for wall in storey.walls:
            spans = sorted((o.offset, o.offset + o.width) for o in (*wall.doors, *wall.windows))
            assert all(a[1] < b[0] for a, b in itertools.pairwise(spans)), wall.name
            assert all(a >= 0.15 and b <= wall.length - 0.15 for a, b in spans), wall.name


def test_spaces_do_not_overlap(scene: Scene) -> None:
    truth = truth_of(scene)
    for storey in truth.storeys:
        polygons = [shapely.Polygon(s.outline, s.holes) for s in truth.spaces if s.storey == storey.name]
        total = sum(p.area for p in polygons)
        assert shapely.union_all(polygons).area == pytest.approx(total)
        assert sum(s.area for s in truth.spaces if s.storey == storey.name) == pytest.approx(total)


def test_turning_and_moving_a_scene_turns_and_moves_its_truth() -> None:
    plain, turned = truth_of(two_rooms(0.0)), truth_of(two_rooms(0.5))
    place = Placement(0.5)
    for a, b in zip(plain.doors, turned.doors, strict=True):
        np.testing.assert_allclose(place.points(np.array(a.corners)), b.corners, atol=1e-12)


def test_a_room_that_no_walls_enclose_is_refused() -> None:
    storey = StoreySpec("ground", (WallSpec("wall", (0.0, 0.0), (4.0, 0.0)),), (Room("nowhere", (1.0, 1.0)),))
    with pytest.raises(ValueError, match="nowhere"):
        truth_of(Scene("broken", (storey,)))


def test_wall_points_lie_on_the_true_faces_within_the_noise() -> None:
    result = scanned(two_rooms(0.6))
    points = result.points()
    for wall in result.truth.walls:
        start, end = np.array(wall.start), np.array(wall.end)
        along = (end - start) / np.linalg.norm(end - start)
        local = points[:, :2] - start
        x, y = local @ along, local @ np.array([-along[1], along[0]])
        on_face = np.abs(y - wall.thickness / 2) < 0.01
        inside = (x > 0.3) & (x < np.linalg.norm(end - start) - 0.3) & (points[:, 2] > 2.2) & (points[:, 2] < 2.45)
        assert (on_face & inside).sum() > 300
        assert abs(float(np.median(y[on_face & inside])) - wall.thickness / 2) < 5e-4


def test_a_closed_leaf_hangs_at_its_recess_and_an_open_one_leaves_the_opening_free() -> None:
    result = scanned(two_rooms())
    points = result.points()
    entrance, middle = result.truth.doors
    (x0, y, _), (x1, _, _) = entrance.corners[:2]
    leaf = points[(points[:, 0] > x0 + 0.2) & (points[:, 0] < x1 - 0.2) & (points[:, 2] > 0.3) & (points[:, 2] < 0.9)]
    near = leaf[np.abs(leaf[:, 1] - y) < 0.16]
    assert float(np.median(near[:, 1])) == pytest.approx(y + 0.15 - entrance.recess, abs=0.002)
    (x, y0, _), (_, y1, _) = middle.corners[:2]
    free = points[(np.abs(points[:, 0] - x) < 0.05) & (points[:, 1] > y0 + 0.1) & (points[:, 1] < y1 - 0.1)]
    assert not ((free[:, 2] > 0.1) & (free[:, 2] < 1.9)).any()


def test_rays_pass_the_glass() -> None:
    result = scanned(two_rooms())
    assert min(len(sweep.miss_directions) for sweep in result.sweeps) > 1000


def test_the_stair_opening_lets_one_storey_see_the_other() -> None:
    result = scanned(two_storeys())
    landing = result.sweeps[3].world()
    assert (landing[:, 2] < 2.4).sum() > 300
