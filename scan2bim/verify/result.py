"""What a verification found, as it is written to report.json. Metres and radians, in the model's own axes."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

REPORT_VERSION = "1.0"

Status = Literal["in_tolerance", "out_of_tolerance", "missing", "occluded", "not_enough_data", "not_applicable"]
STATUSES: tuple[Status, ...] = (
    "out_of_tolerance",
    "missing",
    "in_tolerance",
    "occluded",
    "not_enough_data",
    "not_applicable",
)
"""Worst first, as people want to read them."""
FAULTS: tuple[Status, ...] = ("out_of_tolerance", "missing")
Vector = tuple[float, float, float]
Loa = Literal["LOA10", "LOA20", "LOA30", "LOA40", "LOA50"]


class Record(BaseModel):
    """Frozen, and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Deviation(Record):
    """Of the measured surface, weighted by area: positive where it stands out of the drawn body."""

    median: float
    p95: float
    rmse: float
    within: float


class Fit(Record):
    """Best rigid motion from drawn to built: shift of the element's middle, turn about the vertical, tilt."""

    shift: Vector
    turn: float
    tilt: float
    residual: float


class FaceResult(Record):
    """A visible plane face: outward normal, middle, areas (m2), and the deviation of its measured part."""

    normal: Vector
    middle: Vector
    area: float
    measured: float
    median: float | None = None
    p95: float | None = None


class OpeningResult(Record):
    """A door or window beside what the scans show in its wall.

    finding: matched, moved, resized, other_swing (as drawn but hung otherwise), walled_up, unseen. shift: along the
    wall's u axis and up; width and height as built less as drawn. built_state: of the leaf; other_swing: an open leaf
    hangs at the other end, or swings to the other side.
    """

    finding: Literal["matched", "moved", "resized", "other_swing", "walled_up", "unseen"]
    host: str | None
    shift_along: float | None = None
    shift_up: float | None = None
    width_change: float | None = None
    height_change: float | None = None
    built_state: Literal["open", "ajar", "closed", "unknown"] = "unknown"
    other_swing: bool = False


class ElementResult(Record):
    """An element of the model. Shares are of the visible surface; loa is that measured at 95 %."""

    guid: str
    ifc_class: str
    name: str
    storey: str
    status: Status
    reason: str
    tolerance: float
    loa: Loa | None = None
    area: float = 0.0
    visible: float = 0.0
    measured: float = 0.0
    coverage: float | None = None
    occluded: float | None = None
    looked_through: float | None = None
    deviation: Deviation | None = None
    fit: Fit | None = None
    faces: tuple[FaceResult, ...] = ()
    opening: OpeningResult | None = None


class Addition(Record):
    """A group of points that no element explains: its box (lower, upper corner), points, guess of what it is."""

    id: str
    guess: Literal["wall", "slab", "column", "door", "window", "passage", "object"]
    storey: str
    lower: Vector
    upper: Vector
    points: int
    area: float
    sentence: str


class ScanPlacing(Record):
    """A scan's own residual against the model: motion that would fit it best, metres and radians, and whether its
    points were left out because it lies off while the others do not.
    """

    name: str
    shift: Vector
    turn: float
    residual: float
    left_out: bool


class Placing(Record):
    """How the model came to lie in the scans' coordinates.

    matrix: rows of the 4 x 4 rigid motion from the model's axes (metres) to the scans' coordinates (metres). explained:
    share of the scans' surface within 50 mm of the model. fit_shift, fit_turn: motion of the final fit on top of the
    stated placing; residual: robust root mean square of what it leaves. rival: share explained by the next best placing
    of an automatic alignment.
    """

    method: Literal["given", "map", "identity", "automatic"]
    matrix: tuple[tuple[float, float, float, float], ...]
    explained: float
    residual: float
    fit_shift: Vector
    fit_turn: float
    fitted: bool
    rival: float | None = None
    scans: tuple[ScanPlacing, ...] = ()
    notes: tuple[str, ...] = ()


class Report(Record):
    """The whole verification."""

    version: Literal["1.0"] = "1.0"
    program: str
    model_file: str
    model_name: str
    model_schema: str
    tolerance: float
    points: int
    unexplained_points: int
    placing: Placing
    elements: tuple[ElementResult, ...]
    additions: tuple[Addition, ...] = ()
    notes: tuple[str, ...] = ()

    def counts(self) -> dict[Status, int]:
        """How many elements have each status."""
        found = Counter(e.status for e in self.elements)
        return {status: found[status] for status in STATUSES}

    def faults(self) -> tuple[ElementResult, ...]:
        """Elements out of tolerance or missing."""
        return tuple(e for e in self.elements if e.status in FAULTS)


def dump_report(report: Report) -> str:
    """As JSON text."""
    return report.model_dump_json(indent=1)


def load_report(path: Path) -> Report:
    """Read what ``dump_report`` wrote."""
    return Report.model_validate_json(path.read_bytes())


def report_schema() -> str:
    """The JSON Schema of report.json."""
    schema = Report.model_json_schema(mode="serialization")
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
    return json.dumps(schema, indent=1, sort_keys=True) + "\n"
