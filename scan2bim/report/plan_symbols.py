"""The signs of a plan: doors with leaf and swing, windows, passages, stairs, scanners."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from scan2bim.model.dimension_lines import outer_side
from scan2bim.model.elements import Door, Opening, Point3, Stair, Wall, Window
from scan2bim.model.shapes import Leaf, door_leaves, opening_outline, to_plan
from scan2bim.report.palette import FAINT, INK, SCANNER, opening_colour, pale
from scan2bim.report.sheet import Floats, Mark, Rgb, Shape, Text, View, line

_ARC_STEP = math.radians(4.0)
_QUARTER = math.pi / 2


def draw_opening(view: View, wall: Wall, opening: Opening) -> Iterator[Mark]:
    """The gap in the wall in the colour of its state, its jambs, and what fills it."""
    colour = opening_colour(opening)
    outline = view.page(opening_outline(wall, opening))
    yield Shape((outline,), fill=pale(colour, 0.3))
    for jamb in (outline[[0, 3]], outline[[1, 2]]):
        yield line(jamb, INK, 2)
    match opening.fill:
        case Door():
            yield from _door(view, wall, opening, colour)
        case Window():
            yield from _window(view, wall, opening, colour)
        case _:
            for face in (outline[[0, 1]], outline[[3, 2]]):
                yield line(face, colour, 1, dash=4)


def draw_stair(view: View, stair: Stair) -> Iterator[Mark]:
    """The outline, a line for each riser where their number is known, and an arrow along it."""
    import shapely

    yield Shape((view.page(stair.outline),), fill=(255, 255, 255), stroke=FAINT, width=1, opacity=0.8)
    box = shapely.Polygon(stair.outline).minimum_rotated_rectangle
    if not isinstance(box, shapely.Polygon):
        return
    a, b, c, d = (np.array(point) for point in list(box.exterior.coords)[:4])
    if np.linalg.norm(b - a) < np.linalg.norm(c - b):
        a, b, c, d = b, c, d, a
    for share in np.linspace(0, 1, (stair.risers or 2))[1:-1]:
        yield line(view.page(np.stack([a + share * (b - a), d + share * (c - d)])), FAINT, 1)
    middle = (a + b + c + d) / 4
    yield _label(view, middle, stair.name, 11, FAINT)


def draw_scanner(view: View, position: Point3) -> Iterator[Mark]:
    """A small cross in a ring."""
    x, y = view.page([position[:2]])[0].tolist()
    angles = np.linspace(0, math.tau, 17)[:-1]
    yield Shape((np.column_stack([x + 5 * np.cos(angles), y + 5 * np.sin(angles)]),), stroke=SCANNER)
    for dx, dy in ((8, 0), (0, 8)):
        yield line(np.array([[x - dx, y - dy], [x + dx, y + dy]], np.float64), SCANNER, 1)


def opening_label(view: View, wall: Wall, opening: Opening, further: float = 0.0) -> Text:
    """Width and height in metres beside the opening: inside, where lengths are written outside, behind what a leaf
    sweeps; else on the side to which no leaf swings. further: pixels that it is moved away from there.
    """
    swing = {"left": 1, "right": -1}.get(opening.fill.swing_side, 0) if isinstance(opening.fill, Door) else 0
    side = -outer_side(wall) or -swing or -1
    x, y = opening.offset.value + opening.width.value / 2, wall.thickness.value / 2
    if isinstance(opening.fill, Door) and swing == side:
        y += opening.width.value / (opening.fill.leaves or 1)
    foot, tip = (view.page([to_plan(wall, x, side * reach)])[0] for reach in (y, y + 1.0))
    direction = (tip - foot) / view.scale
    words = f"{opening.width.value:.2f} × {opening.height.value:.2f}"
    half_width = 0.28 * 10 * len(words)  # pixels of a text of size 10
    reach = 8 + further + abs(float(direction[0])) * half_width
    place = foot + direction * reach
    return Text(float(place[0]), float(place[1]) + 4, words, 10, opening_colour(opening), "middle", halo=True)


def _label(view: View, place: Floats, words: str, size: float, colour: Rgb) -> Text:
    x, y = view.page(place.reshape(1, 2))[0].tolist()
    return Text(x, y + size / 3, words, size, colour, "middle", halo=True)


def _window(view: View, wall: Wall, opening: Opening, colour: Rgb) -> Iterator[Mark]:
    half, x0 = wall.thickness.value / 2, opening.offset.value
    x1 = x0 + opening.width.value
    for y in (-half, 0.0, half):
        yield line(view.page([to_plan(wall, x0, y), to_plan(wall, x1, y)]), colour, 2 if y == 0.0 else 1)


def _door(view: View, wall: Wall, opening: Opening, colour: Rgb) -> Iterator[Mark]:
    leaves = door_leaves(wall, opening)
    for leaf in leaves:
        yield from _leaf(view, wall, opening, leaf, colour)
    if not leaves:
        middle = np.mean(opening_outline(wall, opening), axis=0)
        yield _label(view, middle, "?", 16, colour)


def _leaf(view: View, wall: Wall, opening: Opening, leaf: Leaf, colour: Rgb) -> Iterator[Mark]:
    """The leaf as it stands, and the quarter circle (or more) that it sweeps."""
    sweep = np.arange(0.0, max(_QUARTER, abs(leaf.angle)) + _ARC_STEP / 2, _ARC_STEP) * leaf.turn
    if leaf.turn:
        arc = np.column_stack([np.cos(sweep), np.sin(sweep)]) * leaf.reach
        yield line(_place(view, wall, opening, leaf, arc), colour, 1)
    low, high = leaf.depth
    corners = np.array([[0.0, low], [leaf.reach, low], [leaf.reach, high], [0.0, high]])
    c, s = math.cos(leaf.angle), math.sin(leaf.angle)
    turned = corners @ np.array([[c, s], [-s, c]])
    yield Shape((_place(view, wall, opening, leaf, turned),), fill=colour, stroke=colour, width=2)


def _place(view: View, wall: Wall, opening: Opening, leaf: Leaf, points: Floats) -> Floats:
    """Points about the hinge, (n, 2) metres, on the page."""
    x, y = opening.offset.value + leaf.hinge[0], leaf.hinge[1]
    return view.page([to_plan(wall, x + dx, y + dy) for dx, dy in points.tolist()])
