"""How thick the outer walls are at least: as deep as the reveals of their windows and doors go.

Of an outer wall, scans from inside see one face. Through its windows they see the reveal, mostly to the frame, at times
through the pane to the outer edge. What is seen there is a least thickness for the building's outer walls.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.structure.axes import Axis
from scan2bim.structure.plan import Plan
from scan2bim.structure.thicknesses import OUTER
from scan2bim.structure.walls import THICKEST

STEP = 0.10
"""Bins along the wall, metres: a reveal is a line straight into the wall, so that it fills one or two."""
BREAK = 0.09
"""Gap in depth, metres, that ends a reveal: what lies behind it is outside."""
FEWEST = 3
"""Reveals deeper than the usual wall that are needed to believe in a thicker one."""
LEAST_SHARE = 0.3
"""Share of all reveals that must go deeper than the usual wall to believe in a thicker one."""
THICKEST_OUTER = 0.5
"""Thickness, metres, beyond which depths behind a face are niches and rooms never entered, not reveals."""
ROUNDED = 0.05
"""Steps, metres, of an assumed thickness: what reveals tell of it is no finer, and it is to be the same for any scan.
"""
F64 = NDArray[np.float64]


def reveal_depths(plan: Plan, axes: Sequence[Axis]) -> list[float]:
    """Depths (metres behind the face) of the reveals in walls of which one face was seen."""
    return [
        depth
        for axis in axes
        if not (axis.measured or axis.bulge) and axis.length > 1.5
        for depth in _depths(plan, axis)
    ]


def _depths(plan: Plan, axis: Axis) -> list[float]:
    columns = plan.columns
    offset = columns.xy - axis.start
    along = offset @ axis.direction
    depth = axis.thickness / 2 - (1.0 if axis.left else -1.0) * (offset @ axis.normal)
    at = (along > STEP) & (along < axis.length - STEP) & (depth > 0.03) & (depth < THICKEST) & (columns.bins >= 4)
    found: list[float] = []
    for number in np.unique(np.floor(along[at] / STEP)):
        line = np.sort(depth[at & (np.floor(along / STEP) == number)])
        breaks = np.flatnonzero(np.diff(line) > BREAK)
        last = float(line[breaks[0]] if len(breaks) else line[-1])
        if line[0] < 0.12 < last:
            found.append(last)
    return found


def outer_thickness(depths: Sequence[float]) -> float:
    """Thickness to assume for outer walls: the usual one, or more where reveals go deeper."""
    reveals = [d for d in depths if d <= THICKEST_OUTER]
    deep = [d for d in reveals if d > OUTER]
    if len(deep) < max(FEWEST, LEAST_SHARE * len(reveals)):
        return OUTER
    thickness = float(np.percentile(deep, 75)) + 0.02
    return min(round(round(thickness / ROUNDED) * ROUNDED, 3), THICKEST_OUTER)
