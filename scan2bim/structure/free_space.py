"""Where stations looked through: empty space, told from the panoramas on a horizontal slice."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.faces import Face
from scan2bim.structure.plan import Plan

REACH = 20.0
"""Stations farther than this, metres, are not asked: their cells are wider than a wall there."""
MARGIN = 0.1
"""Metres beyond a point that a pulse must have flown to have gone through it."""


def looked_through(
    origin: NDArray[np.float64],
    shape: tuple[int, ...],
    panoramas: Sequence[Panorama],
    height: float,
    misses: bool = False,
) -> NDArray[np.bool_]:
    """Pixels (rows, columns) of PLAN metres that a station looked through at this ``height`` (z, metres), sampled every
    10 cm. ``misses``: pulses that did not return went through, too.
    """
    rows, cols = shape
    free = np.zeros(((rows + 1) // 2, (cols + 1) // 2), np.uint8)
    for panorama in panoramas:
        middle = (panorama.position[:2] - origin) / (2 * PLAN)
        low = np.clip(np.floor(middle - REACH / (2 * PLAN)), 0, free.shape[::-1]).astype(int)
        high = np.clip(np.ceil(middle + REACH / (2 * PLAN)), 0, free.shape[::-1]).astype(int)
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
        points = np.empty((x.size, 3), np.float32)
        points[:, 0], points[:, 1] = x.ravel() * 2 * PLAN + origin[0], y.ravel() * 2 * PLAN + origin[1]
        points[:, 2] = height
        said = panorama.said(points, np.float32(MARGIN), misses)
        free[low[1] : high[1], low[0] : high[0]] |= (said == 1).reshape(x.shape)
    return cv2.resize(free, (free.shape[1] * 2, free.shape[0] * 2), interpolation=cv2.INTER_NEAREST)[:rows, :cols] > 0


def seen_beyond(
    face: Face, plan: Plan, panoramas: Sequence[Panorama], depth: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """What stations before a face say of the places ``depth`` metres behind it, every 10 cm along it and every 20 cm in
    the height of a door: (along, heights) whether any says something, and whether any looked through them. Only what a
    station sees through the face itself counts.
    """
    along = np.arange(face.low + 0.05, face.high, 0.1)
    heights = plan.levels.floor + np.arange(0.4, 2.1, 0.2)
    points = np.empty((len(along), len(heights), 3), np.float32)
    points[..., :2] = (face.centre + np.outer(along, face.direction) - depth * face.normal)[:, None]
    points[..., 2] = heights
    flat, shape = points.reshape(-1, 3), points.shape[:2]
    through, stopped = np.zeros(shape, bool), np.zeros(shape, bool)
    eyes = np.array([panorama.position for panorama in panoramas]).reshape(-1, 3)
    before, beside = np.array([face.normal, face.direction]) @ (eyes[:, :2] - face.centre).T
    for k in np.flatnonzero(before > 0).tolist():
        crossing = beside[k] + (along - beside[k]) * before[k] / (before[k] + depth)
        inside = (crossing > face.low) & (crossing < face.high)
        if inside.any():
            said = panoramas[k].said(flat, np.float32(0.05), misses=True)
            said = np.where(inside[:, None], said.reshape(shape), 0)
            through |= said == 1
            stopped |= said == 3
    return through | stopped, through
