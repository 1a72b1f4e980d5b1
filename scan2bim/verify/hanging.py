"""On which side a door's leaf hangs and to which it swings, as drawn and as built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ifcopenshell.util.placement as placement_util
import numpy as np
from numpy.typing import NDArray

from scan2bim.model.elements import Door

F64 = NDArray[np.float64]

HINGED = ("SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT")
"""Operations that tell both ends and side; double, folding and sliding doors have no hinged end."""
CLEARLY = 0.7
"""Cosine between directions from which on they are the same, or turned round opposite."""
OPENED = np.radians(20.0)
"""Angle of a leaf from which on one sees where it hangs: a leaf that is nearly closed may lean either way."""


@dataclass(frozen=True, slots=True, eq=False)
class Hanging:
    """Unit vectors (2,) in plan: from the opening's middle to its hinged end, and across the wall to where the leaf
    swings.
    """

    hinge: F64
    swing: F64

    def turned(self, turn: F64) -> Hanging:
        """By a turn (2, 2) in plan."""
        return Hanging(turn @ self.hinge, turn @ self.swing)


def drawn_hanging(product: Any, operation: str | None, body: F64) -> Hanging | None:
    """Of a door with one hinged leaf, else None: its own y axis is where the leaf swings to, and left and right are
    those of one who looks along it (ISO 16739, IfcDoorTypeOperationEnum). Axes that do not start at its ``body`` (v,
    3), in the file's unit, are not its own: programs that write triangles may leave all in those of the building.
    """
    if operation not in HINGED or product.ObjectPlacement is None:
        return None
    placement = placement_util.get_local_placement(product.ObjectPlacement)
    low, high = body.min(axis=0)[:2], body.max(axis=0)[:2]
    size = float((high - low).max())
    if ((placement[:2, 3] < low - size) | (placement[:2, 3] > high + size)).any():
        return None
    axes = placement[:2, :2]
    along, swing = axes[:, 0] / np.linalg.norm(axes[:, 0]), axes[:, 1] / np.linalg.norm(axes[:, 1])
    return Hanging(-along if operation.endswith("LEFT") else along, swing)


def built_hanging(door: Door, along: F64) -> Hanging | None:
    """Of a detected door whose leaf stands open, else None; ``along`` (2,) its wall."""
    seen = door.angle is not None and door.angle >= OPENED and door.leaves in (None, 1)
    if not seen or "unknown" in (door.hinge_side, door.swing_side):
        return None
    left = np.array([-along[1], along[0]])
    return Hanging(
        along if door.hinge_side == "end" else -along,
        left if door.swing_side == "left" else -left,
    )


def difference(drawn: Hanging | None, built: Hanging | None) -> str:
    """In words what hangs otherwise; empty where nothing does or it is not known."""
    if drawn is None or built is None:
        return ""
    hinge, swing = float(drawn.hinge @ built.hinge), float(drawn.swing @ built.swing)
    if min(abs(hinge), abs(swing)) < CLEARLY:
        return ""
    parts = [
        words for words, value in (("hangs at the other end", hinge), ("swings to the other side", swing)) if value < 0
    ]
    return " and ".join(parts)
