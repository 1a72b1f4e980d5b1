"""The faces of a storey that bound its spaces, as plane panels cut into cells: sides of walls, floors, ceilings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.coverage.rooms import Rooms
from scan2bim.model.ceilings import plane_of
from scan2bim.model.elements import Covering, RoofPlane, Slab, Space, Storey, Wall
from scan2bim.model.queries import wall_arc, wall_length
from scan2bim.model.wall_measures import height_at

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Bools = NDArray[np.bool_]
Side = Literal["left", "right", "top", "under"]

CELL = 0.10
"""Edge of a cell, metres: that of the points' voxels, and a few points of a usual scan lie in it."""
BEFORE = 0.08
"""Metres before a face at which it is asked which space is there: more than a pixel of the raster's border."""
OWN = 0.3
"""Metres that a slab or ceiling may lie outside of the height of a space that it bounds."""
BENT = 0.2
"""Radians that a plane panel of a curved wall may turn: it leaves a curve of 3 m by 1.5 cm."""


@dataclass(frozen=True, slots=True)
class Face:
    """A side of an element. inner: bounds a space; area (square metres) that does, openings left out."""

    element: str
    side: Side
    inner: bool
    area: float


@dataclass(frozen=True, slots=True, eq=False)
class Panels:
    """p plane panels with c cells of ``faces``, a panel's cells row by row.

    plane (p, 14) float64: a corner, unit vectors along the cells' columns and rows, the normal into the space (3 each),
    and the edges of a cell along columns and rows, metres. cells (p, 3) int64: how many along columns and rows, and the
    first one's number. face (p,) int32. level (p,) bool: a floor or ceiling. asked (c,) bool: the cell belongs to the
    face; hole (c,) bool: it would, but for an opening of the model. space (c,) int16: the space before it, -1 for none.
    """

    faces: tuple[Face, ...]
    plane: F64
    cells: I64
    face: NDArray[np.int32]
    level: Bools
    asked: Bools
    hole: Bools
    space: NDArray[np.int16]

    def __len__(self) -> int:
        return len(self.face)

    @property
    def cell_panel(self) -> I64:
        """(c,) the panel of each cell."""
        return np.repeat(np.arange(len(self)), self.cells[:, 0] * self.cells[:, 1])

    @property
    def cell_area(self) -> F64:
        """(c,) square metres."""
        return (self.plane[:, 12] * self.plane[:, 13])[self.cell_panel]

    def centres(self, panel: int) -> F64:
        """(n, 3) middles of a panel's cells."""
        plane = self.plane[panel]
        return _centres(plane[:3], plane[3:6], plane[6:9], plane[12:14], self.cells[panel, :2])


@dataclass(frozen=True, slots=True, eq=False)
class _Panel:
    face: int
    origin: F64
    u: F64
    v: F64
    normal: F64
    step: F64
    shape: I64
    level: bool
    asked: Bools
    hole: Bools
    space: NDArray[np.int16]


def panels_of(storey: Storey, rooms: Rooms) -> Panels:
    """The panels of a storey's walls, slabs, ceilings and roof planes."""
    faces: list[Face] = []
    panels: list[_Panel] = []
    for wall in storey.walls:
        sides: tuple[tuple[Side, bool], ...] = (("left", bool(wall.left_spaces)), ("right", bool(wall.right_spaces)))
        for side, inner in sides:
            made = [_wall_panel(wall, side, ends, len(faces), inner, rooms) for ends in _stretches(wall)]
            area = sum(float(p.asked.sum() * p.step.prod()) for p in made)
            faces.append(Face(wall.id, side, inner, area))
            panels += made
    for plate in (*storey.slabs, *storey.coverings):
        if isinstance(plate, Slab) and plate.use == "ROOF":
            continue
        made = _plate_panels(plate, storey.spaces, len(faces), rooms)
        side: Side = "top" if isinstance(plate, Slab) else "under"
        faces.append(Face(plate.id, side, True, sum(float(p.asked.sum() * p.step.prod()) for p in made)))
        panels += made
    for roof in storey.roofs:
        panel = _roof_panel(roof, len(faces), rooms)
        faces.append(Face(roof.id, "under", True, float(panel.asked.sum() * panel.step.prod())))
        panels.append(panel)
    return _joined(tuple(faces), panels)


def _joined(faces: tuple[Face, ...], panels: Sequence[_Panel]) -> Panels:
    planes = [np.concatenate([p.origin, p.u, p.v, p.normal, p.step]) for p in panels]
    sizes = [len(p.asked) for p in panels]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if sizes else np.zeros(0)
    return Panels(
        faces,
        np.array(planes, np.float64).reshape(-1, 14),
        np.column_stack([np.array([p.shape for p in panels], np.int64).reshape(-1, 2), first]).astype(np.int64),
        np.array([p.face for p in panels], np.int32),
        np.array([p.level for p in panels], np.bool_),
        np.concatenate([np.zeros(0, np.bool_), *(p.asked for p in panels)]),
        np.concatenate([np.zeros(0, np.bool_), *(p.hole for p in panels)]),
        np.concatenate([np.zeros(0, np.int16), *(p.space for p in panels)]),
    )


def _stretches(wall: Wall) -> list[tuple[float, float]]:
    """From where to where along the axis each plane panel reaches: the whole of a straight wall."""
    count = max(1, math.ceil(abs(wall_arc(wall).angle) / BENT))
    ends = np.linspace(0.0, wall_length(wall), count + 1).tolist()
    return list(pairwise(ends))


def _wall_panel(wall: Wall, side: Side, ends: tuple[float, float], face: int, inner: bool, rooms: Rooms) -> _Panel:
    """A stretch of one side of a wall; openings, and of an inner side what no space lies before, are not asked."""
    axis, sign = wall_arc(wall), 1.0 if side == "left" else -1.0
    direction = (np.array(wall.end) - wall.start) / max(axis.chord, 1e-9)
    plan = np.array([direction, [-direction[1], direction[0]]])
    flat = axis.place(np.array(ends), np.full(2, sign * wall.thickness.value / 2)) @ plan + wall.start
    length = float(np.linalg.norm(flat[1] - flat[0]))
    u = np.append((flat[1] - flat[0]) / max(length, 1e-9), 0.0)
    left = np.array([-u[1], u[0], 0.0])
    v = left * math.sin(wall.lean) + np.array([0.0, 0.0, math.cos(wall.lean)])
    normal = sign * (left * math.cos(wall.lean) - np.array([0.0, 0.0, math.sin(wall.lean)]))
    height = max((z for _, z in wall.profile), default=wall.height.value)
    size = np.array([length, height / math.cos(wall.lean)])
    shape = np.maximum(1, np.rint(size / CELL)).astype(np.int64)
    step = size / shape
    origin = np.append(flat[0], wall.base)
    space = _spaces_at(_centres(origin, u, v, step, shape) + BEFORE * normal, rooms)
    along = ends[0] + (np.arange(shape[0]) + 0.5) / shape[0] * (ends[1] - ends[0])
    up = (np.arange(shape[1]) + 0.5) * step[1] * math.cos(wall.lean)
    there, hole = (mask.ravel() & ((space >= 0) | (not inner)) for mask in _wall_there(wall, side, along, up))
    return _Panel(face, origin, u, v, normal, step, shape, False, there & ~hole, there & hole, space)


def _wall_there(wall: Wall, side: Side, along: F64, up: F64) -> tuple[Bools, Bools]:
    """Two of (rows, columns), at heights ``up`` over the base and places along the axis: below the upper edge; and in
    an opening or, on its side, a niche.
    """
    tops = np.array([height_at(wall.profile, float(a)) for a in along]) if wall.profile else wall.height.value
    below = up[:, None] < np.broadcast_to(tops, along.shape)
    hole = np.zeros_like(below)
    for opening in wall.openings:
        if opening.depth is None or opening.side == side:
            start, sill = opening.offset.value, opening.sill.value
            columns = (along > start) & (along < start + opening.width.value)
            hole |= ((up > sill) & (up < sill + opening.height.value))[:, None] & columns
    return below, hole


def _plate_panels(plate: Slab | Covering, spaces: Sequence[Space], face: int, rooms: Rooms) -> list[_Panel]:
    """The floor of each space that lies on a slab, or a covering's underside where it is in a space."""
    outline = Polygon(plate.outline, plate.holes)
    top = isinstance(plate, Slab)
    height = plate.top.value if top else plate.top.value - plate.thickness.value
    up = np.array([0.0, 0.0, 1.0 if top else -1.0])
    out: list[_Panel] = []
    for number, room in enumerate(spaces):
        part = shapely.intersection(Polygon(room.outline, room.holes), outline)
        if part.area < CELL or not room.base - OWN < height < room.base + room.height.value + OWN:
            continue
        ring = rooms.turned(shapely.get_coordinates(part))
        low, high = ring.min(0), ring.max(0)
        shape = np.maximum(1, np.rint((high - low) / CELL)).astype(np.int64)
        step = (high - low) / shape
        turned = rooms.local(low + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
        origin = np.append(turned[0], height)
        u, v = np.append(turned[1] - turned[0], 0.0), np.append(turned[2] - turned[0], 0.0)
        middles = _centres(origin, u, v, step, shape)
        asked = shapely.contains_xy(part, middles[:, 0], middles[:, 1])
        space = np.full(len(middles), number, np.int16)
        out.append(_Panel(face, origin, u, v, up, step, shape, True, asked, np.zeros_like(asked), space))
    return out


def _roof_panel(roof: RoofPlane, face: int, rooms: Rooms) -> _Panel:
    """The underside of a roof plane, columns along its level direction; asked where it is over a space."""
    a, b, c = plane_of(roof.outline)
    run = math.hypot(a, b)
    u = np.array([-b, a, 0.0]) / run if run > 0.0 else np.array([1.0, 0.0, 0.0])
    normal = np.array([a, b, -1.0]) / math.sqrt(1.0 + run * run)
    v = np.cross(u, normal)
    corners = np.array(roof.outline)
    foot = np.append(corners[0, :2], a * corners[0, 0] + b * corners[0, 1] + c)
    flat = (corners - foot) @ np.stack([u, v]).T
    low, high = flat.min(0), flat.max(0)
    shape = np.maximum(1, np.rint((high - low) / CELL)).astype(np.int64)
    step = (high - low) / shape
    origin = foot + low[0] * u + low[1] * v
    middles = _centres(origin, u, v, step, shape)
    space = _spaces_at(middles + BEFORE * normal, rooms)
    asked = shapely.contains_xy(Polygon(corners[:, :2]), middles[:, 0], middles[:, 1]) & (space >= 0)
    return _Panel(face, origin, u, v, normal, step, shape, False, asked, np.zeros_like(asked), space)


def _centres(origin: F64, u: F64, v: F64, step: F64, shape: I64) -> F64:
    i, j = np.meshgrid(np.arange(shape[0]) + 0.5, np.arange(shape[1]) + 0.5)
    return origin + (i.ravel() * step[0])[:, None] * u + (j.ravel() * step[1])[:, None] * v


def _spaces_at(points: F64, rooms: Rooms) -> NDArray[np.int16]:
    """The space that each point (n, 3) is in, -1 for none."""
    row, col = rooms.pixels(points[:, :2])
    inside = (points[:, 2] > rooms.low[row, col]) & (points[:, 2] < rooms.high[row, col])
    return np.where(inside, rooms.space[row, col], -1).astype(np.int16)
