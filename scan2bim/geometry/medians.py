"""The median of many values in linear time and without branches that depend on them: there are thousands to take."""

from __future__ import annotations

import numba as nb
import numpy as np

BINS = 1024
"""Bins between the least and the greatest value: what shares one with the median is sorted out."""
FEW = 300
"""Values below which the bins take longer than they save."""


@nb.njit(cache=True, nogil=True)
def median(values):  # pyright: ignore
    """The median of finite values (n,), the mean of the two in the middle where n is even; nan of none."""
    n = len(values)
    if n < FEW:
        return np.median(values)
    least = most = values[0]
    for value in values:
        least, most = min(least, value), max(most, value)
    if not most > least:
        return np.float64(least)
    scale = values.dtype.type(BINS - 0.5) / (most - least)
    bins, counts = np.empty(n, np.int32), np.zeros(BINS, np.int32)
    for i in range(n):
        bins[i] = np.int32((values[i] - least) * scale) & (BINS - 1)
        counts[bins[i]] += 1
    lower, upper = (n - 1) // 2, n // 2
    first, before = 0, 0
    while before + counts[first] <= lower:
        before += counts[first]
        first += 1
    last, up_to = first, before + counts[first]
    while up_to <= upper:
        last += 1
        up_to += counts[last]
    part = np.empty(up_to - before + 1, values.dtype)
    used = 0
    for i in range(n):
        part[used] = values[i]
        used += (bins[i] >= first) & (bins[i] <= last)
    part = np.partition(part[:used], upper - before)
    high = part[upper - before]
    return np.float64(high) if lower == upper else (part[: upper - before].max() + high) / 2
