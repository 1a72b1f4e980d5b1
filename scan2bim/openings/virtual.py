"""Virtual stations for clouds without scanner positions: what a scanner in each space would have seen of the merged
cloud.

A made-up panorama knows no pulse that went out and did not return: that nothing was scanned in a direction may mean so,
or that something stood before it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba as nb
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.cloud.surfels import Surfels
from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.structure.shapes import StoreyShape

EDGE = 192
"""Cells along a cube edge: 0.5 degrees, the width of a surfel at 6 m."""
EYE = 1.5
"""Height of a virtual station over the floor, metres: that of a tripod."""
SPACING = 3.0
"""Distance of virtual stations in a large space, metres: every wall gets one that looks at it squarely."""
CLEAR = 0.5
"""Distance of virtual stations from walls, metres."""
REACH = 12.0
"""Surfels farther than this, metres, are not drawn: gaps between them would be looked through."""
SPLAT = 0.045
"""Radius, metres, with which a surfel is drawn: a little more than half of the diagonal of its voxel in plan."""
FIRST = 60_000
"""Virtual stations are numbered from here, above all real ones."""


def virtual_panoramas(storey: StoreyShape, surfels: Surfels) -> dict[int, Panorama]:
    """Panoramas of made-up stations in the spaces of one storey; ``surfels`` are those of the storey."""
    points = [p for space in storey.spaces for p in _places(space.polygon)]
    height = min(storey.floor + EYE, storey.top - 0.4)
    out: dict[int, Panorama] = {}
    index = PlanIndex(surfels.xyz)
    for number, (x, y) in enumerate(points):
        position = np.array([x, y, height])
        near = index.along(np.array([position[:2], position[:2]]), REACH, ordered=False)
        ranges = np.zeros((6, EDGE, EDGE), np.float32)
        _draw(surfels.xyz[near], position.astype(np.float32), ranges, np.float32(SPLAT))
        out[FIRST + number] = Panorama(position, ranges)
    return out


def _places(polygon: Polygon) -> list[tuple[float, float]]:
    """Where virtual stations stand in a space: a grid clear of its borders, or its innermost point."""
    inner = polygon.buffer(-CLEAR)
    low_x, low_y, high_x, high_y = polygon.bounds
    xs = _spread(low_x, high_x)
    ys = _spread(low_y, high_y)
    grid = np.array([(x, y) for x in xs for y in ys])
    inside = grid[shapely.contains_xy(inner, grid)] if not inner.is_empty else grid[:0]
    if len(inside):
        return [(float(x), float(y)) for x, y in inside]
    point = shapely.maximum_inscribed_circle(polygon, 0.05).coords[0]
    return [(float(point[0]), float(point[1]))]


def _spread(low: float, high: float) -> NDArray[np.float64]:
    count = max(1, round((high - low) / SPACING))
    return low + (np.arange(count) + 0.5) * (high - low) / count


def is_virtual(stations: Sequence[int]) -> bool:
    """Whether any of these station numbers is a made-up one's."""
    return any(s >= FIRST for s in stations)


@nb.njit(cache=True, nogil=True)
def _draw(points, position, ranges, radius):  # pyright: ignore
    """Nearest range of each cell when every point is drawn as a disc of ``radius`` metres towards the station; in
    place.
    """
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        dz = points[i, 2] - position[2]
        d = np.sqrt(dx * dx + dy * dy + dz * dz)
        if d < 0.2:
            continue
        f, a, b = cube_cell(dx, dy, dz, edge)
        m = max(abs(dx), abs(dy), abs(dz))
        spread = int(np.ceil(radius / m * 0.5 * edge))
        for u in range(max(a - spread, 0), min(a + spread + 1, edge)):
            for v in range(max(b - spread, 0), min(b + spread + 1, edge)):
                if ranges[f, u, v] == 0.0 or d < ranges[f, u, v]:
                    ranges[f, u, v] = d
