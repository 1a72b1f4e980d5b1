"""The exact truth of a scene, in scan coordinates."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.geometry.polygons import largest_part
from scan2bim.simulate.parts import WallFrame, wall_frame
from scan2bim.simulate.scene import DoorSpec, Placement, Scene, StoreySpec, WallSpec, WindowSpec, room_outlines
from scan2bim.truth.values import (
    Corners,
    DoorTruth,
    Point2,
    SpaceTruth,
    StationTruth,
    StoreyTruth,
    Truth,
    WallTruth,
    WindowTruth,
)

F64 = NDArray[np.float64]


def truth_of(scene: Scene) -> Truth:
    """The exact truth of a scene."""
    hosted = [(storey, wall) for storey in scene.storeys for wall in storey.walls]
    place = scene.placement
    return Truth(
        scene=scene.name,
        yaw=place.yaw,
        storeys=tuple(
            StoreyTruth(name=s.name, elevation=s.elevation + place.offset[2], height=s.height) for s in scene.storeys
        ),
        walls=tuple(_wall(w, s, place) for s, w in hosted),
        doors=tuple(_door(d, w, s, place) for s, w in hosted for d in w.doors),
        windows=tuple(_window(o, w, s, place) for s, w in hosted for o in w.windows),
        spaces=tuple(_space(n, p, s, place) for s in scene.storeys for n, p in room_outlines(s).items()),
        stations=tuple(_station(scene, i) for i in range(len(scene.stations))),
    )


def _plan(points: F64, place: Placement) -> tuple[Point2, ...]:
    moved = place.points(np.column_stack([points, np.zeros(len(points))]))
    return tuple((float(x), float(y)) for x, y in moved[:, :2])


def _wall(wall: WallSpec, storey: StoreySpec, place: Placement) -> WallTruth:
    start, end = _plan(np.array([wall.start, wall.end]), place)
    base = storey.elevation + place.offset[2]
    return WallTruth(
        name=wall.name,
        storey=storey.name,
        start=start,
        end=end,
        thickness=wall.thickness,
        base=base,
        height=storey.height,
        external=wall.external,
    )


def _corners(opening: DoorSpec | WindowSpec, frame: WallFrame, place: Placement) -> Corners:
    x0, x1, z0, z1 = opening.offset, opening.offset + opening.width, opening.sill, opening.sill + opening.height
    local = np.array([frame.point(x, 0.0, z) for x, z in ((x0, z0), (x1, z0), (x1, z1), (x0, z1))])
    a, b, c, d = ((float(x), float(y), float(z)) for x, y, z in place.points(local))
    return a, b, c, d


def _door(door: DoorSpec, wall: WallSpec, storey: StoreySpec, place: Placement) -> DoorTruth:
    frame = wall_frame(wall, storey)
    return DoorTruth(
        name=door.name,
        storey=storey.name,
        wall=wall.name,
        corners=_corners(door, frame, place),
        width=door.width,
        height=door.height,
        sill=door.sill,
        state=door.state,
        angle=door.angle,
        hinge="both" if door.leaves == 2 else door.hinge,
        swing=door.swing,
        recess=door.recess,
        leaves=door.leaves if door.leaf else 0,
        contrast=_contrast(door, wall) if door.leaf else None,
        spaces=(_beside(door, wall, storey, 1.0), _beside(door, wall, storey, -1.0)),
    )


def _contrast(door: DoorSpec, wall: WallSpec) -> float:
    face = wall.left_colour if door.swing == "left" else wall.right_colour
    return max(abs(a - b) for a, b in zip(door.colour, face, strict=True)) / 255.0


def _beside(door: DoorSpec, wall: WallSpec, storey: StoreySpec, side: float) -> str:
    """The room 5 cm in front of the wall's face at the door's middle."""
    point = wall_frame(wall, storey).point(door.offset + door.width / 2, side * (wall.thickness / 2 + 0.05), 0.0)
    return _room_at((float(point[0]), float(point[1])), storey)


def _room_at(point: Point2, storey: StoreySpec) -> str:
    inside = (name for name, outline in room_outlines(storey).items() if outline.contains(shapely.Point(point)))
    return next(inside, "")


def _window(window: WindowSpec, wall: WallSpec, storey: StoreySpec, place: Placement) -> WindowTruth:
    corners = _corners(window, wall_frame(wall, storey), place)
    return WindowTruth(
        name=window.name,
        storey=storey.name,
        wall=wall.name,
        corners=corners,
        width=window.width,
        height=window.height,
        sill=window.sill,
    )


def _space(name: str, room: Polygon, storey: StoreySpec, place: Placement) -> SpaceTruth:
    """A room's clear area: what one can stand on, shafts left out."""
    outline = room
    if storey.shafts:
        floor = shapely.difference(room, shapely.union_all([shaft.polygon for shaft in storey.shafts]))
        outline = largest_part(floor, room)
    rings = [_plan(shapely.get_coordinates(ring)[:-1], place) for ring in (outline.exterior, *outline.interiors)]
    base = storey.elevation + place.offset[2]
    return SpaceTruth(
        name=name,
        storey=storey.name,
        outline=rings[0],
        holes=tuple(rings[1:]),
        area=outline.area,
        base=base,
        height=storey.height,
    )


def _station(scene: Scene, index: int) -> StationTruth:
    station = scene.stations[index]
    below = [s for s in scene.storeys if s.elevation <= station.position[2]]
    room = _room_at(station.position[:2], max(below, key=lambda s: s.elevation)) if below else ""
    x, y, z = scene.placement.points(np.array([station.position]))[0]
    return StationTruth(name=station.name, position=(float(x), float(y), float(z)), room=room)
