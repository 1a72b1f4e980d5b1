"""The wall's surface across its openings, as drawn: what closes an opening, or shows through it, is measured on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.hanging import Hanging
from scan2bim.verify.ifc_model import IfcModel, ModelElement

F64 = NDArray[np.float64]

THICKEST = 1.2
"""Metres of a host across an opening, above which it is no straight wall and the opening's own depth counts."""
QUADS = np.array([[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]], np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class Gap:
    """A drawn opening in the model's axes: its GlobalId, that of its wall and of what fills it; middle (3,) of its box,
    unit vector ``along`` (2,) the wall in plan, width, height, and the places ``low`` and ``high`` of the wall's faces
    across it, metres from the middle; how its door hangs.
    """

    guid: str
    host: str
    fill: ModelElement | None
    middle: F64
    along: F64
    width: float
    height: float
    low: float
    high: float
    hanging: Hanging | None

    @property
    def across(self) -> F64:
        """Unit vector (2,) to the left of ``along``."""
        return np.array([-self.along[1], self.along[0]])


def find_gaps(model: IfcModel) -> tuple[Gap, ...]:
    """The upright openings through walls."""
    elements = {e.guid: e for e in model.elements if e.role != "opening"}
    fills = {e.host: e for e in model.elements if e.role == "fill" and e.host}
    out: list[Gap] = []
    for opening in model.elements:
        host = elements.get(opening.host or "")
        if opening.role != "opening" or host is None or "Wall" not in host.ifc_class:
            continue
        gap = _gap(opening, host, fills.get(opening.guid))
        if gap.width > 0.2 and gap.height > 0.2:
            out.append(gap)
    return tuple(out)


def _gap(opening: ModelElement, host: ModelElement, fill: ModelElement | None) -> Gap:
    box = opening.vertices
    low, high = box.min(axis=0), box.max(axis=0)
    middle = (low + high) / 2
    along = main_direction(host.vertices[:, :2] - host.vertices[:, :2].mean(axis=0))
    plan = box[:, :2] - middle[:2]
    if np.ptp(plan @ along) < 0.2:
        along = np.array([-along[1], along[0]])
    across = np.array([-along[1], along[0]])
    ends = plan @ along
    middle = np.array([*(middle[:2] + along * (ends.min() + ends.max()) / 2), middle[2]])
    sides = (host.vertices[:, :2] - middle[:2]) @ across
    if np.ptp(sides) > THICKEST:
        sides = (box[:, :2] - middle[:2]) @ across
    width, height = float(np.ptp(ends)), float(high[2] - low[2])
    low_side, high_side = float(sides.min()), float(sides.max())
    hanging = None if fill is None else fill.hanging
    return Gap(opening.guid, host.guid, fill, middle, along, width, height, low_side, high_side, hanging)


def with_patches(model: IfcModel, gaps: tuple[Gap, ...]) -> IfcModel:
    """The model with a patch for each gap at the end of its elements."""
    return replace(model, elements=(*model.elements, *(_patch(gap) for gap in gaps)))


def _patch(gap: Gap) -> ModelElement:
    """Both sides of the wall across the gap, looking outwards."""
    ends = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [gap.width / 2, gap.height / 2]
    corners = np.column_stack([ends[:, :1] * gap.along, ends[:, 1]]) + gap.middle
    sides = [corners + np.array([*(gap.across * place), 0.0]) for place in (gap.low, gap.high)]
    return ModelElement(
        guid=gap.guid,
        ifc_class="",
        name="",
        storey="",
        role="patch",
        vertices=np.concatenate(sides),
        triangles=QUADS,
        glass=np.zeros(4, bool),
        host=gap.host,
    )


def main_direction(flat: F64) -> F64:
    """Unit vector (2,) along the longer side of the least box round points (n, 2) about their middle."""
    angles = np.linspace(0, np.pi, 361)[:-1]
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    across = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    best = _least(flat, axes, across)
    fine = best + np.linspace(-1, 1, 201) * np.radians(0.5)
    axes = np.stack([np.cos(fine), np.sin(fine)], axis=1)
    across = np.stack([-np.sin(fine), np.cos(fine)], axis=1)
    angle = _least(flat, axes, across)
    along = np.array([np.cos(angle), np.sin(angle)])
    side = np.array([-along[1], along[0]])
    return along if np.ptp(flat @ along) >= np.ptp(flat @ side) else side


def _least(flat: F64, axes: F64, across: F64) -> float:
    area = np.ptp(flat @ axes.T, axis=0) * np.ptp(flat @ across.T, axis=0)
    best = axes[int(np.argmin(area))]
    return float(np.arctan2(best[1], best[0]))
