"""Bringing model and scans into one frame: by stated coordinates or by alignment, then by a robust fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import Surfels
from scan2bim.geometry.space_index import SpaceIndex
from scan2bim.verify.faces import FaceTable

F64 = NDArray[np.float64]
Method = Literal["given", "map", "identity", "automatic"]

SAMPLE = 16_000
"""Surfels that a placing is judged and fitted by."""
SPACING = 0.15
"""Distance of the model's cells that they are compared with, metres."""
EXPLAINED = 0.05
"""Metres from the model within which a surfel counts as explained."""
NEIGHBOURS = 6
"""Cells looked at for one that faces the surfel's station."""
PLAUSIBLE = 0.35
"""Share of the walls explained from which on a placing is believed: an unrelated place gives below 0.2, and furniture
and what is seen through windows leave 0.5 to 0.9 of a right one."""
COLUMN, LAYER, NEIGHBOUR_LAYERS = 0.10, 0.25, 3
"""Metres in plan and height of the cells that tell walls, and how many of them above and below are looked at."""
GATES = (0.25, 0.15, 0.15, 0.10, 0.06, 0.04, 0.03, 0.03, 0.03)
"""Metres within which surfels count, fit after fit."""
FINE_GATES = (0.03, 0.03, 0.03)
OBSERVED = 0.02
"""Share of the surface that must bear a direction of motion for it to be told."""
TIGHT = 0.006
"""Metres within which a surfel fits closely: noise and registration together."""
WEIGHT_SCALE = 0.006
"""Residual, metres, from which on a surfel counts less: noise, means of corners, registration."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Some surfels: xyz (k, 3) local metres, station (k, 3) positions of what saw them, nan where unknown, and number
    (k,) of the station; wall (k,) bool: others stand above and below it, as on a wall.
    """

    xyz: F64
    position: F64
    number: NDArray[np.int64]
    wall: NDArray[np.bool_]

    def pick(self, which: NDArray[np.bool_]) -> Sample:
        """Some of them."""
        return Sample(self.xyz[which], self.position[which], self.number[which], self.wall[which])


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Cells of a model, thinned: middles and normals (n, 3) in the model's frame, by place."""

    index: SpaceIndex
    middle: F64
    normal: F64
    two_sided: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A rigid motion (4, 4) from the model's anchored frame to the local one, and the shares of the scans' surface and
    of their walls that it explains.
    """

    method: Method
    matrix: F64
    explained: float
    walls: float


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """A motion (4, 4) in the local frame that brings the model onto the scans: shift (3,) metres of the scans' middle,
    turn (radians) about the vertical, residual (metres) that it leaves, count of surfels that bore it, and the share of
    those near the model that it brings to within 6 mm, less the share that were before.
    """

    matrix: F64
    shift: F64
    turn: float
    residual: float
    count: int
    gain: float


def sample_surfels(surfels: Surfels, stations: F64, count: int = SAMPLE) -> Sample:
    """An even choice of surfels with two points or more."""
    rows = np.flatnonzero(surfels.count >= 2)
    rows = rows[:: max(1, len(rows) // count)]
    number = surfels.station[rows].astype(np.int64)
    known = np.minimum(number, len(stations) - 1)
    xyz = surfels.xyz[rows].astype(np.float64)
    return Sample(xyz, stations[known], number, _on_walls(surfels.xyz, rows))


def _on_walls(xyz: NDArray[np.float32], rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of the ``rows`` of xyz (n, 3) have points in most layers of 25 cm over and under them."""
    low = xyz.min(axis=0)
    pixels = np.floor((xyz[:, :2] - low[:2]) / COLUMN).astype(np.int64)
    layer = np.floor((xyz[:, 2] - low[2]) / LAYER).astype(np.int64)
    width = int(pixels[:, 1].max()) + 1
    column = pixels[:, 0] * width + pixels[:, 1]
    layers = int(layer.max()) + 1 + 2 * NEIGHBOUR_LAYERS
    key = np.unique(column * layers + layer + NEIGHBOUR_LAYERS)
    own = column[rows] * layers + layer[rows] + NEIGHBOUR_LAYERS
    around = [d for d in range(-NEIGHBOUR_LAYERS, NEIGHBOUR_LAYERS + 1) if d]
    found = sum(_contains(key, own + d).astype(np.int64) for d in around)
    return np.asarray(found >= NEIGHBOUR_LAYERS + 1)


def _contains(keys: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of ``wanted`` are among the sorted ``keys``."""
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return keys[place] == wanted


def make_target(table: FaceTable, elements_that_count: NDArray[np.bool_]) -> Target:
    """The cells of the elements that count (e,) bool, one in 15 cm each way."""
    stride = np.maximum(1, np.rint(SPACING / table.size).astype(np.int64))[table.cell_face]
    at = table.cell_at
    keep = (at[:, 0] % stride == stride // 2) & (at[:, 1] % stride == stride // 2)
    keep &= elements_that_count[table.cell_element] & ~table.glass[table.cell_face]
    cells = np.flatnonzero(keep)
    face = table.cell_face[cells]
    middle = table.centres(cells)
    return Target(SpaceIndex(middle), middle, table.normal[face], table.two_sided[face])


def residuals(target: Target, sample: Sample, matrix: F64, gate: float) -> tuple[F64, F64, F64, NDArray[np.bool_]]:
    """For each surfel its signed distance (k,) to the plane of the nearest cell that faces its station, the plane's
    normal (k, 3) and the surfel (k, 3) in the model's frame, and whether there is such a cell with the surfel within
    ``gate`` of its plane.
    """
    back = np.linalg.inv(matrix)
    points = sample.xyz @ back[:3, :3].T + back[:3, 3]
    stations = sample.position @ back[:3, :3].T + back[:3, 3]
    near = target.index.nearest(points, NEIGHBOURS, gate + SPACING)
    cells = (target.middle, target.normal, target.two_sided)
    offset, best, hit = _nearest_plane(points, stations, near, *cells, gate)
    return offset, target.normal[best], points, hit


@nb.njit(cache=True, nogil=True)
def _nearest_plane(points, stations, near, middle, normal, two_sided, gate):  # pyright: ignore
    """Of the cells ``near`` (k, n; -1 for none) each point (k, 3) that face its station (k, 3; nan where unknown), the
    one whose plane is nearest, as at a corner several are near: signed distance to its plane (k,), its number
    (k,), and whether there is one within ``gate`` metres (k,).
    """
    offset, best, hit = np.zeros(len(points)), np.zeros(len(points), np.int64), np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        least = gate
        for cell in near[i]:
            if cell < 0:
                continue
            away = ahead = 0.0
            for k in range(3):
                away += (points[i, k] - middle[cell, k]) * normal[cell, k]
                ahead += (stations[i, k] - middle[cell, k]) * normal[cell, k]
            if abs(away) < least and (ahead > 0.0 or two_sided[cell] or np.isnan(ahead)):
                least = abs(away)
                offset[i], best[i], hit[i] = away, cell, True
    return offset, best, hit


def explained(target: Target, sample: Sample, matrix: F64, gate: float = EXPLAINED) -> tuple[float, float]:
    """Share of the sample, and of what of it stands on walls, within the gate (5 cm) of the model.

    Floors and ceilings of a model lie where those of a scan do, wherever it lies in plan: walls decide.
    """
    *_, hit = residuals(target, sample, matrix, gate)
    walls = hit[sample.wall]
    return float(hit.mean()) if len(hit) else 0.0, float(walls.mean()) if len(walls) else 0.0


def fit(target: Target, sample: Sample, matrix: F64, gates: Sequence[float] = GATES) -> Correction:
    """The turn about the vertical and the shift that bring the model onto the scans best, from a first placing."""
    centre = sample.xyz.mean(axis=0)
    current, residual, count = matrix, math.inf, 0
    for gate in gates:
        offset, normal, points, hit = residuals(target, sample, current, gate)
        count = int(hit.sum())
        if count < 50:
            break
        turn = current[:3, :3]
        normal, local = normal[hit] @ turn.T, points[hit] @ turn.T + current[:3, 3]
        step, residual = _step(local - centre, normal, offset[hit], max(WEIGHT_SCALE, gate / 5))
        current = _about(centre, step[3], step[:3]) @ current
    moved = current @ np.linalg.inv(matrix)
    turned = math.atan2(moved[1, 0], moved[0, 0])
    shift = moved[:3, :3] @ centre + moved[:3, 3] - centre
    gain = _tight(target, sample, current) - _tight(target, sample, matrix)
    return Correction(moved, shift, turned, residual, count, gain)


def best_fit(target: Target, sample: Sample, matrix: F64) -> Correction:
    """The fit that brings most of the surface onto the model: from near, where most of it lies there already and some
    walls were built elsewhere, or from farther off, where all of it lies off.
    """
    fits = [fit(target, sample, matrix, gates) for gates in (FINE_GATES, GATES)]
    return max(fits, key=lambda c: sum(explained(target, sample, c.matrix @ matrix, TIGHT)))


def _tight(target: Target, sample: Sample, matrix: F64) -> float:
    """Of the surfels within 10 cm of the model, the share within 6 mm."""
    offset, _, _, hit = residuals(target, sample, matrix, 0.10)
    return float((np.abs(offset[hit]) < TIGHT).mean()) if hit.any() else 0.0


def _step(arm: F64, normal: F64, offset: F64, scale: float) -> tuple[F64, float]:
    """Shift and turn (4,) that take the offsets away best, and the robust residual.

    Offsets beyond ``scale`` metres count less.
    """
    length = max(float(np.abs(arm[:, :2]).mean()), 0.1)
    jacobian = np.column_stack([normal, (arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / length])
    weight = np.ones(len(offset))
    solution = np.zeros(4)
    for _ in range(5):
        values, vectors = np.linalg.eigh((jacobian * weight[:, None]).T @ jacobian / weight.sum())
        told = values > OBSERVED
        right = vectors[:, told].T @ ((jacobian * weight[:, None]).T @ offset / weight.sum())
        solution = vectors[:, told] @ (right / values[told])
        rest = offset - jacobian @ solution
        weight = 1.0 / (1.0 + (rest / scale) ** 2) ** 2
    residual = math.sqrt(float(np.average((offset - jacobian @ solution) ** 2, weights=weight)))
    return np.array([*solution[:3], solution[3] / length]), residual


def _about(centre: F64, turn: float, shift: F64) -> F64:
    """A turn about the vertical through ``centre``, then a shift, as (4, 4)."""
    c, s = math.cos(turn), math.sin(turn)
    out = np.eye(4)
    out[:2, :2] = [[c, -s], [s, c]]
    out[:3, 3] = centre - out[:3, :3] @ centre + shift
    return out


def scan_corrections(target: Target, sample: Sample, matrix: F64) -> dict[int, Correction]:
    """For each station the motion of the model that would fit its own surfels best, from the common placing."""
    out: dict[int, Correction] = {}
    for number in np.unique(sample.number):
        mine = sample.pick(sample.number == number)
        if len(mine.xyz) >= 200:
            out[int(number)] = fit(target, mine, matrix, (0.10, 0.06, 0.05, 0.05))
    return out
