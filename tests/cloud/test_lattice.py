from __future__ import annotations

import numpy as np

from scan2bim.cloud.lattice import Lattice

OBLIQUE = Lattice(0.4, (0.013, 0.031), 0.017)


def test_own_coordinates_lead_back_to_local_ones() -> None:
    points = np.random.default_rng(1).uniform(-50, 50, (20, 3))
    np.testing.assert_allclose(OBLIQUE.local(OBLIQUE.own(points)), points, atol=1e-12)
    np.testing.assert_allclose(OBLIQUE.own(points[:, :2]), OBLIQUE.own(points)[:, :2], atol=1e-12)


def test_a_lattice_found_within_another_is_one() -> None:
    other = Lattice(-1.1, (0.3, -0.2), 0.05)
    points = np.random.default_rng(2).uniform(-50, 50, (20, 3))
    np.testing.assert_allclose(OBLIQUE.then(other).own(points), other.own(OBLIQUE.own(points)), atol=1e-12)
