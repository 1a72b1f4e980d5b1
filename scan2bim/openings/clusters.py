"""Clusters of pixels where a wall's face is missing, by region growing, cut where wall or a curtain parts them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raster import closed, opened
from scan2bim.openings.sides import BLIND
from scan2bim.openings.wall_image import PIXEL, WallImage

BLUR = 4
"""Pixels, 10 cm, of the square in which points on the face are weighed against what was seen behind it."""
GONE = 0.15
"""Share of that square that must show something behind the face."""
PIER = 0.3
"""Share of it that must show the face for a strip between two openings to part them."""
HOLE, SPECK = 5, 5
"""Pixels: gaps up to 12 cm are closed, and what is narrower than 12 cm is dropped."""
LEAST_AREA = 0.05
"""Square metres that must be seen of a window in line with another one, of which furniture or a curtain hides more."""
WALLED, LEAST_SEEN = 0.7, 0.3
"""Share of what was seen of a strip between two openings that must be wall, and of it that must have been seen."""
RAIL = 2
"""Pixels across a strip of wall that parts two openings: 5 cm."""
NARROWEST = 0.3
"""Metres on both sides of what a curtain hides that must be left of a cluster: narrower ones are reveals."""
Mask = NDArray[np.bool_]


def clusters(missing: Mask, image: WallImage) -> list[Mask]:
    """Connected pixels, cut where strips of wall go across or along them, or a curtain hangs in their midst: openings
    that stand close together meet where something hides the wall between them.
    """
    known, blind = image.face | missing, ~image.told
    cut = missing.copy()
    for cluster in _connected(missing):
        rows, cols = np.flatnonzero(cluster.any(1)), np.flatnonzero(cluster.any(0))
        here = np.ix_(np.arange(rows[0], rows[-1] + 1), np.arange(cols[0], cols[-1] + 1))
        wall, seen = (image.face & ~missing)[here], known[here]
        cut[here] &= ~_strips(wall.sum(1), seen.sum(1), wall.shape[1])[:, None]
        cut[here] &= ~_strips(wall.sum(0), seen.sum(0), wall.shape[0])[None] & ~_curtains(blind[here])[None]
    return _connected(cut)


def _connected(mask: Mask) -> list[Mask]:
    """Groups of connected pixels that are large enough."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return [labels == k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] * PIXEL * PIXEL >= LEAST_AREA]


def _strips(wall: NDArray[np.int64], seen: NDArray[np.int64], width: int) -> Mask:
    """Lines (n,) of pixels that are wall as far as they were seen, at least RAIL beside each other."""
    walled = ((wall > WALLED * seen) & (seen > LEAST_SEEN * width)).astype(np.uint8)
    return opened(walled[:, None], RAIL)[:, 0].astype(bool) if len(walled) >= RAIL else np.zeros(len(walled), bool)


def _curtains(blind: Mask) -> Mask:
    """Columns (n,) in the midst of a cluster of which nothing was seen: curtains hang before the piers of windows."""
    nothing = (blind.mean(0) > 1 - BLIND).astype(np.uint8)
    beside = round(NARROWEST / PIXEL)
    nothing[:beside] = nothing[len(nothing) - beside :] = 0
    return opened(nothing[None], RAIL)[0].astype(bool) if len(nothing) > 2 * beside else np.zeros(len(nothing), bool)


def face_missing(image: WallImage) -> Mask:
    """Where the face on one side of the wall is not, since something was seen behind it or rays went through: the leaf
    of an open door may stand before the other face.
    """
    mask = np.zeros(image.through.shape, np.uint8)
    for points, behind, entered in zip(image.faces, image.behind, image.entered, strict=True):
        if not points.any():
            continue
        face = _blurred(points > 0)
        gone = _blurred(((behind > 0) | entered | image.blank | (image.through > 0)) & (points == 0))
        filled = closed(((gone > face) & (gone > GONE)).astype(np.uint8), HOLE)
        mask |= filled & ~((face >= gone) & (face > PIER))
    return opened(mask, SPECK).astype(bool)


def _blurred(mask: Mask) -> NDArray[np.float32]:
    blurred = cv2.boxFilter(mask.astype(np.float32), -1, (BLUR, BLUR), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(blurred, np.float32)
