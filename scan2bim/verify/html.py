"""The report as one page that needs nothing else: summary, plans by status, histograms, a table, pictures."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from html import escape
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.verify.ifc_copy import COLOURS
from scan2bim.verify.result import STATUSES, Addition, ElementResult, Report, Status

if TYPE_CHECKING:
    from scan2bim.verify.build import Found

F64 = NDArray[np.float64]

FLAT = ("IfcSlab", "IfcCovering", "IfcRoof", "IfcFooting", "IfcSite")
"""Classes that would cover a plan: they are drawn as outlines."""
BINS = 41
"""Of the histograms: 20 on each side."""
PLAN_WIDTH = 600
"""Pixels: two plans stand beside each other on a usual screen."""
MARK = 9
"""Radius of the numbered marks on plans, pixels."""
WORDS: dict[Status, str] = {
    "out_of_tolerance": "built otherwise than drawn",
    "missing": "drawn, but not there",
    "in_tolerance": "built as drawn",
    "occluded": "something stood before it",
    "not_enough_data": "too little of it was scanned",
    "not_applicable": "glass, furniture, or no body",
}


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
        "FINDINGS": _findings(report),
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
        f'<button class="tile" data-status="{status}"><b>{number}</b>{status.replace("_", " ")}'
        f"<small>{WORDS[status]}</small></button>"
        for status, number in counts.items()
    )
    loa = dict.fromkeys(("LOA50", "LOA40", "LOA30", "LOA20", "LOA10"), 0)
    for element in report.elements:
        if element.loa is not None:
            loa[element.loa] += 1
    bands = ", ".join(f"{number} {band}" for band, number in loa.items() if number)
    return (
        f"<p class=verdict>{_verdict(report)}</p><div class=tiles>{tiles}</div>"
        f"<p>{escape(report.model_file)} ({escape(report.model_schema)}) against {report.points:,} points; tolerance "
        f"{1000 * report.tolerance:g} mm. Measured accuracy at 95 %: {bands or 'none'}.</p>"
        + "".join(f"<p class=note>{escape(note)}</p>" for note in report.notes)
    )


def _verdict(report: Report) -> str:
    """The answer in one paragraph."""
    counts, faults, added = report.counts(), len(report.faults()), len(_built(report))
    judged = faults + counts["in_tolerance"]
    unseen = counts["occluded"] + counts["not_enough_data"]
    first = f"Of {judged} elements that the scans show, <b>{faults} {_were(faults)} not built as drawn</b>."
    if not judged:
        first = "The scans show no element well enough to judge it."
    second = (
        f" {added} {'thing stands' if added == 1 else 'things stand'} there that {_is(added)} not drawn."
        if added
        else ""
    )
    return f"{first}{second} {unseen} {_were(unseen)} not seen well enough."


def _were(number: int) -> str:
    return "was" if number == 1 else "were"


def _is(number: int) -> str:
    return "is" if number == 1 else "are"


def _built(report: Report) -> list[Addition]:
    """Additions that are more than objects."""
    return [a for a in report.additions if a.guess != "object"]


def _ranked(report: Report) -> list[ElementResult]:
    """Elements at fault: missing ones, then by how far they are off."""

    def key(element: ElementResult) -> tuple[bool, float]:
        opening = element.opening
        sizes = (opening.shift_along, opening.width_change) if opening else ()
        off = max([abs(size or 0.0) for size in sizes] or [element.deviation.p95 if element.deviation else 0.0])
        return element.status != "missing", -off

    return sorted(report.faults(), key=key)


def _numbers(report: Report) -> dict[str, int]:
    """The number of each finding in the list, by GlobalId or an addition's id."""
    keys = [*(e.guid for e in _ranked(report)), *(a.id for a in _built(report))]
    return {key: number for number, key in enumerate(keys, 1)}


def _findings(report: Report) -> str:
    """All findings, the worst first, with the numbers that the plans show."""
    numbers = _numbers(report)
    rows = [
        f'<li data-guid="{escape(e.guid)}"><i class="{e.status}">{numbers[e.guid]}</i><span><b>'
        f"{_kind(e.ifc_class)} {escape(e.name)}</b>{_at(e.storey)}<br>{escape(e.reason)}</span></li>"
        for e in _ranked(report)
    ]
    rows += [
        f'<li data-guid="{escape(a.id)}"><i class="added">{numbers[a.id]}</i><span><b>Not drawn: {a.guess}</b>'
        f"{_at(a.storey)}<br>{escape(a.sentence)}</span></li>"
        for a in _built(report)
    ]
    return f"<ol class=findings>{''.join(rows)}</ol>" if rows else "<p>None.</p>"


def _kind(ifc_class: str) -> str:
    """An IFC class as a word: IfcWallStandardCase as Wall."""
    return escape(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", ifc_class.removeprefix("Ifc").removesuffix("StandardCase")))


def _at(storey: str) -> str:
    return f", {escape(storey)}" if storey else ""


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
    numbers, added = _numbers(found.report), _built(found.report)
    names = list(dict.fromkeys(s.name for s in found.model.storeys))
    names += sorted({r.storey for _, r in drawn} - set(names))
    parts: list[str] = []
    for name in names:
        here = [(r, _outline(e.vertices)) for e, r in drawn if r.storey == name]
        if here:
            plan = _plan(here, [a for a in added if a.storey == name], numbers)
            parts.append(f"<figure><figcaption>{escape(name or 'no storey')}</figcaption>{plan}</figure>")
    return "".join(parts)


def _outline(vertices: F64) -> F64:
    hull = shapely.convex_hull(shapely.multipoints(vertices[:, :2]))
    return np.asarray(shapely.get_coordinates(hull))


def _plan(here: list[tuple[ElementResult, F64]], added: list[Addition], numbers: Mapping[str, int]) -> str:
    boxes = [(a, np.array([a.lower[:2], a.upper[:2]])) for a in added]
    every = np.concatenate([*(outline for _, outline in here), *(box for _, box in boxes)])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = PLAN_WIDTH / max(float((high - low).max()), 0.1)
    width, height = ((high - low) * scale + 2 * MARK).tolist()
    ordered = sorted(here, key=lambda entry: entry[0].ifc_class not in FLAT)
    shapes = [_shape(result, _points(outline, low, high, scale)) for result, outline in ordered]
    marks = [(r.guid, r.status, outline.mean(axis=0)) for r, outline in here if r.guid in numbers]
    for addition, box in boxes:
        corners = box[[0, 1, 1, 0], 0], box[[0, 0, 1, 1], 1]
        points = _points(np.column_stack(corners), low, high, scale)
        shapes.append(f'<polygon class="added" data-guid="{escape(addition.id)}" points="{points}"/>')
        marks.append((addition.id, "added", box.mean(axis=0)))
    for key, look, place in marks:
        x, y = _points(place[None], low, high, scale).split(",")
        circle = f'<circle cx="{x}" cy="{y}" r="{MARK}"/><text x="{x}" y="{y}" dy="4">{numbers[key]}</text>'
        shapes.append(f'<g class="mark {look}" data-guid="{escape(key)}">{circle}</g>')
    return f'<svg viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}">{"".join(shapes)}</svg>'


def _shape(result: ElementResult, points: str) -> str:
    kind = "flat" if result.ifc_class in FLAT else "solid"
    title = escape(f"{result.ifc_class[3:]} {result.name}: {result.status.replace('_', ' ')}")
    look = f'class="{result.status} {kind}" points="{points}"'
    return f'<polygon data-guid="{escape(result.guid)}" {look}><title>{title}</title></polygon>'


def _points(outline: F64, low: F64, high: F64, scale: float) -> str:
    x, y = (outline[:, 0] - low[0]) * scale + MARK, (high[1] - outline[:, 1]) * scale + MARK
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
