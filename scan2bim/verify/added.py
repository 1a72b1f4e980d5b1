"""Openings that the scans show in walls that are drawn without them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.additions import storey_at
from scan2bim.verify.detected import Detected
from scan2bim.verify.ifc_model import IfcModel, ModelStorey
from scan2bim.verify.openings import ANGLE, FLUSH, OPEN, PLANE, SURE, OpeningContext
from scan2bim.verify.result import Addition
from scan2bim.verify.status import Surface
from scan2bim.verify.visibility import LOOKED_THROUGH

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

LIKELY, WELL_OPEN = 0.4, 0.85
"""Confidence from which on a detected opening is one if so great a share of its place shows no wall."""
LEAST_SEEN = 0.3
"""Square metres of that place that must be seen."""


def added_openings(context: OpeningContext, model: IfcModel, matched: set[int], to_model: F64) -> list[Addition]:
    """Detected openings in walls that are drawn without them."""
    surface, elements = context.surface, model.elements
    walls = [i for i, e in enumerate(elements) if e.role == "compared" and "Wall" in e.ifc_class]
    out: list[Addition] = []
    for number, found in enumerate(context.detected):
        if number in matched or found.confidence < LIKELY:
            continue
        gone, seen, host = 0.0, 0.0, ""
        for wall in walls:
            cells = context.cells_of(wall)
            cells = cells[_under(surface, cells, found)]
            if not len(cells):
                continue
            measured = surface.is_measured[cells]
            off = measured & (np.abs(np.where(measured, surface.measured.mean[cells], 0.0)) > 2 * FLUSH)
            through = ~measured & ((surface.bits[cells] & LOOKED_THROUGH) > 0)
            area = surface.table.area(cells)
            gone += float(area[off | through].sum())
            seen += float(area[measured | through].sum())
            host = elements[wall].name
        # A closed leaf that is flush with its wall leaves the wall's surface as it is.
        flush = found.state == "closed" and found.tells_place
        open_there = gone > (OPEN if found.confidence >= SURE else WELL_OPEN) * seen
        if seen > LEAST_SEEN and (flush or open_there):
            out.append(_addition(found, host, len(out), gone, to_model, model.storeys))
    return out


def _under(surface: Surface, cells: NDArray[np.int64], found: Detected) -> Mask:
    """Which cells lie in a detected opening's rectangle."""
    offset = surface.table.centres(cells) - found.middle
    normal = surface.table.normal[surface.table.cell_face[cells]]
    across = np.array([-found.along[1], found.along[0]])
    return (
        (np.abs(offset[:, :2] @ found.along) < found.width / 2)
        & (np.abs(offset[:, 2]) < found.height / 2)
        & (np.abs(offset[:, :2] @ across) < PLANE)
        & (np.abs(normal[:, :2] @ across) > ANGLE)
    )


def _addition(
    found: Detected, host: str, number: int, area: float, to_model: F64, storeys: Sequence[ModelStorey]
) -> Addition:
    half = np.array([*(np.abs(found.along) * found.width / 2 + 0.1), found.height / 2])
    middle = to_model[:3, :3] @ found.middle + to_model[:3, 3]
    reach = np.abs(to_model[:3, :3]) @ half
    size = f"{found.width:.2f} x {found.height:.2f} m"
    words = f"A {found.kind} of {size} in {host or 'a wall'}, which is drawn without it."
    return Addition(
        id=f"opening-{number + 1}",
        guess=found.kind,
        storey=storey_at(storeys, float(middle[2])),
        lower=_vector(middle - reach),
        upper=_vector(middle + reach),
        points=0,
        area=round(area, 3),
        sentence=words,
    )


def _vector(values: F64) -> tuple[float, float, float]:
    return (round(float(values[0]), 3), round(float(values[1]), 3), round(float(values[2]), 3))
