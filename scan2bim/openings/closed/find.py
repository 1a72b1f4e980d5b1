"""Closed doors of a wall: candidates from the discontinuities of both faces, judged by the evidence of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scan2bim.cloud.panorama import Panorama
from scan2bim.openings.closed.edges import moved
from scan2bim.openings.closed.evidence import FaceEvidence, evidence_of
from scan2bim.openings.closed.extents import fitted
from scan2bim.openings.closed.rectangles import Face, Rectangle, candidates, contrasted
from scan2bim.openings.closed.reveals import opening_edges
from scan2bim.openings.closed.score import DOUBLE, FLUSH, UNSEEN, confidence, features_of, probability
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.orthoimage import F64, PIXEL, Side, breaks_of, orthoimage
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import SpaceShape, WallShape

ACCEPTED = 0.6
"""Confidence from which a rectangle is taken for a door: of those below it few are, in the scenes of the fit."""
REFUTED = 0.01
"""Probability where its sides fit best below which a rectangle is no door, whatever speaks for it where it began."""
OUTLINED = 0.4
"""Share of an outline from which on a face is taken to show the door."""
TALL_SIDES, SIDES_SHOWN = 0.5, 0.3
"""Share of each side of a door as high as the room that must be discontinuities on every face on which more than that
share of the sides was seen: there is no head to tell it by.
"""
BESIDE = 0.4
"""Share of the wall beside it that must be seen in its plane to tell that a leaf stands back there."""
ROUGH = 0.03
"""Metres, standard deviation of a side that is only known as a line of the image: half of a trim's width."""
LEAF_THICKNESS = 0.04
"""Metres: inner door leaves are 39 to 42 mm."""
NEAR_FACE = 0.08
"""Recess, metres, up to which a leaf lies near the face that shows it, however thick the wall may be."""
NEARER = 0.02
"""Difference of the recesses on both faces, metres, from which on one of them is the nearer."""
HINGE: dict[str, Literal["start", "end"]] = {"start": "end", "end": "start"}
"""The hinge side by the handle's."""
SIDES: tuple[Side, Side] = ("left", "right")
PART = 0.1
"""Share of its rank that a rectangle loses whose head goes on beyond it: furniture beside it has level lines, too."""
SAME_SIDES, WHOLE_HEAD = 0.75, 0.9
"""Overlap along the wall from which on two rectangles are of one door, a trim more or less, and share of a head that
shows it."""
PAIR, LEVEL = 0.04, 0.03
"""Gap between two leaves of one door, and difference of their heads, metres: doors of their own have a post between."""
LEAVES = 1.35
"""Width, metres, of an opening from which on a door has two leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class ClosedDoor:
    """A rectangle taken for a closed door, with its probability and what the faces, by side, say of it."""

    box: Rectangle
    probability: float
    evidence: Mapping[Side, FaceEvidence]

    @property
    def confidence(self) -> float:
        """The probability that it is right, if it is kept."""
        return confidence(self.probability)

    @property
    def rank(self) -> float:
        """How it stands against others that it overlaps: probable, holding nothing but a leaf, with one change on both
        sides and the head, as a line beside the door is another one, and a head that ends with it, as that of a part
        does not.
        """
        firm = [e for e in self.evidence.values() if not e.loose]
        agree = max((e.agree for e in firm), default=0.0)
        onward = max(firm, key=lambda e: e.support).onward if firm else 0.0
        return self.probability * self.whole * (1 + agree) / 2 * (1 - PART * onward)

    @property
    def whole(self) -> float:
        """Share of the rectangle that has one depth and colour, on the face where that is least."""
        return min((e.whole for e in self.evidence.values() if e.outline > OUTLINED), default=0.0)


def faces_of(
    wall: WallShape,
    spaces: Sequence[SpaceShape],
    points: WallPoints,
    stations: F64,
    panoramas: Mapping[int, Panorama],
) -> list[Face]:
    """The faces of a wall that were seen, with their contrasts; ``spaces`` are those of its storey."""
    images = (
        orthoimage(wall, side, points, stations, panoramas, breaks_of(wall, side, spaces))
        for side in SIDES
        if (wall.left if side == "left" else wall.right)
    )
    return contrasted([image for image in images if image is not None])


def closed_doors(faces: Sequence[Face]) -> list[ClosedDoor]:
    """The closed doors of a wall."""
    found = [judged(faces, box, to_keep=True) for box in candidates(faces)]
    headed = [d for d in found if not d.box.whole]
    tall = [_headed(faces, d, headed) for d in found if d.box.whole and is_tall_leaf(d)]
    return paired(faces, placed(faces, kept([*headed, *tall])))


def placed(faces: Sequence[Face], doors: Sequence[ClosedDoor]) -> list[ClosedDoor]:
    """Doors with their sides and heads where they fit best, none in another one's place, and none that is refuted."""
    out: list[ClosedDoor] = []
    length = faces[0].image.depth.shape[1] * PIXEL if faces else 0.0
    for door in doors:
        others = [d.box for d in doors if d is not door]
        low = max((o.right for o in others if o.right <= door.box.left), default=0.0)
        high = min((o.left for o in others if o.left >= door.box.right), default=length)
        at = judged(faces, fitted(faces, door.box, low, high))
        if at.probability >= REFUTED:
            out.append(replace(at, probability=max(at.probability, door.probability)))
    return out


def _headed(faces: Sequence[Face], tall: ClosedDoor, headed: Sequence[ClosedDoor]) -> ClosedDoor:
    """A rectangle as high as the wall, down to its door's head where that was seen: its sides may be the surer ones."""
    door = head_of(tall, headed)
    if door is None:
        return tall
    below = judged(faces, Rectangle(tall.box.left, tall.box.right, door.box.top))
    return replace(below, probability=max(below.probability, door.probability))


def paired(faces: Sequence[Face], doors: Sequence[ClosedDoor]) -> list[ClosedDoor]:
    """The doors of a wall, those that stand edge to edge as the two leaves of one."""
    out: list[ClosedDoor] = []
    for door in sorted(doors, key=lambda d: d.box.left):
        last = out[-1] if out else None
        if last is None or not _are_leaves(last.box, door.box):
            out.append(door)
            continue
        whole = last.box.whole and door.box.whole
        both = judged(faces, Rectangle(last.box.left, door.box.right, max(last.box.top, door.box.top), whole))
        out[-1] = replace(both, probability=max(last.probability, door.probability, both.probability))
    return out


def _are_leaves(left: Rectangle, right: Rectangle) -> bool:
    """Whether two rectangles touch, end at one height and are as wide together as a door of two leaves."""
    gap, wide = right.left - left.right, right.right - left.left
    return abs(gap) < PAIR and abs(left.top - right.top) < LEVEL and DOUBLE[0] < wide < DOUBLE[1]


def is_tall_leaf(door: ClosedDoor) -> bool:
    """Whether a rectangle as high as the wall is a door, and no panel, curtain or wardrobe: every face on which its
    sides were seen shows them, and on one of them a leaf stands back behind the wall beside it.
    """
    shown = [e for e in door.evidence.values() if e.seen > UNSEEN and e.shown > SIDES_SHOWN]
    back = max((e.recess for e in shown if np.isfinite(e.recess) and e.flank > BESIDE), default=0.0)
    return back > FLUSH and all(e.weakest > TALL_SIDES for e in shown)


def head_of(tall: ClosedDoor, headed: Sequence[ClosedDoor]) -> ClosedDoor | None:
    """The best door in a rectangle as high as the wall whose head was seen below, all of it: under low ceilings little
    wall is left above.
    """
    found: list[ClosedDoor] = []
    for door in headed:
        inner = min(tall.box.right, door.box.right) - max(tall.box.left, door.box.left)
        outer = max(tall.box.right, door.box.right) - min(tall.box.left, door.box.left)
        head = max((e.head for e in door.evidence.values() if not e.loose), default=0.0)
        if inner > SAME_SIDES * outer and head > WHOLE_HEAD and door.confidence >= ACCEPTED:
            found.append(door)
    return max(found, key=lambda d: d.rank, default=None)


def kept(doors: Sequence[ClosedDoor], least: float = ACCEPTED) -> list[ClosedDoor]:
    """Of those that overlap the one that is surest and fits best, if its confidence is ``least``."""
    apart: list[ClosedDoor] = []
    for door in sorted(doors, key=lambda d: -d.rank):
        if door.confidence >= least and all(_apart(door.box, k.box) for k in apart):
            apart.append(door)
    return apart


def judged(faces: Sequence[Face], box: Rectangle, *, to_keep: bool = False) -> ClosedDoor:
    """A rectangle with what the faces say of it; with ``to_keep`` of one that cannot be kept only what shows that."""

    def promising(evidence: Sequence[FaceEvidence]) -> bool:
        return confidence(probability(features_of(evidence, box))) >= ACCEPTED

    evidence = evidence_of(faces, box, promising if to_keep else None)
    sides: dict[Side, FaceEvidence] = {f.image.side: e for f, e in zip(faces, evidence, strict=True)}
    return ClosedDoor(box, probability(features_of(evidence, box)), sides)


def _apart(a: Rectangle, b: Rectangle) -> bool:
    return a.right <= b.left or b.right <= a.left


def closed_openings(
    storey: int, number: int, wall: WallShape, faces: Sequence[Face], points: WallPoints
) -> list[OpeningShape]:
    """The closed doors of a wall, its storey's ``number``, as openings; ``points`` are those near it."""
    return [_opening(storey, number, wall, door, faces, points) for door in closed_doors(faces)]


def _opening(
    storey: int, number: int, wall: WallShape, door: ClosedDoor, faces: Sequence[Face], points: WallPoints
) -> OpeningShape:
    edges = opening_edges(faces, door.box, points, wall.thickness / 2)
    box = moved(door.box, edges)
    length = wall.length
    box = Rectangle(max(box.left, 0.0), min(box.right, length), min(box.top, wall.top - wall.base), box.whole)
    sigma = [ROUGH if edge is None else edge.sigma for edge in edges]
    on_leaf = points.stations_inside(box.left, box.right, -np.inf, box.top)
    sides, depth = _recess(wall, door)
    shown = [e for e in door.evidence.values() if e.outline > OUTLINED]
    handle = next(((e.handle, e.handle_side) for e in shown if e.handle is not None), (None, None))
    leaves = 2 if box.width > LEAVES else 1
    return OpeningShape(
        storey,
        number,
        "door",
        "closed",
        round(box.left, 4),
        0.0,
        round(box.width, 4),
        round(box.top, 4),
        round(float(np.hypot(sigma[0], sigma[1])), 4),
        sigma[2],
        round(max(e.through for e in door.evidence.values()), 3),
        max(int(e.left > 0.5) + int(e.right > 0.5) for e in door.evidence.values()),
        any(e.lintel > 0.5 for e in door.evidence.values()),
        int(on_leaf.sum()),
        tuple(np.flatnonzero(on_leaf).tolist()),
        round(door.confidence, 3),
        hinge=HINGE[handle[1]] if handle[1] is not None and leaves == 1 else "unknown",
        swing=sides,
        leaves=leaves,
        recess=None if depth is None else round(depth, 4),
        recess_side=sides,
        handle_height=handle[0],
        words=in_words(replace(door, box=box)),
    )


def _recess(wall: WallShape, door: ClosedDoor) -> tuple[Literal["left", "right", "unknown"], float | None]:
    """The side to whose face the leaf is nearer, which is the side that it opens to, and how far behind that face it
    stands, metres; unknown where it stands in the middle or nothing tells.
    """
    measured = {s: e.recess for s, e in door.evidence.items() if np.isfinite(e.recess) and e.outline > OUTLINED}
    across = wall.thickness - LEAF_THICKNESS
    left = measured.get("left", across - measured["right"] if "right" in measured else None)
    if left is None or (len(measured) == 1 and wall.faces == 1 and max(measured.values()) > NEAR_FACE):
        return "unknown", None
    right = measured.get("right", across - left)
    if abs(left - right) < NEARER:
        return "unknown", None
    return ("left", max(left, 0.0)) if left < right else ("right", max(right, 0.0))


def in_words(door: ClosedDoor) -> tuple[str, ...]:
    """The evidence for a closed door."""
    seen = {side: e for side, e in door.evidence.items() if e.outline > OUTLINED}
    words = [f"outline seen on {'both faces' if len(seen) == 2 else 'one face'}"]
    sides = "both sides" if door.box.whole else "sides and head"
    words.append(f"discontinuities on {max(e.outline for e in door.evidence.values()):.0%} of {sides}")
    recess = [e.recess for e in seen.values() if np.isfinite(e.recess)]
    if recess:
        deepest = max(recess)
        words.append("leaf in the wall's plane" if deepest < 0.004 else f"leaf recessed {deepest * 1000:.0f} mm")
    if max((e.colour for e in seen.values()), default=0.0) > 0.08:
        words.append("of another colour than the wall")
    if max((e.trim for e in seen.values()), default=0.0) > 0.005:
        words.append("trim round it")
    lintel = "lintel seen" if any(e.lintel > 0.5 for e in seen.values()) else "no lintel seen"
    words.append("as high as the room" if door.box.whole else lintel)
    handle = next((e.handle for e in seen.values() if e.handle is not None), None)
    if handle is not None:
        words.append(f"handle at {handle:.2f} m")
    return tuple(words)
