"""The closed mesh of a room whose upper side is made of plane pieces: slopes of a roof, ceilings at several levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from scan2bim.geometry.meshes import EMPTY, Floats, Mesh

SAME: Final = 0.02
"""Metres. Pieces that meet at heights nearer than this meet."""
ROUNDED: Final = 3e-4
"""Metres. A corner this near to another piece's edge lies on it: corners are rounded to 0.1 mm."""
LEAST: Final = 1e-6
"""Square metres of the smallest piece."""
Node = tuple[float, float]
Corner = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class _Cell:
    """A piece in plan, its ring through all points at which others touch it, counter-clockwise, with the heights."""

    ring: tuple[Node, ...]
    heights: tuple[float, ...]

    def height(self, node: Node) -> float:
        return self.heights[self.ring.index(node)]


def soffit_mesh(soffits: Sequence[Floats], bottom: float) -> Mesh:
    """The mesh between a level floor (z) and plane pieces (n, 3), counter-clockwise in plan, that do not overlap."""
    cells = _met(_cells(soffits))
    if not cells:
        return EMPTY
    owner = {edge: cell for cell in cells for edge in _edges(cell)}
    triangles: list[tuple[Corner, Corner, Corner]] = []
    for cell in cells:
        for a, b, c in _triangles(cell):
            triangles.append(((*a, cell.height(a)), (*b, cell.height(b)), (*c, cell.height(c))))
            triangles.append(((*c, bottom), (*b, bottom), (*a, bottom)))
        for a, b in _edges(cell):
            other = owner.get((b, a))
            low = (bottom, bottom) if other is None else (other.height(a), other.height(b))
            triangles += _side(a, b, low, (cell.height(a), cell.height(b)))
    corners = np.array(triangles, np.float64).reshape(-1, 3)
    vertices, numbers = np.unique(corners.round(6), axis=0, return_inverse=True)
    return Mesh(vertices.astype(np.float64), numbers.reshape(-1, 3).astype(np.int64))


def _cells(soffits: Sequence[Floats]) -> list[_Cell]:
    """The pieces with points wherever their outlines touch."""
    import shapely

    if not soffits:
        return []
    corners = shapely.MultiPoint(np.concatenate([s[:, :2] for s in soffits]))
    rings = [shapely.snap(shapely.LinearRing(s[:, :2]), corners, ROUNDED) for s in soffits]
    areas = [shapely.Polygon(shapely.get_coordinates(ring)) for ring in rings]
    lines = shapely.unary_union([shapely.boundary(area) for area in areas])
    found: list[_Cell] = []
    for part in shapely.get_parts(shapely.polygonize([lines])).tolist():
        inner = part.representative_point()
        number = next((k for k, area in enumerate(areas) if area.contains(inner)), None)
        if number is not None and part.area > LEAST:
            ring = shapely.get_coordinates(shapely.orient_polygons(part).exterior)[:-1]
            nodes = tuple((float(x), float(y)) for x, y in ring)
            found.append(_Cell(nodes, tuple(float(z) for z in _heights(soffits[number], ring))))
    return found


def _heights(soffit: Floats, xy: Floats) -> Floats:
    """Heights (n,) of the plane through a piece over places (n, 2)."""
    middle = soffit.mean(axis=0)
    slope, *_ = np.linalg.lstsq(soffit[:, :2] - middle[:2], soffit[:, 2] - middle[2], rcond=None)
    return np.asarray((xy - middle[:2]) @ slope + middle[2], np.float64)


def _met(cells: Sequence[_Cell]) -> list[_Cell]:
    """Cells of which those that meet at a point nearly have one height there."""
    heights: dict[Node, list[float]] = {}
    for cell in cells:
        for node, z in zip(cell.ring, cell.heights, strict=True):
            heights.setdefault(node, []).append(z)
    return [
        _Cell(cell.ring, tuple(_level(heights[n], z) for n, z in zip(cell.ring, cell.heights, strict=True)))
        for cell in cells
    ]


def _level(heights: Sequence[float], z: float) -> float:
    near = [h for h in heights if abs(h - z) < SAME]
    return sum(near) / len(near)


def _edges(cell: _Cell) -> list[tuple[Node, Node]]:
    return list(pairwise((*cell.ring, cell.ring[0])))


def _triangles(cell: _Cell) -> list[tuple[Node, ...]]:
    import shapely

    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(cell.ring)))
    corners = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)[:, :3].tolist()
    return [tuple((x, y) for x, y in triangle) for triangle in corners]


def _side(a: Node, b: Node, low: tuple[float, float], high: tuple[float, float]) -> list[tuple[Corner, Corner, Corner]]:
    """The upright piece over the edge a to b between two heights at each of its ends, seen from its right; nothing
    where ``high`` is not above ``low``.
    """
    over = high[0] - low[0], high[1] - low[1]
    if max(over) < 1e-6:
        return []
    if min(over) < -1e-6:
        t = over[0] / (over[0] - over[1])
        middle = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]))
        z = low[0] + t * (low[1] - low[0])
        return _side(a, middle, (low[0], z), (high[0], z)) + _side(middle, b, (z, low[1]), (z, high[1]))
    ring = [(*a, low[0]), (*b, low[1]), (*b, high[1]), (*a, high[0])]
    both = [(ring[0], ring[1], ring[2]), (ring[0], ring[2], ring[3])]
    return [t for t in both if len(set(t)) == 3]
