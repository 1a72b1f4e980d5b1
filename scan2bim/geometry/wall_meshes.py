"""Closed meshes of walls: through openings, niches, joined ends, curved in plan, leaning, with a sloping upper edge.

A wall is first a grid of cells in its own straight frame (x along the axis, y to the left, z up from the base), from
which openings and niches are taken; the surface of the cells that stay is then bent to the wall's form. Neighbouring
faces share their vertices, so the mesh is closed whatever is cut. Metres, float64.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from scan2bim.geometry.arcs import Arc
from scan2bim.geometry.meshes import EMPTY, MERGE, Floats, Ints, Mesh, split_quads

Bools = npt.NDArray[np.bool_]

_MARGIN: Final = 1e-3
"""Metres: of wall that stays between a skew end and an opening, so that the mitre's corner has a section."""
_ARC_STEP: Final = math.radians(5.0)
"""Of a curved wall's segments: at 5 m radius they stray 5 mm from the arc."""


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


@dataclass(frozen=True, slots=True, eq=False)
class WallForm:
    """What a wall's mesh is made from.

    openings: (n, 4) rows x0, x1, z0, z1, through the wall; parts outside it are ignored, overlapping ones unite.
    niches: (m, 6) rows x0, x1, z0, z1, y0, y1. axis: the arc that the straight frame's x axis is bent to. lean: radians
    from upright, to the left. profile: (k, 2) points x, z of the upper edge where it is not level.
    """

    ends: WallEnds
    thickness: float
    height: float
    openings: Floats
    niches: Floats
    axis: Arc
    lean: float = 0.0
    profile: Floats | None = None

    @property
    def empty(self) -> bool:
        """Whether there is no wall to speak of."""
        start, end = self.ends.common
        return self.height <= MERGE or self.thickness <= MERGE or end - start <= 4 * _MARGIN


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """Planes that cut the wall and, between them, which cells (columns, layers, rows) are wall."""

    xs: Floats
    ys: Floats
    zs: Floats
    solid: Bools


def wall_mesh(form: WallForm) -> Mesh:
    """The wall's mesh in a frame with its origin at the axis's start and x along the axis's chord."""
    if form.empty:
        return EMPTY
    tips = form.ends.tip_start is not None or form.ends.tip_end is not None
    grid = _grid(form, tips=tips)
    corners = _bend(form, *_grid_corners(form, grid))
    index = np.arange(corners.size // 3, dtype=np.int64).reshape(corners.shape[:3])
    return _compact(corners.reshape(-1, 3), split_quads(_surface_quads(index, grid.solid)))


def wall_pieces(form: WallForm) -> Floats:
    """(n, 8, 3): convex blocks that fill the wall round its openings, in the mesh's frame.

    Of each block the corners lie in the order of ``BOX_CORNERS``. Ends are square: skew ones reach at least to the ends
    of the axis, so that the blocks of walls that meet in a corner leave no gap.
    """
    if form.empty:
        return np.zeros((0, 8, 3))
    grid = _grid(form, tips=False)
    (start, end), xs = form.ends.common, grid.xs.copy()
    xs[0] = start if form.ends.square_start else min(start, 0.0)
    xs[-1] = end if form.ends.square_end else max(end, form.axis.length)
    x, y, z = np.meshgrid(xs, grid.ys, grid.zs, indexing="ij")
    corners = _bend(form, x, y, _clamp_heights(form, x, z))
    boxes = [
        corners[np.ix_((column, column + 1), (low_y, high_y), (low_z, high_z))].reshape(8, 3)
        for column in range(len(xs) - 1)
        for low_y, high_y, low_z, high_z in _blocks(grid.solid[column])
    ]
    blocks = np.array(boxes).reshape(-1, 8, 3)
    heights = blocks[:, [1, 3, 5, 7], 2] - blocks[:, [0, 2, 4, 6], 2]
    return blocks[heights.max(axis=1, initial=0.0) > MERGE]


def piece_mesh(piece: Floats) -> Mesh:
    """A block (8, 3) of ``wall_pieces`` as a closed mesh."""
    index = np.arange(8, dtype=np.int64).reshape(2, 2, 2)
    return _compact(piece, split_quads(_surface_quads(index, np.ones((1, 1, 1), np.bool_))))


BOX_CORNERS: Final = tuple((x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1))
"""Of each corner of a block whether it is at the low (0) or high (1) end of x, y and z."""


def _blocks(column: Bools) -> list[tuple[int, int, int, int]]:
    """Blocks y0, y1, z0, z1 (numbers of planes) that fill a column's (layers, rows) solid cells."""
    if np.all(column == column[0]):
        return [(0, len(column), low, high) for low, high in _runs(column[0])]
    return [(layer, layer + 1, low, high) for layer in range(len(column)) for low, high in _runs(column[layer])]


def _runs(flags: Bools) -> list[tuple[int, int]]:
    """Start and end of each run of True."""
    steps = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(low), int(high)) for low, high in steps.reshape(-1, 2)]


def _grid(form: WallForm, *, tips: bool) -> _Grid:
    start, end = form.ends.common
    holes, niches = _clip(form, form.openings), _clip(form, form.niches)
    niches[:, 4:] = np.clip(niches[:, 4:], -form.thickness / 2, form.thickness / 2)
    half = [] if form.ends.square_start or form.ends.square_end else [(start + end) / 2]
    breaks = form.profile[:, 0] if form.profile is not None else np.zeros(0)
    count = math.ceil(abs(form.axis.angle) / _ARC_STEP) if form.axis.curvature else 1
    bends = np.linspace(start, end, max(count, 1) + 1)
    inner = breaks[(breaks > start + _MARGIN) & (breaks < end - _MARGIN)]
    xs = _cuts(np.concatenate([holes[:, :2].ravel(), niches[:, :2].ravel(), bends, half, inner]))
    middle = [0.0] if tips else []
    ys = _cuts(np.concatenate([niches[:, 4:].ravel(), middle, [-form.thickness / 2, form.thickness / 2]]))
    zs = _cuts(np.concatenate([holes[:, 2:4].ravel(), niches[:, 2:4].ravel(), [0.0, form.height]]))
    whole = np.tile([-form.thickness, form.thickness], (len(holes), 1))
    voids = np.concatenate([np.column_stack([holes, whole]), niches])
    return _Grid(xs, ys, zs, _solid_cells(xs, ys, zs, voids))


def _clip(form: WallForm, rows: Floats) -> Floats:
    """Openings or niches clipped to the wall; what lies outside is left out."""
    ends, height = form.ends, form.height
    start = ends.common[0] + (0.0 if ends.square_start else _MARGIN)
    end = ends.common[1] - (0.0 if ends.square_end else _MARGIN)
    clipped = rows.copy()
    clipped[:, :4] = np.clip(rows[:, :4], [start, start, 0.0, 0.0], [end, end, height, height])
    keep = (clipped[:, 1] - clipped[:, 0] > MERGE) & (clipped[:, 3] - clipped[:, 2] > MERGE)
    return clipped[keep]


def _cuts(values: Floats) -> Floats:
    """Sorted values without those that lie within MERGE of the one before; both extremes stay."""
    ordered = np.unique(values)
    kept = ordered[np.append(True, np.diff(ordered) > MERGE)]
    kept[-1] = ordered[-1]
    return kept


def _solid_cells(xs: Floats, ys: Floats, zs: Floats, voids: Floats) -> Bools:
    """(columns, layers, rows): True where the cell's middle lies in no void (rows x0, x1, z0, z1, y0, y1)."""
    solid = np.ones((len(xs) - 1, len(ys) - 1, len(zs) - 1), np.bool_)
    x, y, z = ((v[1:] + v[:-1]) / 2 for v in (xs, ys, zs))
    for x0, x1, z0, z1, y0, y1 in voids.tolist():
        solid[np.ix_((x0 < x) & (x < x1), (y0 < y) & (y < y1), (z0 < z) & (z < z1))] = False
    return solid


def _grid_corners(form: WallForm, grid: _Grid) -> tuple[Floats, Floats, Floats]:
    """x, y, z, each (columns + 1, layers + 1, rows + 1), the ends cut as they join and the top at the profile."""
    x, y, z = np.meshgrid(grid.xs, grid.ys, grid.zs, indexing="ij")
    ends, half = form.ends, form.thickness / 2
    for column, right, tip, left in (
        (0, ends.right_start, ends.tip_start, ends.left_start),
        (-1, ends.right_end, ends.tip_end, ends.left_end),
    ):
        sides, places = ([-half, half], [right, left]) if tip is None else ([-half, 0.0, half], [right, tip, left])
        x[column] = np.interp(grid.ys, sides, places)[:, None]
    return x, y, _clamp_heights(form, x, z)


def _clamp_heights(form: WallForm, x: Floats, z: Floats) -> Floats:
    if form.profile is None:
        return z
    top = np.interp(x, form.profile[:, 0], form.profile[:, 1])
    return np.where(z > top - MERGE, top, z)


def _bend(form: WallForm, x: Floats, y: Floats, z: Floats) -> Floats:
    """(..., 3): straight coordinates leant and bent to the axis."""
    plan = form.axis.place(x, y + z * math.tan(form.lean))
    return np.concatenate([plan, z[..., None]], axis=-1)


def _surface_quads(index: Ints, solid: Bools) -> Ints:
    """(n, 4): the faces between solid cells and none, counter-clockwise seen from outside."""
    quads: list[Ints] = []
    padded = np.pad(solid, 1).astype(np.int8)
    for axis in range(3):
        inner = tuple(slice(None) if k == axis else slice(1, -1) for k in range(3))
        step = np.moveaxis(np.diff(padded[inner], axis=axis), axis, 0)  # 1 where solid begins, -1 where it ends
        corner = np.moveaxis(index, axis, 0)
        a, b, c, d = corner[:, :-1, :-1], corner[:, 1:, :-1], corner[:, 1:, 1:], corner[:, :-1, 1:]
        faces = np.stack([a, b, c, d] if axis != 1 else [a, d, c, b], axis=-1)  # seen from the high end of the axis
        quads += [faces[step == -1], faces[step == 1][:, ::-1]]
    return np.concatenate(quads)


def _compact(vertices: Floats, triangles: Ints) -> Mesh:
    """The mesh without unused vertices, those in one place made one, and without triangles that are none."""
    used, numbers = np.unique(triangles, return_inverse=True)
    _, first, same = np.unique(np.round(vertices[used], 9), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    welded = rank[same.reshape(-1)[numbers.reshape(-1)]].reshape(-1, 3)
    a, b, c = welded.T
    kept = welded[(a != b) & (b != c) & (c != a)]
    return Mesh(vertices[used][first[order]], kept)
