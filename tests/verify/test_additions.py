"""What points that no element explains are guessed to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.verify.additions import EDGE, Surroundings, _guess  # pyright: ignore[reportPrivateUsage]
from scan2bim.verify.leaves import Doorway
from scan2bim.verify.patches import Gap

F64 = NDArray[np.float64]
CEILING = 2.6


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> F64:
    """Middles of the voxels of a box."""
    axes = [np.arange(a + EDGE / 2, b, EDGE) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def room(*windows: Gap) -> Surroundings:
    """Five metres square, under a level ceiling."""
    places = np.arange(0.1, 5.0, 0.2)
    x, y = np.meshgrid(places, places)
    ceilings = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, CEILING)])
    return Surroundings(np.array([[0.0, 0.0, 0.0], [5.0, 5.0, CEILING]]), ceilings, windows, ())


def window() -> Gap:
    """In the wall along x behind y = 0."""
    return Gap("o", "w", None, np.array([2.5, -0.15, 1.4]), np.array([1.0, 0.0]), 1.2, 1.2, -0.15, 0.15, None)


WALL = block((1.0, 2.0, 0.0), (3.0, 2.1, CEILING))
LEAF = block((1.0, 2.0, 0.0), (1.9, 2.1, 2.1))
POST = block((1.0, 2.0, 0.0), (1.3, 2.3, CEILING))
CURTAIN = block((1.7, 0.1, 0.0), (2.0, 0.3, CEILING))


@pytest.mark.parametrize(
    ("voxels", "expected"),
    [
        (WALL, "wall"),
        (LEAF, "object"),
        (np.concatenate([LEAF, block((1.4, 2.0, 2.1), (1.5, 2.1, CEILING))]), "object"),
        (POST, "column"),
        (block((1.0, 2.0, 0.0), (1.3, 2.3, 2.0)), "object"),
        (block((1.0, 2.0, 0.0), (3.0, 2.1, CEILING - 0.2)), "object"),
    ],
    ids=["wall", "open leaf", "open leaf with strays up to the ceiling", "column", "cupboard", "wardrobe"],
)
def test_what_is_built_reaches_the_ceiling_over_most_of_its_plan(voxels: F64, expected: str) -> None:
    assert _guess(voxels, True, room()) == expected


def test_a_curtain_before_a_window_is_no_column() -> None:
    assert _guess(CURTAIN, True, room()) == "column"
    assert _guess(CURTAIN, True, room(window())) == "object"


def test_a_wall_that_ends_at_a_window_stays_one() -> None:
    across = block((2.4, 0.0, 0.0), (2.5, 3.0, CEILING))
    assert _guess(across, True, room(window())) == "wall"


def test_in_a_room_hardly_taller_than_its_doors_an_open_leaf_is_no_wall() -> None:
    doors = (Doorway(np.array([[1.0, 2.05], [1.0, 1.1]]), 0.95, CEILING - 0.1),)
    leaf = block((1.0, 2.0, 0.0), (1.9, 2.1, CEILING - 0.1))
    low = room()
    assert _guess(leaf, True, low) == "wall"
    assert _guess(leaf, True, replace(low, doors=doors)) == "object"
    assert _guess(block((1.0, 2.0, 0.0), (3.0, 2.1, CEILING - 0.1)), True, replace(low, doors=doors)) == "wall"
