from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, plan, upright

from scan2bim.structure.faces import Face, find_faces

F64 = NDArray[np.float64]
FRONT = 4.4
"""Metres along x at which the wardrobe's front stands, before a wall at 5 m."""


def room_with(top: float, ceiling_to: float = 4.9) -> list[F64]:
    """A room of 5 x 3 x 2.5 m with something before all of one wall that goes up to ``top``, over which the ceiling was
    seen as far as ``ceiling_to``, and the wall itself not at all.
    """
    walls = [((0.0, 0.0), (5.0, 0.0)), ((5.0, 3.0), (0.0, 3.0)), ((0.0, 3.0), (0.0, 0.0))]
    front = upright((FRONT, 0.0), (FRONT, 3.0), 0.0, top)
    flat = [level(0, 0, FRONT, 3, 0.0), level(0, 0, ceiling_to, 3, 2.5)]
    return [*flat, *(upright(a, b, 0.0, 2.5) for a, b in walls), front]


def fronts(parts: list[F64], yaw: float = 0.0) -> list[Face]:
    faces = find_faces(plan([parts], [(2.0, 1.5)], yaw))
    place = np.array([np.cos(yaw), np.sin(yaw)])
    return [f for f in faces if abs(f.normal @ place) > 0.99 and abs(f.centre @ place - FRONT) < 0.05]


@pytest.mark.parametrize("yaw", [0.0, 0.3])
@pytest.mark.parametrize("top", [2.25, 2.3])
def test_a_wardrobe_before_a_whole_wall_is_no_wall(top: float, yaw: float) -> None:
    assert not fronts(room_with(top), yaw)


def test_what_goes_up_to_the_ceiling_is_a_wall() -> None:
    assert fronts(room_with(2.5, FRONT))


def test_what_ends_below_the_ceiling_is_a_wall_if_no_ceiling_was_seen_behind() -> None:
    assert fronts(room_with(2.3, FRONT))


def test_a_partition_that_ends_below_the_ceiling_is_a_wall() -> None:
    before, behind = room_with(2.3, 5.0), upright((FRONT + 0.1, 3.0), (FRONT + 0.1, 0.0), 0.0, 2.3)
    beyond = [level(FRONT + 0.1, 0, 8, 3, 0.0), level(5, 0, 8, 3, 2.5), behind]
    faces = find_faces(plan([before, beyond], [(2.0, 1.5), (6.5, 1.5)]))
    assert len([f for f in faces if abs(f.normal[0]) > 0.99 and abs(f.centre[0] - FRONT - 0.05) < 0.1]) == 2


def test_a_cupboard_in_line_with_a_partition_does_not_prolong_it() -> None:
    """A partition of 10 cm ends in the room, and a low cupboard with its front in its line stands beside."""
    room = room_with(2.5, FRONT)
    stub = [upright((0.0, 1.5), (2.0, 1.5), 0.0, 2.5), upright((2.0, 1.4), (0.0, 1.4), 0.0, 2.5)]
    faces = find_faces(plan([[*room, *stub, upright((2.0, 1.5), (3.0, 1.5), 0.0, 1.0)]], [(3.0, 2.5)]))
    partition = next(f for f in faces if abs(f.normal[1]) > 0.99 and abs(f.centre[1] - 1.5) < 0.02)
    assert abs(partition.ends()[:, 0].max() - 2.0) < 0.08
