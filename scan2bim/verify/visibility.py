"""What the stations could see of a model's cells, and what they saw there instead.

For each station the model is drawn into a cube map of ranges. A cell that lies behind other elements there cannot be
seen from it. Of the others the station's panorama tells whether it looked through the cell's place, saw something in
it, or was blocked before it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.verify.faces import FaceTable, Plane

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

EDGE = 256
"""Cells along a cube edge of the drawn model: 0.35 degrees, 3 cm at 5 m, as wide as a cell of the model."""
FARTHEST = 25.0
"""Metres from which on a station is not asked: its points are sparse there."""
STEEPEST = 0.12
"""Cosine of the angle between ray and normal below which a face is seen edge-on and ranges say nothing of it."""
STEEP = 0.3
"""The same, below which a range at a face is no sign of it: it may be of anything along 15 cm of the ray."""
MARGIN = 0.05
"""Half-width, metres across the face, of "saw it": of a panorama's cell and of what is within reach of points."""
THROUGH = 0.05
"""Metres behind a face, across it, from which on a station looked through it. Only cells without points are asked, and
what was built up to 20 cm off gives its cells points."""

VISIBLE, LOOKED_THROUGH, BLOCKED, SAW = 1, 2, 4, 8
"""Bits of a cell: not hidden by the model from some station; some station looked through it, was blocked before it, saw
something in it."""


def opaque_bodies(planes: Sequence[Plane], opaque: NDArray[np.bool_], matrix: F64) -> F64:
    """Triangles (t, 3, 3) that rays do not pass: of the elements that are ``opaque`` (e,) bool, less their glass; moved
    by ``matrix`` (4, 4).
    """
    parts = [p.corners for p in planes if opaque[p.element] and not p.glass]
    corners = np.concatenate(parts) if parts else np.zeros((0, 3, 3))
    return np.ascontiguousarray(corners @ matrix[:3, :3].T + matrix[:3, 3])


def look(
    table: FaceTable,
    bodies: F64,
    panoramas: Sequence[Panorama],
    asked: NDArray[np.bool_],
    progress: Callable[[float], None],
) -> U8:
    """Bits (c,) of each cell, 0 for those not ``asked`` (c,) bool; ``bodies`` (t, 3, 3) are triangles that rays do not
    pass. The ranges of panoramas are read one by one.
    """
    cells = np.flatnonzero(asked & ~table.glass[table.cell_face])
    bits = np.zeros(len(asked), np.uint8)
    faces = (table.normal, table.origin, table.u, table.v, table.size, table.two_sided)
    drawn = np.empty((6, EDGE, EDGE), np.float32)
    for done, panorama in enumerate(panoramas):
        drawn.fill(0.0)
        _draw(bodies, panorama.position, drawn)
        _to_ranges(drawn)
        _ask(cells, table.cell_face, table.cell_at, faces, panorama.position, drawn, panorama.ranges, bits)
        progress((done + 1) / len(panoramas))
    return bits


@nb.njit(cache=True, nogil=True)
def _draw(corners, position, nearness):  # pyright: ignore
    """Greatest inverse depth of the triangles (t, 3, 3), along the axis of each side of the cube, into ``nearness``
    (6, n, n). It is linear in a side's plane, so that a triangle's rows are filled without a division.
    """
    n = nearness.shape[1]
    near = 0.02
    p = np.empty((3, 3))
    clipped = np.empty((4, 3))
    for t in range(corners.shape[0]):
        closest = np.inf
        for k in range(3):
            for j in range(3):
                p[k, j] = corners[t, k, j] - position[j]
        for j in range(3):
            low = min(p[0, j], p[1, j], p[2, j])
            high = max(p[0, j], p[1, j], p[2, j])
            gap = max(low, -high, 0.0)
            closest = gap if j == 0 else max(closest, gap)
        if closest > FARTHEST:
            continue
        nx = (p[1, 1] - p[0, 1]) * (p[2, 2] - p[0, 2]) - (p[1, 2] - p[0, 2]) * (p[2, 1] - p[0, 1])
        ny = (p[1, 2] - p[0, 2]) * (p[2, 0] - p[0, 0]) - (p[1, 0] - p[0, 0]) * (p[2, 2] - p[0, 2])
        nz = (p[1, 0] - p[0, 0]) * (p[2, 1] - p[0, 1]) - (p[1, 1] - p[0, 1]) * (p[2, 0] - p[0, 0])
        plane = nx * p[0, 0] + ny * p[0, 1] + nz * p[0, 2]
        if plane == 0.0:
            continue
        for face in range(6):
            axis = face // 2
            sign = 1.0 if face % 2 == 0 else -1.0
            iu = 1 if axis == 0 else 0
            iv = 2 if axis < 2 else 1
            count = 0
            for k in range(3):
                a = p[k]
                b = p[(k + 1) % 3]
                ma = sign * a[axis]
                mb = sign * b[axis]
                if ma >= near:
                    clipped[count] = a
                    count += 1
                if (ma >= near) != (mb >= near):
                    w = (near - ma) / (mb - ma)
                    for j in range(3):
                        clipped[count, j] = a[j] + w * (b[j] - a[j])
                    count += 1
            along = sign * (nx if axis == 0 else ny if axis == 1 else nz) / plane
            across = ((nx if iu == 0 else ny) / plane, (nz if iv == 2 else ny) / plane)
            for k in range(1, count - 1):
                _fill(clipped, k, axis, sign, iu, iv, along, across, nearness[face], n)


@nb.njit(cache=True, nogil=True)
def _fill(clipped, k, axis, sign, iu, iv, along, across, face, n):  # pyright: ignore
    """Fill one triangle of a fan, row by row: corners 0, k and k + 1 of ``clipped``."""
    h = 0.5 * n
    m0 = sign * clipped[0, axis]
    m1 = sign * clipped[k, axis]
    m2 = sign * clipped[k + 1, axis]
    x0 = clipped[0, iu] / m0 * h + h
    y0 = clipped[0, iv] / m0 * h + h
    x1 = clipped[k, iu] / m1 * h + h
    y1 = clipped[k, iv] / m1 * h + h
    x2 = clipped[k + 1, iu] / m2 * h + h
    y2 = clipped[k + 1, iv] / m2 * h + h
    if max(x0, x1, x2) < 0.0 or min(x0, x1, x2) > n or max(y0, y1, y2) < 0.0 or min(y0, y1, y2) > n:
        return
    a0 = int(max(np.ceil(min(x0, x1, x2) - 0.5), 0.0))
    a1 = int(min(np.floor(max(x0, x1, x2) - 0.5), n - 1.0))
    for a in range(a0, a1 + 1):
        x = a + 0.5
        low, high = np.inf, -np.inf
        for xa, ya, xb, yb in ((x0, y0, x1, y1), (x1, y1, x2, y2), (x2, y2, x0, y0)):
            if (xa <= x) != (xb <= x):
                y = ya + (x - xa) / (xb - xa) * (yb - ya)
                low = min(low, y)
                high = max(high, y)
        if low > high:
            continue
        b0 = int(max(np.ceil(low - 0.5), 0.0))
        b1 = int(min(np.floor(high - 0.5), n - 1.0))
        base = along + (x - h) / h * across[0] - (h - 0.5) / h * across[1]
        slope = across[1] / h
        for b in range(b0, b1 + 1):
            face[a, b] = max(face[a, b], base + b * slope)


@nb.njit(cache=True, nogil=True)
def _to_ranges(nearness):  # pyright: ignore
    """Inverse depths (6, n, n) to ranges, inf where nothing is, in place."""
    n = nearness.shape[1]
    for face in range(6):
        for a in range(n):
            du = (2 * a + 1.0) / n - 1.0
            for b in range(n):
                dv = (2 * b + 1.0) / n - 1.0
                w = nearness[face, a, b]
                nearness[face, a, b] = np.sqrt(1.0 + du * du + dv * dv) / w if w > 0.0 else np.inf


@nb.njit(cache=True, nogil=True)
def _ask(cells, cell_face, cell_at, faces, position, drawn, ranges, bits):  # pyright: ignore
    """Set the bits of some cells by what one station's drawn model and panorama hold in their direction."""
    normal, origin, u, v, size, two_sided = faces
    n = drawn.shape[1]
    edge = ranges.shape[1]
    for i in cells:
        face = cell_face[i]
        p = (cell_at[i, 0] + 0.5) * size[face]
        q = (cell_at[i, 1] + 0.5) * size[face]
        dx = origin[face, 0] + p * u[face, 0] + q * v[face, 0] - position[0]
        dy = origin[face, 1] + p * u[face, 1] + q * v[face, 1] - position[1]
        dz = origin[face, 2] + p * u[face, 2] + q * v[face, 2] - position[2]
        d = np.sqrt(dx * dx + dy * dy + dz * dz)
        if d > FARTHEST or d < 0.1:
            continue
        cosine = -(dx * normal[face, 0] + dy * normal[face, 1] + dz * normal[face, 2]) / d
        if two_sided[face]:
            cosine = abs(cosine)
        if cosine < STEEPEST:
            continue
        f, a, b = cube_cell(dx, dy, dz, n)
        if drawn[f, a, b] < d - (MARGIN + 3.0 * d / n) / cosine:
            continue
        bits[i] |= VISIBLE
        f, a, b = cube_cell(dx, dy, dz, edge)
        r = ranges[f, a, b]
        if r == 0.0:
            continue
        if r < 0.0 or r > d + THROUGH / cosine:
            bits[i] |= LOOKED_THROUGH
        elif r < d - MARGIN / cosine:
            bits[i] |= BLOCKED
        elif cosine > STEEP:
            bits[i] |= SAW
