"""The probability that a wall is right, from what was seen of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.shapes import WallShape

LONG = 3.0
"""Length, metres, from which on a longer wall is no surer."""
ROUGH = 0.02
"""Root mean square distance, metres, of what is no plane."""
USUAL, THICK = 0.4, 0.7
"""Thicknesses, metres, from the first to the second of which it is ever less likely that no shaft, duct or niche lies
between a wall's faces."""
MANY = 4
"""Stations from which on further ones add nothing."""
WEIGHTS = np.array([-2.63, 2.29, -4.33, 2.81, 2.15, 1.59, -5.85, -2.65])
"""Fitted by ``tests/benchmarks/fit_walls.py``, in the order of ``features``."""
LEAST, MOST = 0.02, 0.98
"""No probability outside these is stated."""


def features(wall: WallShape) -> NDArray[np.float64]:
    """What speaks for a wall, each 0 to 1, after a leading 1: coverage of its faces, roughness, length, ends that join
    others, stations, spaces on both sides of one seen face, and an unusual thickness.
    """
    return np.array(
        [
            1.0,
            wall.coverage,
            min(wall.rms / ROUGH, 1.0),
            min(wall.length / LONG, 1.0),
            len({join.at for join in wall.joins}) / 2,
            min(len(wall.stations) / MANY, 1.0),
            float(wall.thickness_sigma is None and bool(wall.left) and bool(wall.right)),
            min(max((wall.thickness - USUAL) / (THICK - USUAL), 0.0), 1.0),
        ]
    )


def probability(wall: WallShape) -> float:
    """That most of what the wall shows to rooms is within 5 cm of a face of a true wall: in 0-1."""
    chance = float(1 / (1 + np.exp(-features(wall) @ WEIGHTS)))
    return round(min(max(chance, LEAST), MOST), 3)
