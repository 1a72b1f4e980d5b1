"""Curtains before a wall: what hangs there in folds is no straight face, while the wall beside it is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scan2bim.structure.fits import Face

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


def without_curtains(faces: Sequence[Face]) -> list[Face]:
    """The faces without those in folds that hang close before a longer and straighter one."""
    walls = [face for face in faces if face.sided]
    return [face for face in faces if not any(_hangs_before(face, wall) for wall in walls)]


def _hangs_before(face: Face, wall: Face) -> bool:
    if face.normal @ wall.normal < TURNED or face.rms < max(WAVY, ROUGHER * wall.rms):
        return False
    if not face.sided or face.tall > min(LONGEST, SHARE * wall.tall):
        return False
    ends = face.ends() - wall.centre
    before, along = np.sort(ends @ wall.normal), np.sort(ends @ wall.direction)
    near = before[0] > -FOLD and before[1] < FARTHEST and before.mean() > FOLD / 2
    return bool(near and along[0] > wall.low - BESIDE and along[1] < wall.high + BESIDE)
