"""Contrast of colour and depth across upright and level lines of an orthoimage, in units of the face's own noise.

A line across which all of a door's height changes by little stands out from noise that is larger than the change, if
the means of strips on both sides are compared; the paper's pixel gradients (section V.B) need clear edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.orthoimage import Orthoimage

STRIP = 3
"""Width, pixels, of the strips on both sides of a line that are compared: trims and frames are 25 mm and wider."""
BLOCK = 10
"""Length, pixels, of a line's pieces."""
FLOORS = (0.005, 0.005, 0.005, 0.0012)
"""Least noise of a piece's contrast in red, green, blue (of 1) and depth (metres): below it no wall is even."""
LEAST = 3
"""Measured pixels that a strip's piece must have."""
SIGNIFICANT = 3.0
"""Contrast, in noise, above which a piece of a line is a discontinuity."""
LARGEST = 8.0
"""Contrast, in noise, to which larger ones are cut, so that one strong piece does not speak for a whole line."""
CHANNELS = 4
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """``step`` (b, c, 4): for each piece b of BLOCK pixels along a line and place c across, how much red, green, blue
    and depth change from the lower to the higher side; ``ridge`` (b, c, 4) how much a strip at c differs from both
    sides; in noise, nan where not seen. ``noise`` (4,) of a piece's step.
    """

    step: F32
    ridge: F32
    noise: NDArray[np.float64]


def upright_contrast(image: Orthoimage) -> Contrast:
    """Across upright lines: b counts upwards, c along the wall."""
    return _contrast(image.count, np.dstack([image.rgb, image.depth]))


def level_contrast(image: Orthoimage) -> Contrast:
    """Across level lines: b counts along the wall, c upwards."""
    values = np.dstack([image.rgb, image.depth])
    return _contrast(image.count.T, values.transpose(1, 0, 2))


def _contrast(count: NDArray[np.uint16], values: F32) -> Contrast:
    """For lines along the first axis."""
    measured = (count > 0).astype(np.float32)
    n, sums = _blocks(measured[..., None])[..., 0], _blocks(values * measured[..., None])
    weight = np.concatenate([np.zeros((len(n), 1), np.float32), np.cumsum(n, 1)], 1)
    total = np.concatenate([np.zeros((len(n), 1, CHANNELS), np.float32), np.cumsum(sums, 1)], 1)
    width = values.shape[1]
    at = np.arange(width)

    def mean(first: NDArray[np.int64], last: NDArray[np.int64]) -> F32:
        first, last = np.clip(first, 0, width), np.clip(last, 0, width)
        w = weight[:, last] - weight[:, first]
        s = total[:, last] - total[:, first]
        return np.where((w >= LEAST)[..., None], s / np.maximum(w, 1)[..., None], np.nan)

    step = mean(at, at + STRIP) - mean(at - STRIP, at)
    ridge = mean(at - 1, at + 1) - (mean(at + 1, at + 1 + STRIP) + mean(at - 1 - STRIP, at - 1)) / 2
    noise = np.array([_noise(step[..., k], FLOORS[k]) for k in range(CHANNELS)])
    scale = noise.astype(np.float32)
    return Contrast(_cut(step / scale), _cut(ridge / scale), noise)


def _cut(values: NDArray[np.floating]) -> F32:
    return np.clip(values, -LARGEST, LARGEST).astype(np.float32)


def _blocks(values: F32) -> F32:
    """Sums (b, c, k) over pieces of BLOCK pixels of the first axis of (r, c, k); the last piece may be shorter."""
    starts = np.arange(0, max(len(values), 1), BLOCK)
    return np.add.reduceat(values, starts, axis=0).astype(np.float32)


def _noise(steps: F32, least: float) -> float:
    """Robust standard deviation of the steps between neighbouring strips: most lie within one surface."""
    known = steps[np.isfinite(steps)]
    if not len(known):
        return least
    return max(least, 1.4826 * float(np.median(np.abs(known))))
