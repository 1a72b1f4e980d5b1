"""The opening in the wall behind the frame of an open door, whose clear width is known by the frame's reveals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.openings.closed.edges import SIGMAS, Edge, moved
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.closed.reveals import behind_trims
from scan2bim.openings.door_linings import flush_lining
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

INWARDS = 0.01
"""Metres by which an opening may be found narrower than its clear width: noise of both edges."""


def with_frame(opening: OpeningShape, wall: WallShape, faces: Sequence[Face], points: WallPoints) -> OpeningShape:
    """A door or passage with the trims or the lining round it, if they show; ``points`` near its wall."""
    if opening.kind == "window" or opening.glazed or not faces:
        return opening
    box = Rectangle(opening.offset, opening.offset + opening.width, opening.sill + opening.height)
    edges = behind_trims(faces, box, points, wall.thickness / 2)
    if not any(edges):
        width = flush_lining([face.image for face in faces], (box.left, box.right, box.top))
        edges = [None if width is None else Edge(width, SIGMAS["step"], "step", True)] * 3
    edges = [edge if edge and edge.place > -INWARDS else None for edge in edges]
    if not any(edges):
        return opening
    behind = moved(box, edges)
    behind = Rectangle(max(behind.left, 0.0), min(behind.right, wall.length), min(behind.top, wall.top - wall.base))
    left, right, head = (edge.sigma if edge else 0.0 for edge in edges)
    return replace(
        opening,
        offset=round(behind.left, 4),
        width=round(behind.width, 4),
        height=round(behind.top - opening.sill, 4),
        width_sigma=_with(opening.width_sigma, left, right),
        height_sigma=_with(opening.height_sigma, head),
    )


def _with(sigma: float | None, *others: float) -> float | None:
    return None if sigma is None else round(float(np.linalg.norm([sigma, *others])), 4)
