"""Where a closed door's opening ends: the jambs and the head behind the outline that one sees.

What shows on a face is one of three things. A *step* from the wall to the frame or the leaf stands at the opening's
edge itself. A *trim* lies on the wall and laps over the edge: by little where the leaf comes right behind it, and over
a part of the lining where that shows between trim and leaf. A hairline *gap* round a leaf of the wall's own colour is
the leaf's edge, and the frame between it and the opening's edge cannot be told from the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.closed.sections import OFF, Section, level_section, upright_section, wall_beside
from scan2bim.openings.closed.trims import (
    DEPTH_STEP,
    FARTHEST,
    LAP,
    WIDEST_GAP,
    Trim,
    all_round,
    crossing,
    hairline,
    least_change,
    trims_round,
)

INWARDS, NEAR = 0.07, 0.03
"""Distance inwards from a rectangle's side, metres, up to which a change is its edge: things stand before the leaf; and
both ways that of a hairline, as which chance shows more often.
"""
LEAST_PLACES = 12
"""Places across an edge that must have been seen."""
AGREE = 0.02
"""Metres to which the edges of both faces agree, if both are the opening's."""
FRAME = 0.03
"""Metres from a leaf's hairline gap to the opening's edge, behind a frame that cannot be told from the wall."""
SIGMAS = {"reveal": 0.003, "step": 0.006, "trim": 0.010, "lined": 0.010, "gap": 0.015}
"""How far from the truth, metres, an edge of each kind is."""
Kind = Literal["reveal", "step", "trim", "lined", "gap"]


@dataclass(frozen=True, slots=True)
class Edge:
    """A side or head of an opening at ``place`` metres, with its sigma, and what showed it; ``deeper`` whether what is
    inside lies deeper than what is outside.
    """

    place: float
    sigma: float
    kind: Kind
    deeper: bool

    @property
    def is_trim(self) -> bool:
        """Whether a trim showed it."""
        return self.kind in ("trim", "lined")


def edges_of(faces: Sequence[Face], box: Rectangle) -> list[Edge | None]:
    """The edges of the opening behind a rectangle, left, right and at the head, as far as the faces show them."""
    found = [_of_face(face, box) for face in faces]
    return [_best([edges[k] for edges in found]) for k in range(3)]


def moved(box: Rectangle, edges: Sequence[Edge | None]) -> Rectangle:
    """A rectangle with its sides and head moved to the edges that were found."""
    left, right, head = (edge.place if edge else 0.0 for edge in edges)
    return Rectangle(box.left - left, box.right + right, box.top + head, box.whole and edges[2] is None)


def _of_face(face: Face, box: Rectangle) -> list[Edge | None]:
    """The edges left, right and at the head on one face. A trim or a lining that shows on one side is there on all, and
    where there is a trim, a step that goes not deeper is its outer edge or none of the door's.
    """
    left, right = upright_section(face, box, box.left, -1), upright_section(face, box, box.right, 1)
    sections = left, right, level_section(face, box)
    wall = wall_beside(sections)
    steps = [_outermost_step(section, wall) for section in sections]
    trims = trims_round(sections, wall)
    if not _are_the_doors(trims, steps):
        return steps
    lined = any(trim.lined for trim in trims if trim)
    edges: list[Edge | None] = []
    for trim, inner, step in zip(trims, all_round(trims, sections), steps, strict=True):
        if inner is None or (trim is None and step and step.deeper):
            edges.append(step if step and step.deeper else None)
        else:
            kind: Kind = "lined" if lined else "trim"
            edges.append(Edge(inner + LAP * lined, SIGMAS[kind], kind, True))
    return edges


def _are_the_doors(trims: Sequence[Trim | None], steps: Sequence[Edge | None]) -> bool:
    """Whether strips that stand out are a door's trims: one alone is not, where the other sides show steps."""
    seen = [trim is not None and trim.inner is not None for trim in trims]
    stepped = [step is not None and step.deeper for step in steps]
    return any(seen) and (sum(seen) > 1 or sum(s and not t for s, t in zip(stepped, seen, strict=True)) < 2)


def _best(found: Sequence[Edge | None]) -> Edge | None:
    """The edge that is known best, by depth rather than by colour; of two of one kind their mean, or where they do not
    agree the one that is nearer to the rectangle's side.
    """
    seen = [e for e in found if e is not None]
    if not seen:
        return None
    edges = [e for e in seen if e.deeper] or seen
    sure = min(e.sigma for e in edges)
    best = sorted((e for e in edges if e.sigma == sure), key=lambda e: abs(e.place))
    if abs(best[-1].place - best[0].place) > AGREE:
        best = best[:1]
    return replace(best[0], place=float(np.mean([e.place for e in best])))


def _outermost_step(section: Section, wall: float) -> Edge | None:
    """The outermost place where depth or colour changes for good from the wall, else the outermost hairline."""
    t, values, least = section.t, section.values, least_change(section)
    if len(t) < LEAST_PLACES:
        return None
    a, b, c = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))  # of three
    for i in range(len(t) - 4, 3, -1):
        if not -INWARDS < t[i] < FARTHEST:
            continue
        outer, inner = middle[i + 1], middle[i - 3]
        change = np.abs(outer - inner) / least
        if change.max() > 1 and (abs(outer[3] - wall) < OFF or abs(t[i]) < NEAR):
            k = int(np.argmax(change))
            near = range(max(i - 3, 0), min(i + 3, len(t) - 1))
            at = max(near, key=lambda j: abs(values[j + 1, k] - values[j, k]))
            place = crossing(t, values[:, k], at, (outer[k] + inner[k]) / 2)
            if t[at + 1] - t[at] > WIDEST_GAP or place > FARTHEST:
                continue  # something hides where it is, or it is another thing's
            return Edge(place, SIGMAS["step"], "step", bool(outer[3] - inner[3] > DEPTH_STEP))
        if abs(t[i]) < NEAR and hairline(section, i, i - 1) is not None:
            return Edge(float(t[i]) + FRAME, SIGMAS["gap"], "gap", False)
    return None
