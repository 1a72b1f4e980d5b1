"""The discontinuity image J'_CD (section V.B): colour gradient and Otsu's threshold, or Canny's edges of the depth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

CANNY = (15.0, 40.0)
"""Canny's two thresholds on 8-bit depth: with 20 cm as 255 and its 3 x 3 operator, steps of about 3 and 8 mm."""
BLUR = 3
"""Edge, pixels, of the median that takes single wrong pixels out before gradients are formed."""
F32 = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Discontinuities:
    """Binary images (r, c): of colour J'_C, of depth J'_D, and of both J'_CD; ``gradient`` (r, c) of the colour J_C."""

    gradient: F32
    colour: Mask
    depth: Mask

    @property
    def combined(self) -> Mask:
        """J'_CD, the two together (OR)."""
        return self.colour | self.depth


def discontinuities(values: F32, known: Mask) -> Discontinuities:
    """Of J_CD, ``values`` (r, c, 4) from 0 to 1 where ``known`` (r, c)."""
    eight = (values * 255).astype(np.uint8)
    smooth = np.stack([cv2.medianBlur(np.ascontiguousarray(eight[..., k]), BLUR) for k in range(4)], 2)
    gradient = spectral_gradient(smooth[..., :3].astype(np.float32) / np.float32(255))
    clear = cv2.erode(known.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    gradient[~clear] = 0
    depth = cv2.Canny(np.ascontiguousarray(smooth[..., 3]), *CANNY) > 0
    return Discontinuities(gradient, otsu(gradient, clear), depth & clear)


def spectral_gradient(rgb: F32) -> F32:
    """Largest rate of change of a pixel along the spectral dimensions: the larger eigenvalue of the tensor of the
    channels' gradients (Di Zenzo).
    """
    across = np.stack([cv2.Sobel(rgb[..., k], cv2.CV_32F, 1, 0) for k in range(3)], 2)
    up = np.stack([cv2.Sobel(rgb[..., k], cv2.CV_32F, 0, 1) for k in range(3)], 2)
    xx, yy, xy = (across**2).sum(2), (up**2).sum(2), (across * up).sum(2)
    largest = (xx + yy + np.sqrt((xx - yy) ** 2 + 4 * xy**2)) / 2
    return np.sqrt(largest).astype(np.float32)


def otsu(gradient: F32, known: Mask) -> Mask:
    """Pixels above the threshold that parts the histogram of the known ones with least variance within both parts."""
    if not known.any():
        return known
    top = float(np.percentile(gradient[known], 99.5))
    eight = np.clip(gradient / max(top, 1e-6) * 255, 0, 255).astype(np.uint8)
    threshold, _ = cv2.threshold(eight[known].reshape(-1, 1), 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return (eight > threshold) & known
