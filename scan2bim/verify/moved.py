"""Where elements that were built elsewhere than drawn stand: what lies there is theirs, and no addition."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.ifc_model import ModelElement
from scan2bim.verify.patches import main_direction
from scan2bim.verify.result import ElementResult

F64 = NDArray[np.float64]

MARGIN = 0.10
"""Metres round an element's box within which the voxels of its surface lie."""
MOST = 0.7
"""Share of a group's voxels in such a box from which on they are the element's."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The upright box of an element as built, in the local frame: direction (2,) and ranges (2, 3) along it, across it
    and up.
    """

    along: F64
    ranges: F64

    def holds(self, voxels: F64) -> bool:
        """Whether most of some voxels (k, 3) lie in it."""
        inside = (_own(voxels, self.along) > self.ranges[0] - MARGIN) & (
            _own(voxels, self.along) < self.ranges[1] + MARGIN
        )
        return float(inside.all(axis=1).mean()) > MOST


def moved_bodies(elements: Sequence[ModelElement], results: Sequence[ElementResult], to_model: F64) -> tuple[Body, ...]:
    """Those of the elements out of tolerance, moved and turned by their fits; ``to_model`` (4, 4) as elsewhere."""
    found = {r.guid: r.fit for r in results if r.status == "out_of_tolerance" and r.fit is not None}
    back = np.linalg.inv(to_model)
    out: list[Body] = []
    for element in elements:
        fit = found.get(element.guid) if element.role == "compared" else None
        if fit is None:
            continue
        middle = (element.vertices.min(axis=0) + element.vertices.max(axis=0)) / 2
        c, s = math.cos(fit.turn), math.sin(fit.turn)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        built = (element.vertices - middle) @ turn.T + middle + np.array(fit.shift)
        local = built @ back[:3, :3].T + back[:3, 3]
        along = main_direction(local[:, :2] - local[:, :2].mean(axis=0))
        own = _own(local, along)
        out.append(Body(along, np.array([own.min(axis=0), own.max(axis=0)])))
    return tuple(out)


def _own(points: F64, along: F64) -> F64:
    """Points (k, 3) along a direction, across it and up."""
    return np.column_stack([points[:, :2] @ along, points[:, :2] @ np.array([-along[1], along[0]]), points[:, 2]])
