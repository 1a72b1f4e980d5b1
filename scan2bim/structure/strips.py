"""Strips of the plan before and behind a wall's face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.fits import Face
from scan2bim.structure.plan import Plan

I64 = NDArray[np.int64]


def strip_of(plan: Plan, face: Face, back: float, front: float) -> I64:
    """Pixels (across, along, 2) of a strip along a face, from ``back`` to ``front`` metres before it, every 5 cm."""
    t, d = np.meshgrid(np.arange(face.low, face.high, PLAN), np.arange(back + PLAN / 2, front, PLAN))
    points = face.centre + t[..., None] * face.direction + d[..., None] * face.normal
    pixel = plan.grid.pixel_of(points.reshape(-1, 2))
    return np.clip(pixel, 0, np.array(plan.floor.shape[::-1]) - 1).reshape(*t.shape, 2)


def ceiling_on(plan: Plan, face: Face, back: float, front: float) -> NDArray[np.float32]:
    """Heights of the ceiling (across, along) on such a strip; NaN where none was seen."""
    pixel = strip_of(plan, face, back, front)
    seen = plan.ceiling[pixel[..., 1], pixel[..., 0]] > 0
    return np.where(seen, plan.ceiling_z[pixel[..., 1], pixel[..., 0]], np.float32(np.nan))
