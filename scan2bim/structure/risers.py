"""Risers of stairs, which reach the ceiling where that ends above the stair: no walls, though upright and straight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from scan2bim.structure.columns import Columns
from scan2bim.structure.fits import Face
from scan2bim.structure.stairs import FoundStair

LONGEST = 1.5
"""Length, metres, of the longest riser: walls between flights are as long as those."""
WITHIN = 0.1
"""Metres within the outline from which on nothing is a wall beside or before the stair."""
LEAST_LEFT = 0.5
"""Share of a face's columns beyond the stair, from which on it is a wall that stands in line with a riser."""


def without_risers(faces: Sequence[Face], stairs: Sequence[FoundStair], columns: Columns) -> list[Face]:
    """Faces less risers of stairs with flights, also where these were taken for the end of a wall's face."""
    left = list(faces)
    for stair in stairs:
        if stair.kind != "spiral":
            inner = stair.outline.buffer(-WITHIN)
            shapely.prepare(inner)
            left = [rest for face in left for rest in _beyond(face, inner, columns)]
    return left


def _beyond(face: Face, inner: shapely.Geometry, columns: Columns) -> list[Face]:
    """What of a face is no riser of a stair: one face or none."""
    xy = columns.xy[face.columns]
    beyond = ~shapely.contains_xy(inner, xy[:, 0], xy[:, 1])
    along = (xy - face.centre) @ face.direction
    risers = along[~beyond]
    if not len(risers) or np.ptp(risers) > LONGEST:
        return [face]
    if beyond.mean() < LEAST_LEFT:
        return []
    low, high = (float(risers.max()), face.high) if risers.mean() < along.mean() else (face.low, float(risers.min()))
    rest = face.columns[beyond & (along > low) & (along < high)]
    return [replace(face, low=low, high=high, columns=rest)]
