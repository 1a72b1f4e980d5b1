"""Closed triangle meshes of building parts: walls with rectangular openings, upright prisms with holes, boxes.

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
Bools: TypeAlias = npt.NDArray[np.bool_]
Points: TypeAlias = Sequence[tuple[float, float]]

MERGE: Final = 1e-4
"""Metres: cuts that lie nearer together are one, so that no slivers come out; far below a scanner's noise."""
_MARGIN: Final = 1e-3
"""Metres: of wall that stays between a skew end and an opening, so that the mitre's corner has a section."""


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


@dataclass(frozen=True, slots=True)
class WallEnds:
    """Where a wall's two faces begin and end along its axis (metres from the axis's start).

    tip_start, tip_end: where three or more walls share a junction, the end's outline runs from one face to the other by
    this point of the axis; None where it runs straight.
    """

    left_start: float
    left_end: float
    right_start: float
    right_end: float
    tip_start: float | None = None
    tip_end: float | None = None

    @property
    def square_start(self) -> bool:
        """Whether the start is at right angles to the axis."""
        return self.left_start == self.right_start and self.tip_start is None

    @property
    def square_end(self) -> bool:
        """Whether the end is at right angles to the axis."""
        return self.left_end == self.right_end and self.tip_end is None

    @property
    def common(self) -> tuple[float, float]:
        """The part of the axis where the wall has its full section: openings must lie in it."""
        start = max(self.left_start, self.right_start, self.left_start if self.tip_start is None else self.tip_start)
        end = min(self.left_end, self.right_end, self.left_end if self.tip_end is None else self.tip_end)
        return start, end


def wall_mesh(ends: WallEnds, thickness: float, height: float, openings: Floats) -> Mesh:
    """A wall with through openings, in its own frame: x along the axis, y to the left, z up from the base.

    openings: (n, 4) rows x0, x1, z0, z1; parts outside the wall are ignored, overlapping ones unite. The faces are cut
    into a grid by all edges of openings, so that neighbouring faces share their vertices and the mesh is closed.
    """
    start, end = ends.common
    if height <= MERGE or thickness <= MERGE or end - start <= 4 * _MARGIN:
        return EMPTY
    holes = _clip_openings(openings, ends, height)
    middle = [] if ends.square_start or ends.square_end else [(start + end) / 2]
    xs = _cuts(np.concatenate([holes[:, :2].ravel(), [start, end], middle]))
    zs = _cuts(np.concatenate([holes[:, 2:].ravel(), [0.0, height]]))
    vertices, solid = _grid_vertices(xs, zs, ends, thickness), _solid_cells(xs, zs, holes)
    index = np.arange(vertices.size // 3, dtype=np.int64).reshape(vertices.shape[:3])
    tips = [] if ends.tip_start is None else [(ends.tip_start, index[:2], False)]
    tips += [] if ends.tip_end is None else [(ends.tip_end, index[:-3:-1], True)]
    triangles = [_split_quads(_surface_quads(index, solid, ends))]
    all_vertices = [vertices.reshape(-1, 3)]
    for number, (x, columns, flip) in enumerate(tips):
        all_vertices.append(np.column_stack([np.full(len(zs), x), np.zeros(len(zs)), zs]))
        tip = index.size + number * len(zs) + np.arange(len(zs), dtype=np.int64)
        pointed = _tip_triangles(columns, tip)
        triangles.append(pointed[:, ::-1] if flip else pointed)
    return _compact(np.concatenate(all_vertices), np.concatenate(triangles))


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


def _clip_openings(openings: Floats, ends: WallEnds, height: float) -> Floats:
    start = ends.common[0] + (0.0 if ends.square_start else _MARGIN)
    end = ends.common[1] - (0.0 if ends.square_end else _MARGIN)
    clipped = np.clip(openings.reshape(-1, 4), [start, start, 0.0, 0.0], [end, end, height, height])
    keep = (clipped[:, 1] - clipped[:, 0] > MERGE) & (clipped[:, 3] - clipped[:, 2] > MERGE)
    return clipped[keep]


def _cuts(values: Floats) -> Floats:
    """Sorted values without those that lie within MERGE of the one before; both extremes stay."""
    ordered = np.unique(values)
    kept = ordered[np.append(True, np.diff(ordered) > MERGE)]
    kept[-1] = ordered[-1]
    return kept


def _solid_cells(xs: Floats, zs: Floats, holes: Floats) -> Bools:
    """(columns, rows): True where the cell's middle lies in no opening."""
    x, z = ((v[1:] + v[:-1]) / 2 for v in (xs, zs))
    in_x = (holes[:, :1] < x) & (x < holes[:, 1:2])
    in_z = (holes[:, 2:3] < z) & (z < holes[:, 3:])
    return ~np.any(in_x[:, :, None] & in_z[:, None, :], axis=0)


def _grid_vertices(xs: Floats, zs: Floats, ends: WallEnds, thickness: float) -> Floats:
    """(columns + 1, rows + 1, 2, 3): the last but one axis is right face, left face."""
    right, left = xs.copy(), xs.copy()
    right[0], right[-1], left[0], left[-1] = ends.right_start, ends.right_end, ends.left_start, ends.left_end
    vertices = np.empty((len(xs), len(zs), 2, 3))
    vertices[:, :, 0, 0], vertices[:, :, 1, 0] = right[:, None], left[:, None]
    vertices[:, :, 0, 1], vertices[:, :, 1, 1] = -thickness / 2, thickness / 2
    vertices[..., 2] = zs[None, :, None]
    return vertices


def _surface_quads(index: Ints, solid: Bools, ends: WallEnds) -> Ints:
    """(n, 4): the surface of the solid cells, less what the tips at pointed ends replace."""
    padded = np.pad(solid, 1).astype(np.int8)
    step_x = padded[:-1, 1:-1] - padded[1:, 1:-1]  # (columns + 1, rows): 1 where the wall ends going along x
    step_z = padded[1:-1, :-1] - padded[1:-1, 1:]  # (columns, rows + 1): 1 where it ends going up
    for column, tip in ((0, ends.tip_start), (-1, ends.tip_end)):
        if tip is not None:
            step_x[column] = step_z[column] = 0
    right, left = _cell_quads(index[..., 0]), _cell_quads(index[..., 1])[..., ::-1]
    across = np.stack([index[:, :-1, 0], index[:, :-1, 1], index[:, 1:, 1], index[:, 1:, 0]], axis=-1)
    level = np.stack([index[:-1, :, 0], index[1:, :, 0], index[1:, :, 1], index[:-1, :, 1]], axis=-1)
    quads = [right[solid], left[solid]]
    quads += [across[step_x == 1], across[step_x == -1][:, ::-1], level[step_z == 1], level[step_z == -1][:, ::-1]]
    return np.concatenate(quads)


def _tip_triangles(columns: Ints, tip: Ints) -> Ints:
    """The end, top and bottom of a start that ends in a tip.

    columns: (2, rows + 1, 2), the wall's first lines of vertices; tip: (rows + 1,), the tip's.
    """
    (right, left), (inner_right, inner_left) = columns[0].T, columns[1].T
    ends = [np.stack([b[1:], a[1:], a[:-1], b[:-1]], axis=1) for a, b in ((tip, right), (left, tip))]
    fan = [
        np.stack(three, axis=1)
        for three in ((tip, right, inner_right), (tip, inner_right, inner_left), (tip, inner_left, left))
    ]
    caps = [part for three in fan for part in (three[-1:], three[:1, ::-1])]
    return np.concatenate([_split_quads(np.concatenate(ends)), *caps])


def _cell_quads(index: Ints) -> Ints:
    """(columns, rows, 4): each cell's corners, counter-clockwise seen from the right (negative y)."""
    return np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)


def _compact(vertices: Floats, triangles: Ints) -> Mesh:
    used, numbers = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[used], numbers.reshape(-1, 3).astype(np.int64))


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
    return _split_quads(np.stack([ring, following, following + count, ring + count], axis=1))


def _split_quads(quads: Ints) -> Ints:
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
