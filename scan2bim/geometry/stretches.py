"""How far places along a line cover it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def covered_length(along: NDArray[np.float64], width: float) -> float:
    """Length, metres, of what stretches of ``width`` metres round places (n,) on a line cover together.

    Counting the steps of a raster that hold a place depends on where its steps begin: this does not.
    """
    if not len(along):
        return 0.0
    return float(np.minimum(np.diff(np.sort(along)), width).sum()) + width
