"""The probability that an opening that was looked through is one, and of its kind, from what was seen of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

PRECISE = 0.01
"""Standard deviation, metres, up to which a width or height is one between two edges that were seen."""
SMALL, TINY = 0.9, 0.5
"""Least extents, metres, below which a hole may be a gap between things, and at which it is as often that."""
LOW, HEAD = 0.2, 1.8
"""Sill and head, metres, of windows that may be glazed doors behind a threshold."""
WEIGHTS = np.array([-3.42, -2.17, 2.97, 2.21, 2.52, 1.96, 0.96, 0.41, -2.1, -1.34, -0.93, 1.3, 0.65])
"""Weights of ``features``, fitted by ``tests/benchmarks/fit_openings.py --fit SCENE=WORK ...`` on 201 openings of 17
simulated scenes of four buildings, then stretched and shifted, doors by themselves, to how often 379 openings of 25
scenes of ten buildings are right, which is 93 %. By what half of these scenes give, the other half has an expected
calibration error of 0.045 and 0.041, its windows of 0.018 and 0.048; its few doors, 51 and 28, of 0.21 and 0.088."""
LEAST, MOST = 0.02, 0.98
"""No probability outside these is stated: nobody tried thousands of openings."""


def features(opening: OpeningShape, wall: WallShape) -> NDArray[np.float64]:
    """What speaks for an opening, each about 0 to 1, after a leading 1: share looked through, jambs with a reveal,
    sides with the wall's face beside them, width and height precise, lintel, how much of the wall's face was seen, leaf
    seen, passage from the floor up, small, window or glazed door that may be the other, width and height those of like
    ones, door.
    """
    low = opening.kind == "window" and 0.0 < opening.sill < LOW and opening.sill + opening.height > HEAD
    small = (SMALL - min(opening.width, opening.height)) / (SMALL - TINY)
    return np.array(
        [
            1.0,
            opening.looked_through,
            opening.jambs / 2,
            opening.sides / 4,
            _precise(opening.width_sigma) + _precise(opening.height_sigma),
            float(opening.lintel),
            wall.coverage,
            float(opening.angle is not None),
            float(opening.kind == "passage" and opening.sill == 0.0),
            min(max(small, 0.0), 1.0),
            float(low or bool(opening.glazed)),
            float(opening.width_sigma is None) + float(opening.height_sigma is None),
            float(opening.kind == "door"),
        ]
    )


def _precise(sigma: float | None) -> float:
    return 0.5 * float(sigma is not None and sigma <= PRECISE)


def probability(opening: OpeningShape, wall: WallShape) -> float:
    """That an opening is there, of this kind, and overlaps the true one by half: in 0-1."""
    chance = float(1 / (1 + np.exp(-features(opening, wall) @ WEIGHTS)))
    return round(min(max(chance, LEAST), MOST), 3)
