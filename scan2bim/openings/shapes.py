"""What the openings stage finds, as plain values, and its JSON form in the work folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True)
class OpeningShape:
    """A rectangular opening of wall ``wall`` of storey ``storey``: ``offset`` along its axis from its start to the nearer jamb, ``sill`` over
    the wall's base, ``width`` and ``height``, metres, each with its sigma, or None where assumed.

    ``looked_through`` is the share of the rectangle that stations looked through, ``jambs`` how many of its sides show a reveal,
    ``lintel`` whether wall was seen above it, ``points`` on its reveals, ``stations`` that looked through.
    """

    storey: int
    wall: int
    kind: Literal["door", "window", "passage"]
    state: Literal["open", "ajar", "closed", "unknown"]
    offset: float
    sill: float
    width: float
    height: float
    width_sigma: float | None
    height_sigma: float | None
    looked_through: float
    jambs: int
    lintel: bool
    points: int
    stations: tuple[int, ...]
    confidence: float


def save_openings(openings: Sequence[OpeningShape], path: Path) -> None:
    """Write as JSON."""
    path.write_text(json.dumps([asdict(o) for o in openings]), encoding="utf-8")


def load_openings(path: Path) -> tuple[OpeningShape, ...]:
    """Read what ``save_openings`` wrote."""
    return tuple(OpeningShape(**(d | {"stations": tuple(d["stations"])})) for d in json.loads(path.read_text(encoding="utf-8")))
