"""What hangs over open floor is no wall, and a hole along which nothing stands is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from scan2bim.structure.columns import Columns, Grid
from scan2bim.structure.fits import Face
from scan2bim.structure.hanging import without_hanging
from scan2bim.structure.plan import Plan
from scan2bim.structure.spaces import _filled  # pyright: ignore[reportPrivateUsage]
from scan2bim.structure.storeys import StoreyLevels

BOARD = Face(np.array([3.0, 2.0]), np.array([0.0, 1.0]), -0.4, 0.4, np.arange(16), 0.002, 0.8, True)
STANDING = replace(BOARD, columns=np.arange(16, 32))


def hall(floor: NDArray[np.uint8]) -> Plan:
    """A storey of 6 x 4 m with 32 columns, of which the last 16 come down to the floor."""
    low = np.repeat([0, 8], 16)
    pairs, none = np.zeros((32, 2)), np.zeros(32, np.int64)
    columns = Columns(
        pairs.astype(np.int64),
        pairs,
        low + 6,
        none + 4,
        low,
        np.zeros(32),
        pairs,
        none,
        none.astype(np.uint16),
        np.zeros((32, 3)),
    )
    z = np.full(floor.shape, 2.6, np.float32)
    levels, grid = StoreyLevels(0.0, 0.001, 2.6, 2.6, 24.0), Grid(np.zeros(2), z.astype(np.float64), 0.0)
    return Plan(levels, grid, floor, floor, z, np.zeros((*z.shape, 2), np.float32), z, floor * 0, floor * 0, columns,
                floor * 0, z)  # fmt: skip


OPEN = np.ones((80, 120), np.uint8)


def test_a_board_over_open_floor_is_no_face() -> None:
    assert without_hanging([BOARD], hall(OPEN)) == ()


def test_what_stands_is_a_face() -> None:
    assert without_hanging([STANDING], hall(OPEN)) == (STANDING,)


def test_what_hides_the_floor_behind_it_is_a_face() -> None:
    hidden = OPEN.copy()
    hidden[:40] = 0
    assert without_hanging([BOARD], hall(hidden)) == (BOARD,)


def test_a_lintel_from_wall_to_wall_is_a_face() -> None:
    ends = [
        replace(STANDING, centre=np.array([x, 2.0]), normal=np.array([n, 0.0])) for x, n in ((2.6, 1.0), (3.4, -1.0))
    ]
    assert without_hanging([BOARD, *ends], hall(OPEN))[0] is BOARD
    assert without_hanging([BOARD, ends[0]], hall(OPEN)) == (ends[0],)


@pytest.mark.parametrize(("columns", "size", "holes"), [(0, 0.5, 0), (16, 0.5, 1), (0, 1.6, 1)])
def test_a_small_hole_along_which_no_face_was_seen_is_filled(columns: int, size: float, holes: int) -> None:
    hole = box(3 - size / 2, 2 - size, 3 + size / 2, 2)
    space = Polygon(box(0, 0, 6, 4).exterior, [hole.exterior])
    face = replace(BOARD, columns=np.arange(columns))
    assert len(_filled(space, [face]).interiors) == holes
