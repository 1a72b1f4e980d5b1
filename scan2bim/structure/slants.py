"""Floors and ceilings seen at a slant: pulses meet them far apart, and between lies as much floor or ceiling."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.geometry.raster import closed
from scan2bim.structure.columns import pixels_at
from scan2bim.structure.storeys import Layers

GAPLESS, WIDEST_GAP = 0.15, 1.5
"""Metres between the places at which neighbouring pulses meet a floor or ceiling at a slant: up to the first they lie
close enough for a surface, up to the second they are drawn together.
"""
LEVEL = 0.03
"""Metres by which their heights may differ then."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]


def level_over(floor: U8, pixel: I64, z: F64, layers: Layers, ceiling: float | None) -> NDArray[np.bool_]:
    """Which surfels at the ceiling's height, seen from below, lie between the places at which floor was seen."""
    if ceiling is None:
        return np.zeros(len(z), bool)
    seen = closed(floor, 5)[pixel[:, 1], pixel[:, 0]] > 0
    return (layers.side < 0) & (np.abs(z - ceiling) < LEVEL) & seen


def angles_of(surfels: Surfels, layers: Layers, steps: Mapping[int, float]) -> F64:
    """Angle (n,) between the pulses of the station of each surfel (in layer order), 0 where unknown."""
    angle = np.zeros(1 << 16)
    angle[list(steps)] = list(steps.values())
    return angle[surfels.station[layers.order]]


def with_gaps(xyz: F64, eyes: F64, angles: F64, origin: F64, shape: tuple[int, ...]) -> F64:
    """Points (n, 3) of level surfaces seen from ``eyes`` (n, 3) with pulses at ``angles`` (n,), radians, and after them
    what lies between each and the one that the pulse before it met, if that lies level with it: at a slant that may be
    metres, and nothing stands there, for the pulse went through just before the surface.
    """
    away = eyes[:, :2] - xyz[:, :2]
    far, rise = np.linalg.norm(away, axis=1), np.abs(eyes[:, 2] - xyz[:, 2])
    gap = angles * (far**2 + rise**2) / np.where(rise > 0, rise, np.nan)
    wide = np.flatnonzero((gap > GAPLESS) & (gap < WIDEST_GAP) & (2 * gap < far))
    if not len(wide):
        return xyz
    pixel = pixels_at(xyz, origin)
    low, high = (_extreme(pixel, sign * xyz[:, 2], shape) * sign for sign in (1, -1))
    steps = np.arange(2, round(2 * WIDEST_GAP / PLAN))
    toward = away[wide] / far[wide, None] * PLAN
    line = xyz[wide, None, :2] + toward[:, None] * steps[:, None]
    at = np.clip(pixels_at(line, origin), 0, np.array(shape[::-1]) - 1)
    met = np.stack([raster[at[..., 1], at[..., 0]] for raster in (low, high)]) - xyz[wide, 2, None]
    seen = np.isfinite(met[0]) & (steps * PLAN < 2 * gap[wide, None])
    first = np.argmax(seen, axis=1)
    level = seen.any(1) & (np.abs(met).min(0)[np.arange(len(wide)), first] < LEVEL)
    between = (steps < steps[first][:, None] + 1) & level[:, None]
    row, col = np.nonzero(between)
    return np.concatenate([xyz, np.column_stack([line[row, col], xyz[wide[row], 2]])])


def _extreme(pixel: I64, z: F64, shape: tuple[int, ...]) -> F32:
    """The least of heights z (n,) over the 3 x 3 pixels round each, inf where there is none."""
    lowest = np.full(shape, np.inf, np.float32)
    np.minimum.at(lowest, (pixel[:, 1], pixel[:, 0]), z.astype(np.float32))
    return np.asarray(cv2.erode(lowest, np.ones((3, 3), np.uint8)), np.float32)
