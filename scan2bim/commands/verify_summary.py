"""The result of a verification in words and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scan2bim.progress import several, size
from scan2bim.verification import Verified
from scan2bim.verify.result import ElementResult

SHOWN = 20
"""Findings that the summary lists; the report has all."""


def verified_text(outcome: Verified, met: Sequence[str]) -> str:
    """Counts, the worst findings, and the files."""
    report = outcome.report
    place = report.placing
    lines = [
        f"{report.model_name}: {several(outcome.scans, 'scan')}, {several(report.points, 'point')}, tolerance "
        f"{1000 * report.tolerance:g} mm",
        f"placed by {place.method}: {100 * place.explained:.0f} % of the scanned surface within 5 cm of the model, "
        f"residual {1000 * place.residual:.1f} mm",
        "",
    ]
    lines += [f"{number:6}  {status.replace('_', ' ')}" for status, number in report.counts().items()]
    if report.additions:
        lines.append(f"{len(report.additions):6}  additions: groups of points that no element explains")
    faults = sorted(report.faults(), key=_worst)
    lines += ["", *(f"{e.status.replace('_', ' ')}: {e.ifc_class} {e.name}: {e.reason}" for e in faults[:SHOWN])]
    if len(faults) > SHOWN:
        lines.append(f"... and {len(faults) - SHOWN} more: see report.html")
    lines += [f"note: {note}" for note in (*place.notes, *report.notes)]
    lines += [f"note: {scan.name} lies off and was left out." for scan in place.scans if scan.left_out]
    lines += [f"wrote {path} ({size(path.stat().st_size)})" for path in outcome.written]
    lines += [f"fails on: {name}" for name in met]
    return "\n".join(lines)


def _worst(element: ElementResult) -> float:
    return -(element.deviation.p95 if element.deviation else 1.0)


def verified_json(outcome: Verified, met: Sequence[str]) -> dict[str, Any]:
    """The summary; the whole report is in report.json."""
    report = outcome.report
    return {
        "model": report.model_file,
        "points": report.points,
        "scans": outcome.scans,
        "placing": {"method": report.placing.method, "explained": report.placing.explained},
        "counts": report.counts(),
        "additions": len(report.additions),
        "fails_on": list(met),
        "files": [str(path) for path in outcome.written],
        "stages": [{"stage": s.name, "made": s.made, "kept": s.kept, "seconds": s.seconds} for s in outcome.stages],
    }
