"""Which of a wall's points lie in a rectangle of it.

Scanners sweep, so that points which follow each other lie near each other: those of a stretch are looked at one by one
only where it reaches over the rectangle's sides.
"""

from __future__ import annotations

import numba as nb
import numpy as np

STRETCH = 128
"""Points of a stretch: one or two sweeps up and down a wall."""


@nb.njit(cache=True, nogil=True)
def stretch_bounds(along, up):  # pyright: ignore
    """Least and greatest place along and up (b, 4) of each STRETCH points (n,) float32, the last one shorter."""
    n = len(along)
    out = np.empty(((n + STRETCH - 1) // STRETCH, 4), np.float32)
    for b in range(len(out)):
        left, right, bottom, top = np.float32(np.inf), np.float32(-np.inf), np.float32(np.inf), np.float32(-np.inf)
        for i in range(b * STRETCH, min((b + 1) * STRETCH, n)):
            left = along[i] if along[i] < left else left
            right = along[i] if along[i] > right else right
            bottom = up[i] if up[i] < bottom else bottom
            top = up[i] if up[i] > top else top
        out[b, 0], out[b, 1], out[b, 2], out[b, 3] = left, right, bottom, top
    return out


@nb.njit(cache=True, nogil=True)
def within(along, up, bounds, box):  # pyright: ignore
    """Numbers of the points (n,) inside a box (4,) float32, ascending; ``bounds`` of their stretches."""
    rows = np.empty(len(along), np.int64)
    used = 0
    for b in range(len(bounds)):
        if bounds[b, 1] <= box[0] or bounds[b, 0] >= box[1] or bounds[b, 3] <= box[2] or bounds[b, 2] >= box[3]:
            continue
        for i in range(b * STRETCH, min((b + 1) * STRETCH, len(along))):
            rows[used] = i
            used += (along[i] > box[0]) & (along[i] < box[1]) & (up[i] > box[2]) & (up[i] < box[3])
    return rows[:used]
