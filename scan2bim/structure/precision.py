"""How precisely a wall's place, thickness and length are known, from the fits of its faces and its neighbours'."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.shapes import WallShape

F64 = NDArray[np.float64]

ALIKE = 0.5
"""Length, metres, over which what is left of a fit is alike: plaster waves, a scan's shift. It counts once."""
BETWEEN_SCANS = 0.001
"""Standard deviation, metres, of a scan's own place, which one scan of a face does not show."""

FREE_END = 0.015
"""Standard deviation, metres, of an end that meets no wall: that of a place within a plan column of 5 cm."""


def face_sigma(places: F64, distances: F64) -> float | None:
    """Standard deviation, metres, of where a face lies, from the places along it (n,) and the distances to the fitted
    line (n,) of what was seen of it; None of a face that was not seen.
    """
    if not len(places):
        return None
    stretches = len(np.unique(np.floor(places / ALIKE)))
    return math.sqrt(float(np.mean(distances**2)) / stretches + BETWEEN_SCANS**2)


def wall_sigmas(places: F64, distances: F64, length: float) -> tuple[float | None, float | None]:
    """Standard deviations, metres, of a wall's place across it and of its thickness, None where its faces were not
    seen: from what was seen of them as ``FaceEvidence.on_faces`` gives it.
    """
    second = places > length
    sigmas = [s for on in (~second, second) if (s := face_sigma(places[on], distances[on])) is not None]
    if len(sigmas) == 2:
        both = math.hypot(*sigmas)
        return both / 2, both
    return (sigmas[0] if sigmas else None), None


def length_sigma(wall: WallShape, walls: Sequence[WallShape]) -> float | None:
    """Standard deviation, metres, of a wall's length: that of the axes on which its ends lie, ``walls`` of its storey.
    None where such an axis hangs on an assumed thickness.
    """
    ends: list[float] = []
    for at in ("start", "end"):
        met = next((walls[j.other] for j in wall.joins if j.at == at), None)
        if met is None:
            ends.append(FREE_END)
        elif met.thickness_sigma is None or met.position_sigma is None:
            return None
        else:
            unknown = met.thickness_sigma / 2 if met.faces == 1 else 0.0
            ends.append(math.hypot(met.position_sigma, unknown) / max(_sine(wall, met), 0.1))
    return math.hypot(*ends)


def _sine(one: WallShape, other: WallShape) -> float:
    a, b = (np.array(w.end) - np.array(w.start) for w in (one, other))
    return abs(float(a[0] * b[1] - a[1] * b[0])) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-9)
