"""The report as one page that needs nothing else: summary, plans by status, histograms, a table, pictures."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from html import escape
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.verify.ifc_copy import COLOURS
from scan2bim.verify.result import STATUSES, ElementResult, Report

if TYPE_CHECKING:
    from scan2bim.verify.build import Found

F64 = NDArray[np.float64]

FLAT = ("IfcSlab", "IfcCovering", "IfcRoof", "IfcFooting", "IfcSite")
"""Classes that would cover a plan: they are drawn as outlines."""
BINS = 41
"""Of the histograms: 20 on each side."""
PLAN_WIDTH = 640


def page(found: Found, pictures: Mapping[str, bytes]) -> str:
    """The page's text; ``pictures`` are PNGs by GlobalId."""
    template = resources.files("scan2bim.verify").joinpath("page.html").read_text(encoding="utf-8")
    report = found.report
    data = {
        "elements": [_row(e) for e in report.elements],
        "pictures": {guid: base64.b64encode(png).decode() for guid, png in pictures.items()},
        "histograms": _histograms(found),
        "colours": {status: "rgb({},{},{})".format(*COLOURS[status]) for status in STATUSES},
    }
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    parts = {
        "TITLE": escape(f"Verification of {report.model_name}"),
        "SUMMARY": _summary(report),
        "PLANS": _plans(found),
        "ADDITIONS": _additions(report),
        "PLACING": _placing(report),
        "DATA": text,
    }
    for name, part in parts.items():
        template = template.replace(f"@{name}@", part)
    return template


def _row(element: ElementResult) -> dict[str, Any]:
    deviation, fit = element.deviation, element.fit
    return {
        "guid": element.guid,
        "class": element.ifc_class.removeprefix("Ifc"),
        "name": element.name,
        "storey": element.storey,
        "status": element.status,
        "reason": element.reason,
        "loa": element.loa or "",
        "median": None if deviation is None else round(1000 * deviation.median, 1),
        "p95": None if deviation is None else round(1000 * deviation.p95, 1),
        "within": None if deviation is None else round(100 * deviation.within, 1),
        "coverage": None if element.coverage is None else round(100 * element.coverage),
        "occluded": None if element.occluded is None else round(100 * element.occluded),
        "shift": None if fit is None else [round(1000 * value, 1) for value in fit.shift],
        "turn": None if fit is None else round(float(np.degrees(fit.turn)), 3),
        "faces": [
            [
                round(f.measured, 2),
                None if f.median is None else round(1000 * f.median, 1),
                [round(n, 2) for n in f.normal],
            ]
            for f in element.faces[:6]
        ],
        "finding": None if element.opening is None else element.opening.finding,
    }


def _histograms(found: Found) -> dict[str, list[int]]:
    """Measured cells by deviation, in steps of a tenth of twice the tolerance, for each element and for all ("")."""
    surface, elements = found.surface, found.model.elements
    measured = np.flatnonzero(surface.is_measured & ~surface.reveal)
    step = found.report.tolerance / 5
    bins = np.clip(np.rint(surface.measured.mean[measured] / step).astype(np.int64) + BINS // 2, 0, BINS - 1)
    owner = surface.table.cell_element[measured]
    counts = np.bincount(owner * BINS + bins, minlength=len(elements) * BINS).reshape(-1, BINS)
    compared = [i for i, e in enumerate(elements) if e.role == "compared" and counts[i].any()]
    out = {elements[i].guid: counts[i].tolist() for i in compared}
    return out | {"": counts[compared].sum(axis=0).tolist()}


def _summary(report: Report) -> str:
    counts = report.counts()
    tiles = "".join(
        f'<button class="tile" data-status="{status}"><b>{number}</b>{status.replace("_", " ")}</button>'
        for status, number in counts.items()
    )
    loa = dict.fromkeys(("LOA50", "LOA40", "LOA30", "LOA20", "LOA10"), 0)
    for element in report.elements:
        if element.loa is not None:
            loa[element.loa] += 1
    bands = ", ".join(f"{number} {band}" for band, number in loa.items() if number)
    return (
        f"<p>{escape(report.model_file)} ({escape(report.model_schema)}) against {report.points:,} points; tolerance "
        f"{1000 * report.tolerance:g} mm. Measured accuracy at 95 %: {bands or 'none'}.</p>"
        f"<div class=tiles>{tiles}</div>"
    )


def _placing(report: Report) -> str:
    place = report.placing
    shift = 1000 * float(np.linalg.norm(place.fit_shift))
    rows = "".join(
        f"<tr><td>{escape(s.name)}</td><td>{1000 * float(np.linalg.norm(s.shift)):.1f}</td>"
        f"<td>{float(np.degrees(s.turn)):.3f}</td><td>{1000 * s.residual:.1f}</td>"
        f"<td>{'left out' if s.left_out else ''}</td></tr>"
        for s in place.scans
    )
    notes = "".join(f"<p>{escape(note)}</p>" for note in (*place.notes, *report.notes))
    return (
        f"<p>Placed by {place.method}; {100 * place.explained:.0f} % of the scanned surface lies within 5 cm of the "
        f"model. Fit: {shift:.1f} mm, {float(np.degrees(place.fit_turn)):.3f} degrees, residual "
        f"{1000 * place.residual:.1f} mm.</p>{notes}<table><thead><tr><th>scan</th><th>own shift mm</th>"
        f"<th>turn degrees</th><th>residual mm</th><th></th></tr></thead><tbody>{rows}</tbody></table>"
    )


def _additions(report: Report) -> str:
    if not report.additions:
        return "<p>None.</p>"
    rows = "".join(
        f"<tr><td>{escape(a.guess)}</td><td>{escape(a.storey)}</td><td>{escape(a.sentence)}</td><td>{a.area:.1f}</td>"
        f"<td>{a.points:,}</td></tr>"
        for a in sorted(report.additions, key=lambda a: (a.guess == "object", -a.area))
    )
    head = "<tr><th>guess</th><th>storey</th><th>what</th><th>surface m2</th><th>points</th></tr>"
    return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>"


def _plans(found: Found) -> str:
    """An SVG for each storey, its elements coloured by status."""
    results = {e.guid: e for e in found.report.elements}
    drawn = [(e, results[e.guid]) for e in found.model.elements if e.guid in results and e.role != "patch"]
    names = [s.name for s in found.model.storeys]
    names += sorted({r.storey for _, r in drawn} - set(names))
    parts: list[str] = []
    for name in names:
        here = [(r, _outline(e.vertices)) for e, r in drawn if r.storey == name]
        if here:
            parts.append(f"<figure><figcaption>{escape(name or 'no storey')}</figcaption>{_plan(here)}</figure>")
    return "".join(parts)


def _outline(vertices: F64) -> F64:
    hull = shapely.convex_hull(shapely.multipoints(vertices[:, :2]))
    return np.asarray(shapely.get_coordinates(hull))


def _plan(here: list[tuple[ElementResult, F64]]) -> str:
    every = np.concatenate([outline for _, outline in here])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = PLAN_WIDTH / max(float((high - low).max()), 0.1)
    width, height = ((high - low) * scale + 8).tolist()
    ordered = sorted(here, key=lambda entry: entry[0].ifc_class not in FLAT)
    shapes = "".join(_shape(result, _points(outline, low, high, scale)) for result, outline in ordered)
    return f'<svg viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}">{shapes}</svg>'


def _shape(result: ElementResult, points: str) -> str:
    kind = "flat" if result.ifc_class in FLAT else "solid"
    title = escape(f"{result.ifc_class[3:]} {result.name}: {result.status.replace('_', ' ')}")
    look = f'class="{result.status} {kind}" points="{points}"'
    return f'<polygon data-guid="{escape(result.guid)}" {look}><title>{title}</title></polygon>'


def _points(outline: F64, low: F64, high: F64, scale: float) -> str:
    x, y = (outline[:, 0] - low[0]) * scale + 4, (high[1] - outline[:, 1]) * scale + 4
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
