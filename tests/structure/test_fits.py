"""Where the line of a wall's face lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.columns import Columns
from scan2bim.structure.fits import Face, settled


def columns(places: Sequence[tuple[float, float, int, int]]) -> Columns:
    """Columns from (along, before the line, points, heights)."""
    n = len(places)
    xy = np.array([place[:2] for place in places])
    points, bins = (np.array([place[k] for place in places], np.int64) for k in (2, 3))
    none, zero = np.zeros(n, np.int64), np.zeros((n, 2))
    return Columns(
        none.reshape(-1, 1).repeat(2, 1), xy, bins, bins, none, np.zeros(n), zero, points, none.astype(np.uint16), zero
    )


def face(count: int) -> Face:
    return Face(np.zeros(2), np.array([0.0, 1.0]), 0.0, 4.0, np.arange(count), 0.003, 4.0, True)


def told(places: Sequence[tuple[float, float, int, int]]) -> float:
    """Metres before the line at which a face is told."""
    seen = columns(places)
    return float(settled(seen, face(len(seen)), np.ones(len(seen), bool)).centre[1])


def test_a_surface_at_the_edge_of_voxels_lies_where_most_of_its_points_do() -> None:
    strips = np.arange(0.0, 4.0, PLAN)
    halves = [(x, 0.001, 90, 20) for x in strips] + [(x, 0.009, 10, 20) for x in strips]
    assert told(halves) == pytest.approx(0.0018, abs=1e-4)


def test_trims_and_skirtings_before_a_wall_do_not_bring_its_face_forwards() -> None:
    strips = np.arange(0.0, 4.0, PLAN)
    before = [(x, 0.02 if k % 4 == 0 else 0.0, 50, 20) for k, x in enumerate(strips)]
    assert told(before) == pytest.approx(0.0, abs=5e-4)
