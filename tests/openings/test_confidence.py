from __future__ import annotations

import dataclasses

from scan2bim.openings.confidence import LEAST, MOST, WEIGHTS, features, probability
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

WALL = WallShape((0, 0), (4, 0), 0.2, 0.002, 0, 2.5, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))
CLEAR = OpeningShape(
    0, 0, "window", "unknown", 1.0, 0.9, 1.2, 1.2, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.0, sides=4
)  # fmt: skip
DOUBTFUL = dataclasses.replace(CLEAR, width_sigma=0.05, height_sigma=None, jambs=0, lintel=False, sides=2)


def test_every_feature_has_a_weight() -> None:
    assert len(features(CLEAR, WALL)) == len(WEIGHTS)


def test_an_opening_with_jambs_and_wall_round_it_is_nearly_certain() -> None:
    assert 0.9 < probability(CLEAR, WALL) <= MOST


def test_an_opening_with_neither_is_unlikely() -> None:
    assert LEAST <= probability(DOUBTFUL, WALL) < 0.3


def test_a_leaf_makes_a_door_surer() -> None:
    door = dataclasses.replace(DOUBTFUL, kind="door", state="open")
    assert probability(dataclasses.replace(door, angle=1.2), WALL) > probability(door, WALL) + 0.02


def test_a_low_window_that_may_be_a_glazed_door_is_less_sure() -> None:
    tall = dataclasses.replace(DOUBTFUL, sill=0.3, height=1.8)
    assert probability(dataclasses.replace(tall, sill=0.1, height=2.0), WALL) < probability(tall, WALL) - 0.05


def test_a_hole_of_half_a_metre_is_less_sure() -> None:
    assert probability(dataclasses.replace(DOUBTFUL, width=0.5), WALL) < probability(DOUBTFUL, WALL) - 0.05


def test_no_feature_counts_more_than_twice() -> None:
    odd = dataclasses.replace(CLEAR, width=0.1, height=9.0, width_sigma=None, height_sigma=None, glazed=True)
    for opening in (CLEAR, DOUBTFUL, odd):
        assert features(opening, WALL).min() >= 0.0
        assert features(opening, WALL).max() <= 2.0
