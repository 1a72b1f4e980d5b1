"""The visible area of the wall itself (section V.A): coherent patches, their clusters, and the pixels like them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.config import OpeningSettings
from scan2bim.openings.orthoimage import Orthoimage
from scan2bim.openings.paper.clusters import adaptive_k_means

DEPTH_RANGE = 0.20
"""Metres of depth that count as 1, so that one threshold serves all four components: from 10 cm behind the wall's plane
to 10 cm before it.
"""
MARGIN = 0.06
"""How far (of 1) the thresholds of a segment reach beyond its patches."""
F32 = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """``patches`` (p, 2) rows and columns of coherent patches, ``label`` (p,) of their clusters, -1 where inconsistent;
    ``segment`` (r, c) of each pixel, -1 where it matches none; ``wall`` number of the wall's segment, -1 if none.
    """

    patches: NDArray[np.int64]
    label: NDArray[np.int64]
    segment: NDArray[np.int64]
    wall: int

    @property
    def wall_area(self) -> Mask:
        """Pixels (r, c) of the wall itself."""
        return (self.segment == self.wall) & (self.segment >= 0)


def rgbd(image: Orthoimage) -> F32:
    """The image J_CD (r, c, 4): red, green, blue and depth, all from 0 to 1."""
    depth = np.clip(image.depth / np.float32(DEPTH_RANGE) + np.float32(0.5), 0, 1)
    return np.concatenate([image.rgb, depth[..., None]], 2).astype(np.float32)


def segment_wall(values: F32, known: Mask, settings: OpeningSettings) -> Segmentation:
    """Segments of J_CD, ``values`` (r, c, 4) where ``known`` (r, c)."""
    places, means = coherent_patches(values, known, settings)
    clusters = adaptive_k_means(means)
    label = np.where(clusters.silhouette >= settings.paper_silhouette, clusters.label, -1)
    segment = match_pixels(values, known, means, label, clusters.count)
    return Segmentation(places, label, segment, _most_border_pixels(segment, known, clusters.count))


def coherent_patches(
    values: F32, known: Mask, settings: OpeningSettings
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Middles (p, 2) and means (p, 4) of the patches of a grid that deviate little in every component."""
    rows, cols = known.shape
    half = settings.paper_patch // 2
    row = np.unique(np.linspace(half, max(rows - 1 - half, half), settings.paper_grid).astype(np.int64))
    col = np.unique(np.linspace(half, max(cols - 1 - half, half), settings.paper_grid).astype(np.int64))
    middle = np.stack(np.meshgrid(row, col, indexing="ij"), -1).reshape(-1, 2)
    offset = np.arange(-half, half + 1)
    at_row = np.clip(middle[:, :1] + np.repeat(offset, len(offset)), 0, rows - 1)
    at_col = np.clip(middle[:, 1:] + np.tile(offset, len(offset)), 0, cols - 1)
    pixels = values[at_row, at_col].astype(np.float64)
    coherent = known[at_row, at_col].all(1) & (pixels.std(1) <= settings.paper_deviation).all(1)
    return middle[coherent], pixels[coherent].mean(1)


def match_pixels(
    values: F32, known: Mask, means: NDArray[np.float64], label: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """Segment (r, c) of each pixel by exclusive thresholds on all four components: within those of a cluster's patches,
    and of several such clusters the nearest; -1 for none.
    """
    segment = np.full(known.shape, -1, np.int64)
    nearest = np.full(known.shape, np.inf, np.float32)
    for k in range(count):
        mine = means[label == k]
        if not len(mine):
            continue
        low, high = mine.min(0) - MARGIN, mine.max(0) + MARGIN
        inside = ((values >= low) & (values <= high)).all(2) & known
        distance = np.abs(values - mine.mean(0).astype(np.float32)).sum(2)
        closer = inside & (distance < nearest)
        segment[closer], nearest[closer] = k, distance[closer]
    return segment


def _most_border_pixels(segment: NDArray[np.int64], known: Mask, count: int) -> int:
    """The segment with most pixels on the border of what is known of the image."""
    rows, cols = np.flatnonzero(known.any(1)), np.flatnonzero(known.any(0))
    if not len(rows) or not count:
        return -1
    inner = segment[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    border = np.concatenate([inner[:5].ravel(), inner[-5:].ravel(), inner[:, :5].ravel(), inner[:, -5:].ravel()])
    votes = np.bincount(border[border >= 0], minlength=count)
    return int(np.argmax(votes)) if votes.any() else -1
