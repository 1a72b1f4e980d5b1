"""Windows lead out of the building, or to something that was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.openings.outside import enclosed_parts, leads_somewhere
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import SpaceShape, StoreyShape, WallShape

WINDOW = OpeningShape(
    0, 0, "window", "unknown", 1.0, 0.9, 1.0, 1.1, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.9, sides=4
)  # fmt: skip
NOTHING = np.zeros((0, 3), np.float32)


def wall(start: tuple[float, float], end: tuple[float, float]) -> WallShape:
    """With a space on its left and none on its right."""
    return WallShape(start, end, 0.3, None, 0, 2.6, True, (0,), (), 0.002, 900, 0.9, 1, (0,), (200, 200, 200))


def space(left: float, low: float, right: float, high: float) -> SpaceShape:
    return SpaceShape(((left, low), (right, low), (right, high), (left, high)), (), 0.0, 2.6, 0.9, 0.9)


def around(width: float, height: float = 4.0, gap: float = 0.0) -> tuple[StoreyShape, WallShape]:
    """Four rooms round a part of a storey ``width`` x ``height`` that has no space, and the wall on its left; ``gap``
    parts the rooms above it.
    """
    x, y = width + 0.15, height + 0.15
    rooms = [
        box(-4, -4, -0.15, y + 4),
        box(x, -4, x + 4, y + 4),
        box(-0.15, -4, x, -0.15),
        *([box(-0.15, y, width / 2 - gap / 2, y + 4), box(width / 2 + gap / 2, y, x, y + 4)]),
    ]
    spaces = tuple(space(*room.bounds) for room in rooms)
    beside = wall((0.0, y), (0.0, 0.0))
    walls = (
        replace(beside, start=(0.0, 0.0), end=(0.0, y)),
        replace(beside, start=(width, 0.0), end=(width, y), left=(), right=(1,)),
        replace(beside, start=(0.0, 0.0), end=(width, 0.0), left=(), right=(2,)),
    )
    return StoreyShape(0.0, 0.002, 2.6, 2.6, spaces, walls), walls[0]


def leads(window: OpeningShape, host: WallShape, enclosed: list[Polygon], surfels: NDArray[np.float32]) -> bool:
    return leads_somewhere(window, host, enclosed, surfels, PlanIndex(surfels))


def seen(x: tuple[float, float], y: tuple[float, float], count: int = 60) -> NDArray[np.float32]:
    rng = np.random.default_rng(2)
    return np.column_stack([rng.uniform(*x, count), rng.uniform(*y, count), rng.uniform(1, 2, count)]).astype(
        np.float32
    )


def test_a_window_into_a_part_that_nobody_looked_into_leads_nowhere() -> None:
    storey, host = around(3.0)
    assert not leads(WINDOW, host, enclosed_parts(storey), NOTHING)


def test_what_was_seen_beyond_makes_it_a_light_well() -> None:
    storey, host = around(3.0)
    enclosed = enclosed_parts(storey)
    assert leads(WINDOW, host, enclosed, seen((1.0, 2.5), (1.0, 2.0)))
    assert not leads(WINDOW, host, enclosed, seen((1.0, 2.5), (1.0, 2.0), count=10))
    assert not leads(WINDOW, host, enclosed, seen((4.0, 5.0), (1.0, 2.0)))


def test_a_chimney_is_no_light_well_whatever_was_seen_in_it() -> None:
    storey, host = around(1.2)
    assert not leads(WINDOW, host, enclosed_parts(storey), seen((0.4, 0.9), (1.0, 2.0)))


@pytest.mark.parametrize(("gap", "outside"), [(0.8, False), (1.8, True)])
def test_a_narrow_gap_of_the_outline_does_not_open_what_is_behind_it(gap: float, outside: bool) -> None:
    storey, host = around(3.0, gap=gap)
    assert leads(WINDOW, host, enclosed_parts(storey), NOTHING) == outside


def test_a_window_in_the_outline_leads_out() -> None:
    storey, _ = around(3.0)
    host = wall((-4.0, 8.0), (-4.0, -4.0))
    assert leads(WINDOW, host, enclosed_parts(storey), NOTHING)


def test_doors_and_windows_between_spaces_are_not_asked() -> None:
    storey, host = around(3.0)
    enclosed = enclosed_parts(storey)
    assert leads(replace(WINDOW, kind="door"), host, enclosed, NOTHING)
    assert leads(WINDOW, replace(host, right=(3,)), enclosed, NOTHING)
