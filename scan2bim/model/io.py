"""The model's own file: JSON, lossless, the same bytes for the same model, refused where anything in it is unknown."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.model.elements import MODEL_VERSION, Building
from scan2bim.model.queries import everything

SCHEMA_FILE = f"building-{MODEL_VERSION}.schema.json"
"""The published schema's name in ``scan2bim/schemas``."""

SHOWN_PROBLEMS = 5
"""More problems than this in one message help nobody."""


def dump_building(building: Building) -> str:
    """The model as JSON text: keys in the contract's order, floats in the shortest form that reads back."""
    return building.model_dump_json(indent=1) + "\n"


def load_building(path: Path) -> Building:
    """The model in a JSON file.

    Raises InputError (DamagedFileError where it is not even JSON) with the first problems and where in the file they
    are.
    """
    path = Path(path)
    text = _read(path)
    _check_version(path, _parse(path, text))
    try:
        building = Building.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise InputError(path, _in_words(error), "Compare it with the schema (scan2bim/schemas).") from error
    _check_ids(path, building)
    return building


def schema() -> dict[str, Any]:
    """The JSON Schema (Draft 2020-12) of the model's file."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:scan2bim:building:{MODEL_VERSION}",
        **Building.model_json_schema(mode="validation"),
    }


def schema_text() -> str:
    """The published schema file's content."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


def _read(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DamagedFileError(path, f"expected a model as UTF-8 JSON, byte {error.start} is not UTF-8.") from error
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror or error}.", "Give the model's JSON file.") from error


def _parse(path: Path, text: str) -> object:
    try:
        return json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        problem = f"expected a model as JSON, line {error.lineno} column {error.colno}: {error.msg}."
        raise DamagedFileError(path, problem, "Write the model again.") from error
    except (ValueError, RecursionError) as error:
        raise DamagedFileError(path, f"expected a model as JSON: {error}.", "Write the model again.") from error


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    out = dict(pairs)
    if len(out) != len(pairs):
        key = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"the key {key!r} stands twice in one object")
    return out


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON number")


def _check_version(path: Path, data: object) -> None:
    if not isinstance(data, dict):
        raise InputError(path, f"expected a model (a JSON object), got a JSON {type(data).__name__}.")
    version = data.get("version", MODEL_VERSION)
    if version != MODEL_VERSION:
        advice = "Make the model again with this program, or read it with the one that wrote it."
        raise InputError(path, f"expected a model of version {MODEL_VERSION}, got version {version!r}.", advice)


def _in_words(error: ValidationError) -> str:
    problems = [f"{_place(p['loc'])}: {p['msg']}" for p in error.errors(include_url=False)]
    more = len(problems) - SHOWN_PROBLEMS
    shown = "; ".join(problems[:SHOWN_PROBLEMS]) + (f"; and {more} more" if more > 0 else "")
    return f"not a model of version {MODEL_VERSION}: {shown}."


def _place(loc: tuple[int | str, ...]) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".") or "the model"


def _check_ids(path: Path, building: Building) -> None:
    repeated = [name for name, count in Counter(_ids(building)).items() if count > 1]
    if repeated:
        raise InputError(
            path, f"the id {repeated[0]!r} stands for more than one thing.", "Give each element its own id."
        )


def _ids(building: Building) -> Iterator[str]:
    for thing in everything(building):
        yield thing.id
