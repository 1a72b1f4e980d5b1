"""Openings that the scans show, as the conversion has found them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.model.elements import Building, Door
from scan2bim.model.queries import opening_corners, openings_of
from scan2bim.verify.hanging import Hanging, built_hanging

F64 = NDArray[np.float64]


CERTAIN = 0.8
"""Confidence from which on a detected opening tells where one is whose sides are not seen."""


@dataclass(frozen=True, slots=True, eq=False)
class Detected:
    """An opening of the building that the scans show: middle (3,) local metres, direction (2,), sizes, and its fill."""

    identifier: str
    kind: Literal["door", "window", "passage"]
    middle: F64
    along: F64
    width: float
    height: float
    confidence: float
    state: Literal["open", "ajar", "closed", "unknown"]
    hanging: Hanging | None = None

    @property
    def tells_place(self) -> bool:
        """Whether its sides are good enough to judge by where none were seen. Curtains hide those of windows."""
        return self.kind == "door" and self.confidence > CERTAIN


def detected_openings(building: Building | None) -> tuple[Detected, ...]:
    """All openings of the building in its local frame."""
    if building is None:
        return ()
    out: list[Detected] = []
    for hosted in openings_of(building):
        corners = np.array(opening_corners(hosted.wall, hosted.opening))
        edge = corners[1, :2] - corners[0, :2]
        length = max(float(np.linalg.norm(edge)), 1e-6)
        fill = hosted.opening.fill
        kind = "passage" if fill is None else fill.kind
        state = fill.state if isinstance(fill, Door) else "unknown"
        sure = (fill or hosted.opening).confidence
        middle, height = corners.mean(axis=0), float(np.ptp(corners[:, 2]))
        identifier = (fill or hosted.opening).id
        along = edge / length
        hanging = built_hanging(fill, along) if isinstance(fill, Door) else None
        out.append(Detected(identifier, kind, middle, along, length, height, sure, state, hanging))
    return tuple(out)
