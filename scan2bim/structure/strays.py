"""Columns that no run has, in line with a wall face: stripes of a wall that a far scanner looks along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.columns import Columns
from scan2bim.structure.fits import NEAR, Face

APART = 0.5
"""Metres between such stripes up to which a wall goes on from one to the next."""
FEWEST = 4
"""Columns of them, as of any face."""
LONG = 1.0
"""Length, metres, of faces whose line is known well enough to tell what lies in it farther on."""


def with_strays(columns: Columns, faces: Sequence[Face], wall_like: NDArray[np.bool_]) -> list[Face]:
    """The faces, drawn on over ``wall_like`` columns (m,) that lie in their line, seen from their side, and that none
    of the faces has: the longest first.
    """
    free = wall_like.copy()
    for face in faces:
        free[face.columns] = False
    out: list[Face] = []
    for face in sorted(faces, key=lambda f: -f.length):
        grown = _grown(columns, face, free)
        free[grown.columns] = False
        out.append(grown)
    return out


def _grown(columns: Columns, face: Face, free: NDArray[np.bool_]) -> Face:
    if face.length < LONG or not face.sided:
        return face
    offset = columns.xy - face.centre
    mine = free & (np.abs(offset @ face.normal) < NEAR) & (columns.view @ face.normal > 0)
    at = np.flatnonzero(mine)
    along = offset[at] @ face.direction
    new = np.zeros(len(at), bool)
    for sign, end in ((1.0, face.high), (-1.0, -face.low)):
        beyond = np.flatnonzero(sign * along > end)
        beyond = beyond[np.argsort(sign * along[beyond])]
        gaps = np.diff(sign * along[beyond], prepend=end)
        chain = beyond[: int(np.argmax(gaps > APART)) if (gaps > APART).any() else len(beyond)]
        if len(chain) >= FEWEST and np.ptp(along[chain]) > APART:
            new[chain] = True
    if not new.any():
        return face
    low, high = min(face.low, along[new].min() - PLAN / 2), max(face.high, along[new].max() + PLAN / 2)
    tall = face.tall + covered_length(along[new], 2 * PLAN)
    return replace(face, low=float(low), high=float(high), tall=tall, columns=np.concatenate([face.columns, at[new]]))
