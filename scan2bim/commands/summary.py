"""The result of a conversion in words and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from scan2bim.model.coverage import coverage_line, coverage_of, worst_scan_line
from scan2bim.model.elements import Building, Door, ScanSource, Storey, Window
from scan2bim.pipeline import Outcome
from scan2bim.planning import Plan, Request
from scan2bim.progress import about, several, size

COLUMNS = {
    "spaces": "spaces",
    "walls": "walls",
    "doors_open": "doors open",
    "doors_closed": "doors closed",
    "doors_unknown": "doors unknown",
    "windows": "windows",
    "passages": "passages",
}
"""Counts of a storey: name in JSON, heading of the table. A door that is ajar counts as open."""
OPTIONAL = ("doors_unknown",)
"""Columns that are left out where they are 0 throughout."""


def count_storey(storey: Storey) -> dict[str, int]:
    """How many of each column's things the storey holds."""
    fills = Counter(_kind(opening.fill) for wall in storey.walls for opening in wall.openings)
    counts = {"spaces": len(storey.spaces), "walls": len(storey.walls)}
    return counts | {name: fills[name] for name in COLUMNS if name not in counts}


def _kind(fill: Door | Window | None) -> str:
    if fill is None:
        return "passages"
    if isinstance(fill, Window):
        return "windows"
    return {"open": "doors_open", "ajar": "doors_open", "closed": "doors_closed"}.get(fill.state, "doors_unknown")


def outcome_text(outcome: Outcome) -> str:
    """A table of the storeys, the notes, and the files."""
    building = outcome.building
    counts = [count_storey(storey) for storey in building.storeys]
    columns = [name for name in COLUMNS if name not in OPTIONAL or any(row[name] for row in counts)]
    rows = [["storey", "elevation", *(COLUMNS[name] for name in columns)]]
    for storey, row in zip(building.storeys, counts, strict=True):
        rows.append([storey.name, f"{storey.elevation.value:.2f} m", *(str(row[name]) for name in columns)])
    if len(counts) > 1:
        rows.append(["all", "", *(str(sum(row[name] for row in counts)) for name in columns)])
    lines = [
        f"{building.name}: {several(outcome.scans, 'scan')}, {several(outcome.points, 'point')}",
        "",
        *table(rows),
        "",
    ]
    if covered := coverage_line(building):
        lines += [f"coverage: {covered}"]
    if worst := worst_scan_line(building):
        lines += [f"warning: {worst}"]
    lines += [f"note: {note}" for note in building.notes]
    lines += [f"note: {', '.join(names)}: {note}" for note, names in _notes_of_files(outcome).items()]
    lines += [f"wrote {written.path} ({size(written.size)})" for written in outcome.written]
    return "\n".join(lines)


def _notes_of_files(outcome: Outcome) -> dict[str, list[str]]:
    """What the exporters left out, each note once, with the files that it is about."""
    notes: dict[str, list[str]] = {}
    for written in outcome.written:
        for note in written.notes:
            notes.setdefault(note, []).append(written.path.name)
    return notes


def outcome_json(outcome: Outcome, request: Request) -> dict[str, Any]:
    """The same for programs."""
    building = outcome.building
    return {
        "building": {"id": building.id, "name": building.name},
        "scans": outcome.scans,
        "points": outcome.points,
        "skipped": list(outcome.skipped),
        "storeys": [
            {"id": s.id, "name": s.name, "elevation": s.elevation.value, **count_storey(s)} for s in building.storeys
        ],
        "coverage": _coverage_json(building),
        "scan_residuals": [_residual_json(scan) for scan in building.scans],
        "notes": list(building.notes),
        "files": [{"path": str(w.path), "bytes": w.size, "notes": list(w.notes)} for w in outcome.written],
        "stages": [
            {"stage": run.name, "made": run.made, "kept": run.kept, "seconds": round(run.seconds, 3)}
            for run in outcome.stages
        ],
        "work": str(request.work),
    }


def _coverage_json(building: Building) -> dict[str, Any] | None:
    """Shares of the faces that bound spaces; None where they are not known."""
    found = coverage_of(building)
    return None if found is None else asdict(found)


def _residual_json(scan: ScanSource) -> dict[str, Any]:
    """How far a scan lies off the others, metres; null where that is not known."""
    residual = None if scan.residual is None else scan.residual.model_dump(mode="json")
    return {"id": scan.id, "name": scan.name, "residual": residual}


def plan_text(plan: Plan, request: Request) -> str:
    """What a run would do, in words."""
    rows = [["stage", "to run", "kept", "time"]]
    rows += [[run.name, str(run.made), str(run.kept), about(run.seconds) if run.made else "-"] for run in plan.stages]
    lines = [
        f"{several(plan.scans, 'scan')}, {several(plan.points, 'point')}, work folder {request.work}",
        "",
        *table(rows),
        "",
    ]
    lines += [f"left out: {text}" for text in plan.skipped]
    needs = f"about {about(plan.needs.seconds)}, {size(plan.needs.memory)} of memory, {size(plan.needs.disk)} of disk"
    lines.append(f"would take {needs} ({size(plan.free_disk)} free)")
    lines += [f"would write {output}" for output in request.outputs]
    return "\n".join(lines)


def plan_json(plan: Plan, request: Request) -> dict[str, Any]:
    """The same for programs."""
    return {
        "scans": plan.scans,
        "points": plan.points,
        "skipped": list(plan.skipped),
        "stages": [
            {"stage": run.name, "to_run": run.made, "kept": run.kept, "seconds": round(run.seconds, 1)}
            for run in plan.stages
        ],
        "seconds": round(plan.needs.seconds, 1),
        "memory_bytes": round(plan.needs.memory),
        "disk_bytes": round(plan.needs.disk),
        "free_disk_bytes": round(plan.free_disk),
        "outputs": [str(output) for output in request.outputs],
        "work": str(request.work),
    }


def table(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> list[str]:
    """Columns aligned, those of ``left`` to the left, the others to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
