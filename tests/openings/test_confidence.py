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
    assert probability(dataclasses.replace(door, angle=1.2), WALL) > probability(door, WALL) + 0.05
