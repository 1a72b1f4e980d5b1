"""Unit, up axis and shift of the survey, found from headers and a sample of points.

Files state the unit seldom and the up axis never, so both are looked for and reported; settings override them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.frame import SurveyFrame, Up, up_rotation
from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.config import FrameSettings
from scan2bim.errors import PrecheckError

LARGE = 1000.0
"""Coordinates beyond 1 km from the origin are shifted: viewers and float32 lose millimetres there."""
SHIFT = 100.0
"""Metres. Shifts are multiples of this, so that as a rule two surveys of a building lie in one place."""
ONE_PLACE = 0.002
"""Metres: no tripod is set up twice so near the same place."""
F64 = NDArray[np.float64]


def find_frame(headers: Sequence[ScanHeader], samples: Sequence[Chunk], settings: FrameSettings) -> SurveyFrame:
    """Unit, up axis and shift from headers and one sample chunk per header.

    Raises PrecheckError where there are no points, or where all lie in one place.
    """
    points = _common_points(headers, samples)
    if len(points) == 0:
        raise PrecheckError(f"No scan of {len(headers)} holds a valid point. Export the scans again with their points.")
    extent = np.percentile(points, 99.5, axis=0) - np.percentile(points, 0.5, axis=0)
    if extent.max() <= 0:
        raise PrecheckError("All points lie in one place. Export the scans again with their coordinates.")
    notes: list[str] = []
    up: Up = settings.up if settings.up is not None else _find_up(points, extent, headers, notes)
    unit = _find_unit(headers, points @ up_rotation(up).T, settings, notes)
    turned = unit * points @ up_rotation(up).T
    middle = np.median(turned, axis=0)
    shift = np.where(np.abs(middle) > LARGE, _round(middle), 0.0)
    if np.abs(shift[:2]).max() > 0:
        shift[:2] = _round(middle[:2])
    if np.abs(shift).max() > 0:
        x, y, z = (f"{value:,.0f}" for value in shift)
        notes.append(f"Coordinates are large: x {x}, y {y}, z {z} m are taken off, and kept in the model.")
    crs = next((h.crs for h in headers if h.crs), None)
    _tell_one_position(headers, unit, notes)
    return SurveyFrame(unit, up, (float(shift[0]), float(shift[1]), float(shift[2])), crs, tuple(notes))


def _round(middle: F64) -> F64:
    return SHIFT * np.round(middle / SHIFT)


def _common_points(headers: Sequence[ScanHeader], samples: Sequence[Chunk]) -> F64:
    """Samples of all scans in the files' common frame, (n, 3)."""
    parts: list[F64] = []
    for header, chunk in zip(headers, samples, strict=True):
        points = chunk.xyz.astype(np.float64) + header.origin
        parts.append(points if header.pose is None else points @ header.pose.rotation.T + header.pose.translation)
    return np.concatenate(parts) if parts else np.zeros((0, 3))


def _find_up(points: F64, extent: F64, headers: Sequence[ScanHeader], notes: list[str]) -> Up:
    """The axis along which points crowd on few levels (floors and ceilings), z unless another is clearly better."""
    crowding = [_level_share(points[:, k], extent) for k in range(3)]
    best = int(np.argmax(crowding))
    if best == 2 or crowding[best] < 1.5 * crowding[2] or any(h.pose is not None for h in headers):
        return "z"
    axis: Up = "x" if best == 0 else "y"
    notes.append(
        f"The file's {axis} axis points up: {crowding[best]:.0%} of the points lie on floor and ceiling levels."
    )
    return axis


def _level_share(values: F64, extent: F64) -> float:
    """Share of the points on the two most crowded levels, of a hundredth of the smallest extent each.

    A wall is such a level too, for a horizontal axis; but a building has several walls in each direction and its
    floor and ceiling are larger than any one of them.
    """
    width = max(float(extent[extent > 0].min()) / 100, 1e-9)
    bins = np.floor((values - values.min()) / width).astype(np.int64)
    counts = np.sort(np.bincount(np.minimum(bins, 200_000)))[::-1]
    return float(counts[:4].sum() / len(values))


def _tell_one_position(headers: Sequence[ScanHeader], unit: float, notes: list[str]) -> None:
    """Scans of several places that state one position were never registered, or have lost their poses."""
    poses = [h.pose.translation for h in headers if h.pose is not None]
    if not poses:
        return
    places, counts = np.unique(np.rint(np.array(poses) * unit / ONE_PLACE), axis=0, return_counts=True)
    most = int(counts.argmax())
    if counts[most] > 1:
        x, y, z = (places[most] * ONE_PLACE / unit + 0.0).tolist()
        notes.append(
            f"{counts[most]} scans state the same scanner position ({x:.2f} {y:.2f} {z:.2f}): they are not registered "
            "to each other, or have lost their poses. Unless they were taken from one place, register them and export "
            "them again with their poses."
        )


def _find_unit(headers: Sequence[ScanHeader], turned: F64, settings: FrameSettings, notes: list[str]) -> float:
    """Metres per file unit: the setting, else the file's word, else by the height of the storeys."""
    if settings.metres_per_unit is not None:
        return settings.metres_per_unit
    stated = {h.unit for h in headers if h.unit is not None}
    if len(stated) == 1:
        return stated.pop()
    height = float(np.percentile(turned[:, 2], 99) - np.percentile(turned[:, 2], 1))
    if any(h.path.suffix.lower() == ".e57" for h in headers) and height < 500:
        return 1.0
    return _guess_unit(turned, height, notes)


def _guess_unit(turned: F64, height: float, notes: list[str]) -> float:
    """Units whose storey height (between neighbouring crowded levels) is that of a building; metres where nothing
    speaks against it.
    """
    span = float(np.ptp(turned[:, :2], axis=0).max())
    if height >= 1500 and span >= 1500:
        notes.append(f"Coordinates are taken as millimetres: the scan is {height:.0f} units high.")
        return 0.001
    if height >= 150 and span >= 150:
        notes.append(f"Coordinates are taken as centimetres: the scan is {height:.0f} units high.")
        return 0.01
    step = _storey_step(turned[:, 2])
    if step is not None and 7.2 <= step <= 13.0 and height <= 3.2 * step:
        notes.append(f"Coordinates are taken as feet: floor and ceiling are {step:.2f} units apart.")
        return 0.3048
    return 1.0


def _storey_step(z: F64) -> float | None:
    """Distance between the two most crowded levels, in file units; None where there are no clear levels."""
    low, high = np.percentile(z, [0.2, 99.8])
    counts, edges = np.histogram(z, bins=400, range=(float(low), float(high)))
    strong = np.flatnonzero(counts > 5 * max(float(np.median(counts)), 1.0))
    levels = [float(edges[g].mean()) for g in np.split(strong, np.flatnonzero(np.diff(strong) > 4) + 1) if len(g)]
    gaps = [b - a for a, b in pairwise(levels)]
    return max(gaps) if gaps else None
