"""Closed meshes and what is asked of them: inside, volume, closedness, outline in plan. Metres, z up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

SNAP: Final = 1e-5
"""Metres. Corners this near to each other are one when edges are paired."""


@dataclass(slots=True, eq=False)
class Body:
    """A mesh in world coordinates: vertices (n, 3), triangles (m, 3), openings not taken off."""

    vertices: Floats
    triangles: Ints
    _plan: list[BaseGeometry] = field(default_factory=list)

    @property
    def low(self) -> Floats:
        """Lowest corner (3,)."""
        return self.vertices.min(axis=0)

    @property
    def high(self) -> Floats:
        """Highest corner (3,)."""
        return self.vertices.max(axis=0)

    @property
    def corners(self) -> Floats:
        """(m, 3, 3) corners of the triangles."""
        return self.vertices[self.triangles]

    @property
    def volume(self) -> float:
        """Signed volume, cubic metres, positive where the faces look outwards."""
        a, b, c = np.moveaxis(self.corners - self.vertices.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)

    @property
    def surface(self) -> float:
        """Square metres of all faces."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    @property
    def plan(self) -> BaseGeometry:
        """The outline in plan, holes left open where nothing is above or below."""
        if not self._plan:
            import shapely

            triangles: Any = shapely.polygons(self.corners[:, :, :2])
            flat = triangles[shapely.area(triangles) > 1e-8]
            self._plan.append(shapely.union_all(shapely.set_precision(flat, SNAP)))
        return self._plan[0]

    def contains(self, points: Floats) -> Bools:
        """Which points (k, 3) are inside, by the faces above each."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        p = points[:, None, :2] + np.array([1.3e-7, 2.7e-7])  # off the lines between triangles
        d1, d2, d3 = (_side(p, u, v) for u, v in ((a, b), (b, c), (c, a)))
        hit = ((d1 > 0) & (d2 > 0) & (d3 > 0)) | ((d1 < 0) & (d2 < 0) & (d3 < 0))
        total = d1 + d2 + d3
        with np.errstate(invalid="ignore", divide="ignore"):
            z = (d2 * a[:, 2] + d3 * b[:, 2] + d1 * c[:, 2]) / total
        above = hit & (z > points[:, None, 2])
        return above.sum(axis=1) % 2 == 1

    def open_edges(self) -> int:
        """Edges that not exactly two faces share, corners merged; T-joints count as well."""
        keys = np.round(self.vertices / SNAP).astype(np.int64)
        _, merged = np.unique(keys, axis=0, return_inverse=True)
        triangles = merged.reshape(-1)[self.triangles]
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges = edges[edges[:, 0] != edges[:, 1]]
        _, counts = np.unique(edges, axis=0, return_counts=True)
        return int((counts % 2 == 1).sum())

    def distance(self, points: Floats) -> Floats:
        """From points (k, 3) to the nearest face (k,)."""
        return _to_triangles(points[:, None], self.corners).min(axis=1)


def _side(p: Floats, u: Floats, v: Floats) -> Floats:
    return (v[:, 0] - u[:, 0]) * (p[..., 1] - u[:, 1]) - (v[:, 1] - u[:, 1]) * (p[..., 0] - u[:, 0])


def _to_triangles(points: Floats, corners: Floats) -> Floats:
    """Distances (k, m) of points (k, 1, 3) to triangles (m, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = _cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(size, 1e-12)
    nearest = np.full((len(points), len(corners)), np.inf)
    inside = np.broadcast_to(size[:, 0] > 1e-12, nearest.shape).copy()
    for start, end in ((a, b), (b, c), (c, a)):
        along, offset = end - start, points - start
        square = np.maximum((along**2).sum(axis=1), 1e-18)
        share = np.clip((offset * along).sum(axis=2) / square, 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(offset - share[..., None] * along, axis=2))
        inside &= (offset * _cross(normal, along)).sum(axis=2) >= 0
    return np.where(inside, np.abs(((points - a) * normal).sum(axis=2)), nearest)


def _cross(u: Floats, v: Floats) -> Floats:
    """Cross products of rows (m, 3); numpy's own is slow on few rows."""
    (a, b, c), (d, e, f) = u.T, v.T
    return np.column_stack([b * f - c * e, c * d - a * f, a * e - b * d])


@dataclass(frozen=True, slots=True)
class Bar:
    """The outline in plan of something long, such as a wall: ends of its centre line, thickness; metres."""

    start: Floats
    end: Floats
    thickness: float

    @property
    def length(self) -> float:
        """Of the centre line."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def along(self) -> Floats:
        """Unit vector from start to end."""
        return (self.end - self.start) / max(self.length, 1e-9)


def bar_of(plan: BaseGeometry) -> Bar | None:
    """The bar that an outline is, corners cut askew allowed; None where it is bent or no bar."""
    import shapely

    box = plan.minimum_rotated_rectangle
    if not isinstance(box, shapely.Polygon) or box.area < 1e-6 or plan.area < 0.7 * box.area:
        return None
    p = np.array(box.exterior.coords)[:4]
    first, second = float(np.linalg.norm(p[1] - p[0])), float(np.linalg.norm(p[2] - p[1]))
    if first < second:
        p, first, second = np.roll(p, -1, axis=0), second, first
    return Bar((p[0] + p[3]) / 2, (p[1] + p[2]) / 2, second)


def sheet_thickness(plan: BaseGeometry) -> float | None:
    """Thickness of a strip, straight or bent, from its area and girth; None for what is no strip."""
    girth, area = plan.length, plan.area
    root = girth**2 - 16 * area
    return (girth - root**0.5) / 4 if root > 0 else None


def polygons_of(shape: BaseGeometry) -> Sequence[Polygon]:
    """The polygons of any shape."""
    import shapely

    return [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)]
