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
WEIGHTS = np.array([-4.37, -2.77, 3.8, 2.82, 3.22, 2.5, 1.23, 0.52, -2.68, -1.71, -1.19, 1.66, 0.83])
"""Weights of ``features``, fitted by ``tests/benchmarks/fit_openings.py --fit SCENE=WORK ...`` on 201 openings of 17
simulated scenes of four buildings, then stretched about even odds by ``--stretch`` to how often 1024 openings of 30
scenes of 26 buildings are right, which is 98 %. Each building told by what the others give, the expected calibration
error is 0.038, of windows (757) 0.038, of doors (241) 0.030: more are right than is said, but an opening for which
nothing speaks stays unlikely."""
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
