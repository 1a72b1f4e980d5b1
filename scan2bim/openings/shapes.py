"""What the openings stage finds, as plain values, and its JSON form in the work folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter

Kind = Literal["door", "window", "passage"]
NOT_HIDDEN = (0.0, 0.0, 0.0, 0.0)
"""All four sides were seen."""


@dataclass(frozen=True, slots=True)
class OpeningShape:
    """A rectangular opening of wall ``wall`` of storey ``storey``: ``offset`` along its axis from its start to the
    nearer jamb, ``sill`` over the wall's base, ``width`` and ``height``, metres, each with its sigma, or None where
    assumed.

    ``looked_through`` is the share of the rectangle that stations looked through, ``jambs`` how many of its jambs show
    a reveal, ``lintel`` whether wall was seen above it, ``sides`` how many of the four have the wall's face beside them
    (0 of those found closed); ``points`` on its reveals, ``stations`` that looked through; ``angle`` (radians from
    closed), ``hinge`` and ``swing`` side of its leaf, where one was seen. ``leaves`` how many; ``glazed`` whether rays
    went through the closed leaf; ``recess`` metres from the face on the ``recess_side`` in to the closed leaf;
    ``handle_height`` over the base; ``words`` the evidence for a closed door; ``hidden`` how
    far outwards its left, right, lower and upper side may lie, metres, where something hid them, else 0; ``lining``
    width of the lining that shows flush with the wall round a window; ``bars`` middles of its upright bars, metres
    from the wall's start.
    """

    storey: int
    wall: int
    kind: Kind
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
    angle: float | None = None
    hinge: Literal["start", "end", "unknown"] = "unknown"
    swing: Literal["left", "right", "unknown"] = "unknown"
    leaves: int | None = None
    recess: float | None = None
    recess_side: Literal["left", "right", "unknown"] = "unknown"
    handle_height: float | None = None
    words: tuple[str, ...] = ()
    sides: int = 0
    glazed: bool | None = None
    hidden: tuple[float, float, float, float] = NOT_HIDDEN
    lining: float | None = None
    bars: tuple[float, ...] = ()


def save_openings(openings: Sequence[OpeningShape], path: Path) -> None:
    """Write as JSON."""
    path.write_bytes(_adapter().dump_json(tuple(openings)))


def load_openings(path: Path) -> tuple[OpeningShape, ...]:
    """Read what ``save_openings`` wrote."""
    return _adapter().validate_json(path.read_bytes())


@cache
def _adapter() -> TypeAdapter[tuple[OpeningShape, ...]]:
    return TypeAdapter(tuple[OpeningShape, ...])
