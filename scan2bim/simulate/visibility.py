"""What of a scene's walls and doors its stations see: the occlusion that the truth states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.simulate.effects import World
from scan2bim.simulate.parts import wall_frame
from scan2bim.simulate.scene import DoorSpec, Scene, StoreySpec, WallSpec, WindowSpec, room_outlines
from scan2bim.truth.values import Truth

F64 = NDArray[np.float64]

OFF_FACE = 0.018
"""Metres before the wall's face at which it is looked for: before skirting boards and casings."""
CELL = 0.1
"""Metres between the places asked for on a face."""
OUTLINE_STEP = 0.02
"""Metres between the places asked for on a door's outline."""
SLACK = 1e-3
"""Metres by which a ray may end before a place that counts as seen: rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Places before the inner faces of walls, in the scene's frame.

    points (n, 3) float64; owner (n,) int64: the wall's or opening's number; face (n,) int64: 0 on the wall's left, 1
    on its right.
    """

    points: F64
    owner: NDArray[np.int64]
    face: NDArray[np.int64]


def seen_by(world: World, viewpoints: F64, points: F64, slack: float = SLACK) -> NDArray[np.bool_]:
    """Which points (n, 3) each of the viewpoints (k, 3) sees, (k, n), in scan coordinates; glass hides nothing.

    slack: metres by which a ray may end before a point.
    """
    out = np.zeros((len(viewpoints), len(points)), dtype=np.bool_)
    for row, viewpoint in enumerate(viewpoints):
        towards = points - viewpoint
        distance = np.linalg.norm(towards, axis=1)
        hits = world.solid(viewpoint, towards / np.maximum(distance, 1e-9)[:, None])
        out[row] = hits.range >= distance - slack
    return out


def _unseen(world: World, viewpoints: F64, points: F64) -> NDArray[np.bool_]:
    return np.asarray(~seen_by(world, viewpoints, points).any(axis=0))


def wall_places(storey: StoreySpec, cell: float = CELL) -> Places:
    """Cells of the inner faces of all walls outside their openings; owner is the wall's number in the storey."""
    rooms = shapely.union_all(list(room_outlines(storey).values()))
    found = [_face_cells(wall, storey, cell) for wall in storey.walls]
    return _inside(found, rooms)


def outline_places(storey: StoreySpec) -> Places:
    """Places along jambs, heads and window sills; owner numbers doors, then windows, through all walls in order."""
    rooms = shapely.union_all(list(room_outlines(storey).values()))
    return _inside([_outline(wall, storey, opening) for wall, opening in openings_of(storey)], rooms)


def openings_of(storey: StoreySpec) -> list[tuple[WallSpec, DoorSpec | WindowSpec]]:
    """All doors of the storey, then all windows, each with its wall."""
    doors = [(wall, door) for wall in storey.walls for door in wall.doors]
    return [*doors, *((wall, window) for wall in storey.walls for window in wall.windows)]


def with_occlusion(truth: Truth, scene: Scene, world: World) -> Truth:
    """The truth with the share of each wall, door and window that no station of the scene sees."""
    viewpoints = scene.placement.points(np.array([s.position for s in scene.stations], dtype=np.float64))
    walls, openings = list[float | None](), list[tuple[bool, float | None]]()
    for storey in scene.storeys:
        faces, outlines = wall_places(storey), outline_places(storey)
        hidden = _unseen(world, viewpoints, scene.placement.points(faces.points))
        walls += [_share(hidden[faces.owner == i]) for i in range(len(storey.walls))]
        hidden = _unseen(world, viewpoints, scene.placement.points(outlines.points))
        for number, (_, opening) in enumerate(openings_of(storey)):
            openings.append((isinstance(opening, DoorSpec), hidden_outline(outlines, hidden, number)))
    doors = [share for is_door, share in openings if is_door]
    windows = [share for is_door, share in openings if not is_door]
    return truth.model_copy(
        update={
            "walls": tuple(w.model_copy(update={"occlusion": s}) for w, s in zip(truth.walls, walls, strict=True)),
            "doors": tuple(d.model_copy(update={"occlusion": s}) for d, s in zip(truth.doors, doors, strict=True)),
            "windows": tuple(
                w.model_copy(update={"occlusion": s}) for w, s in zip(truth.windows, windows, strict=True)
            ),
        }
    )


def hidden_outline(outlines: Places, hidden: NDArray[np.bool_], number: int) -> float | None:
    """Share of an opening's outline that is hidden, on the face where less of it is; None without an inner face."""
    mine = outlines.owner == number
    shares = [_share(hidden[mine & (outlines.face == face)]) for face in (0, 1)]
    return min((share for share in shares if share is not None), default=None)


def _share(hidden: NDArray[np.bool_]) -> float | None:
    return float(hidden.mean()) if len(hidden) else None


def _inside(found: list[F64], rooms: shapely.geometry.base.BaseGeometry) -> Places:
    """Stack (n, 2, 3) pairs of places on both faces, and keep those in rooms."""
    points = np.concatenate([f.reshape(-1, 3) for f in found]) if found else np.zeros((0, 3))
    owner = np.repeat(np.arange(len(found)), [2 * len(f) for f in found])
    face = np.tile([0, 1], len(points) // 2)
    inner = shapely.contains_xy(rooms, points[:, 0], points[:, 1])
    return Places(points[inner], owner[inner], face[inner])


def _face_cells(wall: WallSpec, storey: StoreySpec, cell: float) -> F64:
    x, z = np.arange(cell / 2, wall.length, cell), np.arange(cell / 2, storey.height, cell)
    gx, gz = (grid.ravel() for grid in np.meshgrid(x, z))
    covered = np.zeros(len(gx), dtype=np.bool_)
    for opening in (*wall.doors, *wall.windows):
        across = (gx > opening.offset) & (gx < opening.offset + opening.width)
        covered |= across & (gz > opening.sill) & (gz < opening.sill + opening.height)
    return _both_faces(wall, storey, gx[~covered], gz[~covered])


def _outline(wall: WallSpec, storey: StoreySpec, opening: DoorSpec | WindowSpec) -> F64:
    x0, x1, z0, z1 = opening.offset, opening.offset + opening.width, opening.sill, opening.sill + opening.height
    up, along = np.arange(z0 + OUTLINE_STEP, z1, OUTLINE_STEP), np.arange(x0, x1, OUTLINE_STEP)
    sides = [(np.full(len(up), x), up) for x in (x0, x1)]
    levels = [z1] if z0 <= 0.0 else [z0, z1]
    sides += [(along, np.full(len(along), z)) for z in levels]
    return _both_faces(wall, storey, np.concatenate([x for x, _ in sides]), np.concatenate([z for _, z in sides]))


def _both_faces(wall: WallSpec, storey: StoreySpec, x: F64, z: F64) -> F64:
    """(n, 2, 3): places before the left and the right face."""
    frame = wall_frame(wall, storey)
    y = wall.thickness / 2 + OFF_FACE
    local = np.stack([np.column_stack([x, np.full(len(x), side * y), z]) for side in (1.0, -1.0)], axis=1)
    return frame.origin + local @ frame.axes.T
