"""The shapes of model elements: footprints, meshes and door leaves, for whatever writes or draws the model.

Metres. A wall's own frame has x along its axis from start to end, y to the left, z up from its base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from scan2bim.geometry.meshes import Mesh, WallEnds, box_mesh, prism_mesh, wall_mesh
from scan2bim.model.elements import Area, Column, Door, Opening, Point2, Ring, Space, Stair, Storey, Wall
from scan2bim.model.queries import point_on_wall, wall_direction
from scan2bim.model.wall_outlines import wall_outlines

LEAF_THICKNESS: Final = 0.04
"""Metres: of a door leaf where it was not measured; inner door leaves are 39 to 42 mm."""
PANE_THICKNESS: Final = 0.02
"""Metres: a stand-in for a window's glazing."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A door leaf in its opening's frame: x from the jamb nearer the wall's start, y left of the axis, z from the sill.

    hinge: the turning axis. reach: signed width along x from the hinge when closed. depth: low and high y from the
    hinge when closed. height: metres. turn: sign of the rotation (counter-clockwise 1) that opens it, 0 where the
    swing is not known. angle: signed rotation as found, radians.
    """

    hinge: Point2
    reach: float
    depth: tuple[float, float]
    height: float
    turn: Literal[-1, 0, 1]
    angle: float


def wall_angle(wall: Wall) -> float:
    """Direction of the axis from start to end, radians from x."""
    dx, dy = wall_direction(wall)
    return math.atan2(dy, dx)


def to_plan(wall: Wall, x: float, y: float) -> Point2:
    """A point of the wall's frame in plan."""
    return point_on_wall(wall, x, y, 0.0)[:2]


def wall_footprints(storey: Storey) -> dict[str, Ring]:
    """Each wall's (by id) outline in plan as it joins the others, counter-clockwise, openings not cut."""
    walls = {wall.id: wall for wall in storey.walls}
    outlines = wall_outlines(storey.walls)
    return {name: tuple(to_plan(walls[name], x, y) for x, y in outline) for name, outline in outlines.items()}


def opening_outline(wall: Wall, opening: Opening) -> Ring:
    """The opening's outline in plan, counter-clockwise."""
    half, x0 = wall.thickness.value / 2, opening.offset.value
    x1 = x0 + opening.width.value
    return tuple(to_plan(wall, x, y) for x, y in ((x0, -half), (x1, -half), (x1, half), (x0, half)))


def wall_bodies(storey: Storey) -> dict[str, Mesh]:
    """Each wall's (by id) mesh with its openings cut, in the wall's own frame, ends shaped as they join the others."""
    outlines = wall_outlines(storey.walls)
    return {wall.id: _wall_body(wall, outlines[wall.id]) for wall in storey.walls}


def _wall_body(wall: Wall, outline: Ring) -> Mesh:
    rows = [
        (o.offset.value, o.offset.value + o.width.value, o.sill.value, o.sill.value + o.height.value)
        for o in wall.openings
    ]
    openings = np.array(rows, np.float64).reshape(-1, 4)
    return wall_mesh(_wall_ends(outline), wall.thickness.value, wall.height.value, openings)


def _wall_ends(outline: Ring) -> WallEnds:
    """The ends of an outline: right face from start to end, left face back; points on the axis are tips."""
    (right_start, _), (right_end, _), *rest = outline
    tip_end = rest.pop(0)[0] if rest[0][1] == 0.0 else None
    (left_end, _), (left_start, _), *last = rest
    tip_start = last[0][0] if last else None
    return WallEnds(left_start, left_end, right_start, right_end, tip_start, tip_end)


def void_body(wall: Wall, opening: Opening) -> Mesh:
    """The opening's void, in the opening's frame."""
    half = wall.thickness.value / 2
    return box_mesh((0.0, -half, 0.0), (opening.width.value, half, opening.height.value))


def pane_body(opening: Opening) -> Mesh:
    """A thin pane in the middle of a window's opening, in the opening's frame."""
    half = PANE_THICKNESS / 2
    return box_mesh((0.0, -half, 0.0), (opening.width.value, half, opening.height.value))


def area_body(area: Area) -> Mesh:
    """A slab or covering in the building's frame."""
    return prism_mesh(area.outline, area.holes, area.top.value - area.thickness.value, area.top.value)


def upright_body(element: Space | Column | Stair) -> Mesh:
    """A space, column or stair's envelope in the building's frame."""
    holes = element.holes if isinstance(element, Space) else ()
    return prism_mesh(element.outline, holes, element.base, element.base + element.height.value)


def leaf_body(leaf: Leaf) -> Mesh:
    """The closed leaf with its hinge axis at the origin."""
    low, high = sorted((0.0, leaf.reach))
    return box_mesh((low, leaf.depth[0], 0.0), (high, leaf.depth[1], leaf.height))


def door_leaves(wall: Wall, opening: Opening) -> tuple[Leaf, ...]:
    """The leaves of a door, so far as the model knows them: none where an open door's hinge, swing or angle is unknown.

    A leaf hangs flush with the face that it swings to. A closed leaf of unknown swing, or one that slides, stands in
    the wall's middle, with turn 0.
    """
    door = opening.fill
    if not isinstance(door, Door):
        return ()
    angle = 0.0 if door.state == "closed" else door.angle
    sides = _hinge_sides(door)
    if angle is not None and sides:
        return tuple(_turning_leaf(wall, opening, side, angle) for side in sides)
    if door.state == "closed":
        half = _leaf_thickness(door) / 2
        return (Leaf((0.0, 0.0), opening.width.value, (-half, half), opening.height.value, 0, 0.0),)
    return ()


def _hinge_sides(door: Door) -> tuple[str, ...]:
    """The ends of the opening at which leaves hang; none where that or the swing is not known, or the door slides."""
    if door.swing_side == "unknown" or "SLID" in door.operation:
        return ()
    if "DOUBLE" in door.operation:
        return ("start", "end")
    return () if door.hinge_side == "unknown" else (door.hinge_side,)


def _leaf_thickness(door: Door) -> float:
    return door.leaf_thickness.value if door.leaf_thickness is not None else LEAF_THICKNESS


def _turning_leaf(wall: Wall, opening: Opening, side: str, angle: float) -> Leaf:
    """The leaf that hangs at one end of the opening; where the door has two, each has half the width."""
    door = opening.fill
    assert isinstance(door, Door)
    at_start, to_left = side == "start", door.swing_side == "left"
    width = opening.width.value / len(_hinge_sides(door))
    half, thickness = wall.thickness.value / 2, min(_leaf_thickness(door), wall.thickness.value)
    turn: Literal[-1, 1] = 1 if at_start == to_left else -1
    hinge = (0.0 if at_start else opening.width.value, half if to_left else -half)
    depth = (-thickness, 0.0) if to_left else (0.0, thickness)
    return Leaf(hinge, width if at_start else -width, depth, opening.height.value, turn, turn * abs(angle))
