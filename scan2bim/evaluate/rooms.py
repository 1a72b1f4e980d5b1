"""Walls, spaces and storeys: how much of the true ones the model has, and how exactly."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from shapely.geometry import LineString, Polygon

from scan2bim.evaluate.openings import Detection, Value
from scan2bim.truth.values import SpaceTruth, StoreyTruth, WallTruth

F64 = NDArray[np.float64]

STEP = 0.05
"""Metres between the places on centre lines that are compared."""
SAME_ROOM = 0.7
"""IoU in plan from which on a space counts as found."""
SAME_STOREY = 0.5
"""Metres between elevations."""
SAME_HEIGHT = 0.5
"""Share of the lower one's height that two walls or spaces must share to be compared."""


class WallScores(Value):
    """Shares of the centre lines' length: of the true ones that the model has (completeness), of the model's that are
    true (correctness). thickness_error: median over the true walls that were found, metres.
    """

    true: int
    predicted: int
    completeness_5cm: float | None
    correctness_5cm: float | None
    completeness_10cm: float | None
    correctness_10cm: float | None
    thickness_error: float | None


class SpaceScores(Value):
    """area_error, area_share and height_error: medians over the found ones, square metres, of the true area, metres."""

    detection: Detection
    mean_iou: float | None
    area_error: float | None
    area_share: float | None
    height_error: float | None


class StoreyScores(Value):
    """elevation_error: mean over the found ones, metres."""

    detection: Detection
    elevation_error: float | None


def score_walls(
    true: Sequence[WallTruth], predicted: Sequence[WallTruth], whole: Sequence[WallTruth] | None = None
) -> WallScores:
    """Walls by their centre lines. ``whole``: with those that nobody saw, which a model may have all the same."""
    all_true = true if whole is None else whole
    return WallScores(
        true=len(true),
        predicted=len(predicted),
        completeness_5cm=_covered(true, predicted, 0.05),
        correctness_5cm=_covered(predicted, all_true, 0.05),
        completeness_10cm=_covered(true, predicted, 0.1),
        correctness_10cm=_covered(predicted, all_true, 0.1),
        thickness_error=_thickness_error(true, predicted),
    )


def _covered(walls: Sequence[WallTruth], others: Sequence[WallTruth], within: float) -> float | None:
    """Share of the walls' length that lies within some metres of another's centre line at the same height."""
    near: list[NDArray[np.bool_]] = []
    for wall in walls:
        beside = [LineString([o.start, o.end]) for o in others if _share_height(wall, o)]
        points = _samples(wall)
        apart = shapely.distance(shapely.points(points), shapely.MultiLineString(beside))
        # An empty line is no number away.
        near.append(np.asarray(np.nan_to_num(np.asarray(apart), nan=np.inf) <= within))
    return float(np.concatenate(near).mean()) if near else None


def _samples(wall: WallTruth) -> F64:
    line = LineString([wall.start, wall.end])
    return shapely.get_coordinates(shapely.line_interpolate_point(line, np.arange(STEP / 2, line.length, STEP)))


def _share_height(a: WallTruth | SpaceTruth, b: WallTruth | SpaceTruth) -> bool:
    shared = min(a.base + a.height, b.base + b.height) - max(a.base, b.base)
    return shared >= SAME_HEIGHT * min(a.height, b.height)


def _thickness_error(true: Sequence[WallTruth], predicted: Sequence[WallTruth]) -> float | None:
    """Each true wall against the predicted one that covers most of it."""
    found: list[float] = []
    for wall in true:
        points = shapely.points(_samples(wall))
        shares = [
            (float((shapely.distance(points, LineString([o.start, o.end])) <= 0.1).mean()), o)
            for o in predicted
            if _share_height(wall, o)
        ]
        best = max(shares, key=lambda pair: pair[0], default=(0.0, wall))
        if best[0] > 0.3:
            found.append(abs(best[1].thickness - wall.thickness))
    return float(np.median(found)) if found else None


def score_spaces(
    true: Sequence[SpaceTruth], predicted: Sequence[SpaceTruth], scanned: Collection[str] | None = None
) -> SpaceScores:
    """Spaces by their outlines. ``scanned``: names of the true ones to be found; the others count neither way."""
    mine, theirs = [_polygon(s) for s in true], [_polygon(s) for s in predicted]
    iou = np.zeros((len(true), len(predicted)))
    for i, a in enumerate(mine):
        for j, b in enumerate(theirs):
            if _share_height(true[i], predicted[j]):
                shared = a.intersection(b).area
                iou[i, j] = shared / max(a.area + b.area - shared, 1e-9)
    rows, columns = linear_sum_assignment(-iou)
    pairs = [(i, j) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if iou[i, j] >= SAME_ROOM]
    asked = [one.name in scanned if scanned is not None else True for one in true]
    aside = sum(not asked[i] for i, _ in pairs)
    pairs = [(i, j) for i, j in pairs if asked[i]]
    n = len(pairs)
    off = np.array([abs(true[i].area - predicted[j].area) for i, j in pairs])
    areas = np.array([true[i].area for i, _ in pairs])
    return SpaceScores(
        detection=Detection(found=n, true=sum(asked), right=n, predicted=len(predicted) - aside),
        mean_iou=float(np.mean([iou[p] for p in pairs])) if pairs else None,
        area_error=float(np.median(off)) if pairs else None,
        area_share=float(np.median(off / areas)) if pairs else None,
        height_error=float(np.median([abs(true[i].height - predicted[j].height) for i, j in pairs])) if pairs else None,
    )


def _polygon(space: SpaceTruth) -> shapely.geometry.base.BaseGeometry:
    return shapely.make_valid(Polygon(space.outline, space.holes))


def score_storeys(true: Sequence[StoreyTruth], predicted: Sequence[StoreyTruth]) -> StoreyScores:
    """Storeys by the elevation of their floor."""
    apart = np.array([[abs(a.elevation - b.elevation) for b in predicted] for a in true]).reshape(
        len(true), len(predicted)
    )
    rows, columns = linear_sum_assignment(np.minimum(apart, SAME_STOREY))
    errors = [apart[p] for p in zip(rows.tolist(), columns.tolist(), strict=True) if apart[p] < SAME_STOREY]
    n = len(errors)
    return StoreyScores(
        detection=Detection(found=n, true=len(true), right=n, predicted=len(predicted)),
        elevation_error=float(np.mean(errors)) if errors else None,
    )
