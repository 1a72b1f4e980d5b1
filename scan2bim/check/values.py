"""What a check finds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of an element. check: short name of what was looked at. amount: how much, in ``unit`` ("" for none)."""

    check: str
    guid: str
    name: str
    ifc_class: str
    text: str
    amount: float | None = None
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    """All findings of a file, in the order of the checks, and what could not be looked at."""

    file: str
    schema: str
    elements: int
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
