"""The shapes of model elements: footprints, meshes and door leaves, for whatever writes or draws the model.

Metres. A wall's own frame has x along its axis from start to end, y to the left, z up from its base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.meshes import EMPTY, Mesh, box_mesh, merge_meshes, plate_mesh, prism_mesh, stepped_mesh
from scan2bim.geometry.wall_meshes import WallEnds, WallForm, wall_mesh
from scan2bim.model.ceilings import space_body
from scan2bim.model.elements import (
    Area,
    Beam,
    Column,
    Door,
    Opening,
    Point2,
    Ring,
    RoofPlane,
    Space,
    Stair,
    Storey,
    Wall,
    Window,
)
from scan2bim.model.queries import point_on_wall, wall_arc, wall_direction
from scan2bim.model.wall_outlines import wall_outlines

LEAF_THICKNESS: Final = 0.04
"""Metres: of a door leaf where it was not measured; inner door leaves are 39 to 42 mm."""
PANE_THICKNESS: Final = 0.02
"""Metres: a stand-in for a window's glazing."""
FRAME_DEPTH: Final = 0.07
"""Metres: a stand-in for how deep a window's frame is across the wall."""
USUAL_RISER: Final = 0.175
"""Metres: of steps that could not be counted; stairs in use have 16 to 19 cm."""
LEAF_GAP: Final = 0.004
"""Metres: of air round a leaf, so that it turns free; doors are hung with 3 to 5 mm."""
_ARC_STEP: Final = math.radians(5.0)
"""Of the segments that a curved outline is drawn with."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A door leaf in its opening's frame: x from the jamb nearer the wall's start, y left of the axis, z from the sill.

    hinge: the turning axis. reach: signed width along x from the hinge when closed. depth: low and high y from the
    hinge when closed. bottom, height: metres, of its lower edge and from that to the upper. turn: sign of the rotation
    (counter-clockwise 1) that opens it, 0 where the swing is not known. angle: signed rotation as found, radians.
    """

    hinge: Point2
    reach: float
    depth: tuple[float, float]
    bottom: float
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
    return {name: tuple(_to_plan_ring(walls[name], outline)) for name, outline in outlines.items()}


def _to_plan_ring(wall: Wall, outline: Ring) -> list[Point2]:
    """An outline of the wall's frame in plan; of a curved wall with points between its corners."""
    if wall.bulge == 0.0:
        return [to_plan(wall, x, y) for x, y in outline]
    points: list[Point2] = []
    for (x0, y0), (x1, y1) in zip(outline, (*outline[1:], outline[0]), strict=True):
        parts = max(1, math.ceil(abs((x1 - x0) * wall_arc(wall).curvature) / _ARC_STEP))
        shares = (k / parts for k in range(parts))
        points += [to_plan(wall, x0 + share * (x1 - x0), y0 + share * (y1 - y0)) for share in shares]
    return points


def opening_outline(wall: Wall, opening: Opening) -> Ring:
    """The outline of the opening or niche in plan, counter-clockwise."""
    low, high = opening_layer(wall, opening)
    x0 = opening.offset.value
    x1 = x0 + opening.width.value
    return tuple(to_plan(wall, x, y) for x, y in ((x0, low), (x1, low), (x1, high), (x0, high)))


def opening_layer(wall: Wall, opening: Opening) -> tuple[float, float]:
    """Low and high y, metres to the left of the axis, of what an opening or niche takes from its wall."""
    half = wall.thickness.value / 2
    if opening.depth is None:
        return -half, half
    depth = min(opening.depth.value, wall.thickness.value)
    return (half - depth, half) if opening.side == "left" else (-half, depth - half)


def opening_angle(wall: Wall, opening: Opening) -> float:
    """Direction in plan from the opening's jamb nearer to the wall's start to the other, radians from x."""
    middle = opening.offset.value + opening.width.value / 2
    dx, dy = wall_direction(wall, middle)
    return math.atan2(dy, dx)


def wall_forms(storey: Storey) -> dict[str, WallForm]:
    """What each wall's (by id) mesh and blocks are made from, ends shaped as they join the others."""
    outlines = wall_outlines(storey.walls)
    return {wall.id: _wall_form(wall, outlines[wall.id]) for wall in storey.walls}


def wall_bodies(storey: Storey) -> dict[str, Mesh]:
    """Each wall's (by id) mesh with openings and niches cut, in the wall's frame (x along its axis's chord)."""
    return {name: wall_mesh(form) for name, form in wall_forms(storey).items()}


def _wall_form(wall: Wall, outline: Ring) -> WallForm:
    rows = [
        (x := o.offset.value, x + o.width.value, z := o.sill.value, z + o.height.value, *opening_layer(wall, o))
        for o in wall.openings
    ]
    voids = np.array(rows, np.float64).reshape(-1, 6)
    through = np.array([o.depth is None or o.depth.value >= wall.thickness.value for o in wall.openings], np.bool_)
    return WallForm(
        _wall_ends(outline),
        wall.thickness.value,
        wall.height.value,
        voids[through, :4],
        voids[~through],
        wall_arc(wall),
        wall.lean,
        np.array(wall.profile, np.float64) if wall.profile else None,
    )


def _wall_ends(outline: Ring) -> WallEnds:
    """The ends of an outline: right face from start to end, left face back; points on the axis are tips."""
    (right_start, _), (right_end, _), *rest = outline
    tip_end = rest.pop(0)[0] if rest[0][1] == 0.0 else None
    (left_end, _), (left_start, _), *last = rest
    tip_start = last[0][0] if last else None
    return WallEnds(left_start, left_end, right_start, right_end, tip_start, tip_end)


def void_body(wall: Wall, opening: Opening) -> Mesh:
    """The void of an opening or niche, in the opening's frame."""
    low, high = opening_layer(wall, opening)
    return box_mesh((0.0, low, 0.0), (opening.width.value, high, opening.height.value))


def pane_body(wall: Wall, opening: Opening) -> Mesh:
    """A window's pane, in the opening's frame: within its frame, as deep in the wall as it was found, else half way."""
    frame = frame_thickness(opening)
    middle, half = _pane_middle(wall, opening), PANE_THICKNESS / 2
    high = (opening.width.value - frame, middle + half, opening.height.value - frame)
    return box_mesh((frame, middle - half, frame), high)


def frame_body(wall: Wall, opening: Opening) -> Mesh:
    """A window's frame round its pane, in the opening's frame; empty where its thickness is not known."""
    frame = frame_thickness(opening)
    middle, half = _pane_middle(wall, opening), min(FRAME_DEPTH, wall.thickness.value) / 2
    return _border_mesh(opening, frame, frame, middle - half, middle + half)


def lining_body(wall: Wall, opening: Opening) -> Mesh:
    """A door's lining at both jambs and the head, in the opening's frame; empty where it was not measured."""
    door = opening.fill
    if not isinstance(door, Door) or door.lining_thickness is None:
        return EMPTY
    depth = wall.thickness.value if door.lining_depth is None else door.lining_depth.value
    return _border_mesh(opening, lining_thickness(opening), 0.0, -depth / 2, depth / 2)


def _border_mesh(opening: Opening, thickness: float, bottom: float, low: float, high: float) -> Mesh:
    """A border of this thickness inside the opening's rectangle, of its lower side ``bottom``, from y low to high."""
    if thickness <= 0.0:
        return EMPTY
    width, height = opening.width.value, opening.height.value
    sides = [box_mesh((x, low, 0.0), (x + thickness, high, height)) for x in (0.0, width - thickness)]
    spans = [(height - thickness, height)] + ([(0.0, bottom)] if bottom > 0.0 else [])
    return merge_meshes([*sides, *(box_mesh((thickness, low, z0), (width - thickness, high, z1)) for z0, z1 in spans)])


def frame_thickness(opening: Opening) -> float:
    """Of a window's frame in the wall's plane, metres; 0 where it is not known."""
    window = opening.fill
    known = window.frame_thickness if isinstance(window, Window) else None
    return 0.0 if known is None else min(known.value, 0.4 * min(opening.width.value, opening.height.value))


def lining_thickness(opening: Opening) -> float:
    """Of a door's lining in the wall's plane, metres; 0 where it is not known."""
    door = opening.fill
    known = door.lining_thickness if isinstance(door, Door) else None
    return 0.0 if known is None else min(known.value, 0.2 * opening.width.value)


def _pane_middle(wall: Wall, opening: Opening) -> float:
    """How far left of the wall's axis the pane stands, metres."""
    window = opening.fill
    if not isinstance(window, Window) or window.recess is None or window.recess_side == "unknown":
        return 0.0
    depth = wall.thickness.value / 2 - min(window.recess.value, wall.thickness.value - PANE_THICKNESS / 2)
    return depth if window.recess_side == "left" else -depth


def area_body(area: Area) -> Mesh:
    """A slab or covering in the building's frame."""
    return prism_mesh(area.outline, area.holes, area.top.value - area.thickness.value, area.top.value)


def upright_body(element: Space | Column | Beam | Stair) -> Mesh:
    """A space, column, beam or stair's envelope in the building's frame."""
    if isinstance(element, Space):
        return space_body(element)
    return prism_mesh(element.outline, (), element.base, element.base + element.height.value)


def roof_body(roof: RoofPlane) -> Mesh:
    """A roof's plane with its thickness; its sides are upright, so that planes meet at ridges. Building's frame."""
    corners = np.array(roof.outline, np.float64)
    return plate_mesh(corners, roof.thickness.value / rise_of(corners))


def rise_of(corners: NDArray[np.float64]) -> float:
    """Cosine of the pitch of a plane through corners (n, 3), at least 0.2 (78 degrees)."""
    normal = np.linalg.svd(corners - corners.mean(axis=0))[2][2]
    return max(0.2, abs(float(normal[2])))


def flight_bodies(stair: Stair) -> Mesh:
    """A stair's flights as steps, in the building's frame; empty where it has none."""
    flights = [
        stepped_mesh(
            (*flight.start, flight.base),
            flight.end,
            flight.height,
            flight.width.value,
            flight.risers or max(2, round(flight.height / USUAL_RISER)),
        )
        for flight in stair.flights
    ]
    return merge_meshes(flights)


def leaf_body(leaf: Leaf) -> Mesh:
    """The closed leaf with its hinge axis at the origin."""
    low, high = sorted((0.0, leaf.reach))
    return box_mesh((low, leaf.depth[0], leaf.bottom), (high, leaf.depth[1], leaf.bottom + leaf.height))


def door_leaves(wall: Wall, opening: Opening) -> tuple[Leaf, ...]:
    """The leaves of a door, so far as the model knows them: none where an open door's hinge, swing or angle is unknown.

    A leaf hangs as deep in the wall as it was measured, else flush with the face that it swings to, with air round it.
    A closed leaf of unknown swing, or one that slides, stands in the wall's middle, with turn 0.
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
        inset = lining_thickness(opening)
        width, height = opening.width.value - 2 * inset, opening.height.value - inset
        return (Leaf((inset, 0.0), width, (-half, half), 0.0, height, 0, 0.0),)
    return ()


def _hinge_sides(door: Door) -> tuple[str, ...]:
    """The ends of the opening at which leaves hang; none where that or the swing is not known, or the door slides."""
    if door.swing_side == "unknown" or "SLID" in door.operation:
        return ()
    if door.operation.startswith("DOUBLE_DOOR"):
        return ("start", "end")
    return () if door.hinge_side == "unknown" else (door.hinge_side,)


def _leaf_thickness(door: Door) -> float:
    return door.leaf_thickness.value if door.leaf_thickness is not None else LEAF_THICKNESS


def _turning_leaf(wall: Wall, opening: Opening, side: str, angle: float) -> Leaf:
    """The leaf that hangs at one end of the opening; where the door has two, each has half the width."""
    door = opening.fill
    assert isinstance(door, Door)
    at_start, to_left = side == "start", door.swing_side == "left"
    lining = lining_thickness(opening)
    clear = opening.width.value - 2 * lining
    width = clear / len(_hinge_sides(door)) - (2 if len(_hinge_sides(door)) == 1 else 1.5) * LEAF_GAP
    half, thickness = wall.thickness.value / 2, min(_leaf_thickness(door), wall.thickness.value)
    face = max(half - _leaf_recess(wall, door, thickness), thickness - half)
    turn: Literal[-1, 1] = 1 if at_start == to_left else -1
    inset = lining + LEAF_GAP
    hinge = (inset if at_start else opening.width.value - inset, face if to_left else -face)
    depth = (-thickness, 0.0) if to_left else (0.0, thickness)
    bottom = LEAF_GAP + (door.threshold.value if door.threshold is not None else 0.0)
    height = opening.height.value - lining - LEAF_GAP - bottom
    return Leaf(hinge, width if at_start else -width, depth, bottom, height, turn, turn * abs(angle))


def _leaf_recess(wall: Wall, door: Door, thickness: float) -> float:
    """How far the leaf's face on its swing side lies behind the wall's face on that side, metres."""
    if door.recess is None or door.recess_side == "unknown":
        return 0.0
    if door.recess_side == door.swing_side:
        return door.recess.value
    return wall.thickness.value - door.recess.value - thickness
