"""The paper's labels (section IV) of all voxels of a storey.

Occupied voxels hold points: of the structure, of clutter in a space, or outliers beyond the spaces. The others are
empty if a station looked through them, else occluded-clutter; those in which a face of the structure should be are
openings if a station looked through the face there, else occluded-structure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import cube_cell
from scan2bim.cloud.scene import Scene
from scan2bim.coverage.faces import StoreyFaces, look_at_faces
from scan2bim.coverage.look import BEFORE, BEHIND, FARTHEST, LOOKED_THROUGH, SEEN, bin_of, on_panel
from scan2bim.coverage.rooms import PIXEL, RIM, Bodies, bodies_of
from scan2bim.model.elements import Building, Storey
from scan2bim.model.voxels import Label, VoxelGrid

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
Bools = NDArray[np.bool_]

SIZE = 0.10
"""Edge of a voxel, metres: half of the paper's, since partitions are 10 cm thick; and as tall as the voxels in which
the points are merged, so that a floor or shelf has no gaps."""
MOST = 60_000_000
"""Voxels of a storey from which on they are as large as the paper's, 20 cm: 60 million take 120 MB."""
MARGIN = 0.05
"""Metres beyond a voxel's middle that a ray must have gone to have looked through it: half of its edge."""
SKIN = 0.03
"""Metres behind a face at which the voxel is that is said to hold the face."""


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A storey's voxels: labels (l, r, c) uint8; visible (l, r, c) bool: a station looked through; open (r, c) bool: a
    pulse that never came back went through the column's top, above all ceilings, as out of doors.
    """

    found: StoreyFaces
    bottom: float
    size: float
    labels: U8
    visible: Bools
    open: Bools

    @property
    def step(self) -> int:
        """Pixels of the rooms' raster along an edge of a voxel."""
        return round(self.size / PIXEL)

    def heights(self) -> F64:
        """(l,) z of the layers' middles."""
        return self.bottom + (np.arange(self.labels.shape[0]) + 0.5) * self.size

    def columns(self, raster: NDArray[Any]) -> NDArray[Any]:
        """A raster (r, c) of pixels as one of voxel columns: the middle one of each voxel's pixels."""
        rows, cols = self.labels.shape[1:]
        step = self.step
        padded = np.pad(raster, [(0, rows * step - raster.shape[0]), (0, cols * step - raster.shape[1])], "edge")
        return padded[step // 2 :: step, step // 2 :: step]


def label_storeys(building: Building, scene: Scene, rim: float = RIM) -> Iterator[VoxelGrid]:
    """The labelled voxels of each storey that has spaces; one storey is in memory at a time."""
    found = look_at_faces(building, scene, rim, holes=True)
    for storey, faces in zip(building.storeys, found, strict=True):
        if faces is not None:
            yield grid_of(storey, field_of(storey, faces, scene), told=bool(scene.panoramas))


def grid_of(storey: Storey, field: Field, *, told: bool) -> VoxelGrid:
    """A storey's labels as a value."""
    origin = np.append(field.found.rooms.origin, field.bottom)
    return VoxelGrid(storey.id, storey.name, origin, field.found.rooms.yaw, field.size, field.labels, told)


def field_of(storey: Storey, found: StoreyFaces, scene: Scene) -> Field:
    """Label the voxels of a storey whose faces, openings too, were looked at."""
    rooms = found.rooms
    floor = min(space.base for space in storey.spaces)
    top = max(space.base + space.height.value for space in storey.spaces) + SIZE
    size = SIZE if rooms.space.size * (top - floor) / SIZE / 4 < MOST else 2 * SIZE
    step = round(size / PIXEL)
    rows, cols = (-(-n // step) for n in rooms.space.shape)
    shape = (int(np.ceil((top - floor) / size)) + 1, rows, cols)
    field = Field(
        found,
        floor - size / 2,
        size,
        np.zeros(shape, np.uint8),
        np.zeros(shape, np.bool_),
        np.zeros(shape[1:], np.bool_),
    )
    walls, others = bodies_of(storey, rooms)
    _put_points(field, scene, walls, others)
    holes = field.columns((rooms.space < 0) & (rooms.low < rooms.high))
    for panorama in scene.panoramas.values():
        station = (panorama.position, panorama.ranges)
        _see(station, rooms.frame, field.bottom, size, holes, field.labels, field.visible, field.open)
    _name_air(field, walls)
    _name_faces(field)
    return field


def _put_points(field: Field, scene: Scene, walls: Bodies, others: Bodies) -> None:
    """Label the voxels with points."""
    found, rooms, panels = field.found, field.found.rooms, field.found.panels
    bins = (found.bins.starts, found.bins.members, found.bins.columns)
    bodies = (walls.low, walls.high, others.low, others.high)
    air = (rooms.space, rooms.low, rooms.high)
    _occupy(
        scene.surfels.xyz,
        rooms.frame,
        bins,
        panels.plane,
        panels.cells,
        bodies,
        air,
        field.bottom,
        field.size,
        field.labels,
    )


def _name_air(field: Field, walls: Bodies) -> None:
    """Label the voxels of spaces and of openings that hold no points."""
    rooms = field.found.rooms
    space, low, high = (field.columns(r) for r in (rooms.space, rooms.low, rooms.high))
    wall = field.columns(walls.low <= walls.high)
    for layer, height in enumerate(field.heights().tolist()):
        labels, visible = field.labels[layer], field.visible[layer]
        free = (labels == Label.NONE) & (low < height) & (height < high)
        air, through = free & (space >= 0), free & (space < 0) & wall
        labels[air] = np.where(visible[air], Label.EMPTY, Label.OCCLUDED_CLUTTER)
        labels[through] = np.where(visible[through], Label.OPENING, Label.OCCLUDED_STRUCTURE)


def _name_faces(field: Field) -> None:
    """Label the voxels right behind the faces that hold no points."""
    panels, rooms, bits = field.found.panels, field.found.rooms, field.found.marks.bits
    first = panels.cells[:, 2]
    wanted = panels.asked | panels.hole
    for p in range(len(panels)):
        mine = slice(int(first[p]), int(first[p] + panels.cells[p, 0] * panels.cells[p, 1]))
        plane = panels.plane[p]
        if not panels.level[p] and not (panels.space[mine] >= 0).any():
            continue  # the outer side of a wall
        said = np.where(bits[mine] & SEEN, Label.STRUCTURE, Label.OCCLUDED_STRUCTURE)
        said = np.where((bits[mine] & (SEEN | LOOKED_THROUGH)) == LOOKED_THROUGH, Label.OPENING, said).astype(np.uint8)
        middles = panels.centres(p)[wanted[mine]] - SKIN * plane[9:12]
        said = said[wanted[mine]]
        for a, b in ((-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)):
            points = middles + a * plane[12] * plane[3:6] + b * plane[13] * plane[6:9]
            at = np.floor(
                np.column_stack([rooms.turned(points[:, :2]), points[:, 2] - field.bottom]) / field.size
            ).astype(int)
            inside = (at >= 0).all(1) & (at < np.array(field.labels.shape)[[2, 1, 0]]).all(1)
            column, row, layer = at[inside].T
            held = field.labels[layer, row, column]
            spare = ~np.isin(held, (Label.CLUTTER, Label.STRUCTURE, Label.OUTLIER, Label.OPENING))
            field.labels[layer[spare], row[spare], column[spare]] = said[inside][spare]


def near(mask: Bools, voxels: int) -> Bools:
    """Columns (r, c) within a square of so many voxels of a marked one."""
    kernel = np.ones((2 * voxels + 1, 2 * voxels + 1), np.uint8)
    return cv2.dilate(mask.astype(np.uint8), kernel) > 0


@nb.njit(cache=True, nogil=True)
def _occupy(xyz, frame, bins, plane, cells, bodies, air, bottom, size, labels):  # pyright: ignore
    starts, members, columns = bins
    wall_low, wall_high, other_low, other_high = bodies
    space, low, high = air
    for i in range(xyz.shape[0]):
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        layer = int(np.floor((z - bottom) / size))
        key = bin_of(x, y, frame, columns, starts.shape[0] - 1)
        if key < 0 or layer < 0 or layer >= labels.shape[0]:
            continue
        dx, dy = x - frame[0], y - frame[1]
        c = int(np.floor((dx * frame[2] + dy * frame[3]) / PIXEL))
        r = int(np.floor((dy * frame[2] - dx * frame[3]) / PIXEL))
        if r < 0 or c < 0 or r >= space.shape[0] or c >= space.shape[1]:
            continue
        label = 3
        if (wall_low[r, c] < z < wall_high[r, c]) or (other_low[r, c] < z < other_high[r, c]):
            label = 2
        elif space[r, c] >= 0 and low[r, c] < z < high[r, c]:
            label = 1
        if label != 2:
            for m in range(starts[key], starts[key + 1]):
                p = members[m]
                depth, a, _ = on_panel(x, y, z, plane[p], cells[p])
                if a >= 0 and -BEHIND < depth < BEFORE:
                    label = 2
                    break
        step = int(np.rint(size / PIXEL))
        held = labels[layer, r // step, c // step]
        if held == 0 or label == 2 or (label == 1 and held == 3):
            labels[layer, r // step, c // step] = label


@nb.njit(cache=True, nogil=True)
def _see(station, frame, bottom, size, holes, labels, visible, sky):  # pyright: ignore
    """Mark the voxels without points that a station looked through, and the columns out of doors. In openings,
    ``holes`` (r, c), pulses without return went through, too.
    """
    position, ranges = station
    edge = ranges.shape[1]
    layers, rows, cols = labels.shape
    px, py = position[0] - frame[0], position[1] - frame[1]
    east, north = px * frame[2] + py * frame[3], py * frame[2] - px * frame[3]
    for row in range(max(0, int((north - FARTHEST) / size)), min(rows, int((north + FARTHEST) / size) + 1)):
        for col in range(max(0, int((east - FARTHEST) / size)), min(cols, int((east + FARTHEST) / size) + 1)):
            along, across = (col + 0.5) * size - east, (row + 0.5) * size - north
            dx, dy = along * frame[2] - across * frame[3], along * frame[3] + across * frame[2]
            for layer in range(layers):
                if labels[layer, row, col] or visible[layer, row, col]:
                    continue
                dz = bottom + (layer + 0.5) * size - position[2]
                f, a, b = cube_cell(dx, dy, dz, edge)
                r = ranges[f, a, b]
                if r < 0.0:
                    sky[row, col] |= layer == layers - 1
                    visible[layer, row, col] = holes[row, col]
                elif r > 0.0:
                    d = np.sqrt(dx * dx + dy * dy + dz * dz)
                    visible[layer, row, col] = r > d + MARGIN
