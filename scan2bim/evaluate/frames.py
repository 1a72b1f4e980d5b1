"""Bringing a model into the truth's coordinates: as it stands, or by its own map conversion."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from scan2bim.truth.ifc import IfcReading
from scan2bim.truth.values import OpeningTruth, Point2, Truth

F64 = NDArray[np.float64]
T = TypeVar("T", bound=OpeningTruth)


def in_frame_of(truth: Truth, reading: IfcReading) -> tuple[Truth, str]:
    """What the model says in the truth's coordinates, and how it came there: of both ways the one that lies nearer."""
    plain = reading.truth
    conversion = reading.model.map_conversion()
    if conversion is None:
        return plain, "as it stands"
    mapped = moved(plain, conversion)
    apart, apart_mapped = _apart(truth, plain), _apart(truth, mapped)
    return (mapped, "by its map conversion") if apart_mapped < apart else (plain, "as it stands")


def _apart(a: Truth, b: Truth) -> float:
    """Metres between the middles of both buildings; infinite where one has nothing."""
    first, second = _middle(a), _middle(b)
    return float("inf") if first is None or second is None else float(np.linalg.norm(first - second))


def _middle(truth: Truth) -> F64 | None:
    points = [p for wall in truth.walls for p in ((*wall.start, wall.base), (*wall.end, wall.base))]
    points += [p for one in (*truth.doors, *truth.windows) for p in one.corners]
    return (np.min(points, axis=0) + np.max(points, axis=0)) / 2 if points else None


def moved(truth: Truth, matrix: F64) -> Truth:
    """The truth turned about z and moved by a (4, 4) matrix."""

    def in_space(point: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = (matrix[:3, :3] @ np.array(point) + matrix[:3, 3]).tolist()
        return x, y, z

    def in_plan(point: Point2) -> Point2:
        return in_space((*point, 0.0))[:2]

    up = float(matrix[2, 3])
    return truth.model_copy(
        update={
            "storeys": tuple(s.model_copy(update={"elevation": s.elevation + up}) for s in truth.storeys),
            "walls": tuple(
                w.model_copy(update={"start": in_plan(w.start), "end": in_plan(w.end), "base": w.base + up})
                for w in truth.walls
            ),
            "doors": _moved_openings(truth.doors, in_space),
            "windows": _moved_openings(truth.windows, in_space),
            "openings": _moved_openings(truth.openings, in_space),
            "spaces": tuple(
                s.model_copy(
                    update={
                        "outline": tuple(in_plan(p) for p in s.outline),
                        "holes": tuple(tuple(in_plan(p) for p in hole) for hole in s.holes),
                        "base": s.base + up,
                    }
                )
                for s in truth.spaces
            ),
        }
    )


def _moved_openings(
    openings: tuple[T, ...], move: Callable[[tuple[float, float, float]], tuple[float, float, float]]
) -> tuple[T, ...]:
    return tuple(o.model_copy(update={"corners": tuple(move(c) for c in o.corners)}) for o in openings)
