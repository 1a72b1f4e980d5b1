"""Walls as the CV4AEC challenge scores them: the corners of their boxes, and the overlap of the boxes.

Storey by storey, the eight corners of all walls are paired one to one so that the distances add up to least; a pair
within a threshold is right. Each true wall's box counts with its overlap (intersection over union) with the predicted
box that an assignment of greatest sum gives it, 0 without one. Figures are means over the storeys.

The challenge's published code measures a distance along x alone, sets the corners of oblique walls off in a direction
that is not theirs, and takes walls half as high as they are. Here distances are Euclidean, corners lie across the
wall, and walls have their height. Ours, too: corners in plan alone, as models differ in how far walls reach into
slabs; and ends that lie in another wall are drawn to its axis first, in the truth and in the model, as location lines
meet in the challenge's models whatever the bodies do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scan2bim.evaluate.openings import Value
from scan2bim.truth.values import StoreyTruth, WallTruth

F64 = NDArray[np.float64]

WITHIN = (0.05, 0.10, 0.20)
"""Metres between two corners that are the same: the challenge's thresholds."""
SLACK = 0.05
"""Metres beyond another wall's body from which on an end does not meet it."""
CROSSING = 0.17
"""Sine of the least angle, 10 degrees, at which two walls meet."""


class CornerScore(Value):
    """Of the corners within a distance: matched over predicted, matched over true, harmonic mean of both."""

    within: float
    precision: float
    recall: float
    f1: float


class BoxScores(Value):
    """Means over the storeys that have walls. space: of the eight corners of each box; plan: of the four; iou: of the
    boxes, plan_iou of what they cover in plan; None where the truth has no walls.
    """

    space: tuple[CornerScore, ...]
    plan: tuple[CornerScore, ...]
    iou: float | None
    plan_iou: float | None


def score_boxes(
    true: Sequence[WallTruth], predicted: Sequence[WallTruth], storeys: Sequence[StoreyTruth], unseen: frozenset[str]
) -> BoxScores:
    """Score the walls. ``unseen``: names of the true ones that nobody could see, which count neither way."""
    found = [
        _score_storey(mine, theirs, unseen)
        for mine, theirs in _by_storey(met_at_axes(true), met_at_axes(predicted), storeys)
        if any(wall.name not in unseen for wall in mine)
    ]
    if not found:
        return BoxScores(space=(), plan=(), iou=None, plan_iou=None)
    space, plan, ious, plan_ious = zip(*found, strict=True)
    return BoxScores(
        space=_means(space), plan=_means(plan), iou=float(np.mean(ious)), plan_iou=float(np.mean(plan_ious))
    )


def _by_storey(
    true: Sequence[WallTruth], predicted: Sequence[WallTruth], storeys: Sequence[StoreyTruth]
) -> list[tuple[list[WallTruth], list[WallTruth]]]:
    """Walls of each storey: by the elevation nearest to their foot."""
    levels = np.array([s.elevation for s in storeys] or [0.0])
    used = np.array([levels[np.abs(levels - wall.base).argmin()] for wall in true])
    with_walls = np.unique(used) if len(true) else levels
    groups: list[tuple[list[WallTruth], list[WallTruth]]] = [([], []) for _ in with_walls]
    for side, walls in enumerate((true, predicted)):
        for wall in walls:
            groups[int(np.abs(with_walls - wall.base).argmin())][side].append(wall)
    return groups


def met_at_axes(walls: Sequence[WallTruth]) -> list[WallTruth]:
    """The walls with each end that lies in another wall's body moved along its own axis onto the other's axis."""
    axes = np.array([(w.start, w.end) for w in walls], np.float64).reshape(-1, 2, 2)
    length = np.maximum(np.linalg.norm(axes[:, 1] - axes[:, 0], axis=1), 1e-9)
    along = (axes[:, 1] - axes[:, 0]) / length[:, None]
    half = np.array([w.thickness / 2 for w in walls])
    low = np.array([w.base for w in walls])
    high = low + [w.height for w in walls]
    moved = axes.copy()
    for i in range(len(walls)):
        across = along[i, 0] * along[:, 1] - along[i, 1] * along[:, 0]
        beside = (np.abs(across) > CROSSING) & (np.minimum(high, high[i]) > np.maximum(low, low[i]))
        for end in (0, 1):
            offset = axes[i, end] - axes[:, 0]
            off = along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]
            on = (offset * along).sum(axis=1)
            inside = (np.abs(off) <= half + SLACK) & (on >= -half[i] - SLACK) & (on <= length + half[i] + SLACK)
            meets = np.flatnonzero(beside & inside)
            if len(meets):
                steps = off[meets] / across[meets]
                moved[i, end] = axes[i, end] + along[i] * steps[np.abs(steps).argmin()]
    return [
        w.model_copy(update={"start": tuple(a.tolist()), "end": tuple(b.tolist())})
        for w, (a, b) in zip(walls, moved, strict=True)
    ]


def _score_storey(
    true: Sequence[WallTruth], predicted: Sequence[WallTruth], unseen: frozenset[str]
) -> tuple[tuple[CornerScore, ...], tuple[CornerScore, ...], float, float]:
    mine, theirs = _outlines(true), _outlines(predicted)
    asked = np.array([wall.name not in unseen for wall in true])
    heights = [np.array([(w.base, w.base + w.height) for w in walls]).reshape(-1, 2) for walls in (true, predicted)]
    boxes = [_corners(outline, height) for outline, height in zip((mine, theirs), heights, strict=True)]
    plan_iou, iou = _overlaps(mine, theirs, *heights)
    return (
        _score_corners(boxes[0], boxes[1], asked),
        _score_corners(mine, theirs, asked),
        _best(iou, asked),
        _best(plan_iou, asked),
    )


def _outlines(walls: Sequence[WallTruth]) -> F64:
    """(n, 4, 2) corners of the walls in plan, in turn."""
    ends = np.array([(w.start, w.end) for w in walls], np.float64).reshape(-1, 2, 2)
    start, end = ends[:, 0], ends[:, 1]
    along = (end - start) / np.maximum(np.linalg.norm(end - start, axis=1), 1e-9)[:, None]
    half = np.array([w.thickness / 2 for w in walls]).reshape(-1, 1)
    across = np.column_stack([-along[:, 1], along[:, 0]]) * half
    return np.stack([start + across, start - across, end - across, end + across], axis=1)


def _corners(outlines: F64, heights: F64) -> F64:
    """(n, 8, 3) corners of the boxes over the outlines (n, 4, 2) between two heights (n, 2)."""
    levels = np.repeat(heights, 4, axis=1)[:, :, None]
    return np.concatenate([np.tile(outlines, (1, 2, 1)), levels], axis=2)


def _score_corners(true: F64, predicted: F64, asked: NDArray[np.bool_]) -> tuple[CornerScore, ...]:
    """Of the corners (n, k, 2 or 3) of true and predicted walls. ``asked`` (n,): walls to be found."""
    mine, theirs = true.reshape(-1, true.shape[2]), predicted.reshape(-1, true.shape[2])
    wanted = np.repeat(asked, true.shape[1])
    apart = np.linalg.norm(mine[:, None] - theirs, axis=2)
    rows, columns = linear_sum_assignment(apart)
    distances, counts = apart[rows, columns], wanted[rows]
    scores: list[CornerScore] = []
    for within in WITHIN:
        matched = int((distances[counts] < within).sum())
        aside = int((distances[~counts] < within).sum())
        recall = matched / max(int(wanted.sum()), 1)
        precision = matched / max(len(theirs) - aside, 1)
        f1 = 2 * precision * recall / (precision + recall) if matched else 0.0
        scores.append(CornerScore(within=within, precision=precision, recall=recall, f1=f1))
    return tuple(scores)


def _overlaps(true: F64, predicted: F64, true_heights: F64, heights: F64) -> tuple[F64, F64]:
    """Intersection over union (n, m) in plan and in space of walls by outlines (n, 4, 2) and heights (n, 2)."""
    mine, theirs = (np.asarray(shapely.polygons(outlines), object) for outlines in (true, predicted))
    area = np.asarray(shapely.area(shapely.intersection(mine[:, None], theirs[None])))
    own, other = np.asarray(shapely.area(mine))[:, None], np.asarray(shapely.area(theirs))[None]
    shared = np.minimum(true_heights[:, None, 1], heights[None, :, 1])
    shared = np.maximum(shared - np.maximum(true_heights[:, None, 0], heights[None, :, 0]), 0.0)
    volume, of_mine = area * shared, own * np.diff(true_heights, axis=1)
    of_theirs = other * np.diff(heights, axis=1).T
    return area / np.maximum(own + other - area, 1e-12), volume / np.maximum(of_mine + of_theirs - volume, 1e-12)


def _best(iou: F64, asked: NDArray[np.bool_]) -> float:
    """Mean over the walls to be found (n,) of their overlap in the assignment of greatest sum."""
    rows, columns = linear_sum_assignment(iou, maximize=True)
    each = np.zeros(len(iou))
    each[rows] = iou[rows, columns]
    return float(each[asked].mean())


def _means(storeys: Sequence[tuple[CornerScore, ...]]) -> tuple[CornerScore, ...]:
    """The mean of each threshold's figures."""
    return tuple(
        CornerScore(
            within=of[0].within,
            precision=float(np.mean([one.precision for one in of])),
            recall=float(np.mean([one.recall for one in of])),
            f1=float(np.mean([one.f1 for one in of])),
        )
        for of in zip(*storeys, strict=True)
    )
