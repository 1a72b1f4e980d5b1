"""By how much each scan lies off the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from modelled import model_of, scan_of
from numpy.typing import NDArray
from synthetic import l_shaped, scanned

from scan2bim.coverage.residuals import Medians, fitted
from scan2bim.model.coverage import scan_offset, worst_scan_line
from scan2bim.model.elements import Building, ScanResidual
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Scene, Station

SPEC = ScannerSpec(step=np.radians(0.6), registration=0.0)
SHIFT = np.array([0.011, -0.009, 0.005])
"""Metres, 15 mm in all."""


def six_stations() -> Scene:
    scene = l_shaped(0.3)
    more = ((1.2, 3.0), (3.4, 0.8))
    return replace(
        scene, stations=(*scene.stations, *(Station(f"more {i}", (*p, 1.55), 0.3) for i, p in enumerate(more)))
    )


def building_of(moved: int | None, shift: NDArray[np.float64] = SHIFT) -> Building:
    sweeps = list(scanned(six_stations(), SPEC).sweeps)
    if moved is not None:
        sweeps[moved] = replace(sweeps[moved], translation=sweeps[moved].translation + shift)
    return model_of([scan_of(sweep) for sweep in sweeps]).building


def residuals(building: Building) -> list[ScanResidual | None]:
    return [scan.residual for scan in building.scans]


@pytest.fixture(scope="module")
def moved() -> Building:
    return building_of(0)


def test_scans_that_fit_are_said_to_fit() -> None:
    building = building_of(None)
    assert all(length is None or length < 0.003 for length in map(scan_offset, building.scans))
    assert sum(r is not None for r in residuals(building)) >= 4
    assert worst_scan_line(building) is None


def test_a_scan_moved_by_15_mm_is_found_with_its_offset_and_the_others_are_not_blamed(moved: Building) -> None:
    found = residuals(moved)
    assert found[0] is not None
    for axis, truth in enumerate(SHIFT):
        offset, sigma = found[0].offset[axis], found[0].sigma[axis]
        assert offset is not None and sigma is not None
        assert offset == pytest.approx(truth, abs=0.003)
        assert sigma < 0.003
    assert all((scan_offset(scan) or 0.0) < 0.004 for scan in moved.scans[1:])


def test_the_worst_scan_is_named_in_one_line(moved: Building) -> None:
    line = worst_scan_line(moved)
    assert line is not None and line.startswith(moved.scans[0].name)
    assert "15 mm" in line or "14 mm" in line or "16 mm" in line


def test_what_no_shared_face_tells_stays_unknown() -> None:
    """A scan on its own shares nothing."""
    sweeps = scanned(six_stations(), SPEC).sweeps
    assert residuals(model_of([scan_of(sweeps[2])]).building) == [None]


def test_two_scans_that_hang_on_the_others_by_one_patch_are_not_moved_by_it() -> None:
    """On one patch two scans may have seen two surfaces: a wall, and a picture on it."""
    groups = [(one, one + 1, axis, 0.0) for one in (0, 2) for axis in range(3) for _ in range(4)]
    links = [(1, 2, axis, 0.0) for axis in (1, 2) for _ in range(4)] + [(1, 2, 0, 0.02)]
    rows = [
        (patch, station, axis, off)
        for patch, (one, other, axis, apart) in enumerate([*groups, *links])
        for station, off in ((one, 0.0), (other, apart))
    ]
    patch, station, axis, distance = (np.array(column) for column in zip(*rows, strict=True))
    found = fitted(Medians(patch, station, np.eye(3)[axis], distance, np.full(len(rows), 0.002)))
    assert len(found) == 4
    for residual in found.values():
        assert all(offset is None or abs(offset) < 0.001 for offset in residual.offset)
        sigmas = [np.inf if sigma is None else sigma for sigma in residual.sigma]
        assert sigmas[0] > 0.003 > max(sigmas[1:])
