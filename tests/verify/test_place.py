"""What is told of where a model lies."""

from __future__ import annotations

import pytest

from scan2bim.verify.build import doubt
from scan2bim.verify.ifc_model import MapConversion
from scan2bim.verify.place import systems_note
from scan2bim.verify.result import ElementResult


def seen(measured: float, through: float) -> ElementResult:
    """An element of 10 m2 that scanners should see."""
    return ElementResult(
        guid="w", ifc_class="IfcWall", name="w", storey="", status="missing", reason="", tolerance=0.01,
        visible=10.0, measured=measured, looked_through=through,
    )  # fmt: skip


def test_a_model_of_which_much_is_not_there_is_doubted() -> None:
    (note,) = doubt([seen(2.0, 0.8), seen(6.0, 0.4)])
    assert "60 %" in note
    assert doubt([seen(9.0, 0.1), seen(1.0, 0.2)]) == ()
    assert doubt([]) == ()


SCANS = "ETRS89 / UTM zone 32N (EPSG:25832)"


def conversion(crs: str | None) -> MapConversion:
    return MapConversion(1.0, 2.0, 3.0, 0.0, crs)


def test_different_reference_systems_of_model_and_scans_are_told() -> None:
    (note,) = systems_note(conversion("EPSG:25833"), SCANS)
    assert "EPSG:25833" in note
    assert SCANS in note


@pytest.mark.parametrize("drawn", [conversion("EPSG:25832"), conversion("local grid"), conversion(None), None])
def test_nothing_is_told_where_they_agree_or_one_is_not_known(drawn: MapConversion | None) -> None:
    assert systems_note(drawn, SCANS) == ()
    assert systems_note(drawn, None) == ()
