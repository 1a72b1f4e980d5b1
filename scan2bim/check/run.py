"""All checks of a file."""

from __future__ import annotations

from pathlib import Path

from scan2bim.check.hosting import check_hosting
from scan2bim.check.levels import check_levels
from scan2bim.check.model import Model, read_model
from scan2bim.check.records import check_records
from scan2bim.check.spaces import check_spaces
from scan2bim.check.values import Report
from scan2bim.check.walls import check_walls


def check_file(path: Path) -> Report:
    """What is wrong in an IFC file. Raises InputError where it cannot be read."""
    return check_model(read_model(path))


def check_model(model: Model) -> Report:
    """What is wrong in a file that has been read."""
    checks = (check_hosting, check_walls, check_levels, check_spaces, check_records)
    findings = tuple(found for check in checks for found in check(model))
    bare = sum(part.body is None and bool(part.entity.Representation) for part in model.parts.values())
    notes = (f"{bare} elements have no body that could be made.",) if bare else ()
    return Report(str(model.path), model.file.schema_identifier, len(model.parts), findings, notes)
