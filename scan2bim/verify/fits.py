"""From the deviations of an element's cells: what hangs on its faces, its statistics, its best-fit shift and turn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

ATTACHED = 0.015
"""Metres before a face's plane from which on something is fixed to it or stands before it: trims, skirtings, pictures.
Plaster seldom bulges so much against its own plane."""
UPRIGHT = 0.5
"""Largest vertical part of the normal of a face that things stand before: floors are raised as a whole."""
CLOSE = 0.008
"""Half-width of a plane's inliers, metres: three times the noise of a cell's mean with registration."""
SHARP = 0.004
"""Metres within which cells speak for a tried plane: of a wall and a board 17 mm before it both lie on neither side of
a plane that slants between them.
"""
STEEPEST = 0.08
"""Slope of a face's deviation above which it is no turned face but another thing: 4.6 degrees."""
TRIALS = 96
"""Planes tried on a face: with 40 % inliers one in 16 triples is clean."""
SAMPLE = 300
"""Cells that a trial is judged by."""
FLAT = 0.35
"""Share of a face's cells on one plane from which on the face is taken as a plane."""
BEHIND = 0.10
"""Share of a face's cells that must lie where it is drawn, behind a plane that most lie on, for that plane to be of a
board or wardrobe that stands before it: what stands before a face hides most of it, and nothing shows through it.
"""
LEAST_CELLS = 6
OBSERVED = 0.02
"""Share of the measured surface that must bear a direction of motion for it to be told."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The measured cells (k,) of one element: face, middle and normal (k, 3), deviation and mean square (metres, m2),
    area (m2), and place (k, 2) in the face's plane, metres.
    """

    face: NDArray[np.int32]
    middle: F64
    normal: F64
    deviation: F64
    square: F64
    area: F64
    place: F64

    def pick(self, which: Mask) -> Cells:
        """Some of them."""
        return Cells(
            self.face[which],
            self.middle[which],
            self.normal[which],
            self.deviation[which],
            self.square[which],
            self.area[which],
            self.place[which],
        )


@dataclass(frozen=True, slots=True)
class Statistics:
    """Of signed deviations, metres, weighted by area: positive where the scanned surface stands out of the drawn body.

    median, p95 of the magnitude, rmse with the noise of the points, within: share of the area within the tolerance.
    """

    median: float
    p95: float
    rmse: float
    within: float


@dataclass(frozen=True, slots=True)
class Motion:
    """Best-fit rigid motion from drawn to built: shift (3,) metres of the element's middle, turn (radians) about the
    vertical through it, tilt (radians) about level axes. residual: root mean square of what it leaves, metres.
    """

    shift: tuple[float, float, float]
    turn: float
    tilt: float
    residual: float

    @property
    def length(self) -> float:
        """Of the shift, metres."""
        return math.hypot(*self.shift)


def own_surface(cells: Cells) -> tuple[Mask, Mask]:
    """Which cells (k,) show the element itself and not what hangs on it, and which of these lie on their face's
    plane.
    """
    own = np.ones(len(cells.face), bool)
    on_plane = np.ones(len(cells.face), bool)
    for face in np.unique(cells.face):
        mine = np.flatnonzero(cells.face == face)
        if len(mine) < LEAST_CELLS:
            continue
        plane = robust_plane(cells.place[mine], cells.deviation[mine])
        if plane is None:
            continue
        if abs(cells.normal[mine[0], 2]) < UPRIGHT:
            plane = _behind(cells.place[mine], cells.deviation[mine], plane)
        rest = cells.deviation[mine] - plane[0] - cells.place[mine] @ plane[1:]
        own[mine] = rest < ATTACHED
        on_plane[mine] = np.abs(rest) < ATTACHED
    return own, on_plane & own


def _behind(place: F64, deviation: F64, plane: F64) -> F64:
    """The plane of the deviations (k,) that lie where the face is drawn, behind the one that most lie on; the given
    ``plane`` where there is none.
    """
    rest = deviation - plane[0] - place @ plane[1:]
    behind = (rest < -ATTACHED) & (np.abs(deviation) < CLOSE)
    if behind.sum() < max(LEAST_CELLS, BEHIND * len(place)):
        return plane
    deeper = robust_plane(place[behind], deviation[behind])
    return plane if deeper is None else deeper


def robust_plane(place: F64, deviation: F64) -> F64 | None:
    """Offset and slopes (3,) of the plane that most deviations (k,) over places (k, 2) lie on, None if few do."""
    rng = np.random.default_rng(0)
    some = rng.choice(len(place), min(len(place), SAMPLE), replace=False)
    sample = np.column_stack([np.ones(len(some)), place[some]])
    values = deviation[some]
    middle = float(np.median(values))
    best = np.array([middle, 0.0, 0.0])
    if (np.abs(values - middle) < CLOSE).sum() < 0.8 * len(some):
        best = _trials(sample, values, best, rng)
    if (np.abs(values - sample @ best) < CLOSE).sum() < FLAT * len(some):
        return None
    design = np.column_stack([np.ones(len(place)), place - place.mean(axis=0)])
    best = np.array([best[0] + place.mean(axis=0) @ best[1:], *best[1:]])
    for _ in range(3):
        inlier = np.abs(deviation - design @ best) < CLOSE
        if inlier.sum() < LEAST_CELLS:
            break
        solution = _ridge(design[inlier], deviation[inlier])
        if np.abs(solution[1:]).max() > STEEPEST:
            break
        best = solution
    return np.array([best[0] - place.mean(axis=0) @ best[1:], *best[1:]])


def _trials(sample: F64, values: F64, best: F64, rng: np.random.Generator) -> F64:
    """The plane that fits best of many through three cells each, and the given one.

    Inliers count by how near they lie: a plane that slants between two levels has many, none of them near.
    """
    triples = rng.integers(0, len(values), (TRIALS, 3))
    matrices = sample[triples]
    clean = np.abs(np.linalg.det(matrices)) > 1e-4
    planes = best[None]
    if clean.any():
        tried = np.linalg.solve(matrices[clean], values[triples[clean]][..., None])[..., 0]
        planes = np.concatenate([planes, tried[np.abs(tried[:, 1:]).max(axis=1) < STEEPEST]])
    away = (planes @ sample.T - values) / SHARP
    return planes[int(np.argmax(np.maximum(1.0 - away**2, 0.0).sum(axis=1)))]


def _ridge(design: F64, values: F64) -> F64:
    """Least squares, drawn a little to no slope where places hardly differ."""
    square = design.T @ design
    square[np.diag_indices(3)] += np.array([0.0, 1e-3, 1e-3]) * len(values) * 0.05
    return np.linalg.solve(square, design.T @ values).astype(np.float64)


def statistics(cells: Cells, tolerance: float) -> Statistics:
    """Of cells, at least one."""
    away = np.abs(cells.deviation)
    return Statistics(
        median=weighted_quantile(cells.deviation, cells.area, 0.5),
        p95=weighted_quantile(away, cells.area, 0.95),
        rmse=math.sqrt(float(np.average(cells.square, weights=cells.area))),
        within=float(cells.area[away <= tolerance].sum() / cells.area.sum()),
    )


def weighted_quantile(values: F64, weights: F64, share: float) -> float:
    """The value below which ``share`` of the weights lies."""
    order = np.argsort(values)
    cumulated = np.cumsum(weights[order])
    place = np.searchsorted(cumulated, share * cumulated[-1])
    return float(values[order][min(int(place), len(values) - 1)])


def best_motion(cells: Cells, middle: F64, half_length: float) -> Motion:
    """The rigid motion that explains the deviations of cells best, about ``middle`` (3,). Directions that too little of
    the surface bears are left at nothing: along a wall of which no end was seen it cannot be told.
    """
    arm = (cells.middle - middle) / half_length
    jacobian = np.column_stack([cells.normal, np.cross(arm, cells.normal)])
    weight = cells.area.copy()
    solution = np.zeros(6)
    for _ in range(4):
        square = (jacobian * weight[:, None]).T @ jacobian / weight.sum()
        values, vectors = np.linalg.eigh(square)
        told = values > OBSERVED
        right = (jacobian * weight[:, None]).T @ cells.deviation / weight.sum()
        solution = vectors[:, told] @ ((vectors[:, told].T @ right) / values[told])
        rest = cells.deviation - jacobian @ solution
        scale = max(1.4826 * float(np.median(np.abs(rest))), 0.0015)
        weight = cells.area / np.maximum(1.0, np.abs(rest) / (1.5 * scale))
    rest = cells.deviation - jacobian @ solution
    residual = math.sqrt(float(np.average(rest**2, weights=weight)))
    turn = solution[3:] / half_length
    shift = (float(solution[0]), float(solution[1]), float(solution[2]))
    return Motion(shift, float(turn[2]), float(math.hypot(turn[0], turn[1])), residual)
