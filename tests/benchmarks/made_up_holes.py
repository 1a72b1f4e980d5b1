"""Doors that join all rooms of a made-up storey, an entrance, and windows to the outside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from made_up_shapes import Hole, Piece, Stair, Style
from numpy.typing import NDArray
from shapely.geometry import Point, Polygon
from shapely.ops import substring

Rng = np.random.Generator

APART = 0.12
"""Metres that are left between two openings of a wall."""


def make_holes(
    pieces: Sequence[Piece], rooms: Sequence[Polygon], stair: Stair | None, ground: bool, style: Style, rng: Rng
) -> list[list[Hole]]:
    """Doors that join all rooms, an entrance on the ground, windows to the outside: for each wall its openings."""
    holes: list[list[Hole]] = [[] for _ in pieces]
    group = list(range(len(rooms)))
    spans = [span for number, piece in enumerate(pieces) for span in _spans(number, piece, rooms)]
    rng.shuffle(spans)
    for span in spans:
        if min(span.left, span.right) < 0 or span.left == span.right or _under_stair(pieces[span.wall], span, stair):
            continue
        joins = group[span.left] != group[span.right]
        door = _door(span, style, rng) if joins or rng.random() < 0.15 else None
        if door is not None and _is_free(door, holes[span.wall]):
            holes[span.wall].append(door)
            group = [group[span.left] if g == group[span.right] else g for g in group]
    entrance = ground
    for span in spans:
        if (span.left < 0) == (span.right < 0) or _under_stair(pieces[span.wall], span, stair):
            continue
        low = span.low
        if entrance and span.high - low > 1.3:
            holes[span.wall].append(Hole("door", low + 0.15, 1.01, 0.0, min(2.1, style.height - 0.12)))
            entrance, low = False, low + 1.5
        for window in _windows(low, span.high, style, rng):
            if _is_free(window, holes[span.wall]):
                holes[span.wall].append(window)
    return holes


@dataclass(frozen=True, slots=True)
class _Span:
    """A stretch of a wall's axis with the same rooms on both sides (-1: none)."""

    wall: int
    left: int
    right: int
    low: float
    high: float


def _spans(number: int, piece: Piece, rooms: Sequence[Polygon]) -> list[_Span]:
    start, end = np.array(piece.axis.coords[0]), np.array(piece.axis.coords[-1])
    along = (end - start) / piece.axis.length
    left = np.array([-along[1], along[0]]) * (piece.thickness / 2 + 0.15)
    places = np.arange(0.3, piece.axis.length - 0.3, 0.1)
    axis = [start + along * u for u in places]
    sides = [(_room_at(at + left, rooms), _room_at(at - left, rooms)) for at in axis]
    found: list[_Span] = []
    first = 0
    for i in range(1, len(places) + 1):
        if i == len(places) or sides[i] != sides[first]:
            if places[i - 1] - places[first] > 0.9:
                found.append(_Span(number, *sides[first], float(places[first]), float(places[i - 1])))
            first = i
    return found


def _room_at(place: NDArray[np.float64], rooms: Sequence[Polygon]) -> int:
    return next((i for i, room in enumerate(rooms) if room.contains(Point(place))), -1)


def _door(span: _Span, style: Style, rng: Rng) -> Hole | None:
    room = span.high - span.low
    width = float(rng.choice([0.7, 0.76, 0.8, 0.885, 0.9, 0.985, 1.01]))
    if rng.random() < 0.1 and room > 2.6:
        width = float(rng.choice([1.2, 1.5, 1.76, 1.8]))
    width = min(width, room - 0.2)
    if width < 0.62:
        return None
    edge = float(rng.choice([0.1, 0.12, 0.15]))
    low, high = span.low + edge, span.high - edge - width
    along = float(rng.choice([low, high, rng.uniform(min(low, high), max(low, high))]))
    return Hole("door" if rng.random() < 0.9 else "passage", along, width, 0.0, style.door_height)


def _windows(low: float, high: float, style: Style, rng: Rng) -> list[Hole]:
    room = high - low
    if room < 1.0:
        return []
    width = min(room - 0.3, float(rng.choice([0.6, 0.9, 1.2, 1.5, 1.8, 2.4])))
    french = rng.random() < 0.06
    count = 1 if room < 4 or rng.random() < 0.4 else 2
    found: list[Hole] = []
    for i in range(count):
        along = low + room * (i + 0.5) / count - width / 2 + float(rng.uniform(-0.1, 0.1))
        if rng.random() < 0.2 or along < low + 0.05 or along + width > high - 0.05:
            continue
        sill = (
            float(rng.choice([0.12, 0.2, 0.3]))
            if french
            else float(rng.uniform(1.2, 1.5))
            if width < 0.7
            else style.sill
        )
        head = min(style.height - 0.1, 2.2) if french else max(style.head, sill + 0.5)
        found.append(Hole("window", along, width, sill, head - sill))
    return found


def _is_free(hole: Hole, others: Sequence[Hole]) -> bool:
    return all(hole.along > o.along + o.width + APART or o.along > hole.along + hole.width + APART for o in others)


def _under_stair(piece: Piece, span: _Span, stair: Stair | None) -> bool:
    if stair is None:
        return False
    stretch = substring(piece.axis, span.low, span.high)
    return bool(stretch.buffer(0.6).intersects(stair.outline))
