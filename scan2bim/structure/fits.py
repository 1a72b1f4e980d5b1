"""One visible wall side in plan, and the robust fit of its line."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.medians import median
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.columns import Columns

BAND = 0.025
"""Half-width of a face, metres: three times a scanner's noise and registration error together."""
SPARSE = 2 * PLAN
"""Metres apart at which columns still fill a stretch: far scanners see stripes of a wall that they look along."""
NEAR = 0.012
"""Distance from a face, metres, within which columns side by side across it are parts of one surface: noise and
registration; trims stand out by more."""
ROUNDS = 5
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """One visible wall side in plan. ``centre`` (2,), ``normal`` (2,) unit, towards the air in front; ``low`` and
    ``high`` its extent along the direction (``normal`` turned by -90 degrees: with the air on the left when walking
    along it); ``columns`` indices into the plan's columns; ``rms`` metres; ``tall`` metres of its length that reach the
    ceiling zone; ``sided`` whether stations tell on which side the air is; ``glass`` a front of panes; ``lintel`` known
    from where the ceiling ends before glazing, not from columns.
    """

    centre: F64
    normal: F64
    low: float
    high: float
    columns: I64
    rms: float
    tall: float
    sided: bool
    glass: bool = False
    lintel: bool = False

    @property
    def direction(self) -> F64:
        """Unit vector along the face, air on the left."""
        return np.array([self.normal[1], -self.normal[0]])

    @property
    def length(self) -> float:
        """Metres from end to end."""
        return self.high - self.low

    def ends(self, margin: float = 0.0) -> F64:
        """End points (2, 2), moved outwards by ``margin`` metres."""
        (x, y), (nx, ny) = self.centre.tolist(), self.normal.tolist()  # thousands are asked: plain numbers are faster
        low, high = self.low - margin, self.high + margin
        return np.array([[x + low * ny, y - low * nx], [x + high * ny, y - high * nx]])


def fit_line(columns: Columns, at: I64, wall_like: NDArray[np.bool_], normal: F64 | None = None) -> Face:
    """Robust line through columns ``at``, weighted by how tall they are; ``normal`` fixes its direction."""
    xy = columns.xy[at]
    tall = columns.bins[at].astype(np.float64) * np.where(wall_like[at], 1.0, 0.3)
    weight = tall
    centre, n = np.zeros(2), np.zeros(2)
    distance = np.zeros(len(at))
    for _ in range(3):
        centre = np.average(xy, axis=0, weights=weight)
        n = _smallest_axis(xy - centre, weight) if normal is None else normal
        distance = (xy - centre) @ n
        scale = max(1.4826 * float(median(np.abs(distance))), 0.001)
        weight = tall / (1 + (distance / (2 * scale)) ** 2) ** 2 + 1e-9
    lean = float((columns.view[at] @ n).mean())
    sided = abs(lean) > 0.1
    if lean < 0:
        n = -n
    along = (xy - centre) @ np.array([n[1], -n[0]])
    near = np.abs(distance) <= BAND
    return Face(
        centre,
        n,
        float(along.min()) - PLAN / 2,
        float(along.max()) + PLAN / 2,
        at,
        float(np.sqrt(np.average(distance[near] ** 2, weights=weight[near]))) if near.any() else BAND,
        covered_length(along[wall_like[at]], SPARSE if sided else PLAN),  # stripes are those of far scanners
        sided,
    )


def settled(columns: Columns, face: Face, wall_like: NDArray[np.bool_]) -> Face:
    """A face moved along its normal to where its surface lies, strip by strip along it.

    A surface at the edge of voxels lies in two columns, of which the emptier lies farther off: their points count
    together. The mean of all that lies about a line would be drawn to trims and skirtings.
    """
    offset = columns.xy[face.columns] - face.centre
    away = offset @ face.normal
    tall = columns.bins[face.columns] * np.where(wall_like[face.columns], 1.0, 0.3)
    points = columns.points[face.columns].astype(np.float64)
    _, strip = np.unique(np.floor(offset @ face.direction / PLAN), return_inverse=True)
    place = 0.0
    for _ in range(ROUNDS):
        near = np.abs(away - place) < NEAR
        count = np.bincount(strip[near], points[near])
        height = np.bincount(strip[near], tall[near])
        seen = count > 0
        if not seen.any():
            return face
        off = np.bincount(strip[near], (points * away)[near])[seen] / count[seen] - place
        scale = max(1.4826 * float(median(np.abs(off))), 0.001)
        place += float(np.average(off, weights=height[seen] / (1 + (off / (2 * scale)) ** 2) ** 2))
    return replace(face, centre=face.centre + place * face.normal)


def _smallest_axis(offset: F64, weight: F64) -> F64:
    covariance = (offset * weight[:, None]).T @ offset
    return np.linalg.eigh(covariance)[1][:, 0]
