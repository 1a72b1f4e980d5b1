"""Open leaves among what no element explains: as tall as a door, and within its reach of where it hangs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.detected import Detected
from scan2bim.verify.patches import Gap

F64 = NDArray[np.float64]

BEYOND = 0.25
"""Metres beyond a leaf's width within which its voxels lie from where it hangs: one voxel, its handle, and half of a
wall, in whose middle the place is told."""
OVER = 0.10
"""Metres over a door's head up to which the middles of its leaf's voxels lie: half a voxel, and a trim."""
WIDEST = 1.3
"""Metres of the widest leaf; what is wider has two."""
MOST = 0.9
"""Share of a group's voxels that must lie so for it to be a leaf: others touch it."""


@dataclass(frozen=True, slots=True, eq=False)
class Doorway:
    """Where a door's leaves may hang: the ``ends`` (2, 2) of its opening in plan, the width of a leaf at the most, and
    the height of the head, metres.
    """

    ends: F64
    width: float
    head: float


def doorways(drawn: Sequence[Gap], detected: Sequence[Detected]) -> tuple[Doorway, ...]:
    """Of the drawn gaps with doors and the detected doors, both in the local frame."""
    doors: list[Gap | Detected] = [g for g in drawn if g.fill is not None and g.fill.ifc_class.startswith("IfcDoor")]
    doors += [d for d in detected if d.kind == "door"]
    sides = np.array([[-0.5], [0.5]])
    return tuple(
        Doorway(d.middle[:2] + sides * d.width * d.along, min(d.width, WIDEST), float(d.middle[2]) + d.height / 2)
        for d in doors
    )


def is_leaf(voxels: F64, doors: Sequence[Doorway]) -> bool:
    """Whether voxels (k, 3) may be the leaf of one of some doors."""
    for door in doors:
        low = voxels[:, 2] < door.head + OVER
        away = np.linalg.norm(voxels[:, None, :2] - door.ends, axis=2)
        if float((low[:, None] & (away < door.width + BEYOND)).mean(axis=0).max()) > MOST:
            return True
    return False
