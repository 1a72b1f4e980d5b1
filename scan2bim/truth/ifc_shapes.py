"""Walls, openings and spaces from meshes: straight axes, rectangles in walls, outlines in plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from scan2bim.geometry.polygons import largest_part
from scan2bim.truth.ifc_file import UPRIGHT, Mesh
from scan2bim.truth.values import Corners, Point2

F64 = NDArray[np.float64]

NEAR = 0.5
"""Metres round an opening in which its wall's direction is looked for: walls may be curved."""
SAME_DIRECTION = math.radians(2.0)
SNAP = 1e-4
"""Metres: vertices of outlines nearer than this are one."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A stretch of wall in plan, or all of it: the lines of its two faces.

    direction: of its axis, radians, with ``left`` a quarter turn to the left of it. low, high: of the faces along
    ``left``, metres from the origin.
    """

    direction: float
    low: float
    high: float

    @property
    def along(self) -> F64:
        """Unit vector (2,)."""
        return np.array([math.cos(self.direction), math.sin(self.direction)])

    @property
    def left(self) -> F64:
        """Unit vector (2,)."""
        return np.array([-math.sin(self.direction), math.cos(self.direction)])

    @property
    def thickness(self) -> float:
        """Between the faces."""
        return self.high - self.low

    def point(self, x: float, y: float | None = None) -> Point2:
        """The place x along the axis, in the middle of the wall unless y says where."""
        place = x * self.along + ((self.low + self.high) / 2 if y is None else y) * self.left
        return float(place[0]), float(place[1])


def wall_strip(mesh: Mesh, near: F64 | None = None, like: F64 | None = None) -> Strip | None:
    """The strip whose faces have the most upright area; ``near`` (2,) looks only round a place.

    like (2,): the axis is given the sense that is nearer to it. None where nothing stands upright.
    """
    normals, areas = mesh.normals()
    upright = np.abs(normals[:, 2]) < UPRIGHT
    if near is not None:
        plan = mesh.vertices[mesh.faces][:, :, :2]
        low, high = plan.min(axis=1) - NEAR, plan.max(axis=1) + NEAR
        round_it = ((near >= low) & (near <= high)).all(axis=1)
        upright = upright & round_it if (upright & round_it).any() else upright
    if not upright.any():
        return None
    angle = np.mod(np.arctan2(normals[upright, 1], normals[upright, 0]), math.pi)
    area = areas[upright]
    off = np.abs(angle[:, None] - angle[None, np.argsort(-area)[:20]])
    off = np.minimum(off, math.pi - off)
    best = int((area[:, None] * (off < SAME_DIRECTION)).sum(axis=0).argmax())
    direction = float(angle[np.argsort(-area)[best]]) - math.pi / 2
    if like is not None and math.cos(direction) * like[0] + math.sin(direction) * like[1] < 0:
        direction += math.pi
    strip = Strip(direction, 0.0, 0.0)
    faces = mesh.faces[upright][off[:, best] < SAME_DIRECTION]
    offsets = mesh.vertices[faces.ravel()][:, :2] @ strip.left
    return Strip(direction, float(offsets.min()), float(offsets.max()))


def flat_strip(mesh: Mesh, like: F64 | None = None) -> Strip:
    """The strip along the longer side of the least rectangle round a mesh in plan: for what is in no wall."""
    box = shapely.minimum_rotated_rectangle(shapely.MultiPoint(mesh.vertices[:, :2]))
    ring = shapely.get_coordinates(box)
    edges: F64 = np.diff(ring, axis=0)
    longest: F64 = edges[int(np.linalg.norm(edges, axis=1).argmax())]
    direction = math.atan2(float(longest[1]), float(longest[0]))
    if like is not None and float(longest @ like) < 0:
        direction += math.pi
    strip = Strip(direction, 0.0, 0.0)
    offsets = mesh.vertices[:, :2] @ strip.left
    return Strip(direction, float(offsets.min()), float(offsets.max()))


def corners_in(strip: Strip, mesh: Mesh) -> Corners:
    """The rectangle that a mesh covers in the middle of a wall."""
    x = mesh.vertices[:, :2] @ strip.along
    x0, x1, z0, z1 = float(x.min()), float(x.max()), float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    a, b = strip.point(x0), strip.point(x1)
    return (*a, z0), (*b, z0), (*b, z1), (*a, z1)


def ends_of(strip: Strip, mesh: Mesh) -> tuple[Point2, Point2]:
    """Where a wall's centre line starts and ends."""
    x = mesh.vertices[:, :2] @ strip.along
    return strip.point(float(x.min())), strip.point(float(x.max()))


def outline_of(mesh: Mesh) -> Polygon | None:
    """What a solid covers in plan, the largest part of it, counter-clockwise; None where that is nothing."""
    normals, _ = mesh.normals()
    level = np.abs(normals[:, 2]) > UPRIGHT
    triangles = mesh.vertices[mesh.faces[level]][:, :, :2]
    plates = np.asarray(shapely.set_precision(shapely.polygons(triangles), SNAP))
    whole = shapely.union_all(plates[~shapely.is_empty(plates)])
    largest = largest_part(whole, Polygon())
    if largest.area <= 0.01:
        return None
    plain = largest.simplify(SNAP * 10)
    return orient(plain) if isinstance(plain, Polygon) else None


def ring_of(ring: shapely.geometry.base.BaseGeometry) -> tuple[Point2, ...]:
    """A ring's points, the first not repeated."""
    return tuple((float(x), float(y)) for x, y in shapely.get_coordinates(ring)[:-1])
