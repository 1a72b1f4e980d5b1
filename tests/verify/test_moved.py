"""What stands where an element was built is no addition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.config import VerifySettings
from scan2bim.verify.build import unused_tolerances
from scan2bim.verify.ifc_model import ModelElement
from scan2bim.verify.moved import moved_bodies
from scan2bim.verify.result import ElementResult, Fit, Status

TURN = math.radians(2.0)


def wall() -> ModelElement:
    """Twelve metres along x, 20 cm thick, 2.5 m tall."""
    corners = [[x, y, z] for x in (0.0, 12.0) for y in (-0.1, 0.1) for z in (0.0, 2.5)]
    none = np.zeros((0, 3), np.int32)
    return ModelElement("w", "IfcWall", "w", "", "compared", np.array(corners), none, np.zeros(0, bool))


def result(status: Status) -> ElementResult:
    fit = Fit(shift=(0.0, 0.0, 0.0), turn=TURN, tilt=0.0, residual=0.001)
    return ElementResult(
        guid="w", ifc_class="IfcWall", name="w", storey="", status=status, reason="", tolerance=0.01, fit=fit
    )


def end(turn: float) -> NDArray[np.float64]:
    """Voxels of the last metre and a half of the wall's face, turned about its middle."""
    x, z = np.meshgrid(np.arange(10.5, 12.0, 0.1), np.arange(0.05, 2.5, 0.1))
    along = x.ravel() - 6.0
    return np.column_stack(
        [6.0 + along * math.cos(turn) + 0.1 * math.sin(turn), along * math.sin(turn) + 0.1, z.ravel()]
    )


def test_the_end_of_a_turned_wall_is_the_walls() -> None:
    (body,) = moved_bodies([wall()], [result("out_of_tolerance")], np.eye(4))
    assert body.holds(end(TURN))
    assert not body.holds(end(-TURN))


def test_a_wall_in_place_moves_nothing() -> None:
    assert moved_bodies([wall()], [result("in_tolerance")], np.eye(4)) == ()


@pytest.mark.parametrize(
    ("ifc_class", "expected"), [("IfcWall", 0.01), ("IfcWallStandardCase", 0.01), ("IfcSlab", 0.015)]
)
def test_a_class_stands_for_its_standard_case(ifc_class: str, expected: float) -> None:
    assert VerifySettings(classes=("IfcWall=0.01",)).tolerance_of(ifc_class) == expected


def test_a_tolerance_for_a_class_that_the_model_lacks_is_told() -> None:
    settings = VerifySettings(classes=("IfcWall=0.01", "IfcColum=0.02"))
    standard = result("in_tolerance").model_copy(update={"ifc_class": "IfcWallStandardCase"})
    (note,) = unused_tolerances(settings, [standard])
    assert "IfcColum" in note
    assert len(unused_tolerances(settings, [])) == 2
