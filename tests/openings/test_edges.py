from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.openings.edges import Edge, find_edge

F64 = NDArray[np.float64]
RNG = np.random.default_rng(5)
EDGE = 1.234


def face(start: float, end: float, count: int = 200) -> tuple[F64, F64]:
    """Points on the wall's face between two places across the edge."""
    return start + (end - start) * RNG.random(count), RNG.normal(0, 0.002, count)


def reveal(place: float, deepest: float = 0.15, count: int = 60) -> tuple[F64, F64]:
    return RNG.normal(place, 0.002, count), RNG.uniform(0.03, deepest, count)


def frame(start: float, end: float, count: int = 80) -> tuple[F64, F64]:
    return start + (end - start) * RNG.random(count), RNG.normal(0.1, 0.002, count)


def edge(*parts: tuple[F64, F64], rough: float, inward: float = 1.0) -> Edge:
    place, depth = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    return find_edge(place, depth, depth < 0.03, rough, inward)


@pytest.mark.parametrize("rough", [EDGE - 0.07, EDGE, EDGE + 0.07])
@pytest.mark.parametrize("inward", [1.0, -1.0])
def test_a_reveal_gives_the_edge_to_millimetres(rough: float, inward: float) -> None:
    parts = (face(EDGE - inward * 0.3, EDGE), reveal(EDGE), frame(EDGE, EDGE + inward * 0.07))
    found = edge(*parts, rough=rough, inward=inward)
    assert found.place == pytest.approx(EDGE, abs=0.004)
    assert found.reveal > 20
    assert found.wall
    assert found.sigma < 0.005


def test_a_frame_flush_behind_the_face_gives_the_edge_without_a_reveal() -> None:
    found = edge(face(EDGE - 0.3, EDGE, 600), frame(EDGE, EDGE + 0.07, 300), rough=EDGE + 0.05)
    assert found.place == pytest.approx(EDGE, abs=0.008)
    assert found.reveal == 0


def test_where_the_wall_hides_the_frame_beside_it_the_edge_is_where_the_face_ends() -> None:
    found = edge(face(EDGE - 0.3, EDGE, 600), frame(EDGE + 0.025, EDGE + 0.1, 300), rough=EDGE + 0.03)
    assert found.place == pytest.approx(EDGE, abs=0.006)
    assert found.reveal == 0


def test_a_frame_that_a_curtain_hides_up_to_its_middle_is_no_reveal() -> None:
    thick = RNG.uniform(EDGE + 0.06, EDGE + 0.15, 400), RNG.uniform(0.09, 0.14, 400)
    mixed = RNG.uniform(EDGE + 0.06, EDGE + 0.07, 5), RNG.uniform(0.03, 0.09, 5)
    found = edge(face(EDGE - 0.3, EDGE - 0.05), thick, mixed, rough=EDGE + 0.05)
    assert found.reveal == 0
    assert found.hidden == pytest.approx(0.11, abs=0.015)


def test_a_few_stray_points_do_not_move_the_edge() -> None:
    stray = (np.linspace(EDGE - 0.12, EDGE - 0.02, 3), np.full(3, 0.1))
    found = edge(face(EDGE - 0.3, EDGE), stray, reveal(EDGE, count=200), rough=EDGE + 0.03)
    assert found.place == pytest.approx(EDGE, abs=0.005)


def test_where_a_curtain_hides_the_edge_it_is_uncertain_and_stays_between_what_was_seen() -> None:
    found = edge(face(EDGE - 0.3, EDGE - 0.1), frame(EDGE + 0.08, EDGE + 0.3), rough=EDGE + 0.02)
    assert EDGE - 0.11 < found.place < EDGE + 0.09
    assert found.sigma > 0.03


def test_without_points_the_rough_edge_is_kept() -> None:
    none = np.zeros(0)
    found = find_edge(none, none, none.astype(bool), EDGE, 1.0)
    assert (found.place, found.reveal, found.wall) == (EDGE, 0, False)


def test_behind_a_curtain_an_opening_of_which_rays_alone_tell_does_not_begin_where_the_face_ends() -> None:
    place, depth = face(EDGE - 0.8, EDGE - 0.5)
    found = find_edge(place, depth, depth < 0.03, EDGE, 1.0, farther=0.5)
    assert found.hidden == pytest.approx(0.5, abs=0.01)
    assert found.inner == pytest.approx(EDGE, abs=0.001)


def test_what_lies_behind_a_strip_of_wall_is_of_another_opening() -> None:
    parts = (face(EDGE - 0.07, EDGE), reveal(EDGE - 0.07))
    place, depth = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    assert find_edge(place, depth, depth < 0.03, EDGE, 1.0).sigma > 0.015
    found = find_edge(place, depth, depth < 0.03, EDGE, 1.0, next_one=0.05)
    assert found.place == pytest.approx(EDGE, abs=0.005)
    assert found.sigma == pytest.approx(0.01)
