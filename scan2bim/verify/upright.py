"""Straight upright surfaces among voxels: walls that furniture, floors or other walls touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]

TALL = 1.8
"""Metres that a wall's voxels reach over each other at the least; furniture is mostly lower."""
FILLED = 0.6
"""Share of that height, and of a wall's length, that must have voxels: the rest is hidden by furniture."""
LONG = 0.9
"""Least length of a wall, metres."""
BREAK = 0.4
"""Metres along a wall without voxels at which it ends."""
HALF = 0.12
"""Metres from a wall's line within which voxels are its own: one voxel and a slope between voxels."""
ANGLES = 180
"""Directions that are tried: 1 degree moves the end of a wall of 5 m by half a voxel."""
MOST = 400
"""Lines that are tried, the fullest first."""


def upright_parts(middle: F64, edge: float) -> I64:
    """Number (k,) of the straight upright surface that each voxel, middle (k, 3) metres and ``edge`` wide, lies on, -1
    for none; the one with most columns first.
    """
    out = np.full(len(middle), -1, np.int64)
    column, places = _tall_columns(middle, edge)
    owner = np.full(len(places), -1, np.int64)
    found = 0
    left = np.ones(len(places), bool)
    for _ in range(MOST):
        rows = np.flatnonzero(left)
        if len(rows) * edge < LONG:
            break
        line = _best_line(places[rows], edge)
        run = _longest_run(places[rows], *line, edge)
        mine = rows[run]
        left[mine] = False
        if _is_wall(places[mine], line[0], edge):
            owner[mine] = found
            found += 1
    inside = column >= 0
    out[inside] = owner[column[inside]]
    return out


def _tall_columns(middle: F64, edge: float) -> tuple[I64, F64]:
    """The tall column (k,) of each voxel, -1 for none, and the places (m, 2) of the tall columns."""
    at = np.floor(middle[:, :2] / edge).astype(np.int64)
    keys, column = np.unique(at, axis=0, return_inverse=True)
    column = column.ravel()
    low, high = np.full(len(keys), np.inf), np.full(len(keys), -np.inf)
    np.minimum.at(low, column, middle[:, 2])
    np.maximum.at(high, column, middle[:, 2])
    height = high - low + edge
    tall = (height >= TALL) & (np.bincount(column, minlength=len(keys)) * edge >= FILLED * height)
    number = np.where(tall, np.cumsum(tall) - 1, -1)
    places: F64 = ((keys[tall] + 0.5) * edge).astype(np.float64)
    return number[column], places


def _best_line(places: F64, edge: float) -> tuple[F64, float]:
    """Normal (2,) and offset of the line with most columns, made better by those near it."""
    angles = np.pi * np.arange(ANGLES) / ANGLES
    best, normal, offset = 0, np.array([1.0, 0.0]), 0.0
    for angle in angles:
        n = np.array([np.cos(angle), np.sin(angle)])
        away = places @ n
        bins = np.floor((away - away.min()) / edge).astype(np.int64)
        counts = np.bincount(bins, minlength=int(bins.max()) + 2)
        pairs = counts[:-1] + counts[1:]
        top = int(np.argmax(pairs))
        if pairs[top] > best:
            best, normal, offset = int(pairs[top]), n, float(away.min()) + (top + 1) * edge
    near = places[np.abs(places @ normal - offset) < HALF]
    middle = near.mean(axis=0)
    _, vectors = np.linalg.eigh(np.cov((near - middle).T)) if len(near) > 2 else (0, np.array([normal, normal]).T)
    refined: F64 = vectors[:, 0] * np.sign(vectors[:, 0] @ normal or 1.0)
    return (refined, float(middle @ refined)) if refined @ normal > 0.99 else (normal, offset)


def _longest_run(places: F64, normal: F64, offset: float, edge: float) -> I64:
    """Rows of the columns near the line that lie on its longest stretch without a break."""
    near = np.flatnonzero(np.abs(places @ normal - offset) < HALF)
    along = places[near] @ np.array([-normal[1], normal[0]])
    order = np.argsort(along)
    part = np.concatenate([[0], np.cumsum(np.diff(along[order]) > BREAK)])
    lengths = np.bincount(part)
    return near[order[part == int(np.argmax(lengths))]]


def _is_wall(places: F64, normal: F64, edge: float) -> bool:
    """Whether columns on a line are long and dense enough for a wall."""
    if len(places) < 2:
        return False
    along = places @ np.array([-normal[1], normal[0]])
    length = float(np.ptp(along)) + edge
    steps = len(np.unique(np.floor(along / edge)))
    return length >= LONG and steps * edge >= FILLED * length
