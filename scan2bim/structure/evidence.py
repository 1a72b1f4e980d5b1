"""What speaks for a wall: the plan columns on its faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.axes import Axis
from scan2bim.structure.columns import Columns
from scan2bim.structure.faces import BAND

F64 = NDArray[np.float64]


class FaceEvidence:
    """Finds the columns on walls' faces. ``lintels`` are faces known without columns: those of window fronts."""

    def __init__(self, columns: Columns, lintels: Sequence[LineString] = ()) -> None:
        self.columns = columns
        self._lintels = lintels
        self._index = PlanIndex(columns.xy)

    def on_faces(self, axis: Axis) -> tuple[NDArray[np.int64], F64, F64]:
        """Columns on those faces of a wall that have a space before them: their numbers, their places along the wall
        (those of the second face beyond the first), their distances to the face; (k,) each.
        """
        rise = abs(axis.bulge) * axis.chord / 2
        near = self._index.along(np.array([axis.start, axis.end]), axis.thickness / 2 + BAND + rise)
        along, across = axis.local(self.columns.xy[near])
        half = axis.thickness / 2 if axis.measured or not (axis.left and axis.right) else 0.0
        parts: list[tuple[NDArray[np.int64], F64, F64]] = []
        for shift, side, spaces in ((0.0, 1.0, axis.left), (axis.length + 1.0, -1.0, axis.right)):
            distance = across - side * half
            on = (np.abs(distance) < BAND) & (along > 0) & (along < axis.length) & bool(spaces)
            parts.append((near[on], along[on] + shift, distance[on]))
        numbers, places, distances = zip(*parts, strict=True)
        return np.concatenate(numbers), np.concatenate(places), np.concatenate(distances)

    def seen_share(self, axis: Axis) -> float:
        """Share of the length of a wall's faces on which something stands upright or a lintel hangs, 0-1."""
        _, along, _ = self.on_faces(axis)
        seen = covered_length(along, PLAN)
        hung = 0.0 if axis.bulge else _share_along(np.array([axis.start, axis.end]) + axis.inset, self._lintels)
        return min(1.0, hung + seen / max(axis.length * (bool(axis.left) + bool(axis.right)), PLAN))


def _share_along(ends: F64, lines: Sequence[LineString]) -> float:
    """Share of a line (2, 2) that runs along one of ``lines``."""
    line = LineString(ends)
    covered = shapely.union_all([shapely.buffer(other, 0.02, cap_style="flat") for other in lines])
    return float(line.intersection(covered).length / max(line.length, 1e-9))
