"""Rooms under slopes as closed meshes."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from scan2bim.geometry.meshes import Mesh
from scan2bim.geometry.soffit_meshes import soffit_mesh


def volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def open_edges(mesh: Mesh) -> int:
    edges = Counter((int(t[i]), int(t[(i + 1) % 3])) for t in mesh.triangles for i in range(3))
    return sum(1 for (a, b), n in edges.items() if edges[b, a] != n)


GABLE = [
    np.array([(0, 0, 1), (8, 0, 1), (8, 3, 3), (0, 3, 3)], np.float64),
    np.array([(0, 3, 3), (8, 3, 3), (8, 6, 1), (0, 6, 1)], np.float64),
]


def test_a_room_under_a_gable_is_closed_and_has_no_wall_under_its_ridge() -> None:
    mesh = soffit_mesh(GABLE, 0.0)
    assert volume(mesh) == pytest.approx(8 * 6 * 2)
    assert open_edges(mesh) == 0
    inside = mesh.corners[(np.abs(mesh.corners[:, :, 1] - 3.0) < 1e-9).all(1)]
    assert len(inside) == 0


def test_pieces_of_other_heights_meet_in_an_upright_step() -> None:
    dormer = np.array([(0, 3, 2), (8, 3, 2), (8, 6, 2), (0, 6, 2)], np.float64)
    mesh = soffit_mesh([GABLE[0], dormer], 0.0)
    assert volume(mesh) == pytest.approx(8 * 3 * 2 + 8 * 3 * 2)
    step = mesh.corners[(np.abs(mesh.corners[:, :, 1] - 3.0) < 1e-9).all(1)]
    assert np.ptp(step[:, :, 2]) == pytest.approx(1.0)


def test_pieces_that_cross_along_their_edge_meet_in_two_steps() -> None:
    tilted = np.array([(0, 3, 2), (8, 3, 4), (8, 6, 4), (0, 6, 2)], np.float64)
    mesh = soffit_mesh([GABLE[0], tilted], 0.0)
    assert volume(mesh) == pytest.approx(8 * 3 * 2 + 8 * 3 * 3)


def test_a_piece_that_touches_two_others_gets_their_corner() -> None:
    parts = [
        np.array([(0, 0, 1), (4, 0, 1), (4, 3, 3), (0, 3, 3)], np.float64),
        np.array([(4, 0, 1), (8, 0, 1), (8, 3, 3), (4, 3, 3)], np.float64),
        GABLE[1],
    ]
    parts[1][3], parts[0][2] = (4, 2.9999, 3), (4, 2.9999, 3)  # as rounding leaves it
    mesh = soffit_mesh(parts, 0.0)
    assert volume(mesh) == pytest.approx(8 * 6 * 2, abs=1e-3)
    assert open_edges(mesh) == 0
