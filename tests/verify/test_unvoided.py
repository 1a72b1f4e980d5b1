"""Doors and windows of models that state no openings."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.verify.ifc_model import IfcModel, ModelElement
from scan2bim.verify.patches import find_gaps
from scan2bim.verify.unvoided import with_openings

F64 = NDArray[np.float64]
TURN = 0.4


def element(guid: str, kind: str, role: Literal["compared", "fill"], *boxes: tuple[F64, F64]) -> ModelElement:
    """Corners of boxes, along a wall, across it and up, turned in plan."""
    ends = [[[x, y, z] for x in b[:, 0] for y in b[:, 1] for z in b[:, 2]] for b in map(np.array, boxes)]
    corners = np.concatenate(ends)
    c, s = np.cos(TURN), np.sin(TURN)
    corners[:, :2] = corners[:, :2] @ np.array([[c, s], [-s, c]])
    return ModelElement(guid, kind, "", "", role, corners, np.zeros((0, 3), np.int32), np.zeros(0, bool))


def box(*ends: tuple[float, float]) -> tuple[F64, F64]:
    low, high = zip(*ends, strict=True)
    return np.array(low, float), np.array(high, float)


def house(*elements: ModelElement) -> IfcModel:
    return IfcModel(Path("a.ifc"), "IFC4", "a", elements, (), None, ())


def test_a_door_in_the_hole_of_its_wall_gets_the_opening_that_the_model_does_not_state() -> None:
    left, right = box((0.0, 2.0), (0.0, 0.2), (0.0, 2.6)), box((2.9, 5.0), (0.0, 0.2), (0.0, 2.6))
    over = box((2.0, 2.9), (0.0, 0.2), (2.1, 2.6))
    wall = element("wall", "IfcWall", "compared", left, right, over)
    other = element("other", "IfcWall", "compared", box((0.0, 5.0), (3.0, 3.2), (0.0, 2.6)))
    door = element("door", "IfcDoor", "fill", box((1.94, 2.96), (-0.02, 0.22), (0.0, 2.16)))  # with its trims
    (gap,) = find_gaps(with_openings(house(wall, other, door)))
    assert (gap.host, gap.fill and gap.fill.guid) == ("wall", "door")
    assert (gap.width, gap.height) == (pytest.approx(0.9, abs=1e-4), pytest.approx(2.1, abs=1e-4))
    along = np.array([np.cos(TURN), np.sin(TURN)])
    assert gap.middle[:2] @ along == pytest.approx(2.45, abs=1e-3)


def test_a_door_before_a_whole_wall_stands_in_no_opening() -> None:
    wall = element("wall", "IfcWall", "compared", box((0.0, 5.0), (0.0, 0.2), (0.0, 2.6)))
    door = element("door", "IfcDoor", "fill", box((2.0, 2.9), (0.0, 0.2), (0.0, 2.1)))
    assert find_gaps(with_openings(house(wall, door))) == ()
