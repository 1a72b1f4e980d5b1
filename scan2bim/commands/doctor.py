"""``scan2bim doctor``: check the installation."""

from __future__ import annotations

import dataclasses
import json
import sys
from argparse import Namespace

from scan2bim.doctor import examine, works
from scan2bim.views import write_line

MARKS = {"ok": "ok  ", "remark": "note", "fault": "FAIL"}


def run(options: Namespace) -> int:
    """Print what was found. 0 where ``convert`` works, else 1."""
    checks = examine()
    good = works(checks)
    if options.json:
        found = {"works": good, "checks": [dataclasses.asdict(check) for check in checks]}
        write_line(sys.stdout, json.dumps(found, indent=1))
        return 0 if good else 1
    for check in checks:
        write_line(sys.stdout, f"{MARKS[check.state]}  {check.name}: {check.text}")
    verdict = "convert works." if good else "convert does not work here: see the lines marked FAIL."
    remarks = sum(check.state == "remark" for check in checks)
    write_line(sys.stdout, f"\n{verdict}" + (f" Things to note: {remarks}." if remarks else ""))
    return 0 if good else 1
