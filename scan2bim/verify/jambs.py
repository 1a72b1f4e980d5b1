"""What the sides of a built opening tell of the drawn one: that it was moved, or is wider or narrower."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.detected import CERTAIN, Detected
from scan2bim.verify.fits import robust_plane
from scan2bim.verify.outlines import BESIDE, LINING, ON, Outline, Side
from scan2bim.verify.patches import Gap
from scan2bim.verify.status import Surface

F64 = NDArray[np.float64]

ANGLE = 0.97
"""Cosine of the angle between surfaces that count as parallel, 14 degrees."""
FACE = 0.006
"""Metres from a wall's drawn face within which a drawn surface is part of it."""
FEWEST = 6
"""Cells of a face that must be measured for its built place to be told."""
MOVED = 0.05
"""Metres that a detected opening must lie aside to count as moved where its sides are not seen: detected sides are good
to some 25 mm."""
WIDER = 0.025
"""Metres beyond a drawn side that points inside the wall lie where the opening is wider, and up to which they may begin
beside the other one: mixed pixels lie nearer to sides, and frames hide so much.
"""
FRAME = 0.08
"""Metres that frames, linings or the hinged edge of a leaf may bring a side of an opening in."""


@dataclass(frozen=True, slots=True)
class Change:
    """Of an opening along its wall, from drawn to built: shift of its middle and change of its width, metres; None
    where the scans do not show its sides.
    """

    shift: float | None
    width: float | None


def built_face(surface: Surface, wall: NDArray[np.int64], gap: Gap, sign: float) -> F64:
    """Place across the wall, metres from the drawn opening's middle, of the wall's face on the side of ``sign`` as
    built: offset and slope (2,) along the wall, of whose cells ``wall`` are. The drawn place where few were measured.
    """
    drawn = gap.low if sign < 0 else gap.high
    cells = wall[surface.is_measured[wall]]
    outwards = surface.table.normal[surface.table.cell_face[cells]][:, :2] @ gap.across
    offset = surface.table.centres(cells) - gap.middle
    along = offset[:, :2] @ gap.along
    mine = (sign * outwards > ANGLE) & (np.abs(offset[:, :2] @ gap.across - drawn) < FACE)
    place, deviation = np.column_stack([along, offset[:, 2]])[mine], surface.measured.mean[cells[mine]]
    # All of the face tells where it was built: beside a window alone there may be more of a curtain than of the wall.
    plane = robust_plane(place, deviation) if len(place) >= FEWEST else None
    if plane is None:
        return np.array([drawn, 0.0])
    own = np.abs(deviation - plane[0] - place @ plane[1:]) < ON
    near = own & (np.abs(place[:, 1]) < gap.height / 2) & (np.abs(place[:, 0]) < gap.width / 2 + BESIDE)
    built = drawn + sign * deviation[near]
    if near.sum() < FEWEST or np.ptp(place[near][:, 0]) < gap.width / 2:
        return np.array([drawn + sign * plane[0], sign * plane[1]])
    design = np.column_stack([np.ones(int(near.sum())), place[near][:, 0]])
    return np.linalg.lstsq(design, built, rcond=None)[0].astype(np.float64)


def outline_change(outline: Outline, tolerance: float, detected: float | None) -> Change:
    """What the sides of an opening tell.

    Wall drawn as opening shows that a side lies further in, points inside the wall outwards of the drawn side that it
    lies further out; by more than frames, linings and trims hide. Where both hold alike it was moved, for what hides
    one side hides the other as much; else it is wider or narrower. detected: shift of the detected opening, metres.
    """
    start, end = _inwards(outline.start, tolerance), _inwards(outline.end, tolerance)
    # An open leaf may hide on one face that wall begins farther in, but not as far as the other side lies out.
    if start < 0.0 == end and _balances(outline.end, start):
        end = outline.end.place
    elif end < 0.0 == start and _balances(outline.start, end):
        start = outline.start.place
    if start < 0 < end:
        hint = None if detected is None else start - 2 * detected
        end = _seen_twice(outline.end, start, hint)
    elif end < 0 < start:
        hint = None if detected is None else 2 * detected + end
        start = _seen_twice(outline.start, end, hint)
    if start * end < 0 and abs(start + end) < 2 * FRAME:
        return Change((start - end) / 2, 0.0)
    if start == 0.0 == end:
        return Change(0.0, 0.0)
    if start and end:
        return Change((start - end) / 2, -(start + end))
    other = outline.end if start else outline.start
    # Where no wall was seen near a drawn side, a frame flush with it may yet be.
    hides = other.built if other.place < -FRAME and other.built else other.place
    hidden = min(max(hides, -FRAME), FRAME)
    change = start + end - hidden
    return Change((change if start else -change) / 2, -change) if abs(change) > tolerance else Change(0.0, 0.0)


def _inwards(side: Side, tolerance: float) -> float:
    """Metres that a side lies inwards of the drawn one, negative outwards; 0 where it may lie there."""
    if side.hollow and side.inside < -tolerance:
        return side.place
    return _built(side) if side.built > FRAME else 0.0


def _built(side: Side) -> float:
    """Metres inwards of the drawn side over which wall goes on, to its reveal if one was seen about there."""
    near = side.reveal is not None and abs(side.reveal - side.built) < FRAME
    return side.reveal if near and side.reveal is not None else side.built


def _balances(side: Side, other: float) -> bool:
    """Whether a side lies as far inwards as the other one outwards, so that frames explain the rest."""
    return side.place > FRAME and abs(side.place + other) < 2 * FRAME


def _seen_twice(side: Side, other: float, hint: float | None) -> float:
    """Metres that a side lies inwards, seen from the wall or from the opening: furniture breaks a wall, leaves narrow
    an opening. The one that is nearer to the hint, or where none was detected to what the other lies outwards.
    """
    expected = -other if hint is None else hint
    return min((_built(side), side.place), key=lambda value: abs(value - expected))


def extent_change(extent: tuple[float, float], gap: Gap, found: Detected) -> Change | None:
    """What points inside the wall and a detected opening tell together, None where they do not agree that it was moved
    or is wider.

    The opening reaches at least as far as the points do, metres inwards of the drawn start and end: where it was moved,
    beyond one side, and no farther than from the other. Where they begin at the other as drawn, it is wider by so much
    at the least.
    """
    start, end = extent
    out, other = min(start, end), max(start, end)
    sign = 1.0 if end < start else -1.0
    reach = found.width / 2 - gap.width / 2 + sign * float((found.middle[:2] - gap.middle[:2]) @ gap.along)
    if out < -WIDER and abs(other) < WIDER and reach > -out:
        return Change(-sign * out / 2, -out)
    aside = sign * float((found.middle[:2] - gap.middle[:2]) @ gap.along)
    if out > -MOVED or aside < MOVED or other < -out:
        return None
    middle = (other - out) / 2
    # Frames hide both sides alike, curtains one: then the detected opening lies elsewhere.
    return Change(sign * (middle if abs(middle - aside) < WIDER else min(max(aside, -out), other)), 0.0)


def detected_change(gap: Gap, found: Detected | None) -> Change:
    """The same from a detected opening alone, as of a closed door flush with its wall."""
    if found is None:
        return Change(None, None)
    shift, width = float((found.middle[:2] - gap.middle[:2]) @ gap.along), found.width - gap.width
    if found.kind == "window" and found.confidence > CERTAIN:
        # Curtains hide a part of a window and never widen it; they shift its middle by half of what they hide.
        near, far = sorted((width / 2 - shift, width / 2 + shift), key=abs)  # metres outwards of the drawn sides
        if far > LINING + WIDER and abs(near) < WIDER:
            return Change(float(np.copysign(far / 2, shift)), far)
        moved = abs(shift) > max(2 * MOVED, abs(width))
    else:
        moved = abs(shift) > MOVED and abs(width) < 2 * FRAME and found.tells_place
    return Change(shift if moved else 0.0, 0.0)
