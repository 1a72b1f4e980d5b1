"""Automatic alignment of a model to scans: storeys by their heights, then turn and place by the walls in plan.

The walls of both are drawn into plan images, a pixel the height of upright surface in it. For each pair of storeys and
each of the four turns that bring the main directions together, the shifts with the highest correlation are candidates;
the candidate that explains most of the scans' surface, and that stations look through least, wins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.model.elements import Building
from scan2bim.verify.agreement import Sights
from scan2bim.verify.placing import PLAUSIBLE, Placed, Sample, Target, explained, fit

F64 = NDArray[np.float64]

PIXEL = 0.10
"""Edge of a pixel of the plan images, metres: about the thickness of a partition."""
UPRIGHT = 0.2
"""Largest vertical part of the normal of an upright surface."""
LEVEL = 0.05
"""Bin of the heights at which level surfaces lie, metres."""
ROUND = 21
"""Bins of heights, 1 m, whose mean is taken off each: less than a room's height."""
HEIGHTS = 5
"""Shifts in height that are tried for each turn: storeys of a building are alike, so several fit."""
PEAKS = 4
"""Shifts in plan that are tried for each turn and height."""
ROOM = 0.3
"""Metres over and under the scans within which the model's walls are drawn into the plan image of a height."""
LEAST_EXPLAINED, AGREES = 0.5, 0.7
"""Share of the scans' surface that a placing must explain, and share of what the stations should see of the model by it
that they did see, for it to be believed. Another building explains less or is looked through."""
APART = 10
"""Pixels that the tried shifts lie apart."""
QUICK = 6_000
"""Surfels that candidates are compared by."""
COARSE = (0.5, 0.4, 0.3, 0.2, 0.15, 0.10, 0.06, 0.04, 0.03, 0.03)
"""Metres within which surfels count, fit after fit, from a candidate on."""
CLOSE = 0.012
"""Metres within which the finalists are compared: the two halves of a mirrored house differ by a few centimetres."""
FINALISTS = 8


@dataclass(frozen=True, slots=True, eq=False)
class Aligned:
    """The placing that fits best, None where none is plausible; what the next best explains; and what share of the
    walls, and of what the stations should see, the best one explains.
    """

    placed: Placed | None
    rival: float | None
    walls: float
    agreement: float


def align(target: Target, sample: Sample, building: Building | None, sights: Sights) -> Aligned:
    """The placing that explains most of the scans and that they contradict least."""
    quick = sample.pick(np.arange(len(sample.xyz)) % max(1, len(sample.xyz) // QUICK) == 0)
    rough = [(sum(explained(target, quick, m, PIXEL)), m) for m in _candidates(target, sample, building)]
    rough.sort(key=lambda entry: -entry[0])
    fine: list[tuple[float, float, Placed]] = []
    for _, matrix in rough[:FINALISTS]:
        fitted = fit(target, quick, matrix, COARSE).matrix @ matrix
        placed = Placed("automatic", fitted, *explained(target, quick, fitted))
        agreement = sights.agreement(fitted)
        fine.append((agreement * sum(explained(target, quick, fitted, CLOSE)), agreement, placed))
    fine.sort(key=lambda entry: -entry[0])
    if not fine:
        return Aligned(None, None, 0.0, 0.0)
    _, agreement, best = fine[0]
    if best.walls < PLAUSIBLE or best.explained < LEAST_EXPLAINED or agreement < AGREES:
        return Aligned(None, None, best.walls, agreement)
    others = [placed.explained for _, _, placed in fine[1:] if np.abs(placed.matrix - best.matrix).max() > 0.1]
    return Aligned(best, round(max(others), 4) if others else None, best.walls, agreement)


def _candidates(target: Target, sample: Sample, building: Building | None) -> Iterator[F64]:
    """Motions (4, 4) from the model's anchored frame to the local one."""
    upright = np.abs(target.normal[:, 2]) < UPRIGHT
    walls = sample.xyz[sample.wall]
    lifts, low, high = _lifts(target, sample), walls[:, 2].min() - ROOM, walls[:, 2].max() + ROOM
    yaw = (building.frame.yaw if building else _direction(walls)) - _main(target.normal[upright])
    for quarter in range(4):
        angle = yaw + quarter * math.pi / 2
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        turned = target.middle[upright].copy()
        turned[:, :2] = turned[:, :2] @ turn.T
        for lift in lifts:
            level = (turned[:, 2] + lift > low) & (turned[:, 2] + lift < high)
            for shift in _shifts(turned[level], walls) if level.any() else ():
                out = np.eye(4)
                out[:2, :2] = turn
                out[:3, 3] = (*shift, lift)
                yield out


def _main(normals: F64) -> float:
    """Main direction of upright faces, radians in a quarter turn."""
    angle = 4 * np.arctan2(normals[:, 1], normals[:, 0])
    return math.atan2(float(np.sin(angle).sum()), float(np.cos(angle).sum())) / 4


def _direction(walls: F64) -> float:
    """Main direction of points of walls: the turn at which their coordinates crowd most."""
    angles = np.radians(np.arange(0.0, 90.0, 0.5))
    crowd = [_crowd(walls[:, 0] * math.cos(a) + walls[:, 1] * math.sin(a)) for a in angles]
    crowd2 = [_crowd(walls[:, 1] * math.cos(a) - walls[:, 0] * math.sin(a)) for a in angles]
    return float(angles[int(np.argmax(np.array(crowd) + np.array(crowd2)))])


def _crowd(values: F64) -> float:
    counts = np.bincount(np.floor((values - values.min(initial=0.0)) / LEVEL).astype(np.int64))
    return float((counts.astype(np.float64) ** 2).sum())


def _lifts(target: Target, sample: Sample) -> list[float]:
    """Shifts in height at which level surfaces of both meet most."""
    level = np.abs(target.normal[:, 2]) > 1 - UPRIGHT
    ours, theirs = target.middle[level, 2], sample.xyz[:, 2]
    if not len(ours):
        return [0.0]
    low = min(float(ours.min()), float(theirs.min()))
    a = np.bincount(np.floor((theirs - low) / LEVEL).astype(np.int64)).astype(np.float64)
    b = np.bincount(np.floor((ours - low) / LEVEL).astype(np.int64)).astype(np.float64)
    match = np.correlate(np.sqrt(_peaks(a)), np.sqrt(b), "full")
    lifts: list[float] = []
    for place in np.argsort(-match):
        lift = (int(place) - (len(b) - 1)) * LEVEL
        if all(abs(lift - other) > 0.5 for other in lifts):
            lifts.append(lift)
        if len(lifts) == HEIGHTS:
            break
    return lifts


def _peaks(counts: F64) -> F64:
    """What stands out of the mean of the bins round each: walls are as high everywhere, floors and ceilings are not."""
    return np.maximum(counts - np.convolve(counts, np.full(ROUND, 1 / ROUND), "same"), 0.0)


def _shifts(model: F64, scan: F64) -> list[tuple[float, float]]:
    """Shifts in plan at which the walls of both lie on each other most, by correlation of plan images."""
    low_m, low_s = model[:, :2].min(axis=0), scan[:, :2].min(axis=0)
    a, b = _image(scan[:, :2] - low_s), _image(model[:, :2] - low_m)
    shape = (a.shape[0] + b.shape[0], a.shape[1] + b.shape[1])
    match = np.fft.irfft2(np.fft.rfft2(a, shape) * np.conj(np.fft.rfft2(b, shape)), shape)
    out: list[tuple[float, float]] = []
    for _ in range(PEAKS):
        i, j = np.unravel_index(int(np.argmax(match)), shape)
        row, column = (int(k) if k < s else int(k) - n for k, s, n in zip((i, j), a.shape, shape, strict=True))
        out.append((row * PIXEL + float(low_s[0] - low_m[0]), column * PIXEL + float(low_s[1] - low_m[1])))
        rows = np.arange(int(i) - APART, int(i) + APART + 1) % shape[0]
        columns = np.arange(int(j) - APART, int(j) + APART + 1) % shape[1]
        match[np.ix_(rows, columns)] = -np.inf
    return out


def _image(plan: F64) -> F64:
    """Root of the number of points in each pixel."""
    pixels = np.floor(plan / PIXEL).astype(np.int64)
    shape = pixels.max(axis=0) + 1
    return np.sqrt(np.bincount(pixels[:, 0] * shape[1] + pixels[:, 1], minlength=int(shape.prod())).reshape(shape))
