"""Openings of doors and windows for which the model states none: the holes that the walls' own bodies leave round them,
as in models of plain triangles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.ifc_model import IfcModel, ModelElement
from scan2bim.verify.patches import THICKEST, main_direction

F64 = NDArray[np.float64]

TRIM = 0.12
"""Metres by which a side of a door or window as drawn may lie off that of its hole: trims and sills reach past it, and
frames are fitted with a joint."""
NARROWEST = 0.2
"""Metres of the narrowest hole."""


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """A wall's GlobalId and storey, unit vector (2,) along it, and the corners (v, 3) of its body along it, across it
    and up.
    """

    guid: str
    storey: str
    along: F64
    corners: F64


def with_openings(model: IfcModel) -> IfcModel:
    """The model with an opening for each door and window that has none and stands in the hole of a wall."""
    known = {e.guid for e in model.elements}
    lone = [i for i, e in enumerate(model.elements) if e.role == "fill" and e.host not in known]
    if not lone:
        return model
    walls = [_wall(e) for e in model.elements if e.role == "compared" and "Wall" in e.ifc_class]
    elements, added = list(model.elements), list[ModelElement]()
    for place in lone:
        opening = _opening(elements[place], walls)
        if opening is not None:
            elements[place] = replace(elements[place], host=opening.guid)
            added.append(opening)
    return replace(model, elements=(*elements, *added))


def _wall(element: ModelElement) -> Wall:
    along = main_direction(element.vertices[:, :2] - element.vertices[:, :2].mean(axis=0))
    return Wall(element.guid, element.storey, along, _own(element.vertices, along))


def _own(points: F64, along: F64) -> F64:
    """Points (k, 3) along a direction, across it and up; ``_own(_, along * [1, -1])`` is the reverse."""
    return np.column_stack([points[:, :2] @ along, points[:, :2] @ np.array([-along[1], along[0]]), points[:, 2]])


def _opening(fill: ModelElement, walls: Sequence[Wall]) -> ModelElement | None:
    """The hole round what fills it, of the wall in whose middle it stands best; None where no wall has one."""
    best, found = np.inf, None
    for wall in walls:
        own = _own(fill.vertices, wall.along)
        box = np.array([own.min(axis=0), own.max(axis=0)])
        low, high, middle = wall.corners.min(axis=0), wall.corners.max(axis=0), box.mean(axis=0)
        away = abs(float(middle[1] - (low[1] + high[1]) / 2))
        outside = (middle < low - TRIM).any() or (middle > high + TRIM).any()
        if outside or away >= best or high[1] - low[1] > THICKEST:
            continue
        hole = _hole(box, wall.corners)
        if hole is not None:
            best, found = away, (wall, hole)
    if found is None:
        return None
    wall, hole = found
    corners = np.array([[x, y, z] for x in hole[:, 0] for y in hole[:, 1] for z in hole[:, 2]])
    return ModelElement(
        guid=f"{fill.guid}-opening",
        ifc_class="IfcOpeningElement",
        name="",
        storey=wall.storey,
        role="opening",
        vertices=_own(corners, wall.along * [1.0, -1.0]),
        triangles=np.zeros((0, 3), np.int32),
        glass=np.zeros(0, bool),
        host=wall.guid,
    )


def _hole(box: F64, corners: F64) -> F64 | None:
    """The hole (2, 3) of a wall's body round a ``box`` (2, 3), all along the wall, across it and up, through the whole
    wall; None where the wall has no sides there. A head or sill that the body does not show is the box's.
    """
    level = corners[(corners[:, 2] > box[0, 2] - TRIM) & (corners[:, 2] < box[1, 2] + TRIM)]
    start, end = (_nearest(level[:, 0], float(place)) for place in box[:, 0])
    if start is None or end is None or end - start < NARROWEST:
        return None
    over = corners[(corners[:, 0] > start - TRIM) & (corners[:, 0] < end + TRIM)]
    heights = [_nearest(over[:, 2], float(place)) or float(place) for place in box[:, 2]]
    faces = [corners[:, 1].min(), corners[:, 1].max()]
    return np.column_stack([[start, end], faces, heights]).astype(np.float64)


def _nearest(values: F64, place: float) -> float | None:
    """The value (k,) nearest to a place, None where none lies within the reach of trims."""
    near = values[np.abs(values - place) < TRIM]
    return float(near[int(np.argmin(np.abs(near - place)))]) if len(near) else None
