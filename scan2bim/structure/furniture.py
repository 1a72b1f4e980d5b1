"""Faces of furniture nearly as high as the room: wardrobes, cupboards, shelves.

What tells them from walls: they end below the room's ceiling, and that goes on behind them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.cloud.surfels import PLAN, TALL
from scan2bim.structure.columns import FLUSH
from scan2bim.structure.fits import Face
from scan2bim.structure.plan import SAME_LEVEL, Plan
from scan2bim.structure.strips import ceiling_on

LOW = FLUSH + TALL + 0.02
"""Metres below the ceiling from which on the highest voxel of a face that goes up to it cannot lie."""
BEHIND = 0.35
"""Depth, metres, behind a front over which a ceiling is looked for, and within which a wall has its other face."""
LEAST_BEHIND = 0.25
"""Share of a front's length behind which the ceiling must have been seen: near scanners see less of it."""
CORNER = 0.1
"""Metres off a front's end within which its side begins."""
SQUARE = 0.2
"""Cosine up to which a side is square to its front."""
OVER = 0.4
"""Share of a cupboard over which the ceiling was seen to go on."""
LONGER = 0.25
"""Length, metres, of the shortest end of a wall's face that is a cupboard in line with it."""
FEWEST = 3
"""Columns in a row that tell that a wall's face reaches the ceiling: fewer may be a wall's that it meets."""


def without_furniture(plan: Plan, faces: Sequence[Face]) -> list[Face]:
    """Faces less those of high furniture: fronts over which the ceiling goes on, and the sides of such; and without
    what stands in line with a wall past its end.
    """
    faces = [_without_ends(plan, face) for face in faces]
    low = [face for face in faces if _gap(plan, face) > LOW and not _opposed(face, faces)]
    fronts = [face for face in low if _under_ceiling(plan, face)]
    gone = fronts + [face for face in low if any(_side_of(face, front) for front in fronts)]
    return [face for face in faces if not any(face is other for other in gone)]


def _without_ends(plan: Plan, face: Face) -> Face:
    """A face up to where it reaches the ceiling for the last time, if the ceiling goes on over what is beyond."""
    along = (plan.columns.xy[face.columns] - face.centre) @ face.direction
    tall = np.sort(along[plan.columns.high[face.columns] >= 2])
    runs = [run for run in np.split(tall, np.flatnonzero(np.diff(tall) > 3 * PLAN) + 1) if len(run) >= FEWEST]
    if not runs:
        return face
    low, high = float(runs[0][0]) - PLAN / 2, float(runs[-1][-1]) + PLAN / 2
    if low - face.low > LONGER and _ceiling_over(plan, replace(face, high=low)):
        face = replace(face, low=low)
    if face.high - high > LONGER and _ceiling_over(plan, replace(face, low=high)):
        face = replace(face, high=high)
    return replace(face, columns=face.columns[(along > face.low) & (along < face.high)])


def _ceiling_over(plan: Plan, face: Face) -> bool:
    """Whether a ceiling was seen over a face and right behind it, where a wall would be."""
    return bool(np.isfinite(ceiling_on(plan, face, -2 * PLAN, 0.0)).all(0).mean() > OVER)


def _gap(plan: Plan, face: Face) -> float:
    """Metres from the top of a face, where it is high at all, up to the ceiling."""
    at = face.columns[plan.columns.high[face.columns] >= 2]
    return float(np.median(plan.columns.gap[at])) if len(at) else 0.0


def _opposed(face: Face, faces: Sequence[Face]) -> bool:
    """Whether the other face of a wall stands close behind: a wall that ends below the ceiling, as of a cubicle."""
    for other in faces:
        behind = -((other.ends() - face.centre) @ face.normal)
        along = np.sort((other.ends() - face.centre) @ face.direction)
        shared = min(along[1], face.high) - max(along[0], face.low)
        if other.normal @ face.normal < -1 + SQUARE**2 and 0 < behind.mean() < BEHIND and shared > face.length / 2:
            return True
    return False


def _under_ceiling(plan: Plan, face: Face) -> bool:
    """Whether the ceiling before a face goes on behind it."""
    behind, before = ceiling_on(plan, face, -BEHIND, -2 * PLAN), ceiling_on(plan, face, 0.1, 0.5)
    if not np.isfinite(before).any():
        return False
    level = np.abs(behind - np.nanmedian(before)) < SAME_LEVEL
    return bool(level.any(0).mean() > LEAST_BEHIND)


def _side_of(face: Face, front: Face) -> bool:
    """Whether a face goes back from an end of a front, square to it."""
    if abs(face.normal @ front.normal) > SQUARE:
        return False
    apart = np.linalg.norm(face.ends()[:, None] - front.ends()[None], axis=2)
    return bool(apart.min() < CORNER)
