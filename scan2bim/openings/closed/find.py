"""Closed doors of a wall: candidates from the discontinuities of both faces, judged by the evidence of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scan2bim.cloud.panorama import Panorama
from scan2bim.openings.closed.evidence import FaceEvidence, evidence_of
from scan2bim.openings.closed.rectangles import Face, Rectangle, distinct, face_of, rectangles_on
from scan2bim.openings.closed.score import features_of, probability
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.orthoimage import F64, Side, orthoimage
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import WallShape

ACCEPTED = 0.5
"""Probability from which a rectangle is taken for a door."""
SIDES: tuple[Side, Side] = ("left", "right")
LEAVES = 1.35
"""Width, metres, of an opening from which on a door has two leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class ClosedDoor:
    """A rectangle taken for a closed door, with its probability and what the faces, by side, say of it."""

    box: Rectangle
    probability: float
    evidence: Mapping[Side, FaceEvidence]


def faces_of(wall: WallShape, points: WallPoints, stations: F64, panoramas: Mapping[int, Panorama]) -> list[Face]:
    """The faces of a wall that were seen, with their contrasts."""
    images = (orthoimage(wall, side, points, stations, panoramas) for side in SIDES)
    return [face_of(image) for image in images if image is not None]


def closed_doors(faces: Sequence[Face]) -> list[ClosedDoor]:
    """The closed doors of a wall, the surest of those that overlap."""
    judged = [_judged(faces, box) for box in distinct(rectangles_on(faces))]
    kept: list[ClosedDoor] = []
    for door in sorted(judged, key=lambda d: -d.probability):
        if door.probability >= ACCEPTED and all(_apart(door.box, k.box) for k in kept):
            kept.append(door)
    return kept


def _judged(faces: Sequence[Face], box: Rectangle) -> ClosedDoor:
    evidence = evidence_of(faces, box)
    sides: dict[Side, FaceEvidence] = {f.image.side: e for f, e in zip(faces, evidence, strict=True)}
    return ClosedDoor(box, probability(features_of(evidence, box)), sides)


def _apart(a: Rectangle, b: Rectangle) -> bool:
    return a.right <= b.left or b.right <= a.left


def closed_openings(storey: int, number: int, faces: Sequence[Face], points: WallPoints) -> list[OpeningShape]:
    """The closed doors of wall ``number`` as openings; ``points`` are those near it."""
    return [_opening(storey, number, door, points) for door in closed_doors(faces)]


def _opening(storey: int, number: int, door: ClosedDoor, points: WallPoints) -> OpeningShape:
    box = door.box
    on_leaf = (points.along > box.left) & (points.along < box.right) & (points.up < box.top)
    recess: dict[Side, float] = {side: e.recess for side, e in door.evidence.items() if np.isfinite(e.recess)}
    nearer: Side | None = min(SIDES, key=lambda side: recess.get(side, np.inf)) if recess else None
    seen = [e for e in door.evidence.values() if e.outline > 0.4]
    return OpeningShape(
        storey,
        number,
        "door",
        "closed",
        round(box.left, 4),
        0.0,
        round(box.width, 4),
        round(box.top, 4),
        0.03,
        0.03,
        round(max(e.through for e in door.evidence.values()), 3),
        max(int(e.left > 0.5) + int(e.right > 0.5) for e in door.evidence.values()),
        any(e.lintel > 0.5 for e in door.evidence.values()),
        int(on_leaf.sum()),
        tuple(np.unique(points.station[on_leaf]).tolist()),
        round(door.probability, 3),
        leaves=2 if box.width > LEAVES else 1,
        recess=None if nearer is None else round(max(recess[nearer], 0.0), 4),
        recess_side="unknown" if nearer is None else nearer,
        handle_height=next((e.handle for e in seen if e.handle is not None), None),
        words=in_words(door),
    )


def in_words(door: ClosedDoor) -> tuple[str, ...]:
    """The evidence for a closed door."""
    seen = {side: e for side, e in door.evidence.items() if e.outline > 0.4}
    words = [f"outline seen on {'both faces' if len(seen) == 2 else 'one face'}"]
    words.append(f"discontinuities on {max(e.outline for e in door.evidence.values()):.0%} of sides and head")
    recess = [e.recess for e in seen.values() if np.isfinite(e.recess)]
    if recess:
        deepest = max(recess)
        words.append("leaf in the wall's plane" if deepest < 0.004 else f"leaf recessed {deepest * 1000:.0f} mm")
    if max((e.colour for e in seen.values()), default=0.0) > 0.08:
        words.append("of another colour than the wall")
    if max((e.trim for e in seen.values()), default=0.0) > 0.005:
        words.append("trim round it")
    words.append("lintel seen" if any(e.lintel > 0.5 for e in seen.values()) else "no lintel seen")
    handle = next((e.handle for e in seen.values() if e.handle is not None), None)
    if handle is not None:
        words.append(f"handle at {handle:.2f} m")
    return tuple(words)
