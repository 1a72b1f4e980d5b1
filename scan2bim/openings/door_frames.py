"""The opening in the wall behind the frame of an open door, whose clear width is known by the frame's reveals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.openings.closed.edges import SIGMAS, Edge, moved
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.closed.reveals import behind_trims
from scan2bim.openings.closed.windows import known_values, level, share_known, share_near, window
from scan2bim.openings.door_linings import flush_lining
from scan2bim.openings.leaves import WIDEST
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

INWARDS, LEAF, FARTHEST = 0.01, 0.06, 0.12
"""Metres by which a trim may begin inside what was taken for the clear width: by the noise of both edges, or by more
than the thickness of a leaf that stands there.
"""
PANEL = (0.12, 0.6)
"""Heights, metres, between which a glazed leaf has a panel: panes begin higher, and handles."""
STILE = 0.1
"""Metres beside the jambs that are not asked of it: frames."""
EVEN = 0.012
"""Metres from its plane within which a panel's points lie: fillings of a frame are recessed."""
SOLID, SEEN = 0.8, 0.5
"""Share of what was seen between those heights that lies in one plane, and share that was seen."""
PROUD = 0.02
"""Metres before the wall's face up to which a leaf may stand: what stands farther out is furniture."""


def with_pane(opening: OpeningShape, wall: WallShape, faces: Sequence[Face]) -> OpeningShape:
    """A door that was looked through, and of which the lower part is shut by a panel within the wall, is closed, with
    a pane in its leaf.
    """
    if opening.kind == "window" or opening.angle is not None or opening.glazed or opening.sill > 0.0:
        return opening
    for face in faces:
        image = face.image
        low, high = opening.offset + STILE, opening.offset + opening.width - STILE
        part = window(image.depth.shape, low, high, *PANEL)
        depths = known_values(image.depth, image.known, part, 1)
        panel = level(depths)
        within = -wall.thickness < panel < PROUD
        if within and share_near(depths, panel, EVEN) > SOLID and share_known(image.known, part, 1) > SEEN:
            leaves = 1 if opening.width <= WIDEST else 2
            return replace(opening, kind="door", state="closed", glazed=True, leaves=leaves)
    return opening


def with_frame(opening: OpeningShape, wall: WallShape, faces: Sequence[Face], points: WallPoints) -> OpeningShape:
    """A door or passage with the trims or the lining round it, if they show; ``points`` near its wall."""
    outer = not (wall.left and wall.right)
    if opening.kind == "window" or opening.sill > 0.0 or (opening.glazed and outer) or not faces:
        return opening
    box = Rectangle(opening.offset, opening.offset + opening.width, opening.sill + opening.height)
    edges = behind_trims(faces, box, points, wall.thickness / 2)
    if not any(edges):
        width = flush_lining([face.image for face in faces], (box.left, box.right, box.top))
        edges = [None if width is None else Edge(width, SIGMAS["step"], "step", True)] * 3
    edges = [edge if edge and _credible(edge) else None for edge in edges]
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


def _credible(edge: Edge) -> bool:
    """Whether an edge is surer than the clear width, which is known by reveals: another reveal, the end of a lining, or
    a trim farther inside than the leaf that stands open is thick.
    """
    sure = edge.kind == "reveal" or (edge.kind != "trim" and edge.place > -INWARDS)
    return edge.place > -FARTHEST and (sure or edge.place < -LEAF)


def _with(sigma: float | None, *others: float) -> float | None:
    return None if sigma is None else round(float(np.linalg.norm([sigma, *others])), 4)
