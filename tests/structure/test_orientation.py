"""The lattice of voxels lies in the building, not in the survey."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from modelled import Modelled, modelled
from numpy.typing import NDArray
from synthetic import two_rooms

from scan2bim.cloud.surfels import PLAN
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Placement, Scene

SPEC = ScannerSpec(step=math.radians(0.8))
F64 = NDArray[np.float64]
PLACES = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]])


def moved(yaw: float, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scene:
    return dataclasses.replace(two_rooms(), placement=Placement(yaw, offset))


def own(model: Modelled, placement: Placement) -> F64:
    """Places of the scene in the lattice's own coordinates."""
    local = PLACES @ placement.rotation().T + np.array(placement.offset) - model.shift
    return model.cloud.lattice.own(local)[:, :2]


@pytest.mark.parametrize(("yaw", "offset"), [(1.3, (0.0, 0.0, 0.0)), (-2.9, (412_345.61, 5_678_901.23, 12.34))])
def test_a_building_turned_and_moved_falls_into_the_same_voxels(yaw: float, offset: tuple[float, float, float]) -> None:
    a, b = (own(modelled(moved(*p), SPEC), Placement(*p)) for p in ((0.4, (0.0, 0.0, 0.0)), (yaw, offset)))
    off = (a - b + PLAN / 2) % PLAN - PLAN / 2
    assert np.abs(off).max() < 0.004
    np.testing.assert_allclose(np.diff(a, axis=0), np.diff(b, axis=0), atol=0.002)


def test_most_faces_stand_in_the_middle_of_voxels() -> None:
    model = modelled(moved(0.4), SPEC)
    lattice = model.cloud.lattice
    assert abs(math.remainder(lattice.yaw - 0.4, math.pi / 2)) < 0.002
    wall = max(model.walls, key=lambda w: w.length)
    ends = lattice.own(np.array([wall.start, wall.end]))
    across = int(np.argmin(np.abs(ends[1] - ends[0])))
    faces = ends[:, across].mean() + np.array([-1, 1]) * wall.thickness / 2
    off = np.abs((faces + PLAN / 2) % PLAN - PLAN / 2 - PLAN / 2)
    assert off.min() < 0.015
