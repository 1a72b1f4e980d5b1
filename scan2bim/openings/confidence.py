"""The probability that an opening that was looked through is one, and of its kind, from what was seen of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

PRECISE = 0.01
"""Standard deviation, metres, up to which a width or height is one between two edges that were seen."""
WEIGHTS = np.array([-3.58, -1.33, 1.41, 1.79, 5.08, 1.1, -1.28, 2.55, 0.47])
"""Weights of ``features``, fitted by ``tests/benchmarks/fit_openings.py --fit SCENE=WORK ...`` on 129 openings of 12
simulated scans of four buildings, 81 % of them right."""
LEAST, MOST = 0.02, 0.98
"""No probability outside these is stated: nobody tried thousands of openings."""


def features(opening: OpeningShape, wall: WallShape) -> NDArray[np.float64]:
    """What speaks for an opening, each about 0 to 1, after a leading 1: share looked through, jambs with a reveal,
    sides with the wall's face beside them, width and height precise, lintel, how much of the wall's face was seen, leaf
    seen, passage.
    """
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
            float(opening.kind == "passage"),
        ]
    )


def _precise(sigma: float | None) -> float:
    return 0.5 * float(sigma is not None and sigma <= PRECISE)


def probability(opening: OpeningShape, wall: WallShape) -> float:
    """That an opening is there, of this kind, and overlaps the true one by half: in 0-1."""
    chance = float(1 / (1 + np.exp(-features(opening, wall) @ WEIGHTS)))
    return round(min(max(chance, LEAST), MOST), 3)
