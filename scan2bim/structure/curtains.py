"""Curtains before a wall: what hangs there in folds is no straight face, while the wall beside it is one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.fits import Face
from scan2bim.structure.plan import SAME_LEVEL, Plan
from scan2bim.structure.strips import ceiling_on

FARTHEST, FOLD = 0.35, 0.05
"""Metres before a wall at which curtains hang at most, and by which a line through their folds may cross its face."""
TURNED = 0.94
"""Cosine up to which such a line may be turned off the wall (20 degrees): folds are deeper at one end."""
WAVY, ROUGHER = 0.005, 2.0
"""Root mean square, metres, of the folds of a face at least, and by how much it is more than the wall's."""
LONGEST, SHARE = 2.5, 0.5
"""Metres that were seen of a curtain at most, and of a wall's length what was seen of it there."""
BESIDE = 0.15
"""Metres beyond a wall's end, as it was seen, at which a curtain may end: it hides the corner."""


UNEVEN, PAST = 0.004, 3.0
"""Root mean square, metres, of a face that hangs up to so many metres past what was seen of a wall, in its line: it
hides the rest, if ...
"""
DEEP, OPEN = (0.08, 0.3), 0.4
"""... the room goes on behind this share of it, where it hangs so far, metres, before the wall's line at most."""
TOUCHING = 0.06
"""Metres from a wall's end within which a face begins that goes on from it: a round wall's next piece is no curtain."""
OPPOSED, THICKEST = -0.96, 0.35
"""Cosine up to which a face looks the other way, and metres behind another one at which it is that of its wall."""


def without_curtains(plan: Plan, faces: Sequence[Face]) -> list[Face]:
    """The faces without those in folds that hang close before a longer and straighter one, or before its line beyond
    its end: then it goes on behind them.
    """
    walls = [face for face in faces if face.sided]
    kept = [face for face in faces if not any(_hangs_before(face, wall) for wall in walls)]
    for curtain in list(kept):
        number = None if curtain.rms < UNEVEN or _opposed(curtain, faces) else _hides(plan, curtain, kept)
        if number is not None:
            wall = kept[number]
            along = (curtain.ends() - wall.centre) @ wall.direction
            kept[number] = replace(wall, low=min(wall.low, float(along.min())), high=max(wall.high, float(along.max())))
            kept = [face for face in kept if face is not curtain]
    return kept


def _opposed(face: Face, faces: Sequence[Face]) -> bool:
    """Whether the other face of a wall stands close behind."""
    for other in faces:
        behind = -float(((other.ends() - face.centre) @ face.normal).mean())
        along = np.sort((other.ends() - face.centre) @ face.direction)
        shared = min(along[1], face.high) - max(along[0], face.low)
        if other.normal @ face.normal < OPPOSED and 0 < behind < THICKEST and shared > face.length / 2:
            return True
    return False


def _hides(plan: Plan, face: Face, walls: Sequence[Face]) -> int | None:
    """The number of the longer wall whose line a face hangs before, with the room going on between the two; or None."""
    for number, wall in enumerate(walls):
        if wall.length <= face.length or wall.normal @ face.normal < TURNED:
            continue
        ends = face.ends() - wall.centre
        before, along = np.sort(ends @ wall.normal), np.sort(ends @ wall.direction)
        near = before[0] > -FOLD and DEEP[0] < before[1] < DEEP[1] and not _goes_on_from(face, wall)
        if near and max(along[0] - wall.high, wall.low - along[1]) < PAST and _open_behind(plan, face, wall) > OPEN:
            return number
    return None


def _goes_on_from(face: Face, wall: Face) -> bool:
    """Whether a face begins where a wall ends."""
    return bool(np.linalg.norm(face.ends()[:, None] - wall.ends()[None], axis=2).min() < TOUCHING)


def _open_behind(plan: Plan, face: Face, wall: Face) -> float:
    """Share of a face behind which a wall was seen up to the ceiling, or the room's ceiling up to the wall."""
    before = ceiling_on(plan, face, 0.1, 0.5)
    if not np.isfinite(before).any():
        return 0.0
    place = face.centre + np.arange(face.low + PLAN / 2, face.high, PLAN)[:, None] * face.direction
    depth = (place - wall.centre) @ wall.normal
    middle = place - np.maximum(depth / 2, PLAN)[:, None] * face.normal
    pixel = np.clip(plan.grid.pixel_of(middle), 0, np.array(plan.floor.shape[::-1]) - 1)
    height = np.where(plan.ceiling > 0, plan.ceiling_z, np.float32(np.nan))[pixel[:, 1], pixel[:, 0]]
    level = (np.abs(height - np.nanmedian(before)) < SAME_LEVEL) & (depth > DEEP[0])
    own = wall.columns[plan.columns.high[wall.columns] >= 2]
    seen = (plan.columns.xy[own] - wall.centre) @ wall.direction
    apart = np.abs(((place - wall.centre) @ wall.direction)[:, None] - seen)
    return float((level | (apart.min(1, initial=np.inf) < PLAN)).mean())


def _hangs_before(face: Face, wall: Face) -> bool:
    if face.normal @ wall.normal < TURNED or face.rms < max(WAVY, ROUGHER * wall.rms):
        return False
    if not face.sided or face.tall > min(LONGEST, SHARE * wall.tall):
        return False
    ends = face.ends() - wall.centre
    before, along = np.sort(ends @ wall.normal), np.sort(ends @ wall.direction)
    near = before[0] > -FOLD and before[1] < FARTHEST and before.mean() > FOLD / 2
    return bool(near and along[0] > wall.low - BESIDE and along[1] < wall.high + BESIDE)
