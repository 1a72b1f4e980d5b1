"""The truth's JSON form."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.truth.values import TRUTH_FORMAT, Truth

UNITS = "metres, radians"
SHOWN_PROBLEMS = 3


def write_truth(path: Path, truth: Truth) -> None:
    """Write the truth as JSON; numbers are rounded to 0.01 mm. The file appears whole or not at all."""
    known = truth.model_dump(exclude={"walls": {"__all__": {"confidence"}}})
    document = {"format": TRUTH_FORMAT, "units": UNITS, **_rounded(known)}
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    part.replace(path)


def read_truth(path: Path) -> Truth:
    """The truth in a JSON file. Raises InputError with the first problems."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror}).") from error
    except ValueError as error:
        raise DamagedFileError(path, f"expected JSON, but {error}.") from error
    found = document.pop("format", None) if isinstance(document, dict) else None
    if found != TRUTH_FORMAT:
        raise InputError(
            path,
            f'expected a truth with "format": "{TRUTH_FORMAT}", got {found!r}.',
            "scan2bim simulate writes such files beside its scans.",
        )
    document.pop("units", None)
    try:
        return Truth.model_validate_json(json.dumps(document))
    except ValidationError as error:
        problems = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()[:SHOWN_PROBLEMS]]
        raise InputError(path, f"is no truth that this version can read: {'; '.join(problems)}.") from error


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return round(value, 5) if isinstance(value, float) else value
