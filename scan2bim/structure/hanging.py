"""What hangs from the ceiling over open floor and is no wall: ducts, boards, the inside of skylights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.faces import Face
from scan2bim.structure.plan import Plan
from scan2bim.structure.strips import strip_of

STANDS = 0.05
"""Share of a face's columns, at least, that come down below 1 m where it stands on the floor."""
BESIDE = 0.3
"""Metres before and behind a face within which the floor under it was seen."""
OPEN = 0.6
"""Share of its length on which that was seen on both sides."""
REACHED = 0.3
"""Metres from a face that stands within which an end is no free one: a lintel goes from wall to wall."""


def without_hanging(faces: Sequence[Face], plan: Plan) -> tuple[Face, ...]:
    """The faces without those that come down to the floor nowhere, with floor before, under and behind them, and that
    end free.
    """
    hangs = np.array([_hangs(face, plan) for face in faces], bool)
    standing = [face for face, up in zip(faces, hangs, strict=True) if not up]
    return tuple(face for face, up in zip(faces, hangs, strict=True) if not (up and _ends_free(face, standing)))


def _hangs(face: Face, plan: Plan) -> bool:
    if (plan.columns.low[face.columns] > 0).mean() > STANDS:
        return False
    pixel = strip_of(plan, face, -BESIDE, BESIDE)
    floor = plan.floor[pixel[..., 1], pixel[..., 0]] > 0
    half = len(floor) // 2
    return all(bool(part.any(0).mean() > OPEN) for part in (floor[:half], floor[half - 1 : half + 1], floor[half:]))


def _ends_free(face: Face, standing: Sequence[Face]) -> bool:
    """Whether an end of a face is far from all faces that stand."""
    return not all(any(_is_near(end, other) for other in standing) for end in face.ends())


def _is_near(place: NDArray[np.float64], face: Face) -> bool:
    along, across = (place - face.centre) @ face.direction, (place - face.centre) @ face.normal
    return bool(face.low - REACHED < along < face.high + REACHED and abs(across) < REACHED)
