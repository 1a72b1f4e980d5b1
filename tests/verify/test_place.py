"""What is told of where a model lies."""

from __future__ import annotations

import pytest

from scan2bim.verify.ifc_model import MapConversion
from scan2bim.verify.place import systems_note

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
