"""The image of a wall: for each pixel of its middle plane, whether there is data, or a station looked through, or
neither.

The paper's image I (section IV.B) of data, centroids and no-data, with pixels of 5 cm instead of voxels of 20 cm: a
pixel is a *centroid* (voxel label Opening) where the panorama of a station shows that its rays went on behind the wall,
or never came back: what is outside a window may be too far away to return them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, seen_through
from scan2bim.cloud.surfels import Surfels
from scan2bim.structure.shapes import WallShape

PIXEL = 0.05
"""Edge of a pixel, metres: the surfels' own, edges are refined on the surfels themselves."""
REACH = 12.0
"""Stations farther than this, metres, are not asked: their panorama's cells are too coarse for a jamb."""
SKIN = 0.035
"""Points within this distance of a face, metres, lie on it."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class WallImage:
    """Rasters (rows bottom up, columns along the axis). ``data`` surfels on either face; ``through`` how many stations
    looked through; ``saw`` how many saw something in the wall there; ``inner`` (k, 2) along and up, metres, of surfels
    inside the wall's thickness: reveals, frames, leaves; ``inner_points`` (k,) their scan points; ``lookers`` stations
    that looked through anywhere.
    """

    data: NDArray[np.bool_]
    through: NDArray[np.uint8]
    saw: NDArray[np.uint8]
    inner: F64
    inner_points: NDArray[np.int64]
    lookers: dict[int, NDArray[np.bool_]]

    @property
    def opening(self) -> NDArray[np.bool_]:
        """The paper's centroids: looked through, by at least as many as saw something there, and without data on the
        faces.
        """
        return (self.through > 0) & (self.through >= self.saw) & ~self.data


def wall_image(wall: WallShape, surfels: Surfels, panoramas: Mapping[int, Panorama]) -> WallImage:
    """Image of one wall. ``surfels`` are those near it (any superset), ``panoramas`` those of stations within REACH."""
    start, end = np.array(wall.start), np.array(wall.end)
    length = float(np.linalg.norm(end - start))
    direction = (end - start) / length
    normal = np.array([-direction[1], direction[0]])
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(length / PIXEL))))
    offset = surfels.xyz[:, :2].astype(np.float64) - start
    along, across = offset @ direction, offset @ normal
    up = surfels.xyz[:, 2].astype(np.float64) - wall.base
    half = wall.thickness / 2
    within = (along > -0.1) & (along < length + 0.1) & (up > -0.1) & (up < wall.top - wall.base + 0.1)
    on_face = within & (np.abs(np.abs(across) - half) < SKIN)
    inside = within & (np.abs(across) < half - min(SKIN, 0.3 * half))
    through, saw, lookers = _through(start, direction, normal, shape, wall, panoramas)
    return WallImage(
        _raster(along[on_face], up[on_face], shape),
        through,
        saw,
        np.stack([along[inside], up[inside]], 1),
        surfels.count[inside].astype(np.int64),
        lookers,
    )


def _raster(along: F64, up: F64, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels with a point, one-pixel gaps between two such closed sideways and upwards."""
    mask = np.zeros(shape, bool)
    row, col = np.floor(up / PIXEL).astype(int), np.floor(along / PIXEL).astype(int)
    ok = (row >= 0) & (row < shape[0]) & (col >= 0) & (col < shape[1])
    mask[row[ok], col[ok]] = True
    mask[1:-1] |= mask[:-2] & mask[2:]
    mask[:, 1:-1] |= mask[:, :-2] & mask[:, 2:]
    return mask


def _through(
    start: F64, direction: F64, normal: F64, shape: tuple[int, int], wall: WallShape, panoramas: Mapping[int, Panorama]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], dict[int, NDArray[np.bool_]]]:
    rows, cols = np.mgrid[0 : shape[0], 0 : shape[1]]
    xy = start + (cols.ravel()[:, None] + 0.5) * PIXEL * direction
    points = np.column_stack([xy, wall.base + (rows.ravel() + 0.5) * PIXEL]).astype(np.float32)
    through, saw = np.zeros(len(points), np.uint8), np.zeros(len(points), np.uint8)
    lookers: dict[int, NDArray[np.bool_]] = {}
    outer = not (wall.left and wall.right)
    for number, panorama in panoramas.items():
        if not wall.base - 0.5 < panorama.position[2] < wall.top + 0.5:
            continue
        to = panorama.position[:2] - start
        slant = np.linalg.norm(points[:, :2] - panorama.position[:2], axis=1) / max(abs(float(to @ normal)), 0.02)
        steep = slant < 5.0
        margin = np.float32(wall.thickness / 2 + 0.05)
        said = seen_through(points, panorama.position.astype(np.float32), panorama.ranges, margin, outer)
        looked = (said == 1) & steep
        through += looked
        saw += (said == 2) & steep
        if looked.any():
            lookers[number] = looked.reshape(shape)
    return through.reshape(shape), saw.reshape(shape), lookers
