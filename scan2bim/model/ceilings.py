"""The upper side of spaces, level or in plane pieces: heights over places and along edges, and the space's mesh."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from scan2bim.geometry.meshes import Mesh, prism_mesh
from scan2bim.geometry.soffit_meshes import soffit_mesh
from scan2bim.model.elements import Point2, Point3, Space

if TYPE_CHECKING:
    from shapely import Polygon

Floats = npt.NDArray[np.float64]

ON_LINE: Final = 0.002
"""Metres. Corners this near to an edge lie on it: both are rounded."""


def space_body(space: Space) -> Mesh:
    """A space's mesh in the building's frame."""
    if space.ceiling:
        return soffit_mesh([np.array(piece, np.float64) for piece in space.ceiling], space.base)
    return prism_mesh(space.outline, space.holes, space.base, space.base + space.height.value)


def plane_of(piece: tuple[Point3, ...]) -> tuple[float, float, float]:
    """The plane z = a x + b y + c through a piece of a ceiling, as (a, b, c)."""
    corners = np.array(piece, np.float64)
    middle = corners.mean(axis=0)
    slope, *_ = np.linalg.lstsq(corners[:, :2] - middle[:2], corners[:, 2] - middle[2], rcond=None)
    a, b = float(slope[0]), float(slope[1])
    return a, b, float(middle[2]) - a * float(middle[0]) - b * float(middle[1])


def under_ceiling(space: Space, start: Point2, end: Point2) -> Polygon:
    """The upright area over an edge of a space's outline: x from ``start``, y over the space's base, metres."""
    import shapely

    length = math.dist(start, end)
    full = shapely.box(0.0, 0.0, length, space.height.value)
    if not space.ceiling:
        return full
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    parts: list[Polygon] = []
    for piece in space.ceiling:
        placed = [
            ((x - start[0]) * ux + (y - start[1]) * uy, (y - start[1]) * ux - (x - start[0]) * uy, z)
            for x, y, z in piece
        ]
        for (s, off, z0), (t, away, z1) in pairwise((*placed, placed[0])):
            if max(abs(off), abs(away)) < ON_LINE and abs(t - s) > ON_LINE:
                low, high = z0 - space.base, z1 - space.base
                parts.append(shapely.Polygon([(s, 0.0), (t, 0.0), (t, high), (s, low)]))
    found = shapely.union_all(parts, grid_size=1e-4).intersection(full.buffer(ON_LINE))
    return found if isinstance(found, shapely.Polygon) and not found.is_empty else full
