"""The verification's method, step by step: place, compare, look, judge."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim import __version__
from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.panorama import Panorama
from scan2bim.config import VerifySettings
from scan2bim.model.elements import Building
from scan2bim.verify.compare import compare_points
from scan2bim.verify.faces import FaceTable, make_faces
from scan2bim.verify.ifc_model import IfcModel, read_model
from scan2bim.verify.place import Placement, place_model
from scan2bim.verify.result import ElementResult, Report
from scan2bim.verify.status import Surface, judge_elements
from scan2bim.verify.visibility import look, opaque_bodies

F64 = NDArray[np.float64]
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What a verification works on. transform, placing and fitted as in ``verification.VerifyRequest``."""

    model: Path
    scan_folders: tuple[Path, ...]
    surfel_folder: Path
    frame: SurveyFrame
    building: Building | None
    transform: tuple[tuple[float, ...], ...] | None
    placing: str
    fitted: bool


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The report, and what pictures and copies of the model are made from."""

    report: Report
    model: IfcModel
    surface: Surface
    placement: Placement


def verify_model(inputs: Inputs, settings: VerifySettings, progress: Progress) -> Found:
    """Compare a model with scans. Raises InputError or PrecheckError."""
    model = read_model(inputs.model)
    summaries = tuple(ScanSummary.load(folder) for folder in inputs.scan_folders)
    stations = _stations(summaries)
    anchor = np.round(np.concatenate([e.vertices for e in model.elements]).mean(axis=0))
    drawn = make_faces(model.elements, anchor)
    progress(0.15)
    placement = place_model(inputs, model, drawn, anchor, stations, summaries)
    table = drawn.moved(placement.matrix)
    progress(0.3)
    measured = compare_points(
        table, inputs.scan_folders, stations, placement.ignored, [], lambda share: progress(0.3 + 0.4 * share)
    )
    surface = _seen(inputs, model, table, placement, measured.count, anchor, lambda s: progress(0.7 + 0.2 * s))
    surface = Surface(table, measured, surface, reveals(model, table, placement, anchor))
    tolerances = [settings.tolerance_of(e.ifc_class) for e in model.elements]
    results = judge_elements(model.elements, surface, tolerances, placement.to_model(anchor))
    report = Report(
        program=f"scan2bim {__version__}",
        model_file=inputs.model.name,
        model_name=model.name,
        model_schema=model.schema,
        tolerance=settings.tolerance,
        points=measured.points,
        unexplained_points=measured.unexplained,
        placing=placement.told,
        elements=tuple(results) + _others(model, settings),
    )
    return Found(report, model, surface, placement)


def _stations(summaries: Sequence[ScanSummary]) -> F64:
    """Positions by station number, (s, 3), nan where unknown."""
    last = max((s.station + len(s.sources) for s in summaries), default=0)
    out = np.full((last + 1, 3), np.nan)
    for summary in summaries:
        if summary.position is not None:
            out[summary.station] = summary.position
    return out


def _seen(
    inputs: Inputs,
    model: IfcModel,
    table: FaceTable,
    placement: Placement,
    count: NDArray[np.int64],
    anchor: F64,
    progress: Progress,
) -> NDArray[np.uint8]:
    """What the stations saw of the cells without points."""
    folders = [f for f in inputs.scan_folders if (f / "panorama.npz").exists()]
    bodies = opaque_bodies(model.elements, anchor, placement.matrix)

    def panoramas() -> Iterator[Panorama]:
        for folder in folders:
            if not placement.ignored[ScanSummary.load(folder).station]:
                yield Panorama.load(folder / "panorama.npz")

    return look(table, bodies, panoramas(), count == 0, progress, len(folders))


def reveals(model: IfcModel, table: FaceTable, placement: Placement, anchor: F64) -> NDArray[np.bool_]:
    """Which cells (c,) line an opening of their own element: frames and leaves hide them, they are judged with it."""
    place = {e.guid: i for i, e in enumerate(model.elements)}
    out = np.zeros(len(table.cell_face), bool)
    order = np.argsort(table.cell_element, kind="stable")
    ends = np.searchsorted(table.cell_element[order], np.arange(len(model.elements) + 1))
    for opening in model.elements:
        host = place.get(opening.host or "") if opening.role == "opening" else None
        if host is None:
            continue
        cells = order[ends[host] : ends[host + 1]]
        out[cells] |= _inside(table.centres(cells), placement.local(opening.vertices - anchor))
    return out


LINING = 0.02
"""Metres by which a cell may lie outside of an opening's box and still line it."""


def _inside(points: F64, corners: F64) -> NDArray[np.bool_]:
    """Which points lie in the box round ``corners`` whose axes are the opening's own in plan."""
    flat = corners[:, :2] - corners[:, :2].mean(axis=0)
    edges = corners[:, None, :2] - corners[None, :, :2]
    lengths = np.linalg.norm(edges, axis=2)
    along = edges.reshape(-1, 2)[np.argmax(lengths)] if len(flat) < 3 else _main_direction(flat)
    along = along / max(float(np.linalg.norm(along)), 1e-9)
    axes = np.array([[along[0], along[1], 0.0], [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    own = corners @ axes.T
    mine = points @ axes.T
    return ((mine > own.min(axis=0) - LINING) & (mine < own.max(axis=0) + LINING)).all(axis=1)


def _main_direction(flat: F64) -> F64:
    """Of the points (n, 2): the direction in which their bounding box is smallest."""
    angles = np.linspace(0, np.pi / 2, 181)
    turned = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    across = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    area = np.ptp(flat @ turned.T, axis=0) * np.ptp(flat @ across.T, axis=0)
    return turned[np.argmin(area)]


def _others(model: IfcModel, settings: VerifySettings) -> tuple[ElementResult, ...]:
    """Results of the elements that are not judged, with why."""
    context = [
        (e.guid, e.ifc_class, e.name, e.storey, "It may be moved: where it stands is no fault of building.")
        for e in model.elements
        if e.role == "context"
    ]
    bare = [(guid, kind, name, "", "It has no body in the model.") for guid, kind, name in model.without_body]
    return tuple(
        ElementResult(
            guid=guid,
            ifc_class=kind,
            name=name,
            storey=storey,
            status="not_applicable",
            reason=reason,
            tolerance=settings.tolerance_of(kind),
        )
        for guid, kind, name, storey, reason in (*context, *bare)
    )
