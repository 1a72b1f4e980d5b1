"""Scan points in the model's frame, as whoever has the scans gives them to an exporter that wants them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class LocalPoints:
    """Some points in the order of their file.

    xyz (n, 3) float64, metres, the model's frame. rgb (n, 3) uint8 and intensity (n,) float32 in 0-1, or None. station
    (n,) uint16: number of the scan, by its place in ``Building.scans``.
    """

    xyz: NDArray[np.float64]
    rgb: NDArray[np.uint8] | None
    intensity: NDArray[np.float32] | None
    station: NDArray[np.uint16]


PointSource: TypeAlias = Callable[[], Iterator[LocalPoints]]
"""Reads all scans once more, from their beginning, in chunks; may raise InputError."""
