"""Closed triangle meshes of building parts: upright prisms with holes, boxes, plates; walls are in ``wall_meshes``.

All are two-manifold up to touching corners, wound counter-clockwise seen from outside (right-handed). Metres, float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import shapely

Floats: TypeAlias = npt.NDArray[np.float64]
Ints: TypeAlias = npt.NDArray[np.int64]
Points: TypeAlias = Sequence[tuple[float, float]]

MERGE: Final = 1e-4
"""Metres: cuts that lie nearer together are one, so that no slivers come out; far below a scanner's noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """vertices: (V, 3) float64, metres. triangles: (T, 3) int64 indices, counter-clockwise seen from outside."""

    vertices: Floats
    triangles: Ints

    def __post_init__(self) -> None:
        for name, array in (("vertices", self.vertices), ("triangles", self.triangles)):
            if array.ndim != 2 or array.shape[1] != 3:
                raise ValueError(f"{name} must be of shape (n, 3), not {array.shape}")

    @property
    def corners(self) -> Floats:
        """(T, 3, 3): the three corners of each triangle."""
        return self.vertices[self.triangles]


EMPTY: Final = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


def prism_mesh(outline: Points, holes: Sequence[Points], bottom: float, top: float) -> Mesh:
    """An upright prism from z ``bottom`` to ``top`` over an outline with holes.

    Outlines that cross themselves are made valid. Empty where the outline has no area or top is not above bottom.
    """
    parts = [_prism(polygon, bottom, top) for polygon in _polygons(outline, holes)] if top - bottom > MERGE else []
    return merge_meshes(parts)


def flat_mesh(outline: Points, holes: Sequence[Points], z: float) -> Mesh:
    """An outline with holes as an open, upward-facing sheet at height z."""
    parts = [_cap(polygon, z) for polygon in _polygons(outline, holes)]
    return merge_meshes(parts)


def plate_mesh(outline: Floats, thickness: float) -> Mesh:
    """A sloping plate over an outline (n, 3) in a plane that is not upright, ``thickness`` metres upwards.

    Points off the plane that fits them best are moved up or down onto it.
    """
    if len(outline) < 3:
        return EMPTY
    middle = outline.mean(axis=0)
    plan = np.column_stack([outline[:, :2] - middle[:2], np.ones(len(outline))])
    slope, *_ = np.linalg.lstsq(plan, outline[:, 2], rcond=None)
    flat = prism_mesh([(x, y) for x, y, _ in outline.tolist()], (), 0.0, thickness)
    heights = (flat.vertices[:, :2] - middle[:2]) @ slope[:2] + slope[2] + flat.vertices[:, 2]
    return Mesh(np.column_stack([flat.vertices[:, :2], heights]), flat.triangles)


def stepped_mesh(
    foot: tuple[float, float, float], top: tuple[float, float], height: float, width: float, risers: int
) -> Mesh:
    """A straight flight of steps, from the foot of its first riser to the last riser, closed below by a slope.

    height: of all risers together; the last tread is the floor above and not part of it.
    """
    run, count = float(np.hypot(top[0] - foot[0], top[1] - foot[1])), max(risers, 2)
    if run <= MERGE or height <= MERGE or width <= MERGE:
        return EMPTY
    rise, going = height / count, run / (count - 1)
    side = [(going * k, rise * (k + step)) for k in range(count - 1) for step in (0, 1)]
    side += [(run, rise * (count - 1)), (run, max(rise * (count - 1) - 2 * rise, 0.0)), (2 * going, 0.0)]
    flat = prism_mesh(side if count > 3 else [*side[:-2], (run, 0.0)], (), -width / 2, width / 2)
    (along, up, right), x, y = flat.vertices.T, (top[0] - foot[0]) / run, (top[1] - foot[1]) / run
    return Mesh(
        np.column_stack([foot[0] + along * x + right * y, foot[1] + along * y - right * x, foot[2] + up]),
        flat.triangles,
    )


def box_mesh(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """A box along the axes between two corners."""
    outline = ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))
    return prism_mesh(outline, (), low[2], high[2])


def merge_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """All meshes as one; vertices are not welded."""
    filled = [mesh for mesh in meshes if len(mesh.triangles)]
    if not filled:
        return EMPTY
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in filled[:-1]])
    triangles = [mesh.triangles + offset for mesh, offset in zip(filled, offsets, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in filled]), np.concatenate(triangles))


def move_mesh(mesh: Mesh, angle: float, shift: tuple[float, float, float]) -> Mesh:
    """The mesh turned about z by ``angle`` (radians), then shifted."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Mesh(mesh.vertices @ turn.T + np.asarray(shift), mesh.triangles)


def face_normals(mesh: Mesh) -> Floats:
    """(T, 3) unit normals."""
    cross = _crosses(mesh)
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def mesh_volume(mesh: Mesh) -> float:
    """Volume inside a closed mesh, cubic metres; negative when it is wound inside out."""
    a, b, c = mesh.corners[:, 0], mesh.corners[:, 1], mesh.corners[:, 2]
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def is_closed(mesh: Mesh) -> bool:
    """Whether each directed edge has as many partners running the other way, so that no side is open or flipped."""
    ends = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    keys = ends[:, 0] * len(mesh.vertices) + ends[:, 1]
    reverse = ends[:, 1] * len(mesh.vertices) + ends[:, 0]
    return bool(np.array_equal(np.sort(keys), np.sort(reverse)))


def _crosses(mesh: Mesh) -> Floats:
    corners = mesh.corners
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@dataclass(frozen=True, slots=True, eq=False)
class _Polygon:
    """points: (n, 2), each place once. rings: indices of them, the outside counter-clockwise, holes clockwise."""

    points: Floats
    rings: tuple[Ints, ...]


def _polygons(outline: Points, holes: Sequence[Points]) -> list[_Polygon]:
    """The valid polygons with area that outline and holes make; several where the outline crosses itself.

    Where a ring touches another between two of its points, it gets a point there.
    """
    import shapely

    if len(outline) < 3:
        return []
    valid = shapely.get_parts(shapely.make_valid(shapely.Polygon(outline, [hole for hole in holes if len(hole) > 2])))
    shape = shapely.unary_union(valid[shapely.get_dimensions(valid) == 2])
    pieces = shapely.get_parts(shapely.polygonize([shapely.unary_union(shapely.boundary(shape))])).tolist()
    parts = [part for part in pieces if part.area > MERGE**2 and shape.contains(part.representative_point())]
    return [_index_rings(shapely.orient_polygons(part)) for part in parts]


def _index_rings(polygon: shapely.Polygon) -> _Polygon:
    numbers: dict[tuple[float, ...], int] = {}
    rings = tuple(
        np.array([numbers.setdefault(point[:2], len(numbers)) for point in list(ring.coords)[:-1]], np.int64)
        for ring in (polygon.exterior, *polygon.interiors)
    )
    return _Polygon(np.array(list(numbers)), rings)


def _triangulate(polygon: _Polygon) -> Ints:
    """(t, 3): constrained Delaunay triangles over the polygon's own points, counter-clockwise."""
    import shapely

    outside, *holes = (polygon.points[ring] for ring in polygon.rings)
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(outside, holes)))
    corners = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)[:, :3]
    lookup = {(x, y): number for number, (x, y) in enumerate(polygon.points.tolist())}
    numbers = [lookup[x, y] for x, y in corners.reshape(-1, 2).tolist()]
    return np.array(numbers, np.int64).reshape(-1, 3)


def _cap(polygon: _Polygon, z: float) -> Mesh:
    return Mesh(_at_height(polygon.points, z), _triangulate(polygon))


def _at_height(points: Floats, z: float) -> Floats:
    return np.column_stack([points, np.full(len(points), z)])


def _prism(polygon: _Polygon, bottom: float, top: float) -> Mesh:
    count, cap = len(polygon.points), _triangulate(polygon)
    vertices = np.concatenate([_at_height(polygon.points, bottom), _at_height(polygon.points, top)])
    sides = [_side_triangles(ring, count) for ring in polygon.rings]
    return Mesh(vertices, np.concatenate([cap[:, ::-1], cap + count, *sides]))


def _side_triangles(ring: Ints, count: int) -> Ints:
    """The upright sides between the ring's lower points and the upper ones, numbered ``count`` further on."""
    following = np.roll(ring, -1)
    return split_quads(np.stack([ring, following, following + count, ring + count], axis=1))


def split_quads(quads: Ints) -> Ints:
    """(2 n, 3) triangles of (n, 4) quads, wound as they are."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
