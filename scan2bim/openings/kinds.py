"""What an opening that was looked through is: a door, a window or a passage, glazed or not, or no opening at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.shapes import Kind
from scan2bim.openings.wall_image import PIXEL, Box, WallImage, part
from scan2bim.structure.shapes import WallShape

NARROWEST, WIDEST_DOOR = 0.45, 2.6
"""Clear widths of doors, metres (trade: single 0.5 to 1.5, double to 2.5)."""
WIDEST_SINGLE = 1.3
"""Clear width, metres, up to which an opening whose lintel cannot be seen (scan cut below the ceiling) is taken for a
door; and of the widest single leaf."""
LOWEST_HEAD, HIGHEST_SILL = 1.55, 0.05
"""A door's head lies at least this high over the floor, its sill at most this high, metres."""
LOWEST_GLAZED = 1.9
"""Height, metres, of the lowest glazed door: lower ones are windows that reach the floor."""
TALLEST_GLAZED = 2.6
"""Height, metres, of the tallest glazed door: taller fronts do not open."""
WIDEST_PAIR = 2.2
"""Clear width, metres, of the widest pair of glazed leaves."""
STILE = 0.8
"""Share of the height on which the stiles in the middle of a pair of leaves must be seen."""
RING = 0.3
"""Width, metres, of the ring round a part of an opening in which the wall's density of points is taken."""
SOLID = 0.8
"""Share of the wall's density of points from which on a thing is solid: panes return fewer."""
PANE = 0.6
"""Share of the wall's density of points up to which a recessed rectangle that nobody looked through is a pane."""
RIM = 0.15
"""Width, metres, of an opening's rim, in which lining and frame are left out when panes are looked for."""
GLASS = 0.1
"""Share of the face round a window that was looked through from which on it is glass: beside windows less than a
hundredth is."""
FRAMES = (0.025, 0.1)
"""Metres from an opening's sides between which its frame shows: reveals are nearer."""
PLANE = 0.015
"""Metres from a pane within which what came back from it lies: noise and registration."""
CELL, ALL_OVER = 0.1, 0.5
"""Squares, metres, of which a pane must have sent back something from more than this share: a pulse in twenty comes
back even at a slant."""
WHOLE = 0.12
"""Distance, metres, to the wall's ends, head and foot, within which an opening is the whole wall: a glass front or no
wall at all."""
Mask = NDArray[np.bool_]


def wall_above(image: WallImage, left: float, right: float, top: float) -> bool:
    """Whether the wall's face was seen above the opening."""
    above = part(image.face, left, right, top + PIXEL, top + 0.4)
    return bool(above.size and above.mean() > 0.1)


def kind_of(wall: WallShape, image: WallImage, box: Box, lintel: bool) -> tuple[Kind, int]:
    """What a rectangle is, and how many leaves it has if it is a closed glazed door, else 0."""
    leaves = _glazed_leaves(wall, image, box)
    return ("door", leaves) if leaves else (_kind(wall, image, box, lintel), 0)


def _kind(wall: WallShape, image: WallImage, box: Box, lintel: bool) -> Kind:
    left, right, bottom, top = box
    outer = not (wall.left and wall.right)
    if bottom > HIGHEST_SILL:
        return "window" if outer or _framed(image, box) or glazed(image, box) else "passage"
    if top < LOWEST_HEAD:
        return "window" if outer else "passage"
    if glazed(image, box) if outer else _paned(wall, image, box):
        return "window"
    door_like = lintel or (not wall.top_seen and right - left <= WIDEST_SINGLE)
    return "door" if door_like and NARROWEST <= right - left <= WIDEST_DOOR else "passage"


def _glazed_leaves(wall: WallShape, image: WallImage, box: Box) -> int:
    """Leaves of a closed glazed door, 0 of anything else: one walks through it, and two leaves meet in its middle."""
    left, right, bottom, top = box
    if bottom > 0.0 or not LOWEST_GLAZED <= top <= TALLEST_GLAZED:
        return 0
    if not (_paned(wall, image, box) if wall.left and wall.right else glazed(image, box)):
        return 0
    width = right - left
    if width <= WIDEST_SINGLE:
        return 1
    middle = part(image.behind.sum(0) > 0, left + 0.4 * width, right - 0.4 * width, bottom + RIM, top - RIM)
    return 2 if width <= WIDEST_PAIR and middle.size and middle.mean(0).max() > STILE else 0


def glazed(image: WallImage, box: Box) -> bool:
    """Whether something hangs in the opening between its sides, within the wall: panes return some pulses, bars and
    frames all.
    """
    left, right, bottom, top = box
    inside = part(image.behind.sum(0) > 0, left + RIM, right - RIM, bottom + RIM, top - RIM)
    return bool(inside.size and inside.mean() > 0.08)


def _framed(image: WallImage, box: Box) -> bool:
    """Whether a frame stands in an opening, within the wall, beside half of its sides or more: holes have none."""
    left, right, bottom, top = box
    there = image.behind.sum(0) > 0
    low, high = FRAMES
    strips = (
        part(there, left + low, left + high, bottom, top).any(1),
        part(there, right - high, right - low, bottom, top).any(1),
        part(there, left, right, bottom + low, bottom + high).any(0),
        part(there, left, right, top - high, top - low).any(0),
    )
    return sum(1 for strip in strips if strip.size and strip.mean() > 0.5) >= 2


def _paned(wall: WallShape, image: WallImage, box: Box) -> bool:
    """Whether a pane stands in an opening of an inner wall: all over it some pulses came back from one plane within the
    wall where others went through.
    """
    left, right, bottom, top = box
    rows = image.rows_within(left + RIM, right - RIM, bottom + RIM, top - RIM)
    rows = rows[~image.on_face[rows]]
    across = np.where(image.side[rows] == 0, image.depth[rows], wall.thickness - image.depth[rows])
    if not len(across) or density(image, (left + RIM, right - RIM, bottom + RIM, top - RIM)) > SOLID:
        return False
    plane = float(np.median(across))
    near = np.abs(across - plane) < PLANE
    if not 0.0 < plane < wall.thickness or near.mean() < SOLID:
        return False
    x, z = image.along[rows][near], image.up[rows][near]
    clear = image.through[_pixels(z), _pixels(x)] > 0
    cells = np.floor(np.column_stack([x - left, z - bottom])[clear] / CELL)
    whole = (right - left - 2 * RIM) * (top - bottom - 2 * RIM) / CELL**2
    return len(np.unique(cells, axis=0)) > ALL_OVER * whole


def _pixels(places: NDArray[np.float32]) -> NDArray[np.int64]:
    """Rows or columns of places (n,) within an image."""
    return np.floor(places / PIXEL).astype(np.int64)


def is_pane(wall: WallShape, image: WallImage, box: Box) -> bool:
    """Whether a rectangle in an outer wall, which nobody looked through, is a pane all the same: it returned fewer
    pulses than its surroundings.
    """
    left, right, bottom, top = box
    if (wall.left and wall.right) or min(right - left, top - bottom) < 3 * RIM:
        return False
    return density(image, (left + RIM, right - RIM, bottom + RIM, top - RIM)) < PANE


def solid(image: WallImage, box: Box) -> bool:
    """Whether a part of the opening returned as many pulses as the wall round it: a leaf or a panel, no pane."""
    return density(image, box) > SOLID


def density(image: WallImage, box: Box) -> float:
    """Points a pixel behind the face within a rectangle, by those on the face round it; nan where there are none."""
    left, right, bottom, top = box
    ring = left - RING, right + RING, bottom - RING, top + RING
    here = part(image.behind[0], *box) + part(image.behind[1], *box)
    around = part(image.faces[0], *ring) + part(image.faces[1], *ring)
    wall = around[around > 0]
    return float(here.mean() / wall.mean()) if here.size and len(wall) else np.nan


def in_glass(image: WallImage, box: Box) -> bool:
    """Whether the wall round a rectangle was looked through, too: it is a part of a glass front."""
    left, right, bottom, top = box
    around = left - RING, right + RING, bottom - RING, top + RING
    face = part(image.face, *around).copy()
    low, first = (
        max(0, round((bottom - max(around[2], 0.0)) / PIXEL)),
        max(0, round((left - max(around[0], 0.0)) / PIXEL)),
    )
    face[low : low + round((top - bottom) / PIXEL), first : first + round((right - left) / PIXEL)] = False
    clear = part((image.through > 0) & ~image.lost, *around)
    return bool(face.any() and clear[face].mean() > GLASS)


def is_recess(wall: WallShape, image: WallImage, box: Box) -> bool:
    """Whether what stands back from the floor up to the wall's upper edge is as solid as the wall: it is wall, too."""
    bare = box[2] + wall.top - wall.base - box[3]
    return bare < 2 * WHOLE and solid(image, (box[0] + RIM, box[1] - RIM, box[2] + RIM, box[3] - RIM))


def share(mask: Mask, box: Box) -> float:
    """Share of a box that a mask (r, c) fills."""
    inside = part(mask, *box)
    return float(inside.mean()) if inside.size else 0.0
