"""Of a storey: what stops rays, what is missing, and where a scanner could stand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.coverage.faces import StoreyFaces
from scan2bim.coverage.look import LOOKED_THROUGH, SEEN
from scan2bim.coverage.outdoors import Above, is_passable, may_be_room
from scan2bim.coverage.rooms import bodies_of, drawn, with_openings
from scan2bim.coverage.sights import Obstacles, Targets
from scan2bim.coverage.voxels import Field
from scan2bim.model.elements import Building, Door, Opening, Storey, Wall
from scan2bim.model.queries import point_on_wall
from scan2bim.model.voxels import Label

F64 = NDArray[np.float64]
Bools = NDArray[np.bool_]

EYE = 1.55
"""Metres of a scanner over the floor on its tripod."""
CLEAR = 0.4
"""Metres round the scanner in which nothing may stand: its tripod's legs, and what is nearer than it can measure."""
LOW, TALL = 0.15, 1.9
"""Metres over the floor between which things stand in the way of scanner and tripod."""
SPACING = 0.5
"""Metres between places tried: a station that far off sees much the same."""
MOST_PLACES = 600
"""Places tried in a storey; with more, they lie farther apart."""
MOST_TARGETS = 30_000
"""Cells that rays are cast to in a storey; of more, every so many stand for the others."""
BEFORE = 0.05
"""Metres before a face of the places that rays are cast to."""
FLOOR_EDGE = 0.2
"""Edge, metres, of the squares of unknown floor."""
CHEST = 1.0
"""Metres over the floor at which unknown floor is looked for: higher than most furniture."""
BEYOND_DOOR = 1.0
"""Metres beyond a closed door of the place to stand: the leaf must clear the tripod."""
OVERHEAD = 2.1
"""Metres over the floor from which on points are walls, lintels and ceilings of a room rather than things outdoors."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where a scanner could stand: points (n, 3) local metres, behind (n,) the closed door before it or None."""

    points: F64
    behind: list[str | None]


@dataclass(frozen=True, slots=True, eq=False)
class Prospect:
    """What the search for stations needs to know of a storey."""

    storey: Storey
    faces: StoreyFaces
    obstacles: Obstacles
    targets: Targets
    places: Places
    unknown: F64


def prospect_of(building: Building, storey: Storey, field: Field, *, told: bool) -> Prospect:
    """Of a storey with labelled voxels; ``told``: positions of scanners are known, so that empty voxels are."""
    rooms, found = field.found.rooms, field.found
    floor = min(space.base for space in storey.spaces)
    walls, _ = bodies_of(storey, rooms)
    passable = with_openings(storey, rooms, is_passable)
    solid = (walls.low <= walls.high) & (passable.low > passable.high)
    wells = drawn([hole for slab in storey.slabs for hole in slab.holes], rooms)
    beyond = (rooms.space < 0) & (walls.low > walls.high) & ~wells
    sky = field.open & field.columns(beyond)
    outside = field.columns(beyond) & ~sky
    seen = field.visible[_layer(field, floor + CHEST)] & field.visible[_layer(field, floor + EYE)]
    if not told:  # what stands on a floor with points, and has none itself, is taken as free
        seen = (field.labels[:2] == Label.STRUCTURE).any(0) & (field.columns(rooms.space) >= 0)
    reached = _reached(field.columns(passable.low <= passable.high), outside & seen)
    overhead = (field.labels[_layer(field, floor + OVERHEAD) :] == Label.OUTLIER).any(0)
    unknown = ~seen & may_be_room(building, storey, field, outside, reached, Above(overhead, sky))
    low, high = passable.low.copy(), passable.high.copy()
    low[beyond], high[beyond] = floor, float(np.max(rooms.high))
    low[solid], high[solid] = np.inf, -np.inf
    obstacles = Obstacles(rooms.frame, low, high, _things(field, told=told), field.bottom, field.size)
    squares = _squares(unknown, field, floor)
    return Prospect(
        storey,
        found,
        obstacles,
        _targets(found, squares),
        _places(storey, field, solid, reached & seen, unknown, floor),
        squares[:, :2],
    )


def _layer(field: Field, height: float) -> int:
    return int(np.clip((height - field.bottom) // field.size, 0, field.labels.shape[0] - 1))


def _things(field: Field, *, told: bool) -> NDArray[np.uint8]:
    """Voxels that stop rays (1), and air of spaces that no station looked through (2)."""
    inner = field.columns(field.found.rooms.inner)
    labels = field.labels
    out = np.zeros(labels.shape, np.uint8)
    if told:
        out[labels == Label.OCCLUDED_CLUTTER] = 2
    out[(labels == Label.CLUTTER) | (labels == Label.OUTLIER)] = 1
    standing = (labels == Label.STRUCTURE) & inner  # columns and stairs; walls, floors and ceilings are in the rasters
    standing[:2], standing[-2:] = False, False
    out[standing] = 1
    return out


def _reached(inside: Bools, beyond: Bools) -> Bools:
    """Columns that one can go to: those of spaces and open doors, and free ones beyond that join them."""
    _, parts = cv2.connectedComponents((inside | beyond).astype(np.uint8), connectivity=4)
    return (inside | beyond) & np.isin(parts, np.unique(parts[inside]))


def _squares(unknown: Bools, field: Field, floor: float) -> F64:
    """Middles (n, 3) at chest height of the squares of unknown floor."""
    step = max(1, round(FLOOR_EDGE / field.size))
    row, col = np.nonzero(unknown[step // 2 :: step, step // 2 :: step])
    middle = np.asarray((np.column_stack([col, row]) * step + step / 2) * field.size, np.float64)
    return np.column_stack([field.found.rooms.local(middle), np.full(len(row), floor + CHEST)])


def missing_cells(found: StoreyFaces) -> Bools:
    """(c,) cells of faces that were not seen and are no openings."""
    return found.panels.asked & ((found.marks.bits & (SEEN | LOOKED_THROUGH)) == 0)


def _targets(found: StoreyFaces, squares: F64) -> Targets:
    """Cells that were not seen, and squares of unknown floor."""
    panels = found.panels
    missing = missing_cells(found) & (panels.space >= 0)
    first, size = panels.cells[:, 2], panels.cells[:, 0] * panels.cells[:, 1]
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for p in range(len(panels)):
        mine = missing[first[p] : first[p] + size[p]]
        points.append(panels.centres(p)[mine] + BEFORE * panels.plane[p, 9:12])
        normals.append(np.repeat(panels.plane[p : p + 1, 9:12], len(points[-1]), axis=0))
    owner = panels.face[panels.cell_panel[missing]].astype(np.int64)
    every = -(-len(owner) // MOST_TARGETS) or 1
    kept = slice(every // 2, None, every)
    area = panels.cell_area[missing][kept] * every
    return Targets(
        np.concatenate([np.concatenate(points)[kept], squares]),
        np.concatenate([np.concatenate(normals)[kept], np.zeros((len(squares), 3))]),
        np.concatenate([area, np.full(len(squares), FLOOR_EDGE**2)]),
        np.concatenate([owner[kept], np.full(len(squares), -1)]),
    )


def _places(storey: Storey, field: Field, solid: Bools, free: Bools, unknown: Bools, floor: float) -> Places:
    """Free places on a grid, the clearest of each square; and those right behind closed doors to the unknown."""
    low, tall = _layer(field, floor + LOW), _layer(field, floor + TALL)
    labels = field.labels[low : tall + 1]
    things = ((labels == Label.CLUTTER) | (labels == Label.OUTLIER)).any(0)
    stands = ((labels == Label.STRUCTURE).any(0) & field.columns(field.found.rooms.inner)) | things
    blocked = field.columns(solid) | stands
    room = cv2.distanceTransform((~blocked).astype(np.uint8), cv2.DIST_L2, 5) * field.size
    room[~free | (room < CLEAR)] = 0.0
    chosen = _clearest(room, field.size)
    middles = field.found.rooms.local(np.asarray((chosen[:, ::-1] + 0.5) * field.size, np.float64))
    bases = np.array([space.base for space in storey.spaces])
    space = field.columns(field.found.rooms.space)[chosen[:, 0], chosen[:, 1]]
    height = np.where(space >= 0, bases[np.maximum(space, 0)], floor) + EYE
    doors = list(_behind_doors(storey, field, unknown, floor))
    points = np.concatenate([np.column_stack([middles, height]), np.array([p for p, _ in doors]).reshape(-1, 3)])
    return Places(points, [*[None] * len(middles), *(name for _, name in doors)])


def _clearest(room: NDArray[np.float32], size: float) -> NDArray[np.int64]:
    """Rows and columns (n, 2) of the place with most room round it in each square of the grid."""
    edge = max(1, round(SPACING / size))
    while True:
        rows, cols = (-(-n // edge) for n in room.shape)
        padded = np.pad(room, [(0, rows * edge - room.shape[0]), (0, cols * edge - room.shape[1])])
        blocks = padded.reshape(rows, edge, cols, edge).transpose(0, 2, 1, 3).reshape(rows, cols, edge * edge)
        best, clear = blocks.argmax(2), blocks.max(2)
        row, col = np.nonzero(clear > 0.0)
        if len(row) <= MOST_PLACES:
            inside = best[row, col]
            return np.column_stack([row * edge + inside // edge, col * edge + inside % edge])
        edge += 1


def _behind_doors(storey: Storey, field: Field, unknown: Bools, floor: float) -> Iterator[tuple[F64, str]]:
    """Places beyond closed doors where nothing is known, each with the door's name."""
    for wall in storey.walls:
        for opening in wall.openings:
            if not isinstance(opening.fill, Door) or is_passable(opening):
                continue
            for side in (1.0, -1.0):
                place = _beyond(wall, opening, side)
                col, row = np.floor(field.found.rooms.turned(place[None])[0] / field.size).astype(int)
                inside = 0 <= row < unknown.shape[0] and 0 <= col < unknown.shape[1]
                if inside and unknown[row, col]:
                    yield np.append(place, floor + EYE), opening.fill.name


def _beyond(wall: Wall, opening: Opening, side: float) -> F64:
    middle = opening.offset.value + opening.width.value / 2
    x, y, _ = point_on_wall(wall, middle, side * (wall.thickness.value / 2 + BEYOND_DOOR), 0.0)
    return np.array([x, y])
