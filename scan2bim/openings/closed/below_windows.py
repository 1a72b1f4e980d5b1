"""Closed doors that are windows: furniture hides the wall below a sill, and what is left has a door's sides and head.

Such a window was seen all round: right below its sill the wall's face goes on. Where a leaf with a pane does so, its
own sides go on below, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scan2bim.openings.closed.contrast import BLOCK
from scan2bim.openings.closed.rectangles import FOOT, Face
from scan2bim.openings.orthoimage import PIXEL
from scan2bim.openings.shapes import OpeningShape

LOWEST = 0.4
"""Height, metres, of the lowest sill under which enough is left to tell."""
SAME = 0.06
"""Metres within which jambs and heads are the same: frames."""
ALL_SIDES = 4
"""Sides of a window."""
LINE = 0.5
"""Share of a line below a sill that must be a discontinuity for a leaf to go on there."""


def without_windows(
    doors: Sequence[OpeningShape], found: Sequence[OpeningShape], faces: Sequence[Face]
) -> list[OpeningShape]:
    """The closed ``doors`` of a wall without those in the place of a window that was ``found`` with wall below it."""
    windows = [o for o in found if o.kind == "window" and o.sill > LOWEST and _walled(o)]
    return [d for d in doors if not any(_same(d, w) and not _goes_on(w, faces) for w in windows)]


def _walled(window: OpeningShape) -> bool:
    """Whether a window has wall beside it on all sides that nothing hides, its lower one among them."""
    left, right, lower, upper = window.hidden
    return lower == 0.0 and window.sides + sum(1 for away in (left, right, upper) if away > 0.0) >= ALL_SIDES


def _same(door: OpeningShape, window: OpeningShape) -> bool:
    left, right, _, upper = window.hidden
    beyond = window.offset - door.offset, door.offset + door.width - window.offset - window.width
    above = door.sill + door.height - window.sill - window.height
    away = zip((*beyond, above), (left, right, upper), strict=True)
    return all(-SAME < out < hidden + SAME for out, hidden in away)


def _goes_on(window: OpeningShape, faces: Sequence[Face]) -> bool:
    """Whether the sides of a window go on below its sill, on any face."""
    reach, block = round(SAME / PIXEL), BLOCK * PIXEL
    first, last = (np.array([round(z / block)]) for z in (FOOT, window.sill - block))
    for face in faces:
        for jamb in (window.offset, window.offset + window.width):
            places = np.arange(round(jamb / PIXEL) - reach, round(jamb / PIXEL) + reach + 1)
            if face.sides.share(places, first, last)[0].max() > LINE:
                return True
    return False
