"""Walls among voxels that furniture touches."""

from __future__ import annotations

import math

import numpy as np

from scan2bim.verify.upright import upright_parts

EDGE = 0.1


def test_a_slanting_wall_is_told_from_the_furniture_that_touches_it() -> None:
    along, up = (a.ravel() for a in np.meshgrid(np.arange(0, 4, 0.05), np.arange(0, 2.5, 0.05)))
    wall = np.column_stack([along * math.cos(0.4), along * math.sin(0.4), up])
    low = np.random.default_rng(0).uniform(0, [1.5, 1.5, 0.9], (4000, 3))
    tall = np.random.default_rng(1).uniform([2.0, 2.4, 0.0], [2.4, 2.8, 2.2], (4000, 3))
    voxels = np.unique(np.floor(np.concatenate([wall, low, tall]) / EDGE), axis=0) * EDGE + EDGE / 2
    label = upright_parts(voxels, EDGE)
    away = np.abs(voxels[:, :2] @ [-math.sin(0.4), math.cos(0.4)])
    assert set(np.unique(label)) == {-1, 0}
    assert (away[label == 0] < 0.2).all()
    assert (label[(away < 0.05) & (voxels[:, 2] > 1.0)] == 0).mean() > 0.9
