"""What a reader of a scene's scans is to find, in scan coordinates, metres and radians."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.simulate.parts import WallFrame, wall_frame
from scan2bim.simulate.scene import (
    DoorSpec,
    Placement,
    Point2,
    Point3,
    Scene,
    StoreySpec,
    WallSpec,
    WindowSpec,
    room_outlines,
)

F64 = NDArray[np.float64]
Corners = tuple[Point3, Point3, Point3, Point3]
TRUTH_FORMAT = "scan2bim scene truth 1"


@dataclass(frozen=True, slots=True)
class WallTruth:
    """A wall's centre line, thickness, underside and height."""

    name: str
    storey: str
    start: Point2
    end: Point2
    thickness: float
    base: float
    height: float
    external: bool


@dataclass(frozen=True, slots=True)
class DoorTruth:
    """A door or passage.

    corners: of its opening in the middle of the wall: lower start, lower end, upper end, upper start, as the wall
    runs. spaces: on the wall's left and right there, "" outside. hinge: at the start's or the end's jamb. swing: to
    the wall's left or right.
    """

    name: str
    storey: str
    wall: str
    corners: Corners
    width: float
    height: float
    sill: float
    state: str
    angle: float
    hinge: str
    swing: str
    recess: float
    spaces: tuple[str, str]


@dataclass(frozen=True, slots=True)
class WindowTruth:
    """A window; corners as those of a door."""

    name: str
    storey: str
    wall: str
    corners: Corners
    width: float
    height: float
    sill: float


@dataclass(frozen=True, slots=True)
class SpaceTruth:
    """A room's clear inner outline (counter-clockwise, first point not repeated), holes, net area, extent in z."""

    name: str
    storey: str
    outline: tuple[Point2, ...]
    holes: tuple[tuple[Point2, ...], ...]
    area: float
    base: float
    height: float


@dataclass(frozen=True, slots=True)
class StoreyTruth:
    """Elevation of the floor's upper side, and clear height."""

    name: str
    elevation: float
    height: float


@dataclass(frozen=True, slots=True)
class StationTruth:
    """Where the scanner stood; ``room`` is the space round it, "" outside."""

    name: str
    position: Point3
    room: str


@dataclass(frozen=True, slots=True)
class Truth:
    """All that is known of a scene."""

    scene: str
    yaw: float
    storeys: tuple[StoreyTruth, ...]
    walls: tuple[WallTruth, ...]
    doors: tuple[DoorTruth, ...]
    windows: tuple[WindowTruth, ...]
    spaces: tuple[SpaceTruth, ...]
    stations: tuple[StationTruth, ...]


def truth_of(scene: Scene) -> Truth:
    """The exact truth of a scene."""
    hosted = [(storey, wall) for storey in scene.storeys for wall in storey.walls]
    place = scene.placement
    return Truth(
        scene=scene.name,
        yaw=place.yaw,
        storeys=tuple(StoreyTruth(s.name, s.elevation + place.offset[2], s.height) for s in scene.storeys),
        walls=tuple(_wall(w, s, place) for s, w in hosted),
        doors=tuple(_door(d, w, s, place) for s, w in hosted for d in w.doors),
        windows=tuple(_window(o, w, s, place) for s, w in hosted for o in w.windows),
        spaces=tuple(_space(n, p, s, place) for s in scene.storeys for n, p in room_outlines(s).items()),
        stations=tuple(_station(scene, i) for i in range(len(scene.stations))),
    )


def write_truth(path: Path, truth: Truth) -> None:
    """Write the truth as JSON; numbers are rounded to 0.01 mm."""
    document = {"format": TRUTH_FORMAT, "units": "metres, radians", **_rounded(dataclasses.asdict(truth))}
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return round(value, 5) if isinstance(value, float) else value


def _plan(points: F64, place: Placement) -> tuple[Point2, ...]:
    moved = place.points(np.column_stack([points, np.zeros(len(points))]))
    return tuple((float(x), float(y)) for x, y in moved[:, :2])


def _wall(wall: WallSpec, storey: StoreySpec, place: Placement) -> WallTruth:
    start, end = _plan(np.array([wall.start, wall.end]), place)
    base = storey.elevation + place.offset[2]
    return WallTruth(wall.name, storey.name, start, end, wall.thickness, base, storey.height, wall.external)


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
        hinge=door.hinge,
        swing=door.swing,
        recess=door.recess,
        spaces=(_beside(door, wall, storey, 1.0), _beside(door, wall, storey, -1.0)),
    )


def _beside(door: DoorSpec, wall: WallSpec, storey: StoreySpec, side: float) -> str:
    """The room 5 cm in front of the wall's face at the door's middle."""
    point = wall_frame(wall, storey).point(door.offset + door.width / 2, side * (wall.thickness / 2 + 0.05), 0.0)
    return _room_at((float(point[0]), float(point[1])), storey)


def _room_at(point: Point2, storey: StoreySpec) -> str:
    inside = (name for name, outline in room_outlines(storey).items() if outline.contains(shapely.Point(point)))
    return next(inside, "")


def _window(window: WindowSpec, wall: WallSpec, storey: StoreySpec, place: Placement) -> WindowTruth:
    corners = _corners(window, wall_frame(wall, storey), place)
    return WindowTruth(window.name, storey.name, wall.name, corners, window.width, window.height, window.sill)


def _space(name: str, outline: Polygon, storey: StoreySpec, place: Placement) -> SpaceTruth:
    rings = [_plan(shapely.get_coordinates(ring)[:-1], place) for ring in (outline.exterior, *outline.interiors)]
    base = storey.elevation + place.offset[2]
    return SpaceTruth(name, storey.name, rings[0], tuple(rings[1:]), outline.area, base, storey.height)


def _station(scene: Scene, index: int) -> StationTruth:
    station = scene.stations[index]
    below = [s for s in scene.storeys if s.elevation <= station.position[2]]
    room = _room_at(station.position[:2], max(below, key=lambda s: s.elevation)) if below else ""
    x, y, z = scene.placement.points(np.array([station.position]))[0]
    return StationTruth(station.name, (float(x), float(y), float(z)), room)
