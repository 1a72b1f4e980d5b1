"""Leaves as high as the room: no walls, and the wall goes on across closed ones; niches, piers and stubs stay."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import level, plan, room, turned, upright

from scan2bim.structure.faces import Face, find_faces

YAWS = [0.0, 0.3]
F64 = NDArray[np.float64]
Span = tuple[float, float]


def far_wall(*recesses: tuple[Span, float], yaw: float, thin: bool = False) -> tuple[Face, ...]:
    """Faces of a room of 6 x 3 m whose far wall stands back on stretches by a depth; there the ceiling goes on. If it
    is ``thin``, a second room of 6 x 2 m lies beyond a wall of 12 cm and sees what stands back from behind, 4 cm off.
    """
    floor, ceiling, *walls = room(0, 0, 6, 3)
    parts, others = [floor, ceiling, *walls[:2], walls[3]], room(0, 3.12, 6, 5.12)
    ends = [0.0, *(x for span, _ in recesses for x in span), 6.0]
    beyond = [*others[:2], *others[3:]]
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        parts.append(upright((low, 3), (high, 3), 0, 2.5))
        beyond.append(upright((high, 3.12), (low, 3.12), 0, 2.5))
    for (low, high), depth in recesses:
        parts += [upright((low, 3 + depth), (high, 3 + depth), 0, 2.5), level(low, 3, high, 3 + depth, 2.5)]
        parts.append(level(low, 3, high, 3 + depth, 0))
        beyond.append(upright((high, 3.04 + depth), (low, 3.04 + depth), 0, 2.5))
    rooms, eyes = ([parts, beyond], [(3.0, 1.0), (3.0, 4.5)]) if thin else ([parts], [(3.0, 1.0)])
    return find_faces(plan(rooms, eyes, yaw))


def at(faces: tuple[Face, ...], low: float, high: float, y: float, yaw: float) -> list[Face]:
    """Faces on a line along x."""
    ends = turned(np.array([[low, y, 0.0], [high, y, 0.0]]), yaw)[:, :2]
    return [f for f in faces if np.abs((ends - f.centre) @ f.normal).max() < 0.01]


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize("depth", [0.05, 0.12])
def test_a_wall_goes_on_across_a_closed_leaf_as_high_as_the_room(depth: float, yaw: float) -> None:
    faces = far_wall(((2.0, 2.9), depth), ((4.0, 4.8), depth), yaw=yaw)
    (wall,) = at(faces, 2.0, 2.9, 3.0, yaw)
    assert wall.length == pytest.approx(6.0, abs=0.1)
    assert not at(faces, 2.0, 2.9, 3.0 + depth, yaw)


@pytest.mark.parametrize("yaw", YAWS)
def test_thin_leaves_side_by_side_are_closed_doors_though_little_is_left_of_the_wall(yaw: float) -> None:
    spans: list[tuple[Span, float]] = [((0.4 + 1.85 * k, 1.9 + 1.85 * k), 0.06) for k in range(3)]
    assert len(at(far_wall(*spans, yaw=yaw, thin=True), 0.4, 5.6, 3.0, yaw)) == 1
    assert len(at(far_wall(*spans, yaw=yaw), 0.4, 5.6, 3.0, yaw)) > 1


@pytest.mark.parametrize("yaw", YAWS)
def test_the_next_wall_right_beside_leaves_is_a_jamb_as_well(yaw: float) -> None:
    ends = [(0.0, 2.1), (3.9, 6.0)]
    across = [upright((2.95, 0), (2.95, 3), 0, 2.5), upright((3.05, 3), (3.05, 0), 0, 2.5)]
    floor, ceiling, *walls = room(0, 0, 6, 3)
    far = [upright((low, 3), (high, 3), 0, 2.5) for low, high in ends]
    deep = [upright((low, 3.17), (high, 3.17), 0, 2.5) for low, high in ((2.1, 2.95), (3.05, 3.9))]
    deep += [level(2.1, 3, 2.95, 3.17, z) for z in (0, 2.5)] + [level(3.05, 3, 3.9, 3.17, z) for z in (0, 2.5)]
    west, east = ([w[w[:, 0] < 3] for w in (*far, *deep)], [w[w[:, 0] > 3] for w in (*far, *deep)])
    parts = [[floor, ceiling, *walls[:2], walls[3], across[0], *west], [across[1], *east]]
    faces = find_faces(plan(parts, [(1.5, 1.0), (4.5, 1.0)], yaw))
    assert len(at(faces, 0.0, 6.0, 3.0, yaw)) == 1
    assert not at(faces, 2.1, 3.9, 3.17, yaw)


@pytest.mark.parametrize(("low", "high", "depth"), [(2.0, 4.0, 0.4), (1.5, 4.5, 0.15)])
def test_what_stands_back_deeper_or_wider_than_a_door_is_a_niche(low: float, high: float, depth: float) -> None:
    faces = far_wall(((low, high), depth), yaw=0.3)
    assert len(at(faces, low, high, 3.0 + depth, 0.3)) == 1
    assert len(at(faces, low, high, 3.0, 0.3)) == 2


def with_plate(length: float, thickness: float, turn: float, gap: float = 0.9) -> tuple[Face, ...]:
    """Two rooms with a gap in the wall between them, at whose jamb a plate hangs that is swung into the first."""
    floor, ceiling, *walls = room(0, 0, 6, 3)
    hinge = np.array([2.0, 3.0])
    along, across = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])
    near, far = (hinge + k * thickness * across for k in (-1, 0))
    plate = [upright(tuple(p), tuple(p + length * along), 0, 2.5) for p in (near, far)]
    open_wall = [upright((0, 3), (2, 3), 0, 2.5), upright((2 + gap, 3), (6, 3), 0, 2.5)]
    first = [floor, ceiling, *walls[:2], walls[3], *open_wall, plate[0]]
    return find_faces(plan([first, [plate[1]]], [(1.0, 0.6), (3.0, 2.6)], 0.3))


@pytest.mark.parametrize("turn", [np.pi / 2, 1.2])
def test_a_plate_as_long_as_the_gap_that_it_hangs_at_is_a_leaf_and_no_wall(turn: float) -> None:
    assert len(with_plate(0.88, 0.04, turn)) == 4


def test_a_stub_of_wall_beside_a_gap_stays() -> None:
    assert len(with_plate(0.88, 0.12, np.pi / 2)) > 4
    assert len(with_plate(0.88, 0.04, np.pi / 2, gap=2.4)) > 4
