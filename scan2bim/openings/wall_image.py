"""The image of a wall: for each pixel, whether its face was seen there, something behind the face, or a station looked
through.

The paper's image I (section IV.B) of data, centroids and no-data, with pixels of 2.5 cm instead of voxels of 20 cm. A
window's panes return some pulses, mirror a few and let most pass; but in all of the window, frame, pane and reveals,
the wall's face itself is missing. So what was *behind* the face, seen from the room before it, counts beside the
*centroids* (voxel label Opening), where the panorama of a station shows that its rays went on behind the wall, or never
came back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.openings.near_points import WallPoints
from scan2bim.structure.shapes import WallShape

PIXEL = 0.025
"""Edge of a pixel, metres: half of the narrowest strip of wall between two windows."""
ASKED = 2
"""Pixels along an edge of the squares for which stations are asked: 5 cm, their panorama's cells are no finer."""
REACH = 12.0
"""Stations farther than this, metres, are not asked: their panorama's cells are too coarse for a jamb."""
SKIN = 0.03
"""Points up to this far behind a face, metres, lie on it: noise and plaster; leaves and frames stand back more."""
THIN = 0.15
"""Share of a wall's thickness that SKIN may take: points on the reveals of thin walls are not all on a face."""
PROUD = 0.06
"""Points up to this far before a face, metres, lie on it: trims and skirting boards."""
STEEPEST = 5.0
"""Slant (1 / cosine) beyond which a station is not asked."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WallImage:
    """Rasters (rows bottom up from the base, columns along the axis from its start) and the points they are made of.

    ``faces`` (2, r, c) points on the left and on the right face, ``behind`` (2, r, c) seen from there behind it;
    ``through`` (r, c) how many stations looked through, ``lookers`` where each of them did. ``along``, ``up`` (n,)
    metres; ``depth`` (n,) metres behind the face on whose side the point was seen, ``on_face`` (n,) whether it lies on
    that, ``side`` (n,) 0 for the left and 1 for the right one.
    """

    faces: NDArray[np.int32]
    behind: NDArray[np.int32]
    through: NDArray[np.uint8]
    lookers: dict[int, NDArray[np.bool_]]
    along: F32
    up: F32
    depth: F32
    on_face: NDArray[np.bool_]
    side: NDArray[np.int8]

    @property
    def face(self) -> NDArray[np.bool_]:
        """Where points lie on either face (r, c)."""
        return np.asarray(self.faces.any(0))


def wall_image(wall: WallShape, points: WallPoints, panoramas: Mapping[int, Panorama], stations: F64) -> WallImage:
    """Image of one wall from the ``points`` near it and the ``panoramas`` of stations within REACH.

    ``stations`` (s, 3) positions by number, nan where unknown.
    """
    start, end = np.array(wall.start), np.array(wall.end)
    length = float(np.linalg.norm(end - start))
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(length / PIXEL))))
    sign = _side(wall, points, stations)
    depth = np.float32(wall.thickness / 2) - sign * points.across
    skin = min(SKIN, THIN * wall.thickness)
    near = np.flatnonzero(depth > -PROUD)
    along, up, depth = points.along[near], points.up[near], depth[near]
    on_face, side = depth < skin, (sign[near] < 0).astype(np.int8)
    through, lookers = _through(wall, shape, panoramas)
    return WallImage(
        _raster(along[on_face], up[on_face], side[on_face], shape),
        _raster(along[~on_face], up[~on_face], side[~on_face], shape),
        through,
        lookers,
        along,
        up,
        depth,
        on_face,
        side,
    )


def _side(wall: WallShape, points: WallPoints, stations: F64) -> F32:
    """1 for each point that was seen from the left of the wall, -1 from the right; where the station is unknown, from
    where the wall has a space, or else from the side on which the point lies.
    """
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    place = (stations[:, :2] - start) @ np.array([-direction[1], direction[0]])
    side = np.sign(np.where(np.abs(place) > wall.thickness / 2, place, 0.0))[points.station]
    here = np.sign(points.across) if wall.left and wall.right else np.full(len(side), 1.0 if wall.left else -1.0)
    return np.where(np.isfinite(side) & (side != 0.0), side, here).astype(np.float32)


def _raster(along: F32, up: F32, side: NDArray[np.int8], shape: tuple[int, int]) -> NDArray[np.int32]:
    """Points in each pixel (2, r, c), those of the left side first."""
    row, col = np.floor(up / PIXEL).astype(np.int64), np.floor(along / PIXEL).astype(np.int64)
    ok = (row >= 0) & (row < shape[0]) & (col >= 0) & (col < shape[1])
    flat = (side[ok].astype(np.int64) * shape[0] + row[ok]) * shape[1] + col[ok]
    return np.bincount(flat, minlength=2 * shape[0] * shape[1]).reshape(2, *shape).astype(np.int32)


def _through(
    wall: WallShape, shape: tuple[int, int], panoramas: Mapping[int, Panorama]
) -> tuple[NDArray[np.uint8], dict[int, NDArray[np.bool_]]]:
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    normal = np.array([-direction[1], direction[0]])
    coarse = ((shape[0] + ASKED - 1) // ASKED, (shape[1] + ASKED - 1) // ASKED)
    rows, cols = np.mgrid[0 : coarse[0], 0 : coarse[1]]
    step = ASKED * PIXEL
    xy = start + (cols.ravel()[:, None] + 0.5) * step * direction
    points = np.column_stack([xy, wall.base + (rows.ravel() + 0.5) * step]).astype(np.float32)
    through = np.zeros(coarse, np.uint8)
    lookers: dict[int, NDArray[np.bool_]] = {}
    outer = not (wall.left and wall.right)
    for number, panorama in panoramas.items():
        if not wall.base - 0.5 < panorama.position[2] < wall.top + 0.5:
            continue
        away = abs(float((panorama.position[:2] - start) @ normal))
        beyond = np.float32(1.0 + (wall.thickness / 2 + 0.05) / max(away, 0.02))
        place = panorama.position.astype(np.float32)
        farthest = np.float32(max(away, 0.02) * STEEPEST)
        looked = _looked_through(points, place, panorama.ranges, beyond, farthest, outer).reshape(coarse)
        through += looked
        if looked.any():
            lookers[number] = _fine(looked, shape)
    return _fine(through, shape), lookers


@nb.njit(cache=True, nogil=True)
def _looked_through(points, position, ranges, beyond, farthest, misses):  # pyright: ignore
    """Whether the ray towards each of ``points`` (n, 3) went on to more than ``beyond`` times its distance; not asked
    beyond ``farthest`` metres in plan. With ``misses``, a pulse that did not return went on.
    """
    out = np.zeros(points.shape[0], np.bool_)
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        dz = points[i, 2] - position[2]
        if dx * dx + dy * dy > farthest * farthest:
            continue
        f, a, b = cube_cell(dx, dy, dz, edge)
        r = ranges[f, a, b]
        if r > 0.0:
            out[i] = r > beyond * np.sqrt(dx * dx + dy * dy + dz * dz)
        elif r < 0.0:
            out[i] = misses
    return out


def _fine(raster: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
    return raster.repeat(ASKED, 0).repeat(ASKED, 1)[: shape[0], : shape[1]]
