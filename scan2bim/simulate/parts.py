"""The patches of a wall: its faces round the openings, reveals, casings, door leaves and window frames."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.scene import DoorSpec, Rgb, StoreySpec, WallSpec, WindowSpec, turn, wall_directions, wall_extents

F64 = NDArray[np.float64]

FINISHES = ("plain", "paint", "wood", "print", "cloth", "metal")
"""How a surface's colour varies over it, and how it reflects: what they mean stands in ``appearance``."""
CASING_DEPTH = 0.012
"""How far a door's casing stands out of the wall's face, metres: a usual flat trim."""
FRAME_DEPTH = 0.07
"""Depth of a window frame, metres: a usual 70 mm profile."""
SKIRTING_DEPTH = 0.014
"""How far skirting boards stand out, metres."""
SKIRTING_COLOUR: Rgb = (206, 202, 194)
STOP = (0.013, 0.025)
"""How far the stop behind a leaf with gaps reaches into the opening, and its depth, metres: a usual rebate."""
FLOOR_GAP = 0.006
"""Under a leaf with gaps, metres."""
GLASS_COLOUR: Rgb = (150, 165, 165)
HANDLE_COLOUR: Rgb = (96, 98, 102)
HANDLE_HEIGHT = 1.05
"""Of a door's handle above the leaf's lower edge, metres (DIN 18101)."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """One parallelogram, or half of it: a triangle. origin, u, v (3,) float64."""

    element: str
    origin: F64
    u: F64
    v: F64
    rgb: Rgb
    half: bool = False
    finish: str = "plain"
    glass: bool = False


@dataclass(frozen=True, slots=True)
class Hole:
    """A rectangle cut out of a wall, in the wall's own coordinates: x along, z up from the storey's floor."""

    x0: float
    x1: float
    z0: float
    z1: float


@dataclass(frozen=True, slots=True, eq=False)
class WallFrame:
    """The wall's own coordinates: x along its axis from the start, y to the left, z up from the storey's floor."""

    origin: F64
    axes: F64

    def point(self, x: float, y: float, z: float) -> F64:
        """(3,) in the scene's frame."""
        return self.origin + self.axes @ np.array([x, y, z])

    def box(
        self,
        element: str,
        low: tuple[float, float, float],
        high: tuple[float, float, float],
        rgb: Rgb,
        finish: str = "plain",
    ) -> Iterable[Patch]:
        """The sides of a box between two corners."""
        size = np.subtract(high, low)
        return box_patches(element, self.point(*low), self.axes * size, rgb, finish)


def wall_frame(wall: WallSpec, storey: StoreySpec) -> WallFrame:
    """The wall's own coordinates."""
    along, left = wall_directions(wall)
    return WallFrame(np.array([*wall.start, storey.elevation]), np.column_stack([along, left, [0.0, 0.0, 1.0]]))


def box_patches(element: str, corner: F64, edges: F64, rgb: Rgb, finish: str = "plain") -> Iterable[Patch]:
    """The six sides of the box at ``corner`` (3,) with the edge vectors ``edges[:, i]``, (3, 3)."""
    a, b, c = edges.T
    for u, v, w in ((a, b, c), (b, c, a), (c, a, b)):
        yield Patch(element, corner, u, v, rgb, finish=finish)
        yield Patch(element, corner + w, u, v, rgb, finish=finish)


def wall_patches(wall: WallSpec, storey: StoreySpec) -> Iterable[Patch]:
    """The wall with all that it hosts."""
    frame = wall_frame(wall, storey)
    holes = [_hole(opening) for opening in (*wall.doors, *wall.windows)]
    yield from _faces(wall, storey, frame, holes)
    for hole in holes:
        yield from _reveals(wall, frame, hole)
    if wall.skirting > 0.0:
        yield from _skirting(wall, storey, frame)
    for door in wall.doors:
        yield from door_patches(door, wall, frame)
    for window in wall.windows:
        yield from window_patches(window, frame)


def _hole(opening: DoorSpec | WindowSpec) -> Hole:
    x0, z0 = opening.offset, opening.sill
    return Hole(x0, x0 + opening.width, z0, z0 + opening.height)


def _faces(wall: WallSpec, storey: StoreySpec, frame: WallFrame, holes: list[Hole]) -> Iterable[Patch]:
    before, after = wall_extents(wall, storey)
    x0, x1, half = -before, wall.length + after, wall.thickness / 2
    for y, rgb in ((half, wall.left_colour), (-half, wall.right_colour)):
        for part in rectangles_around(Hole(x0, x1, 0.0, storey.height), holes):
            yield _face(wall, frame, part, y, rgb)
    for x in (x0, x1):
        sideways = frame.axes[:, 1] * wall.thickness
        yield Patch(wall.name, frame.point(x, -half, 0.0), sideways, frame.axes[:, 2] * storey.height, wall.left_colour)


def _face(wall: WallSpec, frame: WallFrame, part: Hole, y: float, rgb: Rgb) -> Patch:
    u, v = frame.axes[:, 0] * (part.x1 - part.x0), frame.axes[:, 2] * (part.z1 - part.z0)
    return Patch(wall.name, frame.point(part.x0, y, part.z0), u, v, rgb, finish=wall.finish)


def _skirting(wall: WallSpec, storey: StoreySpec, frame: WallFrame) -> Iterable[Patch]:
    """Boards along the feet of both faces, left out before the doors and their casings."""
    before, after = wall_extents(wall, storey)
    doors = [Hole(d.offset - d.casing, d.offset + d.width + d.casing, 0.0, wall.skirting) for d in wall.doors]
    low, high = wall.thickness / 2, wall.thickness / 2 + SKIRTING_DEPTH
    for part in rectangles_around(Hole(-before, wall.length + after, 0.0, wall.skirting), doors):
        for y0, y1 in ((low, high), (-high, -low)):
            yield from frame.box(wall.name, (part.x0, y0, 0.0), (part.x1, y1, part.z1), SKIRTING_COLOUR)


def rectangles_around(whole: Hole, holes: list[Hole]) -> list[Hole]:
    """The part of ``whole`` outside ``holes`` as rectangles, column by column between the holes' jambs."""
    cuts = sorted({whole.x0, whole.x1, *(x for h in holes for x in (h.x0, h.x1) if whole.x0 < x < whole.x1)})
    found: list[Hole] = []
    for x0, x1 in itertools.pairwise(cuts):
        level = whole.z0
        for hole in sorted((h for h in holes if h.x0 < x1 and h.x1 > x0), key=lambda h: h.z0):
            found.append(Hole(x0, x1, level, hole.z0))
            level = hole.z1
        found.append(Hole(x0, x1, level, whole.z1))
    return [part for part in found if part.z1 - part.z0 > 1e-9]


def _reveals(wall: WallSpec, frame: WallFrame, hole: Hole) -> Iterable[Patch]:
    across = frame.axes[:, 1] * wall.thickness
    wide, tall = frame.axes[:, 0] * (hole.x1 - hole.x0), frame.axes[:, 2] * (hole.z1 - hole.z0)
    low = frame.point(hole.x0, -wall.thickness / 2, hole.z0)
    yield Patch(wall.name, low, across, tall, wall.left_colour)
    yield Patch(wall.name, low + wide, across, tall, wall.left_colour)
    yield Patch(wall.name, low + tall, across, wide, wall.left_colour)
    if hole.z0 > 0.0:
        yield Patch(wall.name, low, across, wide, wall.left_colour)


def door_patches(door: DoorSpec, wall: WallSpec, frame: WallFrame) -> Iterable[Patch]:
    """A door's casing on both faces, its leaves with handles, and the stop behind leaves with gaps."""
    if door.casing > 0.0:
        for side in (1.0, -1.0):
            yield from _casing(door, side * wall.thickness / 2, side * (wall.thickness / 2 + CASING_DEPTH), frame)
    if not door.leaf:
        return
    if door.gap > 0.0:
        yield from _stop(door, wall, frame)
    for leaf in leaves_of(door):
        yield from _leaf(leaf, wall, frame)


def leaves_of(door: DoorSpec) -> list[DoorSpec]:
    """Each leaf as a door of its own within the gaps."""
    width = (door.width - door.gap * (door.leaves + 1)) / door.leaves
    floor = FLOOR_GAP if door.gap > 0.0 else 0.0
    inner = dataclasses.replace(
        door,
        offset=door.offset + door.gap,
        width=width,
        sill=door.sill + floor,
        height=door.height - floor - door.gap,
        leaves=1,
    )
    if door.leaves == 1:
        return [inner]
    second = dataclasses.replace(inner, offset=inner.offset + width + door.gap, hinge="end")
    return [dataclasses.replace(inner, hinge="start"), second]


def _stop(door: DoorSpec, wall: WallSpec, frame: WallFrame) -> Iterable[Patch]:
    """Strips at jambs and head behind the closed leaf, and behind the meeting of two leaves."""
    side = 1.0 if door.swing == "left" else -1.0
    y0 = side * (wall.thickness / 2 - door.recess - door.leaf_thickness)
    low, high = sorted((y0, y0 - side * STOP[1]))
    x0, x1, top, reach = door.offset, door.offset + door.width, door.sill + door.height, STOP[0]
    strips = [(x0, x0 + reach, door.sill, top), (x1 - reach, x1, door.sill, top), (x0, x1, top - reach, top)]
    middle = (x0 + x1) / 2
    if door.leaves == 2 and door.angle == 0.0:
        strips.append((middle - reach / 2, middle + reach / 2, door.sill, top))
    for a, b, c, d in strips:
        yield from frame.box(door.name, (a, low, c), (b, high, d), door.casing_colour or door.colour)


def _casing(door: DoorSpec, y0: float, y1: float, frame: WallFrame) -> Iterable[Patch]:
    x0, x1, top, low, high = door.offset, door.offset + door.width, door.sill + door.height, min(y0, y1), max(y0, y1)
    colour = door.casing_colour or door.colour
    for a, b in ((x0 - door.casing, x0), (x1, x1 + door.casing)):
        yield from frame.box(door.name, (a, low, door.sill), (b, high, top), colour)
    yield from frame.box(door.name, (x0 - door.casing, low, top), (x1 + door.casing, high, top + door.casing), colour)


def leaf_frame(door: DoorSpec, wall: WallSpec, frame: WallFrame) -> WallFrame:
    """Coordinates of the leaf: origin at the hinge's foot, x along it, y from its outer side into it, z up."""
    side = 1.0 if door.swing == "left" else -1.0
    toward = 1.0 if door.hinge == "start" else -1.0
    x = door.offset if door.hinge == "start" else door.offset + door.width
    pivot = frame.point(x, side * (wall.thickness / 2 - door.recess), door.sill)
    opened = turn(side * toward * door.angle)
    axes = opened @ frame.axes @ np.diag([toward, -side, 1.0])
    return WallFrame(pivot, axes)


def _leaf(door: DoorSpec, wall: WallSpec, frame: WallFrame) -> Iterable[Patch]:
    leaf = leaf_frame(door, wall, frame)
    width, thickness, height = door.width, door.leaf_thickness, door.height
    yield from leaf.box(door.name, (0.0, 0.0, 0.0), (width, thickness, height), door.colour, door.finish)
    for low, high in ((-0.05, -0.03), (thickness + 0.03, thickness + 0.05)):
        start, end = (width - 0.17, low, HANDLE_HEIGHT - 0.01), (width - 0.05, high, HANDLE_HEIGHT + 0.01)
        yield from leaf.box(door.name, start, end, HANDLE_COLOUR)


def window_patches(window: WindowSpec, frame: WallFrame) -> Iterable[Patch]:
    """A window's frame and mullions, in the middle of the wall."""
    hole, bar = _hole(window), window.frame
    centres = np.linspace(hole.x0, hole.x1, window.mullions + 2)[1:-1]
    uprights = [(hole.x0, hole.x0 + bar), (hole.x1 - bar, hole.x1), *((c - bar / 2, c + bar / 2) for c in centres)]
    rails = [(hole.z0, hole.z0 + bar), (hole.z1 - bar, hole.z1)]
    y0, y1 = -FRAME_DEPTH / 2, FRAME_DEPTH / 2
    for a, b in uprights:
        yield from frame.box(window.name, (float(a), y0, hole.z0), (float(b), y1, hole.z1), window.colour)
    for a, b in rails:
        yield from frame.box(window.name, (hole.x0, y0, a), (hole.x1, y1, b), window.colour)
    if window.pane:
        u, v = frame.axes[:, 0] * window.width, frame.axes[:, 2] * window.height
        yield Patch(window.name, frame.point(hole.x0, 0.0, hole.z0), u, v, GLASS_COLOUR, glass=True)
