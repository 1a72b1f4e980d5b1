"""Which elements of a model the scans can say anything of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.cloud.tiles import TileWriter
from scan2bim.verify.faces import BODY, Plane
from scan2bim.verify.reach import within_reach
from scan2bim.verify.visibility import FARTHEST

F64 = NDArray[np.float64]


def plane(element: int, *middle: float) -> Plane:
    """A triangle of 0.2 m."""
    corners = np.array(middle) + np.array([[-0.1, 0.0, -0.1], [0.1, 0.0, -0.1], [0.0, 0.0, 0.1]])
    return Plane(element, np.array([0.0, -1.0, 0.0]), corners[None], False, False, BODY)


@pytest.fixture
def scans(tmp_path: Path) -> list[Path]:
    """Points about x = 100 m in one tile, and about 130 m in another."""
    with TileWriter(tmp_path) as writer:
        for x in (100.0, 130.0):
            xyz = np.array([[x, 1.0, 1.0]], np.float32)
            writer.add(xyz, np.zeros((1, 3), np.uint8), np.zeros(1, np.uint8), np.zeros(1, np.uint16))
    return [tmp_path]


def near(scans: list[Path], *middles: tuple[float, float, float], station: F64) -> list[bool]:
    planes = [plane(i, *middle) for i, middle in enumerate(middles)]
    return within_reach(planes, len(middles), np.eye(4), scans, station).tolist()


def test_what_lies_where_no_points_are_is_beyond_reach(scans: list[Path]) -> None:
    unknown = np.full((1, 3), np.nan)
    assert near(scans, (100.0, 2.0, 1.0), (130.0, 2.0, 1.0), station=unknown) == [True, True]
    assert near(scans, (116.0, 2.0, 1.0), (100.0, 2.0, 40.0), (-500.0, 0.0, 0.0), station=unknown) == [False] * 3


def test_what_a_station_can_see_is_within_reach_without_points(scans: list[Path]) -> None:
    station = np.array([[100.0, 1.0, 1.0]])
    assert near(scans, (100.0, FARTHEST, 1.0), (100.0, FARTHEST + 2.0, 1.0), station=station) == [True, False]


def test_an_element_between_tiles_with_points_is_within_reach(scans: list[Path]) -> None:
    long = Plane(
        0,
        np.array([0.0, -1.0, 0.0]),
        np.array([[[0.0, 1.0, 1.0], [500.0, 1.0, 1.0], [0.0, 1.0, 2.0]]]),
        False,
        False,
        BODY,
    )
    assert within_reach([long], 2, np.eye(4), scans, np.full((1, 3), np.nan)).tolist() == [True, True]
