from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Polygon, box
from surfaces import level, room, surfels_of, turned, upright

from scan2bim.structure.faces import find_faces
from scan2bim.structure.plan import plan_of
from scan2bim.structure.shapes import SpaceShape
from scan2bim.structure.spaces import find_spaces, parted_at_necks
from scan2bim.structure.storeys import find_storeys, layers_of

F64 = NDArray[np.float64]


def spaces_of(rooms: list[list[F64]], eyes: list[tuple[float, float]], yaw: float) -> tuple[Polygon, ...]:
    """Of rooms, each seen by the station that stands in it; nothing is known of what was looked through."""
    points = [np.concatenate(parts) for parts in rooms]
    station = np.repeat(np.arange(len(rooms)), [len(p) for p in points])
    surfels = surfels_of(turned(np.concatenate(points), yaw), station)
    layers = layers_of(surfels)
    positions = turned(np.array([[x, y, 1.5] for x, y in eyes]), yaw)
    plan = plan_of(find_storeys(surfels, layers, positions)[0], surfels, layers, positions)
    return find_spaces(plan, find_faces(plan), ())[0]


def behind_a_wardrobe() -> list[F64]:
    """A room of 4 x 3 m, of whose wall at x = 4 m all but 80 cm is hidden by a wardrobe, 2.1 m tall and 60 cm deep."""
    around = room(0, 0, 4, 3)[2:]
    flat = [level(0, 0, 3.4, 3, z) for z in (0.0, 2.5)] + [level(3.4, 0, 4, 0.8, z) for z in (0.0, 2.5)]
    walls = [around[0], upright((4, 0), (4, 0.8), 0, 2.5), upright((0, 3), (3.4, 3), 0, 2.5), around[3]]
    return [*flat, *walls, upright((3.4, 0.8), (3.4, 3), 0, 2.1), upright((3.4, 0.8), (4, 0.8), 0, 2.1)]


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_space_goes_on_behind_a_wardrobe_as_far_as_the_other_face_of_its_wall_was_seen(yaw: float) -> None:
    found = spaces_of([behind_a_wardrobe(), room(4.1, 0, 8, 3)], [(1, 1), (6, 1.5)], yaw)
    assert sorted(p.area for p in found) == pytest.approx([3.9 * 3, 4 * 3], abs=0.15)


def test_rooms_that_hang_together_by_less_than_a_passage_are_parted() -> None:
    west, east, slit = box(0, 0, 4, 3), box(4.1, 0, 8, 3), box(4, 1, 4.1, 1.4)
    found = parted_at_necks(west.union(east).union(slit))
    assert sorted(p.area for p in found) == pytest.approx([east.area, west.area], abs=0.05)


def test_a_passage_and_a_shallow_nook_stay_with_their_room() -> None:
    room_and_passage = box(0, 0, 4, 3).union(box(4, 1, 4.1, 1.8)).union(box(4.1, 0, 8, 3)).union(box(1, 3, 3, 3.3))
    (found,) = parted_at_necks(room_and_passage)
    assert found.equals(room_and_passage)


def test_an_outline_that_crosses_itself_leaves_its_largest_part() -> None:
    ring = (0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (3.9, -0.1), (0.0, 3.0)
    bow = SpaceShape(ring, (), 0.0, 2.5, 1.0, 1.0)
    assert bow.polygon.is_valid
    assert bow.polygon.area > 5.0
