"""The four sides of an opening that was looked through, on the face that shows each better."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.edges import FEWEST, MARGIN, REACH, Edge, find_edge
from scan2bim.openings.wall_image import PIXEL, PROUD, Box, WallImage, part

FARTHEST = 0.6
"""Metres outwards from what was seen of an opening within which its hidden side may lie: a curtain's width."""
TOLD = 0.25
"""Share of a strip along a side in which something must have been seen for it not to be hidden."""
BLIND = 0.1
"""Share up to which nothing was seen of it: stray ranges."""
NEIGHBOURS = 5
"""Pixels along a strip, 12 cm, in which one that was seen speaks for its neighbours."""
STANDS_OUT = 0.012
"""Metres before the wall's face from which on a point below a window is of its board's front."""
BOARD, BOARD_GAP = (0.01, 0.06), 0.01
"""Thickness of window boards, metres, and the gap between points of a front that ends it."""
BOARD_LENGTH = 0.3
"""Share of a window's width on which the front of its board must be seen."""
BOARD_SIGMA = 0.004
"""Standard deviation of a board's thickness, metres."""
F64 = NDArray[np.float64]
Sides = tuple[Edge, Edge, Edge, Edge]
"""Left, right, lower and upper."""


def seen_part(image: WallImage, box: Box) -> Box:
    """A box without the strips along its sides of which nothing was seen: a curtain may hide wall and opening there."""
    left, right, bottom, top = box
    here = part(image.told, left, right, bottom if bottom > 0.0 else MARGIN, top)
    if not here.size:
        return box
    columns, rows = np.flatnonzero(_shares(here, 0) > BLIND), np.flatnonzero(_shares(here, 1) > BLIND)
    if not len(columns) or not len(rows):
        return box
    left, right = left + columns[0] * PIXEL, right - (here.shape[1] - 1 - columns[-1]) * PIXEL
    low = rows[0] * PIXEL if bottom > 0.0 else 0.0
    return left, right, bottom + low, top - (len(here) - 1 - rows[-1]) * PIXEL


def sides_of(image: WallImage, box: Box, outer: bool) -> Sides:
    """The sides near a rough box. In ``outer`` walls, where curtains hang, they may lie far behind what hides them."""
    left, right, bottom, top = box = seen_part(image, box) if outer else box
    hidden = [_hidden_beyond(image, box, k) if outer else 0.0 for k in range(4)]
    others = [_next_one(image, box, k) for k in range(4)]
    ends = left - REACH - hidden[0], right + REACH + hidden[1], bottom - REACH - hidden[2], top + REACH + hidden[3]
    near = image.rows_within(*ends)
    along, up = image.along[near].astype(np.float64), image.up[near].astype(np.float64)
    depth, on_face, side = image.depth[near].astype(np.float64), image.on_face[near], image.side[near]
    margin = _margins(box)
    tall = (up > bottom + margin[0]) & (up < top - margin[0])
    wide = (along > left + margin[1]) & (along < right - margin[1])
    found: list[list[Edge]] = []
    near_face = depth > -PROUD
    for here in (near_face & (side == 0), near_face & (side == 1)):
        t, w = tall & here, wide & here
        edges = [
            find_edge(along[t], depth[t], on_face[t], left, 1.0, hidden[0], others[0]),
            find_edge(along[t], depth[t], on_face[t], right, -1.0, hidden[1], others[1]),
            find_edge(up[w], depth[w], on_face[w], bottom, 1.0, hidden[2], others[2]),
            find_edge(up[w], depth[w], on_face[w], top, -1.0, hidden[3], others[3]),
        ]
        found.append(edges)
    pairs = zip(*found, (1.0, -1.0, 1.0, -1.0), strict=True)
    first, second, third, fourth = (_outer(a, b, inward) for a, b, inward in pairs)
    proud = depth < -STANDS_OUT
    third = _under_board(third, along[wide & proud], up[wide & proud], right - left)
    return first, second, third, fourth


def _margins(box: Box) -> tuple[float, float]:
    """Metres from the lower and upper, and from the left and right sides of a box, in which points say nothing about
    the others.
    """
    left, right, bottom, top = box
    return min(MARGIN, (top - bottom) / 4), min(MARGIN, (right - left) / 4)


def _under_board(sill: Edge, along: F64, up: F64, width: float) -> Edge:
    """The lower edge of a window below the board that lies on it, if the front of one stands out from the wall there;
    ``along``, ``up`` (n,) are points that do.
    """
    below = sill.place - up
    near = (below > -BOARD[0]) & (below < BOARD[1] + BOARD_GAP)
    if sill.hidden > 0 or near.sum() < FEWEST:
        return sill
    front = np.sort(below[near])
    ends = np.flatnonzero(np.diff(front) > BOARD_GAP)
    last = int(ends[0]) if len(ends) else len(front) - 1
    thickness = float(front[max(0, last - last // 20)])
    long = len(np.unique(np.floor(along[near] / BOARD_GAP))) * BOARD_GAP > BOARD_LENGTH * width
    if not (long and BOARD[0] <= thickness <= BOARD[1] and front[0] < BOARD_GAP):
        return sill
    return replace(sill, place=sill.place - thickness, sigma=float(np.hypot(sill.sigma, BOARD_SIGMA)))


def _outer(a: Edge, b: Edge, inward: float) -> Edge:
    """The better of the edges of both faces, or the farther out: an open leaf hides one of them."""
    if a.wall != b.wall:
        return a if a.wall else b
    return min(a, b, key=lambda e: (e.sigma, inward * e.place))


def _hidden_beyond(image: WallImage, box: Box, side: int) -> float:
    """Metres outwards from the left (0), right, lower or upper side of a box in which neither the wall's face was seen
    nor anything behind it.
    """
    share = _beyond(image.told, box, side)
    ends = np.flatnonzero(share > TOLD)
    return float((ends[0] if len(ends) else len(share)) * PIXEL)


def _next_one(image: WallImage, box: Box, side: int) -> float:
    """Metres outwards from a side of a box to the middle of the strip of wall that parts it from another opening."""
    face = _beyond(image.face, box, side)
    walled = face > TOLD
    gone = ~walled & (_beyond(image.told & ~image.face, box, side) > TOLD)
    first = int(np.argmax(walled)) if walled.any() else len(walled)
    again = np.flatnonzero(gone[first:])
    return float((first + again[0] / 2) * PIXEL) if len(again) else np.inf


def _beyond(mask: NDArray[np.bool_], box: Box, side: int) -> F64:
    """Share of each line of pixels outwards from the left (0), right, lower or upper side of a box near which a mask
    (r, c) is set.
    """
    left, right, bottom, top = box
    tall, wide = _margins(box)
    boxes = (
        (left - FARTHEST, left - PIXEL, bottom + tall, top - tall),
        (right + PIXEL, right + FARTHEST, bottom + tall, top - tall),
        (left + wide, right - wide, bottom - FARTHEST, bottom - PIXEL),
        (left + wide, right - wide, top + PIXEL, top + FARTHEST),
    )
    lines = part(mask, *boxes[side])
    share = _shares(lines, 0 if side < 2 else 1) if lines.size else np.zeros(0)
    return share[::-1] if side in (0, 2) else share


def _shares(seen: NDArray[np.bool_], axis: int) -> F64:
    """Share of each column (axis 0) or row near which something was seen: sparse scans leave gaps."""
    kernel = np.ones((NEIGHBOURS, 1) if axis == 0 else (1, NEIGHBOURS), np.uint8)
    return np.asarray(cv2.dilate(seen.astype(np.uint8), kernel).mean(axis), np.float64)
