"""What lies in a window that goes along an array."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound="np.generic[Any]")


def windows(values: NDArray[Number], size: int, axis: int = -1) -> NDArray[Number]:
    """For each place along an axis the values in a window of odd ``size`` round it, (..., size); beyond the ends the
    array is mirrored.
    """
    padding = [(0, 0)] * values.ndim
    padding[axis] = (size // 2, size // 2)
    padded = np.pad(values, padding, mode="symmetric")
    return np.lib.stride_tricks.sliding_window_view(padded, size, axis)
