"""Morphology of masks: closing, opening, and the nearest marked pixel."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8]


def closed(mask: Mask, size: int, rows: int | None = None) -> Mask:
    """``mask`` (r, c) of 0 and 1 with gaps filled that are narrower than ``size`` pixels (and ``rows``, if given)."""
    return _morphed(mask, cv2.MORPH_CLOSE, size, rows)


def opened(mask: Mask, size: int) -> Mask:
    """``mask`` without what a square of ``size`` pixels does not fit in."""
    return _morphed(mask, cv2.MORPH_OPEN, size, None)


def _morphed(mask: Mask, operation: int, size: int, rows: int | None) -> Mask:
    kernel = np.ones((rows or size, size), np.uint8)
    return np.asarray(cv2.morphologyEx(mask, operation, kernel), np.uint8)


def nearest_of(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each pixel of ``known`` (r, c) the flat index of the nearest marked one. At least one must be marked."""
    label = nearest_labels(known).astype(np.int64)
    index = np.zeros(int(label.max()) + 1, np.int64)
    index[label[known]] = np.flatnonzero(known)
    return index[label]


def nearest_labels(known: NDArray[np.bool_]) -> NDArray[np.int32]:
    """A number for each marked pixel of ``known`` (r, c), and for each other that of the nearest marked one."""
    away = (~known).view(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(away, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    return np.asarray(labels, np.int32)
