"""Hand-made surfaces as surfels: ``from surfaces import level, upright, surfels_of``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN, TALL, Surfels
from scan2bim.structure.plan import Plan, plan_of
from scan2bim.structure.storeys import find_storeys, layers_of

F64 = NDArray[np.float64]
STEP = 0.025
"""Metres between points: two in each direction a surfel."""
NOISE = 0.002
"""Standard deviation, metres, of the points' distance to their surface: a usual scanner's."""


def level(x0: float, y0: float, x1: float, y1: float, z: float) -> F64:
    """Points (n, 3) on a horizontal rectangle."""
    x, y = np.meshgrid(np.arange(x0, x1, STEP) + STEP / 2, np.arange(y0, y1, STEP) + STEP / 2)
    x, y = (axis.ravel() + _jitter(x.size, seed) for seed, axis in enumerate((x, y)))
    return np.column_stack([x, y, _noisy(np.full(x.size, z))])


def upright(a: tuple[float, float], b: tuple[float, float], low: float, high: float) -> F64:
    """Points (n, 3) on an upright rectangle over the line from a to b."""
    start, end = np.array(a), np.array(b)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    t, z = np.meshgrid(np.arange(0, length, STEP) + STEP / 2, np.arange(low, high, STEP) + STEP / 2)
    t, z = (axis.ravel() + _jitter(t.size, seed) for seed, axis in enumerate((t, z)))
    off = _noisy(np.zeros(t.size))
    plan = start + t[:, None] * along + off[:, None] * np.array([-along[1], along[0]])
    return np.column_stack([plan, z])


def room(x0: float, y0: float, x1: float, y1: float, floor: float = 0.0, ceiling: float | None = 2.5) -> list[F64]:
    """Floor, ceiling and four walls of a rectangular room; without ``ceiling`` the walls end at 2.5 m."""
    top = floor + 2.5 if ceiling is None else ceiling
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    walls = [upright(corners[i], corners[(i + 1) % 4], floor, top) for i in range(4)]
    flat = [level(x0, y0, x1, y1, floor)] + ([] if ceiling is None else [level(x0, y0, x1, y1, ceiling)])
    return flat + walls


def turned(points: F64, yaw: float) -> F64:
    """Points (n, 3) turned about z."""
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def surfels_of(points: F64, station: int | NDArray[np.int64] = 0) -> Surfels:
    """Mean and number of the points (n, 3) of each voxel; ``station`` one for all or (n,)."""
    cell = np.floor(points / [PLAN, PLAN, TALL]).astype(np.int64)
    x, y, z = (cell - cell.min(0)).T
    _, first, inverse, count = np.unique(
        (x * 4096 + y) * 4096 + z, return_index=True, return_inverse=True, return_counts=True
    )
    mean = np.stack([np.bincount(inverse, points[:, k]) / count for k in range(3)], 1)
    seen_by = np.broadcast_to(np.asarray(station, np.uint16), len(points))[first]
    n = len(count)
    return Surfels(
        mean.astype(np.float32),
        count.astype(np.uint32),
        np.full((n, 3), 200, np.uint8),
        seen_by,
        np.zeros(n, np.float16),
    )


def _noisy(values: F64) -> F64:
    return values + np.random.default_rng(len(values)).normal(0.0, NOISE, len(values))


def _jitter(count: int, seed: int) -> F64:
    """So that the points' grid does not beat with that of the voxels."""
    return np.random.default_rng([count, seed]).uniform(-0.4 * STEP, 0.4 * STEP, count)


def plan(rooms: list[list[F64]], eyes: list[tuple[float, float]], yaw: float = 0.0) -> Plan:
    """Plan of rooms, each seen by the station that stands in it."""
    points = [np.concatenate(parts) for parts in rooms]
    station = np.repeat(np.arange(len(rooms)), [len(p) for p in points])
    surfels = surfels_of(turned(np.concatenate(points), yaw), station)
    layers = layers_of(surfels)
    positions = turned(np.array([[x, y, 1.5] for x, y in eyes]), yaw)
    return plan_of(find_storeys(surfels, layers, positions)[0], surfels, layers, positions)
