"""What a scanner at a place would see of what is missing: rays through the model's openings, past the known clutter."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.coverage.rooms import PIXEL

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

RANGE = 8.0
"""Metres within which a station counts: scans of 0.2 degrees have points 3 cm apart there, 8 cm on a steep face, which
is a cell."""
STEEPEST = 0.34
"""Cosine of the angle between ray and normal, 70 degrees, from which on a face counts as seen: beyond it points lie
three times as far apart, and noise along the ray moves them along the face."""
FLOOR_RANGE = 5.0
"""Metres within which a station tells what unknown floor there is: across a room, since behind it may be a wall."""
DIMMED = 1.0
"""Metres of a space's air that no station looked through, after which the chance to look through it is one half: there
may be more furniture."""
STEP = 0.06
"""Metres between the places along a ray that are looked at: little more than a pixel."""
SHORT = 0.12
"""Metres before its target at which a ray has arrived: the target's own voxel may be occupied."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """What stops rays in a storey. frame (4,) of the rasters; low, high (r, c) float32 heights between which a pixel is
    air or unknown; things (l, r, c) uint8: 1 occupied, 2 air of a space that no station looked through; bottom and size
    of these voxels, metres.
    """

    frame: F64
    low: F32
    high: F32
    things: NDArray[np.uint8]
    bottom: float
    size: float


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """n places to be seen: points (n, 3) right before a face, normal (n, 3) of it (0 of unknown floor), area (n,)
    square metres, owner (n,) int64: the face's number, or -1 of unknown floor.
    """

    points: F64
    normal: F64
    area: F64
    owner: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.area)


def chances(eye: F64, targets: Targets, obstacles: Obstacles) -> F32:
    """(n,) chance that a scanner at ``eye`` (3,) sees each target, 0-1."""
    o = obstacles
    return _chances(eye, targets.points, targets.normal, o.frame, o.low, o.high, o.things, o.bottom, o.size)


@nb.njit(cache=True, nogil=True)
def _chances(eye, points, normal, frame, low, high, things, bottom, size):  # pyright: ignore
    out = np.zeros(points.shape[0], np.float32)
    rows, cols = low.shape
    step = int(np.rint(size / PIXEL))
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - eye[0], points[i, 1] - eye[1], points[i, 2] - eye[2]
        d = np.sqrt(x * x + y * y + z * z)
        cosine = -(x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]) / max(d, 1e-6)
        floor = normal[i, 0] == 0.0 and normal[i, 1] == 0.0 and normal[i, 2] == 0.0
        if d > (FLOOR_RANGE if floor else RANGE) or d < 0.3 or (cosine < STEEPEST and not floor):
            continue
        dim = 0.0
        free = True
        count = int((d - SHORT) / STEP)
        for k in range(1, count + 1):
            t = k * STEP / d
            dx, dy = eye[0] + t * x - frame[0], eye[1] + t * y - frame[1]
            h = eye[2] + t * z
            col = int(np.floor((dx * frame[2] + dy * frame[3]) / PIXEL))
            row = int(np.floor((dy * frame[2] - dx * frame[3]) / PIXEL))
            if col < 0 or row < 0 or col >= cols or row >= rows or h < low[row, col] or h > high[row, col]:
                free = False
                break
            layer = int(np.floor((h - bottom) / size))
            if 0 <= layer < things.shape[0]:
                thing = things[layer, row // step, col // step]
                if thing == 1:
                    free = False
                    break
                if thing == 2:
                    dim += STEP
        if free:
            out[i] = 0.5 ** (dim / DIMMED)
    return out
