from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.cloud.panorama import NO_RETURN, UNSEEN, Panorama, add_hits, add_misses, agreement, seen_through

EYE = np.array([1.0, -2.0, 1.5])
MARGIN = np.float32(0.05)
F32 = NDArray[np.float32]


@cache
def sphere(count: int = 300_000) -> F32:
    """Directions (n, 3), evenly spread; by default a dozen for every cell."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    azimuth = np.pi * (1 + 5**0.5) * i
    flat = np.sqrt(1 - z * z)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z]).astype(np.float32)


def panorama_of(points: F32, misses: F32 | None = None, edge: int = 64) -> Panorama:
    ranges = np.zeros((6, edge, edge), np.float32)
    add_hits(points, EYE.astype(np.float32), ranges)
    if misses is not None:
        add_misses(misses, ranges)
    return Panorama(EYE, ranges)


def ball(radius: float) -> Panorama:
    """The inside of a ball round the station."""
    return panorama_of((sphere() * np.float32(radius) + EYE).astype(np.float32))


def said(panorama: Panorama, points: F32) -> NDArray[np.uint8]:
    return seen_through(points, panorama.position.astype(np.float32), panorama.ranges, MARGIN)


@pytest.mark.parametrize(
    ("distance", "expected"), [(1.0, 1), (2.9, 1), (2.98, 2), (3.0, 2), (3.02, 2), (3.1, 3), (9.0, 3)]
)
def test_points_before_on_and_behind_a_surface_were_looked_through_seen_and_blocked(
    distance: float, expected: int
) -> None:
    points = (sphere(2_000) * np.float32(distance) + EYE).astype(np.float32)
    assert set(said(ball(3.0), points).tolist()) == {expected}


def test_nothing_is_said_of_directions_that_were_never_measured() -> None:
    half = sphere()[sphere()[:, 2] > 0.1]
    panorama = panorama_of((half * np.float32(3.0) + EYE).astype(np.float32))
    below = sphere(2_000)[sphere(2_000)[:, 2] < -0.1]
    assert not said(panorama, (below + EYE).astype(np.float32)).any()


def test_the_nearest_surface_in_a_direction_counts() -> None:
    far, near = (
        (sphere() * np.float32(5.0) + EYE).astype(np.float32),
        (sphere() * np.float32(2.0) + EYE).astype(np.float32),
    )
    points = (sphere(500) * np.float32(3.0) + EYE).astype(np.float32)
    assert set(said(panorama_of(np.concatenate([far, near])), points).tolist()) == {3}
    assert set(said(panorama_of(np.concatenate([near, far])), points).tolist()) == {3}


def test_a_pulse_without_return_is_kept_apart_from_what_was_never_measured() -> None:
    up = sphere()[sphere()[:, 2] > 0.8]
    panorama = panorama_of(np.zeros((0, 3), np.float32), up)
    assert (panorama.ranges == NO_RETURN).any()
    assert (panorama.ranges == UNSEEN).any()


def test_a_return_counts_more_than_a_pulse_without_one_in_the_same_direction() -> None:
    for_hits = (sphere() * np.float32(3.0) + EYE).astype(np.float32)
    assert not (panorama_of(for_hits, sphere()).ranges == NO_RETURN).any()
    ranges = np.zeros((6, 64, 64), np.float32)
    add_misses(sphere(), ranges)
    add_hits(for_hits, EYE.astype(np.float32), ranges)
    assert not (ranges == NO_RETURN).any()


def test_saving_and_loading_keeps_ranges_to_a_millimetre_and_marks_exactly(tmp_path: Path) -> None:
    directions = sphere()
    radius = np.random.default_rng(0).uniform(0.3, 60.0, len(directions))[:, None]
    low = directions[:, 2] < 0.5
    panorama = panorama_of((directions * radius + EYE)[low].astype(np.float32), directions[directions[:, 2] > 0.9])
    panorama.save(tmp_path / "panorama.npy")
    back = Panorama.load(tmp_path / "panorama.npy")
    np.testing.assert_array_equal(back.position, EYE)
    np.testing.assert_array_equal(back.ranges == NO_RETURN, panorama.ranges == NO_RETURN)
    np.testing.assert_array_equal(back.ranges == UNSEEN, panorama.ranges == UNSEEN)
    assert np.abs(back.ranges - panorama.ranges).max() < 0.0011


def wall_and_lone_points() -> tuple[F32, F32, Panorama]:
    """A wall 3 m before the station, and single points that hang 2 m behind it as if seen through a pane."""
    u, v = np.meshgrid(np.arange(-2, 2, 0.02), np.arange(-1.2, 1.2, 0.02))
    wall = np.column_stack([np.full(u.size, 3.0), u.ravel(), v.ravel()]) + EYE
    lone = np.array([[3.0, y, z] for y in (-1.5, 0.0, 1.5) for z in (-0.5, 0.5)]) * (5 / 3) + EYE
    apart = np.abs((wall - EYE)[:, None] / 3.0 - (lone - EYE)[None] / 5.0).max(2).min(1) > 0.01
    points = np.concatenate([wall[apart], lone]).astype(np.float32)
    return wall[apart].astype(np.float32), lone.astype(np.float32), panorama_of(points, edge=192)


def test_lone_points_behind_a_pane_do_not_agree_and_walls_do() -> None:
    wall, lone, panorama = wall_and_lone_points()
    everything = np.concatenate([wall, lone])
    share = agreement(everything, np.zeros(len(everything), np.uint16), {0: panorama})
    assert share[len(wall) :].max() < 0.5
    assert (share[: len(wall)] >= 0.5).mean() > 0.999


def test_a_floor_agrees_where_neighbouring_pulses_meet_it_metres_apart_and_what_hangs_over_it_does_not() -> None:
    fall, turn = np.meshgrid(np.arange(0.02, 1.2, 0.006), np.arange(-0.4, 0.4, 0.006))
    ray = np.column_stack([np.cos(turn.ravel()), np.sin(turn.ravel()), -np.tan(fall.ravel())])
    floor = (ray * (0.8 / np.tan(fall.ravel()))[:, None] + EYE).astype(np.float32)
    far = np.flatnonzero((floor[:, 0] > 11) & (floor[:, 0] < 13) & (np.abs(turn.ravel()) < 0.3))
    lone = far[:: len(far) // 5]
    seen = floor.copy()
    seen[lone] = EYE + (floor[lone] - EYE) * 0.6
    share = agreement(seen, np.zeros(len(seen), np.uint16), {0: panorama_of(seen, edge=166)})
    assert (share[np.setdiff1d(far, lone)] >= 0.5).mean() > 0.8
    assert share[lone].max() < 0.5


def test_points_of_an_unknown_station_are_believed() -> None:
    wall, lone, panorama = wall_and_lone_points()
    points = np.concatenate([wall, lone])
    station = np.full(len(points), 7, np.uint16)
    assert (agreement(points, station, {0: panorama}) == 1.0).all()
