"""The building's local frame, and how each scan's coordinates become local ones."""

from __future__ import annotations

from dataclasses import dataclass
from json import dumps, loads
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import ScanHeader

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SurveyFrame:
    """``unit`` metres per file unit, file axis ``up`` that points up, ``shift`` (metres, after both) taken off, ``crs``
    if known.

    ``notes`` say in words what was found or assumed.
    """

    unit: float = 1.0
    up: Up = "z"
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    crs: str | None = None
    notes: tuple[str, ...] = ()

    def of_scan(self, header: ScanHeader) -> tuple[F64, F64]:
        """Matrix (3, 3) and offset (3,) that take the ``xyz`` of a scan's chunks to local metres."""
        turn = self.unit * up_rotation(self.up)
        if header.pose is None:
            return turn, turn @ header.origin - np.array(self.shift)
        matrix = turn @ header.pose.rotation
        return matrix, matrix @ header.origin + turn @ header.pose.translation - np.array(self.shift)

    def position_of(self, header: ScanHeader) -> F64:
        """Where the scanner stood, (3,) local metres. The header must have a pose."""
        if header.pose is None:
            raise ValueError(f"{header.path} scan {header.index} has no pose")
        return self.unit * up_rotation(self.up) @ header.pose.translation - np.array(self.shift)

    def to_json(self) -> str:
        """As text that ``from_json`` reads back without loss."""
        return dumps({"unit": self.unit, "up": self.up, "shift": self.shift, "crs": self.crs, "notes": self.notes})

    @staticmethod
    def from_json(text: str) -> SurveyFrame:
        """Read what ``to_json`` wrote."""
        data = loads(text)
        shift = cast("tuple[float, float, float]", tuple(data["shift"]))
        return SurveyFrame(data["unit"], data["up"], shift, data["crs"], tuple(data["notes"]))


def up_rotation(up: Up) -> F64:
    """Proper rotation (3, 3) that takes the file axis ``up`` to +z."""
    sign = -1.0 if up.startswith("-") else 1.0
    match up[-1]:
        case "x":
            return (
                np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
                if sign > 0
                else np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
            )
        case "y":
            return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -sign], [0.0, sign, 0.0]])
        case _:
            return np.diag([1.0, sign, sign])
