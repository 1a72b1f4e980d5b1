"""The sample flat as a simulator sees it: its doors open inside the building, and a body gets from room to room."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from simulation import RADIUS, Rooms, Simulation

from scan2bim.model.io import load_building
from scan2bim.model.shapes import opening_outline, wall_footprints


@pytest.fixture(scope="module")
def stage(converted_flat: tuple[Path, str]) -> Path:
    return converted_flat[0] / "flat.usdc"


@pytest.fixture(scope="module")
def rooms(converted_flat: tuple[Path, str]) -> Rooms:
    return Rooms(converted_flat[0] / "flat.nav.json")


def test_each_door_opens_inside_the_building(stage: Path) -> None:
    simulation = Simulation(stage)
    opened = simulation.push_doors()
    assert len(opened) >= 4
    for hinge in simulation.hinges:
        assert opened[hinge.name] == pytest.approx(max(hinge.high, -hinge.low), abs=1.5)
        assert opened[hinge.name] > 80


def test_a_body_passes_each_open_doorway_from_room_to_room(stage: Path, rooms: Rooms) -> None:
    (storey,) = rooms.storeys
    ways = rooms.ways(storey)
    assert len(ways) >= 5
    for way in ways:
        path = rooms.path(way)
        assert path is not None, way
        door = rooms.doors[way["via"]]
        track = Simulation(stage, door["guid"], (*path[0], door["position"][2])).drive(path)
        assert np.hypot(*(track[-1] - path[-1])) < 0.05, door["name"]


def test_a_closed_door_stops_a_body(stage: Path, rooms: Rooms) -> None:
    """Driven against the side that a leaf swings to: from the other it would push it open."""
    for door in rooms.doors.values():
        if not door["hinges"]:
            continue
        left, right = (np.array(point[:2]) for point in door["approach"])
        hinge, middle = np.array(door["hinges"][0]), np.array(door["position"][:2])
        start, end = (left, right) if np.dot(hinge - middle, left - right) > 0 else (right, left)
        simulation = Simulation(stage, "", (*start, door["position"][2]))
        track = simulation.drive(np.array([start, end]))
        assert np.dot(track[-1] - middle, start - end) > 0, door["name"]


def test_a_body_passes_no_wall(converted_flat: tuple[Path, str], stage: Path, rooms: Rooms) -> None:
    """Driven from the middle of each room in eight directions to far outside it, it stays out of the walls."""
    (storey,) = load_building(converted_flat[0] / "flat.json").storeys
    ways = [opening_outline(w, o) for w in storey.walls for o in w.openings if o.sill.value < 0.1]
    walls = shapely.union_all([shapely.Polygon(ring) for ring in wall_footprints(storey).values()])
    walls = walls.difference(shapely.union_all([shapely.Polygon(ring).buffer(0.01) for ring in ways]))
    for space in rooms.spaces.values():
        x, y, z = space["centre"]
        simulation = Simulation(stage, "", (x, y, z))
        for angle in np.arange(8) * np.pi / 4:
            path = np.array([[x, y], [x + 5 * np.cos(angle), y + 5 * np.sin(angle)]])
            track = simulation.drive(path)
            assert shapely.distance(shapely.MultiPoint(track), walls) > RADIUS - 0.03, space["name"]
