"""The surfaces of a model as plane faces cut into square cells: what points are assigned to and rays are cast at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.graphs import join
from scan2bim.verify.ifc_model import ModelElement

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

CELL = 0.05
"""Edge of a cell, metres: several points of a usual scan lie in it, and a door frame is wider."""
MOST_CELLS = 8e6
"""Cells from which on they are made larger: 8 million take 200 MB."""
COARSE, MOST_COARSE = 0.15, 4e6
"""Edge of the cells, metres, that a model is placed by, and their number from which on they are made larger: a fit
needs a few thousand."""
LEAST_CELL = 0.01
"""Faces narrower than two of these (metres) are left out: no scanner resolves them."""
MOST_FACES = 600
"""Faces of an element that are kept, the largest: a wash basin is drawn with thousands."""
ANGLE_STEP = 0.004
"""Normals are grouped in steps of this (radians): far below what the drawing of a curve is divided in."""
OFFSET_STEP = 0.002
"""Planes are grouped in steps of this, metres: less than any comparison resolves."""
EDGES = 12
"""Longest edges of a level face that its grid is tried along."""
BODY, FILL, PATCH = 0, 1, 2
"""Parts that faces play: most measure their element; those of doors and windows in walls only explain points, for
leaves stand open and linings differ; patches, the wall's surface across an opening, measure there instead."""
RIM = -2


@dataclass(frozen=True, slots=True, eq=False)
class FaceTable:
    """f plane faces of a model and their c cells, metres in one frame.

    element (f,) int32 place in the model's elements; normal, origin, u, v (f, 3) float64: outward normal, a corner of
    the cells' grid and its axes; size (f,) float64 edge of a cell; shape (f, 2) int32 cells along u and v; start (f,)
    int64 first entry in ``grid``; grid (g,) int32 cell number or -1; two_sided (f,) bool where the body is open, so
    that its outside is not known; glass (f,) bool; part (f,) uint8 one of BODY, FILL, PATCH. Grid entries of RIM belong
    to cells that a face covers less than half.
    cell_face (c,) int32, cell_at (c, 2) int32 place in the face's grid.
    """

    element: I32
    normal: F64
    origin: F64
    u: F64
    v: F64
    size: F64
    shape: I32
    start: I64
    grid: I32
    two_sided: NDArray[np.bool_]
    glass: NDArray[np.bool_]
    part: NDArray[np.uint8]
    cell_face: I32
    cell_at: I32

    def __len__(self) -> int:
        return len(self.element)

    @property
    def cell_element(self) -> I32:
        """(c,) the element of each cell."""
        return self.element[self.cell_face]

    def area(self, cells: I64) -> F64:
        """(k,) square metres of some cells."""
        return self.size[self.cell_face[cells]] ** 2

    def by_element(self, elements: int) -> tuple[I64, I64]:
        """Numbers (c,) of the cells sorted by element, as they are, and the first entry (elements + 1,) of each."""
        owner = self.cell_element
        return np.arange(len(owner)), np.searchsorted(owner, np.arange(elements + 1))

    def centres(self, cells: I64 | NDArray[np.bool_] | slice = slice(None)) -> F64:
        """(k, 3) middles of the cells."""
        face, at = self.cell_face[cells], self.cell_at[cells]
        return _centres(face, at, self.size, self.origin, self.u, self.v)

    def box(self) -> F64:
        """(2, 3) lower and upper corner of what its faces' grids take."""
        ends = self.shape * self.size[:, None]
        corners = [self.origin + a * ends[:, :1] * self.u + b * ends[:, 1:] * self.v for a in (0, 1) for b in (0, 1)]
        every = np.concatenate(corners)
        return np.array([every.min(axis=0), every.max(axis=0)])

    def moved(self, matrix: F64) -> FaceTable:
        """By a rigid motion (4, 4)."""
        turn = matrix[:3, :3].T
        return replace(
            self,
            normal=self.normal @ turn,
            origin=self.origin @ turn + matrix[:3, 3],
            u=self.u @ turn,
            v=self.v @ turn,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """The triangles (t, 3, 3) of one plane of an element."""

    element: int
    normal: F64
    corners: F64
    two_sided: bool
    glass: bool
    part: int

    @property
    def area(self) -> float:
        """Square metres."""
        return float(np.linalg.norm(_crossed(self.corners), axis=1).sum()) / 2


def find_planes(elements: Sequence[ModelElement], anchor: F64) -> list[Plane]:
    """Planes of all elements but openings, element by element; ``anchor`` (3,) is taken off all coordinates."""
    planes: list[Plane] = []
    patched = {element.guid for element in elements if element.role == "patch"}
    for number, element in enumerate(elements):
        if element.role != "opening":
            fills = element.role == "fill" and element.host in patched
            part = PATCH if element.role == "patch" else FILL if fills else BODY
            planes += _planes(number, element, part, anchor)
    return planes


def make_faces(planes: Sequence[Plane]) -> FaceTable:
    """Faces and cells as points are compared with."""
    return _table(planes, max(CELL, math.sqrt(sum(p.area for p in planes) / MOST_CELLS)))


def coarse_faces(planes: Sequence[Plane]) -> FaceTable:
    """Faces and cells that a model is placed by."""
    return _table(planes, max(COARSE, math.sqrt(sum(p.area for p in planes) / MOST_COARSE)))


def areas_of(planes: Sequence[Plane], elements: int) -> F64:
    """Square metres (e,) of the elements' planes."""
    owner, area = np.array([p.element for p in planes], np.int64), np.array([p.area for p in planes], np.float64)
    return np.bincount(owner, area, elements).astype(np.float64)


def oriented(vertices: F64, triangles: I32) -> tuple[I32, NDArray[np.bool_], bool]:
    """Triangles (k, 3) turned so that their normals point outwards, which of the given they are, and whether the body
    is closed, so that its outside is known.

    Kernels give boundary representations with either winding, but the same one within a connected shell.
    """
    _, welded = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    corner = welded.ravel()[triangles]
    keep = (corner[:, 0] != corner[:, 1]) & (corner[:, 1] != corner[:, 2]) & (corner[:, 2] != corner[:, 0])
    triangles, corner = triangles[keep], corner[keep]
    count = int(corner.max(initial=0)) + 1
    shell = _shells(corner, count)
    edges = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
    key, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    closed = np.array_equal(np.sort(key), np.sort(back))
    p = vertices[triangles] - vertices.mean(axis=0)
    volume = np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2]))
    inside_out = np.bincount(shell, weights=volume) < 0
    return np.where(inside_out[shell][:, None], triangles[:, ::-1], triangles), keep, closed


@nb.njit(cache=True, nogil=True)
def _shells(corner, count):  # pyright: ignore
    """Number (t,) of the connected part of each triangle; ``corner`` (t, 3) of its corners among ``count``."""
    parent = np.arange(count)
    for t in range(corner.shape[0]):
        for k in range(1, 3):
            join(parent, corner[t, 0], corner[t, k])
    out = np.empty(corner.shape[0], np.int64)
    number = np.full(count, -1, np.int64)
    parts = 0
    for t in range(corner.shape[0]):
        a = corner[t, 0]
        while parent[a] != a:
            a = parent[a]
        if number[a] < 0:
            number[a] = parts
            parts += 1
        out[t] = number[a]
    return out


def _planes(number: int, element: ModelElement, part: int, anchor: F64) -> list[Plane]:
    triangles, kept, closed = oriented(element.vertices, element.triangles)
    glass = element.glass[kept]
    corners = element.vertices[triangles] - anchor
    cross = _crossed(corners)
    length = np.linalg.norm(cross, axis=1)
    solid = length > 1e-9
    corners, glass, length = corners[solid], glass[solid], length[solid]
    normal = cross[solid] / length[:, None]
    middle = corners.reshape(-1, 3).mean(axis=0) if len(corners) else np.zeros(3)
    offset = np.einsum("ij,ij->i", normal, corners[:, 0] - middle)
    steps = np.column_stack([np.round(normal / ANGLE_STEP), np.round(offset / OFFSET_STEP), glass]).astype(np.int64)
    _, group = np.unique(steps, axis=0, return_inverse=True)
    group = group.ravel()
    area = np.bincount(group, weights=length) / 2
    out: list[Plane] = []
    for which in np.argsort(-area)[:MOST_FACES]:
        mine = np.flatnonzero(group == which)
        main = mine[np.argmax(length[mine])]
        out.append(Plane(number, normal[main], corners[mine], not closed and part != PATCH, bool(glass[mine[0]]), part))
    return out


def _crossed(corners: F64) -> F64:
    """Cross products (t, 3) of two edges of triangles (t, 3, 3): normals as long as twice their areas."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.column_stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ]
    )


def _axes(normal: F64, corners: F64) -> tuple[F64, F64]:
    """Axes in the plane: level and upwards on what stands, along the least box round it on what lies."""
    if abs(normal[2]) < 0.9:
        u = np.array([-normal[1], normal[0], 0.0])
    else:
        edges = (corners - np.roll(corners, 1, axis=1)).reshape(-1, 3)
        edges = edges[np.argsort(-np.linalg.norm(edges, axis=1), kind="stable")[:EDGES]]
        edges = edges - np.outer(edges @ normal, normal)
        along = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-9)
        points = corners.reshape(-1, 3)
        box = np.ptp(points @ along.T, axis=0) * np.ptp(points @ np.cross(normal, along).T, axis=0)
        u = along[int(np.argmin(box))]
    u = u / math.sqrt(float(u @ u))
    (a, b, c), (x, y, z) = normal.tolist(), u.tolist()
    return u, np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _table(groups: Sequence[Plane], largest: float) -> FaceTable:
    rows: list[tuple[Plane, F64, F64, F64, float, tuple[int, int]]] = []
    grids: list[I32] = []
    for group in groups:
        u, v = _axes(group.normal, group.corners)
        flat = np.stack([group.corners @ u, group.corners @ v], axis=2)
        low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
        size = min(largest, float((high - low).min()) / 2)
        if size < LEAST_CELL:
            continue
        shape = (math.ceil((high[0] - low[0]) / size - 1e-6), math.ceil((high[1] - low[1]) / size - 1e-6))
        grid = np.full(shape, -1, np.int32)
        _fill((flat - low) / size, grid)
        _rim(grid)
        if grid.max() < 0:
            continue
        origin = low[0] * u + low[1] * v + (group.corners[0, 0] @ group.normal) * group.normal
        rows.append((group, origin, u, v, size, shape))
        grids.append(grid.ravel())
    return _joined(rows, grids)


def _joined(rows: Sequence[tuple[Plane, F64, F64, F64, float, tuple[int, int]]], grids: Sequence[I32]) -> FaceTable:
    lengths = np.array([len(g) for g in grids], np.int64)
    start = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)[:-1]
    grid = np.concatenate(grids) if grids else np.zeros(0, np.int32)
    taken = np.flatnonzero(grid >= 0)
    grid[taken] = np.arange(len(taken), dtype=np.int32)
    face = (np.searchsorted(start, taken, side="right") - 1).astype(np.int32)
    shape = np.array([r[5] for r in rows], np.int32).reshape(-1, 2)
    within = taken - start[face]
    at = np.column_stack([within // shape[face, 1], within % shape[face, 1]]).astype(np.int32)
    return FaceTable(
        element=np.array([r[0].element for r in rows], np.int32),
        normal=np.array([r[0].normal for r in rows]).reshape(-1, 3),
        origin=np.array([r[1] for r in rows]).reshape(-1, 3),
        u=np.array([r[2] for r in rows]).reshape(-1, 3),
        v=np.array([r[3] for r in rows]).reshape(-1, 3),
        size=np.array([r[4] for r in rows]),
        shape=shape,
        start=start,
        grid=grid,
        two_sided=np.array([r[0].two_sided for r in rows], bool),
        glass=np.array([r[0].glass for r in rows], bool),
        part=np.array([r[0].part for r in rows], np.uint8),
        cell_face=face,
        cell_at=at,
    )


@nb.njit(cache=True, nogil=True)
def _fill(flat, grid):  # pyright: ignore
    """Mark with 0 the cells whose middle lies in a triangle; ``flat`` (t, 3, 2) in cells from the grid's corner."""
    nu, nv = grid.shape
    for t in range(flat.shape[0]):
        ax = flat[t, 0, 0]
        ay = flat[t, 0, 1]
        bx = flat[t, 1, 0]
        by = flat[t, 1, 1]
        cx = flat[t, 2, 0]
        cy = flat[t, 2, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        i0 = max(int(np.floor(min(ax, bx, cx) - 0.5)), 0)
        i1 = min(int(np.ceil(max(ax, bx, cx) + 0.5)), nu)
        j0 = max(int(np.floor(min(ay, by, cy) - 0.5)), 0)
        j1 = min(int(np.ceil(max(ay, by, cy) + 0.5)), nv)
        for i in range(i0, i1):
            x = i + 0.5
            for j in range(j0, j1):
                y = j + 0.5
                a = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / area
                b = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / area
                if a >= -1e-9 and b >= -1e-9 and a + b <= 1.0 + 1e-9:
                    grid[i, j] = 0


@nb.njit(cache=True, nogil=True)
def _rim(grid):  # pyright: ignore
    """Mark with RIM the cells beside marked ones: a face reaches into them, though not to their middle."""
    nu, nv = grid.shape
    for i in range(nu):
        for j in range(nv):
            if grid[i, j] != 0:
                continue
            for a in range(max(i - 1, 0), min(i + 2, nu)):
                for b in range(max(j - 1, 0), min(j + 2, nv)):
                    if grid[a, b] == -1:
                        grid[a, b] = RIM


@nb.njit(cache=True, nogil=True)
def _centres(face, at, size, origin, u, v):  # pyright: ignore
    """Middles (k, 3) of cells by their faces (k,) and their places ``at`` (k, 2) in their grids."""
    out = np.empty((len(face), 3))
    for i in range(len(face)):
        f = face[i]
        a, b = (at[i, 0] + 0.5) * size[f], (at[i, 1] + 0.5) * size[f]
        for k in range(3):
            out[i, k] = origin[f, k] + a * u[f, k] + b * v[f, k]
    return out
