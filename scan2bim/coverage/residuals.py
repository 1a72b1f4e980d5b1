"""By how much each scan lies off the building's faces as the other scans see them: what its registration left.

Points of each scan, a sample, are measured from the model's faces in patches of a square metre. In a patch that several
scans saw their median distances differ by what those scans are off across it. One adjustment over all patches finds the
shift of each scan; where two scans contradict each other and no third one tells, the shift is shared between them, else
as few scans as possible are blamed (least sum of absolute shifts).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.tiles import POINT, STEPS, TILE, TileIndex
from scan2bim.coverage.faces import StoreyFaces
from scan2bim.coverage.look import ahead_of, bin_of, on_panel
from scan2bim.coverage.panels import CELL
from scan2bim.model.elements import ScanResidual

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

SAMPLE = 5_000
"""Points of a scan that are looked at: about fifty a square metre of a room."""
STRETCH = 16
"""Neighbouring points that are read together, so that few pages of the file are touched."""
BAND = 0.05
"""Metres from a face within which points are taken for its own: a registration error of 2 cm, and noise."""
PATCH = round(1.0 / CELL)
"""Cells along a patch's edge, a metre: within it a wall is even, and a scan has dozens of points."""
FEWEST = 8
"""Points of a scan that a patch needs: their median is good to a millimetre."""
UNEVEN = 0.0015
"""Metres, one standard deviation, by which two scans' medians on a patch differ though both are right: they saw other
parts of it, at another slant."""
PRIOR = 0.005
"""Metres: usual shift of a scan (scale of a Laplace distribution). Only says who is blamed where the data does not."""
LEAST_SHIFT = 0.0005
"""Metres below which a shift is as good as none."""
ROUNDS = 12
"""Rounds of the adjustment: weights of doubtful patches and blame settle in fewer."""
DOUBTFUL = 2.5
"""Standard deviations beyond which a patch loses weight: a picture, a skirting board, a moved curtain."""
UNKNOWN = 0.004
"""Metres of sigma from which on a shift along an axis counts as not known: no face across it was shared."""
ALONE = 0.4
"""Share of what is known along one direction, above which one median is not believed: two others at least are to bear
it out."""
LEAST_PATCHES = 6
"""Patches shared with other scans below which nothing is said of a scan."""


@dataclass(frozen=True, slots=True, eq=False)
class Medians:
    """m medians of one station on one patch: ``patch``, ``station`` (m,) int64 numbers without gaps, ``normal`` (m, 3),
    ``distance`` (m,) metres, ``sigma`` (m,) metres.
    """

    patch: I64
    station: I64
    normal: F64
    distance: F64
    sigma: F64


def residuals_of(faces: Sequence[StoreyFaces], scan_folders: Sequence[Path], stations: F64) -> dict[int, ScanResidual]:
    """By station number, those that share enough with others; ``stations`` (s, 3), nan if unknown."""
    found = _medians(faces, scan_folders, stations)
    return {} if found is None else fitted(found)


def fitted(found: Medians) -> dict[int, ScanResidual]:
    """By station number, from the medians on all patches."""
    found = _checked(found)
    if not len(found.patch):
        return {}
    names, station = np.unique(found.station, return_inverse=True)
    shift, weight = _adjusted(found, station, len(names))
    sigma = _sigmas(_covariance(found, station, weight, len(names)))
    left = _left(found, station, shift, weight)
    out: dict[int, ScanResidual] = {}
    for number, name in enumerate(names.tolist()):
        mine = station == number
        if mine.sum() >= LEAST_PATCHES:
            out[name] = _residual(shift[number], sigma[number], left[mine], weight[mine])
    return out


def _residual(shift: F64, sigma: F64, left: F64, weight: F64) -> ScanResidual:
    known = [bool(s < UNKNOWN) for s in sigma]
    x, y, z = (round(float(v), 4) if k else None for v, k in zip(shift, known, strict=True))
    sx, sy, sz = (round(float(v), 4) if k else None for v, k in zip(sigma, known, strict=True))
    rms = float(np.sqrt(np.average(left**2, weights=weight)))
    return ScanResidual(offset=(x, y, z), sigma=(sx, sy, sz), rms=round(rms, 4), patches=len(left))


def _medians(faces: Sequence[StoreyFaces], folders: Sequence[Path], stations: F64) -> Medians | None:
    """Medians on the patches that at least two stations saw."""
    keys, distances, normals, first = [np.zeros(0, np.int64)], [np.zeros(0, np.float32)], [np.zeros((0, 3))], 0
    count = len(stations)
    sample = list(_samples(folders))
    for storey in faces:
        panels, bins = storey.panels, (storey.bins.starts, storey.bins.members, storey.bins.columns)
        across = -(-panels.cells[:, :2] // PATCH)
        sizes = across[:, 0] * across[:, 1]
        patches = np.column_stack([first + np.cumsum(sizes) - sizes, across[:, 0]])
        for xyz, station in sample:
            points = (xyz, station, stations)
            patch, distance = _distances(
                points, storey.rooms.frame, bins, panels.plane, panels.cells, panels.asked, patches
            )
            on = patch >= 0
            keys.append(patch[on] * count + station[on])
            distances.append(distance[on])
        normals.append(np.repeat(panels.plane[:, 9:12], sizes, axis=0))
        first += int(sizes.sum())
    return _grouped(np.concatenate(keys), np.concatenate(distances), np.concatenate(normals), count)


def _grouped(key: I64, distances: F32, normals: F64, stations: int) -> Medians | None:
    order = np.lexsort((distances, key))
    key, distance = key[order], distances[order].astype(np.float64)
    groups, start, size = np.unique(key, return_index=True, return_counts=True)
    enough = size >= FEWEST
    groups, start, size = groups[enough], start[enough], size[enough]
    patch = groups // stations
    _, number, seen = np.unique(patch, return_inverse=True, return_counts=True)
    shared = seen[number] > 1
    if not shared.any():
        return None
    groups, start, size, patch = groups[shared], start[shared], size[shared], patch[shared]
    spread = (distance[start + size * 84 // 100] - distance[start + size * 16 // 100]) / 2
    return Medians(
        np.unique(patch, return_inverse=True)[1],
        groups % stations,
        normals[patch],
        distance[start + size // 2],
        np.sqrt(1.57 * spread**2 / size + UNEVEN**2),
    )


def _samples(folders: Sequence[Path]) -> Iterator[tuple[F32, NDArray[np.uint16]]]:
    """Of each scan up to about SAMPLE points (n, 3) with their stations (n,)."""
    for folder in folders:
        index = TileIndex.load(folder)
        total = int(index.runs["count"].sum())
        if total == 0:
            continue
        points = np.asarray(np.memmap(index.path, POINT, "r"))
        gap = max(STRETCH, STRETCH * (total // SAMPLE))
        # Runs follow each other in the file; which one a record is in tells its tile.
        runs = index.runs[np.argsort(index.runs["start"])]
        at = (np.arange(0, total - STRETCH + 1, gap)[:, None] + np.arange(STRETCH)).ravel()
        part = points[at]
        tile = runs["tile"][np.searchsorted(runs["start"], at, "right") - 1]
        steps = np.column_stack([part["x"], part["y"], part["z"]]) + 0.5
        yield (tile * TILE + steps * (TILE / STEPS)).astype(np.float32), part["station"].copy()


@nb.njit(cache=True, nogil=True)
def _distances(points, frame, bins, plane, cells, asked, patches):  # pyright: ignore
    """Of each point (n, 3) the patch of the nearest face within BAND, -1 for none, and its distance to that face;
    ``patches`` (p, 2): a panel's first one, and how many it has along a row.
    """
    xyz, station, stations = points
    starts, members, columns = bins
    out = np.full(xyz.shape[0], -1, np.int64)
    distance = np.zeros(xyz.shape[0], np.float32)
    for i in range(xyz.shape[0]):
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        key = bin_of(x, y, frame, columns, starts.shape[0] - 1)
        if key < 0:
            continue
        for m in range(starts[key], starts[key + 1]):
            p = members[m]
            depth, a, b = on_panel(x, y, z, plane[p], cells[p])
            if a < 0 or abs(depth) > BAND or (out[i] >= 0 and abs(depth) > abs(distance[i])):
                continue
            if not asked[cells[p, 2] + b * cells[p, 0] + a]:
                continue
            if ahead_of(stations[station[i]], plane[p]) < 0.0:  # seen from behind; nan, unknown, is not
                continue
            out[i] = patches[p, 0] + (b // PATCH) * patches[p, 1] + a // PATCH
            distance[i] = depth
    return out, distance


def _checked(found: Medians) -> Medians:
    """Without medians that no others check: on one patch two scans may well have seen two surfaces."""
    names, station = np.unique(found.station, return_inverse=True)
    weight = 1.0 / found.sigma**2
    covariance = _covariance(found, station, weight, len(names))
    keep = _alone(found.patch, station, found.normal, weight, covariance) < ALONE
    _, number, seen = np.unique(found.patch[keep], return_inverse=True, return_counts=True)
    at = np.flatnonzero(keep)[seen[number] > 1]
    patch = np.unique(found.patch[at], return_inverse=True)[1]
    return Medians(patch, found.station[at], found.normal[at], found.distance[at], found.sigma[at])


def _adjusted(found: Medians, station: I64, count: int) -> tuple[F64, F64]:
    """Shifts (count, 3) of the stations, and the weight (m,) of each median, 1 / square metres."""
    base = 1.0 / found.sigma**2
    weight, shift = base.copy(), np.zeros((count, 3))
    for _ in range(ROUNDS):
        blame = 1.0 / (PRIOR * np.maximum(np.abs(shift), LEAST_SHIFT))
        shift = _solved(found, station, weight, blame)
        left = _left(found, station, shift, weight)
        spread = max(1.0, 1.4826 * float(np.median(np.abs(left) * np.sqrt(base))))
        off = np.abs(left) * np.sqrt(base) / spread
        weight = base / spread**2 * np.minimum(1.0, (DOUBTFUL / np.maximum(off, 1e-9)) ** 2)
    return shift, weight


def _left(found: Medians, station: I64, shift: F64, weight: F64) -> F64:
    """(m,) metres: how far each median, its station's shift taken off, lies from where its patch's stations put it."""
    level = found.distance - np.einsum("ij,ij->i", found.normal, shift[station])
    total = np.bincount(found.patch, weights=weight)
    return level - (np.bincount(found.patch, weights=weight * level) / total)[found.patch]


def _solved(found: Medians, station: I64, weight: F64, blame: F64) -> F64:
    """Shifts (s, 3) of least squares."""
    whole, right = _equations(found.patch, station, found.normal, found.distance, weight, len(blame))
    solved = np.linalg.solve(whole + np.diag(blame.ravel()), right)
    return np.asarray(solved, np.float64).reshape(len(blame), 3)


@nb.njit(cache=True, nogil=True)
def _equations(patch, station, normal, distance, weight, count):  # pyright: ignore
    """Normal equations of the stations' shifts, each patch's own place eliminated; ``patch`` (m,) ascends."""
    whole = np.zeros((3 * count, 3 * count))
    right = np.zeros(3 * count)
    first = 0
    while first < patch.shape[0]:
        last = first
        total = 0.0
        mean = 0.0
        while last < patch.shape[0] and patch[last] == patch[first]:
            total += weight[last]
            mean += weight[last] * distance[last]
            last += 1
        n = normal[first]
        for a in range(first, last):
            s = 3 * station[a]
            for b in range(first, last):
                t = 3 * station[b]
                w = weight[a] * ((1.0 if a == b else 0.0) - weight[b] / total)
                for i in range(3):
                    for j in range(3):
                        whole[s + i, t + j] += w * n[i] * n[j]
            for i in range(3):
                right[s + i] += weight[a] * (distance[a] - mean / total) * n[i]
        first = last
    return whole, right


def _covariance(found: Medians, station: I64, weight: F64, count: int) -> F64:
    """(3 s, 3 s) of all stations' shifts, square metres."""
    whole, _ = _equations(found.patch, station, found.normal, found.distance, weight, count)
    prior = np.eye(3 * count) / (2 * PRIOR**2)  # a Laplace distribution's variance
    return np.asarray(np.linalg.inv(whole + prior), np.float64)


def _sigmas(covariance: F64) -> F64:
    """(s, 3) standard deviations, metres, of the stations' shifts along each axis against the mean of all.

    From all equations at once: scans that hang together well and on the others badly are off together.
    """
    count = len(covariance) // 3
    against = np.eye(3 * count) - np.tile(np.eye(3), (count, count)) / count
    variance = np.diag(against @ covariance @ against.T)
    return np.asarray(np.sqrt(variance), np.float64).reshape(count, 3)


@nb.njit(cache=True, nogil=True)
def _alone(patch, station, normal, weight, covariance):  # pyright: ignore
    """How far each median (m,) alone decides what it tells of its station against the others on its patch, 0-1: one
    less its redundancy, the patch's own place left out; ``patch`` (m,) ascends.
    """
    out = np.zeros(patch.shape[0])
    first = 0
    while first < patch.shape[0]:
        last = first
        total = 0.0
        while last < patch.shape[0] and patch[last] == patch[first]:
            total += weight[last]
            last += 1
        n = normal[first]
        for a in range(first, last):
            variance = 0.0
            for b in range(first, last):
                for c in range(first, last):
                    part = ((1.0 if a == b else 0.0) - weight[b] / total) * (
                        (1.0 if a == c else 0.0) - weight[c] / total
                    )
                    for i in range(3):
                        for j in range(3):
                            variance += part * n[i] * n[j] * covariance[3 * station[b] + i, 3 * station[c] + j]
            out[a] = weight[a] * variance / max(1.0 - weight[a] / total, 1e-9)
        first = last
    return out
