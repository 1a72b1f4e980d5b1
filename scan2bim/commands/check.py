"""``scan2bim check``: the integrity of an IFC file."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from scan2bim.check.run import check_file
from scan2bim.check.values import Finding, Report

FAULTY = 1
"""Exit code where something was found."""


def run(options: Namespace) -> int:
    """Check the file; 0 where nothing was found."""
    report = check_file(Path(options.path))
    text = json.dumps(asdict(report), indent=2) if options.json else _text(report)
    sys.stdout.write(text + "\n")
    return FAULTY if report.findings else 0


def _text(report: Report) -> str:
    head = f"{report.file}: {report.schema}, {report.elements} elements and spaces"
    if not report.findings:
        return "\n".join([f"{head}, nothing found", *report.notes])
    counts = ", ".join(f"{count} {name}" for name, count in Counter(f.check for f in report.findings).most_common())
    lines = [_line(found) for found in report.findings]
    return "\n".join([f"{head}, {len(report.findings)} findings: {counts}", *lines, *report.notes])


def _line(found: Finding) -> str:
    amount = "" if found.amount is None else f" ({found.amount:g} {found.unit})".replace(" )", ")")
    return f"{found.guid} {found.ifc_class} {found.name!r}: {found.check}: {found.text}{amount}"
