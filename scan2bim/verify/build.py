"""The verification's method, step by step: place, compare, look, judge."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim import __version__
from scan2bim.cloud.ingest import ScanSummary, load_panoramas, stations_of
from scan2bim.config import VerifySettings
from scan2bim.verify.added import added_openings
from scan2bim.verify.additions import Surroundings, Unexplained, find_additions
from scan2bim.verify.compare import compare_points
from scan2bim.verify.detected import detected_openings
from scan2bim.verify.faces import FaceTable, Plane, areas_of, find_planes, make_faces
from scan2bim.verify.ifc_model import IfcModel, read_model
from scan2bim.verify.inputs import Inputs
from scan2bim.verify.leaves import doorways
from scan2bim.verify.moved import moved_bodies
from scan2bim.verify.openings import OpeningContext, judge_openings, placed_gap
from scan2bim.verify.outlines import Profiles
from scan2bim.verify.patches import find_gaps, main_direction, with_patches
from scan2bim.verify.place import Placement, place_model
from scan2bim.verify.reach import within_reach
from scan2bim.verify.result import ElementResult, Report
from scan2bim.verify.status import Surface, judge_elements
from scan2bim.verify.unvoided import with_openings
from scan2bim.verify.visibility import look, opaque_bodies

F64 = NDArray[np.float64]
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The points: folders of the scans' tiles, positions (s, 3) of the stations, and the survey's shift, metres."""

    scan_folders: tuple[Path, ...]
    stations: F64
    shift: tuple[float, float, float]


UNASKED = (
    "No scanner positions are known (merged clouds lose them): what was not measured is told as not enough data, "
    "and no element as missing or occluded. The single scans, as E57 or PTX, keep them."
)


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The report, and what pictures, clouds and copies of the model are made from."""

    report: Report
    model: IfcModel
    surface: Surface
    placement: Placement
    anchor: F64
    source: Source


def verify_model(inputs: Inputs, settings: VerifySettings, progress: Progress) -> Found:
    """Compare a model with scans. Raises InputError or PrecheckError."""
    model = with_openings(read_model(inputs.model))
    gaps = find_gaps(model)
    model = with_patches(model, gaps)
    summaries = tuple(ScanSummary.load(folder) for folder in inputs.scan_folders)
    stations = stations_of(summaries)
    anchor = np.round(np.concatenate([e.vertices for e in model.elements]).mean(axis=0))
    every = find_planes(model.elements, anchor)
    progress(0.15)
    placement = place_model(inputs, model, every, anchor, stations, summaries)
    near = within_reach(every, len(model.elements), placement.matrix, inputs.scan_folders, stations)
    planes = [plane for plane in every if near[plane.element]]
    table = make_faces(planes).moved(placement.matrix)
    progress(0.3)
    unexplained = Unexplained()
    profiles = Profiles([placed_gap(g, placement.matrix, anchor) for g in gaps])
    measured = compare_points(
        table,
        inputs.scan_folders,
        stations,
        placement.ignored,
        [unexplained, profiles],
        lambda s: progress(0.3 + 0.4 * s),
    )
    looked = Looked(model, planes, table, placement, measured.count)
    bits = _seen(inputs, looked, frozenset(), lambda s: progress(0.7 + 0.2 * s))
    known = bool(np.isfinite(stations[~placement.ignored]).any())
    beyond = areas_of([plane for plane in every if not near[plane.element]], len(model.elements))
    surface = Surface(table, measured, bits, reveals(model, table, placement, anchor), beyond, known)
    source = Source(inputs.scan_folders, stations, inputs.frame.shift)
    return _judged(inputs, settings, Seen(model, planes, profiles, surface, placement, anchor, unexplained, source))


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What was measured, before it is judged."""

    model: IfcModel
    planes: list[Plane]
    profiles: Profiles
    surface: Surface
    placement: Placement
    anchor: F64
    unexplained: Unexplained
    source: Source


def _judged(inputs: Inputs, settings: VerifySettings, seen: Seen) -> Found:
    """Elements, doors and windows, and what is not drawn."""
    model, elements = seen.model, seen.model.elements
    to_model = seen.placement.to_model(seen.anchor)
    tolerances = [settings.tolerance_of(e.ifc_class) for e in elements]
    results, layers = judge_elements(elements, seen.surface, tolerances, to_model)
    missing = frozenset(result.guid for result in results if result.status == "missing")
    if missing:
        seen = _without(inputs, seen, missing)
        results, layers = judge_elements(elements, seen.surface, tolerances, to_model)
    surface = seen.surface
    context = _opening_context(inputs, seen)
    fills, matched = judge_openings(context, elements, tolerances)
    windows = tuple(g for g in context.gaps if g.fill is not None and g.fill.ifc_class.startswith("IfcWindow"))
    moved = moved_bodies(elements, results, to_model)
    doors = doorways(context.gaps, context.detected)
    around = Surroundings(surface.table.box(), ceilings(surface.table, model), windows, model.storeys, moved, doors)
    additions = find_additions(seen.unexplained, around, to_model)
    told = (*results, *fills, *_others(model, settings))
    report = Report(
        program=f"scan2bim {__version__}",
        model_file=inputs.model.name,
        model_name=model.name,
        model_schema=model.schema,
        tolerance=settings.tolerance,
        points=surface.measured.points,
        unexplained_points=surface.measured.unexplained,
        placing=seen.placement.told,
        elements=told,
        additions=(*added_openings(context, model, matched, to_model), *layers, *additions),
        notes=(*(() if surface.asked else (UNASKED,)), *doubt(results), *unused_tolerances(settings, told)),
    )
    return Found(report, model, surface, seen.placement, seen.anchor, seen.source)


DOUBTFUL = 0.4
"""Share of the surface that scanners should see, and looked through, from which on the model is doubted."""


def doubt(results: Sequence[ElementResult]) -> tuple[str, ...]:
    """That so much of the model is not there that it may be another building's, or another state's, if it is so."""
    through = sum((r.looked_through or 0.0) * r.visible for r in results)
    seen = through + sum(min(r.measured, r.visible) for r in results)
    if through < DOUBTFUL * seen or not seen:
        return ()
    words = f"Scanners looked through {100 * through / seen:.0f} % of the model's surface that they should see: "
    return (f"{words}is it the model of this building, in the state that was scanned, and in the right place?",)


def unused_tolerances(settings: VerifySettings, elements: Sequence[ElementResult]) -> tuple[str, ...]:
    """That classes have tolerances of their own of which the model has no element: perhaps a name is misspelt."""
    unused = settings.unused_classes({element.ifc_class for element in elements})
    return tuple(f"[verify] classes: the model has no {name}, so its tolerance is not used." for name in unused)


def _opening_context(inputs: Inputs, seen: Seen) -> OpeningContext:
    table, elements = seen.surface.table, seen.model.elements
    order, ends = table.by_element(len(elements))
    patches = {e.guid: i for i, e in enumerate(elements) if e.role == "patch"}
    places = {e.guid: i for i, e in enumerate(elements) if e.role not in ("patch", "opening")}
    return OpeningContext(
        surface=seen.surface,
        order=order,
        ends=ends,
        gaps=seen.profiles.gaps,
        patches=tuple(patches[g.guid] for g in seen.profiles.gaps),
        hosts=tuple(places[g.host] for g in seen.profiles.gaps),
        detected=detected_openings(inputs.building),
        profiles=seen.profiles,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """What stations look at: the planes of a model, its placed faces, and the points (c,) of their cells."""

    model: IfcModel
    planes: Sequence[Plane]
    table: FaceTable
    placement: Placement
    count: NDArray[np.int64]


def _seen(inputs: Inputs, looked: Looked, missing: frozenset[str], progress: Progress) -> NDArray[np.uint8]:
    """What the stations saw of the cells without points; what is ``missing`` (GlobalIds) hides nothing."""
    panoramas = load_panoramas(inputs.scan_folders)
    elements, table = looked.model.elements, looked.table
    asked = [panorama for station, panorama in panoramas.items() if not looked.placement.ignored[station]]
    # Doors stand open or closed: what fills openings hides nothing.
    opaque = np.array([e.role in ("compared", "context") and e.guid not in missing for e in elements])
    bodies = opaque_bodies(looked.planes, opaque, looked.placement.matrix)
    judged = np.array([e.role in ("compared", "patch") for e in elements])
    return look(table, bodies, asked, (looked.count == 0) & judged[table.cell_element], progress)


def _without(inputs: Inputs, seen: Seen, missing: frozenset[str]) -> Seen:
    """The same, with what stands behind drawn elements that were not built: stations see it."""
    surface = seen.surface
    looked = Looked(seen.model, seen.planes, surface.table, seen.placement, surface.measured.count)
    bits = _seen(inputs, looked, missing, lambda _: None)
    return replace(seen, surface=replace(surface, bits=surface.bits | bits))


def reveals(model: IfcModel, table: FaceTable, placement: Placement, anchor: F64) -> NDArray[np.bool_]:
    """Which cells (c,) line an opening of their own element: frames and leaves hide them, they are judged with it."""
    place = {e.guid: i for i, e in enumerate(model.elements)}
    out = np.zeros(len(table.cell_face), bool)
    order, ends = table.by_element(len(model.elements))
    for opening in model.elements:
        host = place.get(opening.host or "") if opening.role == "opening" else None
        if host is None:
            continue
        cells = order[ends[host] : ends[host + 1]]
        out[cells] |= _inside(table.centres(cells), placement.local(opening.vertices - anchor))
    return out


def ceilings(table: FaceTable, model: IfcModel) -> F64:
    """Middles (n, 3) of cells of slabs, roofs and ceilings that look down, also at a slant, one in 20 cm each way."""
    over = np.array([e.ifc_class in ("IfcSlab", "IfcRoof", "IfcCovering") for e in model.elements])
    looks_down = (table.normal[table.cell_face][:, 2] < -0.3) & over[table.cell_element]
    stride = np.maximum(1, np.rint(0.2 / table.size).astype(np.int64))[table.cell_face]
    return table.centres(np.flatnonzero(looks_down & (table.cell_at % stride[:, None] == 0).all(axis=1)))


LINING = 0.02
"""Metres by which a cell may lie outside of an opening's box and still line it."""


def _inside(points: F64, corners: F64) -> NDArray[np.bool_]:
    """Which points lie in the box round ``corners`` whose axes are the opening's own in plan."""
    along = main_direction(corners[:, :2] - corners[:, :2].mean(axis=0))
    axes = np.array([[along[0], along[1], 0.0], [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    own = corners @ axes.T
    mine = points @ axes.T
    return ((mine > own.min(axis=0) - LINING) & (mine < own.max(axis=0) + LINING)).all(axis=1)


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
