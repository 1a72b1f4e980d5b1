"""What stations see of an IFC model's walls and openings, and what stands in their way when rooms are furnished."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from scan2bim.simulate import decor, furniture
from scan2bim.simulate.areas import Area
from scan2bim.simulate.clutter import CLEAR, CLOTHES, Piece, box_plan
from scan2bim.simulate.effects import World
from scan2bim.simulate.mesh import box_patches_of, gather
from scan2bim.simulate.parts import Patch
from scan2bim.simulate.scene import Box, Placement, Point2, StoreySpec
from scan2bim.simulate.visibility import OUTLINE_STEP, seen_by
from scan2bim.truth.values import DoorTruth, OpeningTruth, Truth, WallTruth

F64 = NDArray[np.float64]
Rng = np.random.Generator

OFF_FACE = 0.03
"""Metres before a face at which it is looked for: before casings and skirting boards."""
SLACK = 0.05
"""Metres by which a ray may end before such a place: trims of the model's own."""
CELL = 0.2
"""Metres between places on walls."""
TRIES = 40
"""Pieces tried for each room."""
AT_WALL = 0.7
"""Share of the pieces that stand at a wall."""


def with_occlusion(truth: Truth, thicknesses: dict[str, float], areas: Sequence[Area], world: World) -> Truth:
    """The truth with the hidden shares of walls, doors and windows; 1 for what is in no room.

    thicknesses: of the wall at each door and window, by its name.
    """
    eyes = np.array([station.position for station in truth.stations], dtype=np.float64)

    def hidden(faces: list[F64]) -> float:
        """The least hidden share of the faces that are in a room."""
        shares: list[float] = []
        for face in faces:
            inner = face[_in_rooms(face, areas)]
            if len(inner):
                shares.append(1.0 - float(seen_by(world, eyes, inner, SLACK).any(axis=0).mean()))
        return min(shares, default=1.0)

    def of_opening(one: OpeningTruth) -> float:
        return hidden(_outline_faces(one, thicknesses[one.name]))

    def of_wall(wall: WallTruth) -> float:
        mine = [o for o in (*truth.doors, *truth.windows, *truth.openings) if o.wall == wall.name]
        return hidden([np.concatenate(_wall_faces(wall, mine))])

    return truth.model_copy(
        update={
            "walls": tuple(w.model_copy(update={"occlusion": of_wall(w)}) for w in truth.walls),
            "doors": tuple(d.model_copy(update={"occlusion": of_opening(d)}) for d in truth.doors),
            "windows": tuple(w.model_copy(update={"occlusion": of_opening(w)}) for w in truth.windows),
        }
    )


def _in_rooms(points: F64, areas: Sequence[Area]) -> NDArray[np.bool_]:
    inside = np.zeros(len(points), dtype=np.bool_)
    for area in areas:
        level = (points[:, 2] > area.floor - 0.1) & (points[:, 2] < area.floor + area.height)
        inside |= level & shapely.contains_xy(area.outline, points[:, 0], points[:, 1])
    return inside


def _outline_faces(one: OpeningTruth, thickness: float) -> list[F64]:
    """Places along jambs, head and, above the floor, sill, before both faces."""
    a, b, c, d = np.array(one.corners)
    sides = [(a, d), (b, c), (d, c), *([(a, b)] if one.sill > 0.15 else [])]
    return _before_faces(np.concatenate([_along(p, q) for p, q in sides]), b - a, thickness)


def _along(start: F64, end: F64) -> F64:
    """Places from start to end, (n, 3)."""
    count = max(int(float(np.linalg.norm(end - start)) / OUTLINE_STEP), 2)
    return start + (end - start) * np.linspace(0.0, 1.0, count)[:, None]


def _wall_faces(wall: WallTruth, openings: Sequence[OpeningTruth]) -> list[F64]:
    """Cells of both faces outside the openings."""
    start, along = np.array(wall.start), np.subtract(wall.end, wall.start)
    length = float(np.linalg.norm(along))
    x, z = np.arange(CELL / 2, length, CELL), np.arange(CELL / 2, wall.height, CELL)
    gx, gz = (grid.ravel() for grid in np.meshgrid(x, z))
    free = np.ones(len(gx), dtype=np.bool_)
    unit = along / max(length, 1e-9)
    for one in openings:
        ends = (np.array(one.corners)[:2, :2] - start) @ unit
        low, high = one.corners[0][2] - wall.base, one.corners[2][2] - wall.base
        free &= ~((gx > ends.min()) & (gx < ends.max()) & (gz > low) & (gz < high))
    places = np.column_stack([start + gx[free, None] * unit, wall.base + gz[free]])
    return _before_faces(places, np.array([*along, 0.0]), wall.thickness)


def _before_faces(points: F64, along: F64, thickness: float) -> list[F64]:
    left = np.array([-along[1], along[0], 0.0]) / max(float(np.linalg.norm(along[:2])), 1e-9)
    return [points + side * (thickness / 2 + OFF_FACE) * left for side in (1.0, -1.0)]


def furnish(
    areas: Sequence[Area], eyes: F64, world: World, doors: Sequence[DoorTruth], share: float, rng: Rng
) -> tuple[list[Patch], float]:
    """Furniture and people, until they hide ``share`` of what the stations ``eyes`` (k, 3) saw of the rooms' walls.

    Gives their patches and the share that they hide. They stand clear of the stations and of open leaves.
    """
    swings = shapely.union_all([_swing(door) for door in doors if door.state in ("open", "ajar")])
    patches: list[Patch] = []
    saw, sees = 0, 0
    for area in areas:
        points = _wall_points(area)
        seen = seen_by(world, eyes, points, SLACK)
        before = after = int(seen.any(axis=0).sum())
        free = area.outline.buffer(-0.02).difference(swings)
        standing: list[BaseGeometry] = []
        storey = StoreySpec(area.storey, (), (), elevation=area.floor)
        for _ in range(TRIES):
            if after <= (1.0 - share) * before:
                break
            piece = _piece(area, rng)
            plan = shapely.union_all([box_plan(box) for box in piece])
            if not _fits(plan, free, standing, eyes, area) or max(b.base + b.size[2] for b in piece) > area.height:
                continue
            standing.append(plan)
            boxes = [patch for box in piece for patch in box_patches_of(box, storey)]
            patches += boxes
            seen &= seen_by(World(gather(boxes, Placement())), eyes, points)
            after = int(seen.any(axis=0).sum())
        saw, sees = saw + before, sees + after
    return patches, 1.0 - sees / saw if saw else 0.0


def _fits(plan: BaseGeometry, free: BaseGeometry, standing: list[BaseGeometry], eyes: F64, area: Area) -> bool:
    here = (eyes[:, 2] > area.floor) & (eyes[:, 2] < area.floor + area.height)
    clear = all(plan.distance(shapely.Point(eye[:2])) > CLEAR for eye in eyes[here])
    return clear and bool(free.contains(plan)) and not any(plan.intersects(other) for other in standing)


def _swing(door: DoorTruth) -> BaseGeometry:
    middle = np.mean(np.array(door.corners)[:2, :2], axis=0)
    return shapely.Point(middle).buffer(1.2 * door.width / (door.leaves or 1) + 0.2)


def _wall_points(area: Area) -> F64:
    ring = area.outline.buffer(-OFF_FACE).boundary
    points = [
        shapely.get_coordinates(shapely.line_interpolate_point(line, np.arange(0.0, line.length, CELL)))
        for line in shapely.get_parts(ring)
        if line.length > 0
    ]
    plan = np.concatenate(points) if points else np.zeros((0, 2))
    heights = np.arange(CELL / 2, area.height, CELL)
    return np.column_stack([np.tile(plan, (len(heights), 1)), area.floor + np.repeat(heights, len(plan))])


def _piece(area: Area, rng: Rng) -> Piece:
    """Something of a room, at a wall or in the open."""
    place, facing = _somewhere(area, rng)
    turned, size, chance = (
        float(rng.uniform(0.0, 2 * math.pi)),
        float(rng.uniform(0.8, 1.5)),
        int(rng.integers(1 << 30)),
    )
    clothes = CLOTHES[chance % len(CLOTHES)]
    makers: list[Callable[[], Iterable[Box]]] = [
        lambda: decor.person("person", place, turned, 1.2 + 0.45 * size, clothes),
        lambda: decor.plant("plant", place, 0.6 + 0.8 * size, chance),
        lambda: decor.screen("screen", place, facing, size, 0.6 + 0.8 * size),
        lambda: decor.bench("bench", place, facing, size),
        lambda: furniture.table("table", place, facing),
        lambda: furniture.sofa("sofa", place, facing),
        lambda: furniture.shelves("shelves", place, facing),
        lambda: furniture.wardrobe("wardrobe", place, facing),
    ]
    return list(makers[int(rng.integers(len(makers)))]())


def _somewhere(area: Area, rng: Rng) -> tuple[Point2, float]:
    """A place in a room, and the turn of a piece there whose back is to the nearest wall."""
    off = float(rng.uniform(0.2, 0.6)) if rng.random() < AT_WALL else float(rng.uniform(0.6, 1.5))
    ring = area.outline.buffer(-off).boundary
    if ring.is_empty or ring.length == 0.0:
        middle = area.outline.representative_point()
        return (middle.x, middle.y), 0.0
    point = ring.interpolate(float(rng.uniform(0.0, ring.length)))
    (x, y), (a, b) = shapely.get_coordinates(shapely.shortest_line(point, area.outline.boundary))[[0, -1]]
    # At no turn a piece's back is at +y.
    return (float(x), float(y)), math.atan2(b - y, a - x) - math.pi / 2
