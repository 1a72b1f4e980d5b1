"""Closed doors by the paper's section V: the wall's own area, discontinuities, rectangles, and four conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scan2bim.config import OpeningSettings
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.orthoimage import PIXEL, Orthoimage
from scan2bim.openings.paper.clusters import adaptive_k_means
from scan2bim.openings.paper.discontinuities import Discontinuities, discontinuities
from scan2bim.openings.paper.rectangles import (
    Rectangles,
    lines_of,
    outermost,
    rectangles_of,
    share_of,
    support_of,
)
from scan2bim.openings.paper.segmentation import F32, Mask, Segmentation, rgbd, segment_wall
from scan2bim.openings.shapes import OpeningShape

PAPER_CONFIDENCE = 0.5
"""The paper's conditions are met or not; they give no probability."""
SAMPLES = 20
"""Rows and columns of the pixels of a rectangle whose colours and depths are clustered."""


@dataclass(frozen=True, slots=True, eq=False)
class PaperDoors:
    """Each step's outcome on one face: segments, discontinuities, lines (columns and rows), rectangles before the
    conditions, and the doors.
    """

    segmentation: Segmentation
    edges: Discontinuities
    upright: tuple[int, ...]
    level: tuple[int, ...]
    candidates: Rectangles
    doors: tuple[Rectangle, ...]


def closed_doors_of(image: Orthoimage, settings: OpeningSettings) -> PaperDoors:
    """The closed doors of one face, with all that led to them."""
    values = rgbd(image)
    segmentation = segment_wall(values, image.known, settings)
    edges = discontinuities(values, image.known)
    upright, level = lines_of(edges.combined, settings)
    candidates = rectangles_of(upright, level, settings)
    # The conditions are independent of each other: the costly first one comes last.
    found = candidates.pick(support_of(edges.combined, candidates).min(1) >= settings.paper_outline)
    found = found.pick(share_of(segmentation.wall_area, found) <= settings.paper_wall)
    found = found.pick(_consistent(values, image.known, found, settings))
    found = found.pick(outermost(found))
    doors = (
        Rectangle(float(a) * PIXEL, float(b) * PIXEL, float(c) * PIXEL)
        for a, b, c in zip(found.left, found.right, found.top, strict=True)
    )
    return PaperDoors(segmentation, edges, tuple(upright.tolist()), tuple(level.tolist()), candidates, tuple(doors))


def _consistent(values: F32, known: Mask, found: Rectangles, settings: OpeningSettings) -> Mask:
    """Condition 1: the dominant colour and the dominant depth each cover enough of the rectangle (n,)."""
    out = np.zeros(len(found), bool)
    for k, (left, right, top) in enumerate(zip(found.left, found.right, found.top, strict=True)):
        rows = np.linspace(0, top - 1, SAMPLES).astype(np.int64)
        cols = np.linspace(left, right - 1, SAMPLES).astype(np.int64)
        seen = known[np.ix_(rows, cols)].ravel()
        pixels = values[np.ix_(rows, cols)].reshape(-1, 4)[seen].astype(np.float64)
        if len(pixels) < SAMPLES:
            continue
        shares = (adaptive_k_means(pixels[:, :3]).dominant, adaptive_k_means(pixels[:, 3:]).dominant)
        out[k] = min(shares) * len(pixels) / SAMPLES**2 >= settings.paper_dominant
    return out


def paper_openings(storey: int, number: int, faces: Sequence[Face], settings: OpeningSettings) -> list[OpeningShape]:
    """The closed doors of a wall, its storey's ``number``, each face by itself; what both show counts once."""
    kept: list[Rectangle] = []
    for face in faces:
        found = closed_doors_of(face.image, settings).doors
        kept += [box for box in found if not any(box.overlap(other) > 0 for other in kept)]
    return [
        OpeningShape(
            storey,
            number,
            "door",
            "closed",
            round(box.left, 4),
            0.0,
            round(box.width, 4),
            round(box.top, 4),
            PIXEL,
            PIXEL,
            0.0,
            2,
            lintel=False,
            points=0,
            stations=(),
            confidence=PAPER_CONFIDENCE,
            words=("meets the four conditions of the paper's section V",),
        )
        for box in kept
    ]
