"""Surfels sorted into plan columns, however far apart they lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from surfaces import surfels_of

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.storeys import layers_of


@pytest.mark.parametrize("outlier", [5.0, 9_000.0], ids=["near", "far"])
def test_surfels_of_a_plan_column_lie_one_above_the_other_with_their_free_heights(outlier: float) -> None:
    points = np.random.default_rng(3).uniform([-3, -2, -4], [3, 2, 6], (4_000, 3))
    surfels = surfels_of(np.concatenate([points, [[outlier, -outlier, 0.0]]]))
    layers = layers_of(surfels)
    xyz = surfels.xyz[layers.order].astype(np.float64)
    cell = np.floor(xyz[:, :2] / PLAN)
    expected = np.lexsort((surfels.xyz[:, 2], *np.floor(surfels.xyz[:, 1::-1].astype(np.float64) / PLAN).T))
    assert np.array_equal(layers.order, expected)
    same = (cell[1:] == cell[:-1]).all(1)
    assert np.array_equal(layers.above[:-1], np.where(same, np.diff(xyz[:, 2]), np.inf))
    assert np.array_equal(layers.above[:-1], layers.below[1:])
    assert np.isinf([layers.above[-1], layers.below[0]]).all()


def test_no_surfels_make_no_layers() -> None:
    none = surfels_of(np.zeros((1, 3)))
    none = replace(none, **{name: getattr(none, name)[:0] for name in ("xyz", "count", "rgb", "station", "spread")})
    assert len(layers_of(none).order) == len(layers_of(none).above) == 0
