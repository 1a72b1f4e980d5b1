"""The structure of whole scenes: ray-cast scans on one side, the exact truth on the other."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
from modelled import Modelled, modelled, overlap, true_spaces
from numpy.typing import NDArray
from shapely.geometry import LineString
from synthetic import FINE, Scanned, l_shaped, rotated_flat, scanned, two_rooms, two_storeys

from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Scene
from scan2bim.structure.shapes import StructureShape, WallShape
from scan2bim.truth.values import WallTruth

F64 = NDArray[np.float64]
SPEC = ScannerSpec(step=math.radians(0.7))
SCENES: dict[str, Scene] = {
    "two rooms": two_rooms(0.4),
    "two rooms at 45 degrees": two_rooms(math.radians(45)),
    "L": l_shaped(),
    "L turned": l_shaped(1.2),
    "two storeys": two_storeys(0.4),
    "flat": rotated_flat(),
}


@pytest.fixture(params=list(SCENES), scope="module")
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def truth(name: str) -> Scanned:
    return scanned(SCENES[name], SPEC)


@pytest.fixture(scope="module")
def model(name: str) -> Modelled:
    return modelled(SCENES[name], SPEC)


def storey_number(name: str, truth: Scanned) -> int:
    return [s.name for s in truth.truth.storeys].index(name)


def room_overlaps(model: Modelled, truth: Scanned) -> dict[str, float]:
    """Of every true room with the best of the spaces found in its storey."""
    polygons = true_spaces(truth)
    found = [[space.polygon for space in s.spaces] for s in model.structure.storeys]
    numbers = {space.name: storey_number(space.storey, truth) for space in truth.truth.spaces}
    return {room: max(overlap(other, polygons[room]) for other in found[number]) for room, number in numbers.items()}


def counterpart(wall: WallTruth, model: Modelled, truth: Scanned) -> WallShape:
    """The found wall whose axis is nearest to the middle of a true wall, among those that run alike."""
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    walls = model.structure.storeys[storey_number(wall.storey, truth)].walls
    alike = [w for w in walls if abs(along @ direction(w)) > 0.999]
    return min(alike, key=lambda w: LineString([w.start, w.end]).distance(shapely.Point((start + end) / 2)))


def direction(wall: WallShape) -> F64:
    along = np.array(wall.end) - np.array(wall.start)
    return along / np.linalg.norm(along)


def off_axis(points: F64, wall: WallTruth) -> F64:
    """Distance of points (n, 2) to the left of a true wall's centre line, metres (n,)."""
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    return (points - start) @ np.array([-along[1], along[0]])


def test_storeys_lie_where_they_are(model: Modelled, truth: Scanned) -> None:
    found, true = model.structure.storeys, truth.truth.storeys
    assert [s.floor for s in found] == pytest.approx([s.elevation for s in true], abs=0.01)
    assert [s.ceiling for s in found] == pytest.approx([s.elevation + s.height for s in true], abs=0.01)


def test_every_room_is_a_space_of_its_own_shape_and_there_are_no_others(model: Modelled, truth: Scanned) -> None:
    overlaps = room_overlaps(model, truth)
    assert min(overlaps.values()) > 0.95, overlaps
    assert [len(s.spaces) for s in model.structure.storeys] == [
        sum(space.storey == s.name for space in truth.truth.spaces) for s in truth.truth.storeys
    ]


def test_areas_and_heights_of_spaces_are_those_of_the_rooms(model: Modelled, truth: Scanned) -> None:
    true = sorted((s.area for s in truth.truth.spaces), reverse=True)
    assert sorted((p.area for p in model.spaces), reverse=True) == pytest.approx(true, rel=0.05)
    for storey in model.structure.storeys:
        for space in storey.spaces:
            assert space.ceiling == pytest.approx(storey.ceiling, abs=0.01)
            assert 0.25 < space.floor_share <= 1.0
            assert 0.4 < space.ceiling_share <= 1.0


def test_inner_walls_have_their_axis_and_thickness_within_15_millimetres(model: Modelled, truth: Scanned) -> None:
    for wall in (w for w in truth.truth.walls if not w.external):
        found = counterpart(wall, model, truth)
        assert np.abs(off_axis(np.array([found.start, found.end]), wall)).max() < 0.015, wall.name
        assert found.thickness == pytest.approx(wall.thickness, abs=0.015), wall.name
        assert found.thickness_sigma is not None
        assert found.faces == 2


def test_outer_walls_have_their_inner_face_within_15_millimetres(model: Modelled, truth: Scanned) -> None:
    for wall in (w for w in truth.truth.walls if w.external):
        found = counterpart(wall, model, truth)
        # The scenes' outer walls run counter-clockwise, so that the inside is on their left.
        inner = np.abs(off_axis(np.array([found.start, found.end]), wall)) + found.thickness / 2 - wall.thickness / 2
        assert np.abs(inner).max() < 0.015, wall.name
        assert found.thickness_sigma is None
        assert found.faces == 1


def test_no_wall_stands_where_there_is_none(model: Modelled, truth: Scanned) -> None:
    assert [len(s.walls) for s in model.structure.storeys] == [
        sum(w.storey == s.name for w in truth.truth.walls) for s in truth.truth.storeys
    ]


def test_walls_are_as_high_as_their_rooms(model: Modelled) -> None:
    for storey in model.structure.storeys:
        for wall in storey.walls:
            assert wall.base == pytest.approx(storey.floor, abs=1e-3)
            assert wall.top == pytest.approx(storey.ceiling, abs=0.01)
            assert wall.top_seen


def test_every_wall_is_joined_at_both_ends_and_ends_lie_on_the_other_axis(model: Modelled) -> None:
    for storey in model.structure.storeys:
        for wall in storey.walls:
            assert {join.at for join in wall.joins} == {"start", "end"}
            for join in wall.joins:
                other = storey.walls[join.other]
                end = shapely.Point(wall.start if join.at == "start" else wall.end)
                assert LineString([other.start, other.end]).distance(end) < 1e-3


def test_spaces_lie_beside_their_walls(model: Modelled) -> None:
    for storey in model.structure.storeys:
        for wall in storey.walls:
            left = np.array([-direction(wall)[1], direction(wall)[0]])
            for numbers, side in ((wall.left, 1.0), (wall.right, -1.0)):
                ends = np.array([wall.start, wall.end]) + side * (wall.thickness / 2 + 0.1) * left
                for number in numbers:
                    assert storey.spaces[number].polygon.intersection(LineString(ends)).length > 0.3
            assert wall.left or wall.right


def test_the_main_direction_is_that_of_the_scene(model: Modelled, truth: Scanned) -> None:
    off = math.remainder(model.structure.yaw - truth.truth.yaw, math.pi / 2)
    assert abs(off) < 0.002


def test_what_was_found_survives_being_saved(model: Modelled, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("structure") / "structure.json"
    model.structure.save(path)
    assert StructureShape.load(path) == model.structure
    assert dataclasses.asdict(StructureShape.load(path)) == dataclasses.asdict(model.structure)


def test_rooms_do_not_leak_past_the_end_of_a_partition() -> None:
    for yaw in (0.2, 1.2):
        overlaps = room_overlaps(modelled(two_storeys(yaw), SPEC), scanned(two_storeys(yaw), SPEC))
        assert min(overlaps.values()) > 0.95, (yaw, overlaps)


def test_a_tall_wardrobe_is_no_part_of_the_walls() -> None:
    for yaw in (-0.35, math.pi / 4, 1.2):
        truth, model = scanned(rotated_flat(yaw), FINE), modelled(rotated_flat(yaw), FINE)
        assert room_overlaps(model, truth)["bedroom"] > 0.95, yaw
        assert len(model.walls) == len(truth.truth.walls), yaw
