"""Upright bars of windows: mullions and stiles that meet, which no ray passes, between panes that some do.

Windows are symmetric: of one whose side a curtain hides, the bars and the other side tell where it is.
"""

from __future__ import annotations

import numpy as np

from scan2bim.openings.wall_image import PIXEL, Box, WallImage, part

STILE = 0.8
"""Share of the height on which a bar must be seen."""
PASSED = 0.3
"""Share of the height of a pane's columns that rays must pass, and at most a third of it of a bar's."""
WIDEST = 0.25
"""Width, metres, of the widest bar: two stiles that meet and a post."""
PANE = 0.15
"""Width, metres, beside a bar in which a pane must show."""
NARROWEST, LOWEST = 0.3, 0.5
"""Width and height, metres, of the narrowest and lowest pane beside a bar: smaller windows have none."""
RIM = 0.15
"""Metres at a window's head and sill that say nothing: frames."""


def bars_of(image: WallImage, box: Box) -> tuple[float, ...]:
    """Middles of the bars in a window, metres along the wall from its start."""
    left, right, bottom, top = box
    rows = bottom + RIM, top - RIM
    behind = part(image.behind.sum(0) > 0, left, right, *rows)
    through = part(image.through > 0, left, right, *rows)
    if rows[1] - rows[0] < LOWEST or not behind.size:
        return ()
    solid = (behind.mean(0) > STILE) & (through.mean(0) < PASSED / 3)
    pane = through.mean(0) > PASSED
    reach = round(PANE / PIXEL)
    first = max(0, round(left / PIXEL))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], solid.astype(np.int8), [0]])))
    found: list[float] = []
    for low, high in edges.reshape(-1, 2).tolist():
        beside = pane[max(0, low - reach) : low].any() and pane[high : high + reach].any()
        middle = (first + (low + high) / 2) * PIXEL
        inside = left + NARROWEST < middle < right - NARROWEST
        if beside and inside and (high - low) * PIXEL < WIDEST:
            found.append(round(middle, 4))
    return tuple(found)
