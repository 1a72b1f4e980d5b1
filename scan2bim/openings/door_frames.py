"""The opening in the wall behind the frame of an open door, whose clear width is known by the frame's reveals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.openings.closed.edges import LAP, SIGMAS, Edge, moved
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.closed.reveals import LINED, behind_trims
from scan2bim.openings.closed.windows import known_values, level, share_known, share_near, window
from scan2bim.openings.door_linings import faint_lining, is_plain, seen_lining
from scan2bim.openings.door_trims import trim_setbacks
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
FLAT = np.radians(145)
"""Angle from which on what seems to be a leaf lies flat against the wall, as boards and cupboards do."""
FRAME, DEEP = (0.015, 0.06), 0.01
"""Distances inwards from a jamb, metres, between which a frame within the wall shows, and depth behind the wall's faces
from which on.
"""
FOOT, PIECE, FRAMED = 0.15, 0.1, 0.5
"""Height, metres, above thresholds; length of a jamb's pieces, and share of them in which a frame shows."""
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
    edges = _frame_edges(box, faces, points, wall.thickness / 2, _hidden_side(opening))
    if not any(edges):
        return _passage(opening) if not outer and _is_bare(opening, box, faces, points, wall.thickness / 2) else opening
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


def _passage(opening: OpeningShape) -> OpeningShape:
    """A doorway without a door."""
    return replace(
        opening, kind="passage", state="unknown", angle=None, hinge="unknown", swing="unknown", leaves=None, glazed=None
    )


def _is_bare(opening: OpeningShape, box: Rectangle, faces: Sequence[Face], points: WallPoints, half: float) -> bool:
    """Whether an open doorway has neither leaf nor frame: what lies flat against the wall may be anything, the wall's
    own colour goes on up to its sides, and nothing stands in it beside them.
    """
    if opening.kind != "door" or opening.state != "open" or (opening.angle or np.pi) < FLAT:
        return False
    if not is_plain([face.image for face in faces], (box.left, box.right, box.top)):
        return False
    near = points.inside(box.left, box.right, FOOT, box.top - STILE)
    deep = np.abs(near.across) < half - DEEP
    pieces = np.floor(near.up / PIECE).astype(np.int64)
    count = max(int((box.top - STILE - FOOT) / PIECE), 1)
    for inwards in (near.along - box.left, box.right - near.along):
        here = deep & (inwards > FRAME[0]) & (inwards < FRAME[1])
        if len(np.unique(pieces[here])) > FRAMED * count:
            return False
    return True


def _hidden_side(opening: OpeningShape) -> int | None:
    """The side, 0 left and 1 right, before whose jamb a leaf stands open."""
    return {"start": 0, "end": 1}.get(opening.hinge) if opening.state == "open" else None


def _frame_edges(
    box: Rectangle, faces: Sequence[Face], points: WallPoints, half: float, hidden: int | None
) -> list[Edge | None]:
    """The edges left, right and at the head of the opening behind the frame whose clear width is a ``box``; on the
    ``hidden`` side it is that of a leaf that stands before the jamb.

    A trim round it laps over the lining that shows inside it; else the lining's colour ends at the opening, but for
    sides at which the wall's own reveal was seen; else what each side shows by itself counts.
    """
    setbacks = trim_setbacks(points, box, half, hidden)
    if setbacks is not None and min(setbacks) >= LINED:
        return [Edge(setback + LAP, SIGMAS["lined"], "lined", True) for setback in setbacks]
    images, clear = [face.image for face in faces], (box.left, box.right, box.top)
    lining = None if setbacks is not None else seen_lining(images, clear) or faint_lining(images, clear)
    if lining is not None:
        bounds = [max if side == hidden else min for side in range(3)]
        ends = [bound(end, lining.width) for bound, end in zip(bounds, lining.sides, strict=True)]
        return [Edge(end, SIGMAS["step"], "step", True) if end > 0.0 else None for end in ends]
    return [edge if edge and _credible(edge) else None for edge in behind_trims(faces, box, points, half)]


def _credible(edge: Edge) -> bool:
    """Whether an edge is surer than the clear width, which is known by reveals: another reveal, the end of a lining, or
    a trim farther inside than the leaf that stands open is thick.
    """
    sure = edge.kind == "reveal" or (edge.kind != "trim" and edge.place > -INWARDS)
    return edge.place > -FARTHEST and (sure or edge.place < -LEAF)


def _with(sigma: float | None, *others: float) -> float | None:
    return None if sigma is None else round(float(np.linalg.norm([sigma, *others])), 4)
