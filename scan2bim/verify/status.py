"""The status of each element, from its measured cells and from what the stations saw in the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.compare import Measured
from scan2bim.verify.faces import FaceTable
from scan2bim.verify.fits import Cells, Motion, Statistics, best_motion, own_surface, statistics
from scan2bim.verify.ifc_model import ModelElement
from scan2bim.verify.layers import Layer, find_layers, layer_addition
from scan2bim.verify.result import Addition, Deviation, ElementResult, FaceResult, Fit, Loa, Status
from scan2bim.verify.visibility import BLOCKED, LOOKED_THROUGH, SAW, VISIBLE

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_POINTS = 2
"""Points of a measured cell: one may be a stray."""
ENOUGH = 0.10
"""Square metres that must be measured of an element, or a fifth of what is visible if that is less."""
LEAST_COVERAGE = 0.03
"""Share of the visible surface that must be measured: of a slab under its finish one sees only gaps."""
WITHIN = 0.90
"""Share of an element's own measured surface that must lie within its tolerance; the rest may be fixings, joints and
edges that are not drawn."""
LEAST_OFF = 0.05
"""Square metres that must be off at the least for that share to count: less are a few cells at edges."""
FACE_AREA = 0.10
"""Square metres measured of a face whose own median is judged, and at least a tenth of all that was measured of the
element: less may be a fixing, or what covers a reveal."""
GONE = 0.6
"""Share of what was seen of an element's place that stations looked through, from which on it is missing."""
HOLE = 0.25
"""The same, from which on a part of it is missing."""
LEAST_HOLE = 0.15
"""Square metres looked through, at the least, for either."""
LOA_BANDS: tuple[tuple[float, Loa], ...] = (
    (0.001, "LOA50"),
    (0.005, "LOA40"),
    (0.015, "LOA30"),
    (0.050, "LOA20"),
)
"""Metres at 95 % up to which a band of the USIBD Level of Accuracy specification reaches."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """The cells of a model with all that is known of them: (c,) each.

    bits as in ``visibility``; reveal: it lines an opening, so that frames hide it and it counts for the opening;
    is_measured: it has enough points. beyond: square metres (e,) of elements that lie beyond what the scans reach, of
    which there are no cells. asked: whether the position of any station is known, so that it can be asked.
    """

    table: FaceTable
    measured: Measured
    bits: NDArray[np.uint8]
    reveal: Mask
    beyond: F64
    asked: bool
    is_measured: Mask = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_measured", self.measured.count >= LEAST_POINTS)


def loa_of(p95: float) -> Loa:
    """The band of a deviation at 95 %, metres."""
    for limit, band in LOA_BANDS:
        if p95 <= limit:
            return band
    return "LOA10"


def judge_elements(
    elements: Sequence[ModelElement], surface: Surface, tolerances: Sequence[float], to_model: F64
) -> tuple[list[ElementResult], list[Addition]]:
    """A result for each compared element, and layers that stand before walls; ``to_model`` (4, 4) takes the cells'
    frame to the model's axes.
    """
    order, ends = surface.table.by_element(len(elements))
    results: list[ElementResult] = []
    added: list[Addition] = []
    for i, element in enumerate(elements):
        if element.role != "compared":
            continue
        if surface.beyond[i] > 0.0:
            results.append(_beyond(element, float(surface.beyond[i]), tolerances[i]))
            continue
        result, layers = _judge(element, order[ends[i] : ends[i + 1]], surface, tolerances[i], to_model)
        results.append(result)
        for layer in layers:
            added.append(layer_addition(layer, element.name, element.storey, len(added) + 1, to_model))
    return results, added


def _beyond(element: ModelElement, area: float, tolerance: float) -> ElementResult:
    return result_of(element, "not_enough_data", "It lies beyond what the scans reach.", tolerance, area)


def result_of(element: ModelElement, status: Status, reason: str, tolerance: float, area: float = 0.0) -> ElementResult:
    """What is said of an element of which nothing was measured; ``area`` in m2."""
    return ElementResult(
        guid=element.guid,
        ifc_class=element.ifc_class,
        name=element.name,
        storey=element.storey,
        status=status,
        reason=reason,
        tolerance=tolerance,
        area=round(area, 4),
    )


def _judge(
    element: ModelElement, cells: NDArray[np.int64], surface: Surface, tolerance: float, to_model: F64
) -> tuple[ElementResult, list[Layer]]:
    table = surface.table
    area = table.area(cells)
    glass = table.glass[table.cell_face[cells]]
    reason = "It has no surface that a scanner resolves."
    base = result_of(element, "not_applicable", reason, tolerance, float(area.sum()))
    if not len(cells):
        return base, []
    if glass.all():
        return base.model_copy(update={"reason": "Glass: scanners see through it."}), []
    counted = ~glass & ~surface.reveal[cells]
    return _judged(base, cells[counted], surface, tolerance, to_model)


def _judged(
    base: ElementResult, cells: NDArray[np.int64], surface: Surface, tolerance: float, to_model: F64
) -> tuple[ElementResult, list[Layer]]:
    table = surface.table
    area = table.area(cells)
    measured = surface.is_measured[cells]
    bits = surface.bits[cells]
    found = _cells(table, surface.measured, cells[measured])
    own, on_plane = own_surface(found)
    layers = find_layers(found, own, tolerance) if "Wall" in base.ifc_class else []
    for layer in layers:
        own, on_plane = own & ~layer.cells, on_plane & ~layer.cells
    own_area = float(found.area[own].sum())
    visible = measured | ((bits & VISIBLE) > 0)
    saw = measured | ((bits & SAW) > 0)
    through = ~saw & ((bits & LOOKED_THROUGH) > 0)
    blocked = ~saw & ~through & ((bits & BLOCKED) > 0)
    areas = [float(area[mask].sum()) for mask in (visible, saw, through, blocked)]
    visible_area, saw_area, through_area, blocked_area = areas
    stats = statistics(found.pick(own), tolerance) if own.any() else None
    motion = _motion(found.pick(on_plane), table.centres(cells)) if on_plane.any() else None
    faces = _faces(table, cells, found, own, to_model)
    enough = own_area >= max(0.005, LEAST_COVERAGE * visible_area, min(ENOUGH, 0.2 * visible_area))
    gone = through_area / max(through_area + saw_area, 1e-9) if through_area >= LEAST_HOLE else 0.0
    status, reason = _status(stats, motion, faces, tolerance, enough, gone, areas)
    if status == "occluded" and not surface.asked:
        status, reason = (
            "not_enough_data",
            "Too little of it was measured, and no scanner's position is known to tell why.",
        )
    kept = stats if enough and stats else None
    result = base.model_copy(
        update={
            "status": status,
            "reason": reason,
            "visible": round(visible_area, 4),
            "measured": round(float(found.area.sum()), 4),
            "coverage": _share(float(found.area.sum()), visible_area),
            "occluded": _share(blocked_area, visible_area),
            "looked_through": _share(through_area, visible_area),
            "loa": loa_of(kept.p95) if kept else None,
            "deviation": _deviation(kept) if kept else None,
            "fit": _fit(motion, to_model) if motion and kept else None,
            "faces": faces if kept else (),
        }
    )
    return result, layers


def _status(
    stats: Statistics | None,
    motion: Motion | None,
    faces: Sequence[FaceResult],
    tolerance: float,
    enough: bool,
    gone: float,
    areas: Sequence[float],
) -> tuple[Status, str]:
    visible, _, through, blocked = areas
    if gone >= GONE:
        return "missing", f"Scanners looked through {100 * gone:.0f} % of the place where it should be seen."
    if not enough or stats is None:
        return _unseen(visible, through, blocked)
    least = max(FACE_AREA, (1 - WITHIN) * sum(f.measured for f in faces))
    worst = max((abs(f.median) for f in faces if f.median is not None and f.measured >= least), default=0.0)
    off = (1 - stats.within) * sum(f.measured for f in faces)
    if (stats.within < WITHIN and off > LEAST_OFF) or abs(stats.median) > tolerance or worst > tolerance:
        return "out_of_tolerance", _reason(stats, motion, worst, tolerance)
    if gone >= HOLE:
        return "out_of_tolerance", f"Scanners looked through {through:.2f} m2 of it: a part is missing."
    return "in_tolerance", f"{100 * stats.within:.0f} % of the measured surface lies within {1000 * tolerance:.0f} mm."


def _reason(stats: Statistics, motion: Motion | None, worst: float, tolerance: float) -> str:
    text = f"{100 * (1 - stats.within):.0f} % of the measured surface is off by more than {1000 * tolerance:.0f} mm"
    text += f"; its worst face by {1000 * worst:.0f} mm (median)." if worst > tolerance else "."
    if motion and motion.length > tolerance / 2:
        text += f" Best fit: shifted by {1000 * motion.length:.0f} mm."
    if motion and abs(motion.turn) > 0.002:
        text += f" Turned by {abs(motion.turn) * 180 / np.pi:.2f} degrees."
    return text


def _unseen(visible: float, through: float, blocked: float) -> tuple[Status, str]:
    if visible <= 0.0:
        return "occluded", "It lies behind other elements, seen from every station."
    if blocked > 0.5 * visible:
        return "occluded", f"Something stood before {100 * blocked / visible:.0f} % of its visible surface."
    return "not_enough_data", f"Too little of its {visible:.2f} m2 of visible surface was measured."


def _cells(table: FaceTable, measured: Measured, cells: NDArray[np.int64]) -> Cells:
    face = table.cell_face[cells]
    return Cells(
        face=face,
        middle=table.centres(cells),
        normal=table.normal[face],
        deviation=measured.mean[cells],
        square=measured.square[cells],
        area=table.size[face] ** 2,
        place=(table.cell_at[cells] + 0.5) * table.size[face][:, None],
    )


def _motion(cells: Cells, drawn: F64) -> Motion:
    """About the middle of the ``drawn`` cells (k, 3), of which some were measured."""
    middle = (drawn.min(axis=0) + drawn.max(axis=0)) / 2
    length = float(np.linalg.norm(cells.middle.max(axis=0) - cells.middle.min(axis=0)))
    return best_motion(cells, middle, max(length / 2, 0.1))


def _faces(
    table: FaceTable, cells: NDArray[np.int64], found: Cells, own: Mask, to_model: F64
) -> tuple[FaceResult, ...]:
    out: list[FaceResult] = []
    numbers, counts = np.unique(table.cell_face[cells], return_counts=True)
    total = dict(zip(numbers.tolist(), counts.tolist(), strict=True))
    for face in np.unique(found.face).tolist():
        mine = found.pick((found.face == face) & own)
        measured = float(mine.area.sum())
        if measured < 0.02:
            continue
        stats = statistics(mine, 1.0)
        out.append(
            FaceResult(
                normal=_vector(to_model[:3, :3] @ table.normal[face], 6),
                middle=_vector(to_model[:3, :3] @ mine.middle.mean(axis=0) + to_model[:3, 3]),
                area=round(float(total[face] * table.size[face] ** 2), 4),
                measured=round(measured, 4),
                median=round(stats.median, 5),
                p95=round(stats.p95, 5),
            )
        )
    return tuple(sorted(out, key=lambda f: -f.measured))


def _deviation(stats: Statistics) -> Deviation:
    return Deviation(
        median=round(stats.median, 5),
        p95=round(stats.p95, 5),
        rmse=round(stats.rmse, 5),
        within=round(stats.within, 4),
    )


def _fit(motion: Motion, to_model: F64) -> Fit:
    return Fit(
        shift=_vector(to_model[:3, :3] @ np.array(motion.shift), 5),
        turn=round(motion.turn, 6),
        tilt=round(motion.tilt, 6),
        residual=round(motion.residual, 5),
    )


def _vector(values: F64, digits: int = 4) -> tuple[float, float, float]:
    return (round(float(values[0]), digits), round(float(values[1]), digits), round(float(values[2]), digits))


def _share(part: float, whole: float) -> float | None:
    return round(min(part / whole, 1.0), 4) if whole > 0 else None
