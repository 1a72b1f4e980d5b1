"""What a simulated building consists of. Metres and radians, z up, in the scene's own frame.

``Placement`` turns and moves the scene into scan coordinates; ``truth`` and ``mesh`` apply it, nothing before them
does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from scan2bim.geometry.polygons import filled, polygons_of

F64 = NDArray[np.float64]
Point2 = tuple[float, float]
Point3 = tuple[float, float, float]
Rgb = tuple[int, int, int]

WHITE: Rgb = (226, 224, 218)
WOOD: Rgb = (146, 100, 62)
CONCRETE: Rgb = (150, 148, 146)


@dataclass(frozen=True, slots=True)
class DoorSpec:
    """A door, or with ``leaf`` False a passage, in a wall.

    offset: from the wall's start to the nearer jamb. angle: of the leaf from closed. hinge: at which jamb it hangs,
    ``start`` being nearer to the wall's start. swing: the side of the wall, looking from start to end, that it opens
    to. recess: depth of the closed leaf's outer side behind the wall's face on the swing side; 0 is flush. leaves: 1,
    or 2 that meet in the middle and stand at the same angle. gap: between leaf and jambs and head; behind it a stop
    closes the view. casing: width of the trim round the opening on both faces; 0 is none. finish: the leaf's, one of
    ``parts.FINISHES``.
    """

    name: str
    offset: float
    width: float = 0.885
    height: float = 2.005
    sill: float = 0.0
    angle: float = 0.0
    hinge: Literal["start", "end"] = "start"
    swing: Literal["left", "right"] = "left"
    recess: float = 0.0
    leaf: bool = True
    leaf_thickness: float = 0.04
    leaves: int = 1
    gap: float = 0.0
    casing: float = 0.05
    colour: Rgb = WOOD
    casing_colour: Rgb | None = None
    finish: str = "plain"

    @property
    def state(self) -> Literal["passage", "closed", "ajar", "open"]:
        """One of passage, closed, ajar (below 30 degrees), open."""
        if not self.leaf:
            return "passage"
        if self.angle == 0.0:
            return "closed"
        return "ajar" if self.angle < math.radians(30) else "open"


@dataclass(frozen=True, slots=True)
class WindowSpec:
    """A window in a wall; ``frame`` is the width of frame and mullions.

    Without ``pane`` its glass lets every ray pass; with it the scanner's own settings say what glass does.
    """

    name: str
    offset: float
    sill: float = 0.9
    width: float = 1.2
    height: float = 1.3
    frame: float = 0.07
    mullions: int = 0
    pane: bool = False
    colour: Rgb = (238, 238, 236)


@dataclass(frozen=True, slots=True)
class WallSpec:
    """A straight wall by its centre line, as high as its storey. ``skirting``: height of the boards along its feet."""

    name: str
    start: Point2
    end: Point2
    thickness: float = 0.1
    external: bool = False
    doors: tuple[DoorSpec, ...] = ()
    windows: tuple[WindowSpec, ...] = ()
    left_colour: Rgb = WHITE
    right_colour: Rgb = WHITE
    finish: str = "plain"
    skirting: float = 0.0

    @property
    def length(self) -> float:
        """Of the centre line."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True, slots=True)
class Room:
    """A name for the space that ``inside`` lies in, and the colour of its floor. Its outline follows from the walls."""

    name: str
    inside: Point2
    floor_colour: Rgb = CONCRETE


@dataclass(frozen=True, slots=True)
class Box:
    """A solid box: ``centre`` in plan, ``size`` along its own axes, ``base`` its underside above the storey's floor."""

    name: str
    centre: Point2
    size: Point3
    base: float = 0.0
    yaw: float = 0.0
    colour: Rgb = WOOD
    finish: str = "plain"


@dataclass(frozen=True, slots=True)
class Shaft:
    """A rectangular hole in a storey's floor, as over a stair: its lower left and upper right corner."""

    lower: Point2
    upper: Point2

    @property
    def polygon(self) -> Polygon:
        """Its outline."""
        return shapely.box(*self.lower, *self.upper)


@dataclass(frozen=True, slots=True)
class StoreySpec:
    """A storey: ``elevation`` of its floor's upper side, clear ``height``, the slab under it ``slab`` thick."""

    name: str
    walls: tuple[WallSpec, ...]
    rooms: tuple[Room, ...]
    elevation: float = 0.0
    height: float = 2.5
    slab: float = 0.2
    boxes: tuple[Box, ...] = ()
    shafts: tuple[Shaft, ...] = ()


@dataclass(frozen=True, slots=True)
class Station:
    """Where the scanner stands: its centre in the scene's frame, and the heading of its own x axis there."""

    name: str
    position: Point3
    heading: float = 0.0


@dataclass(frozen=True, slots=True)
class Placement:
    """Scan coordinates are the scene's, turned by ``yaw`` about z, then moved by ``offset``."""

    yaw: float = 0.0
    offset: Point3 = (0.0, 0.0, 0.0)

    def rotation(self) -> F64:
        """(3, 3) float64."""
        return turn(self.yaw)

    def points(self, xyz: F64) -> F64:
        """(n, 3) in the scene's frame to (n, 3) in scan coordinates."""
        return xyz @ self.rotation().T + np.asarray(self.offset, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Scene:
    """A whole building with the stations to scan it from."""

    name: str
    storeys: tuple[StoreySpec, ...]
    stations: tuple[Station, ...] = field(default=())
    placement: Placement = Placement()


def turn(angle: float) -> F64:
    """Rotation by ``angle`` about z, (3, 3) float64."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def wall_directions(wall: WallSpec) -> tuple[F64, F64]:
    """Unit vectors along the wall's centre line and to its left, (3,) each."""
    along = np.array([wall.end[0] - wall.start[0], wall.end[1] - wall.start[1], 0.0]) / wall.length
    return along, np.array([-along[1], along[0], 0.0])


def wall_extents(wall: WallSpec, storey: StoreySpec) -> tuple[float, float]:
    """How far the solid wall reaches beyond its centre line's ends so that corners are filled, metres.

    At a corner (another wall ends there too, and none runs through) it reaches the other wall's far face; at a T it
    ends on the other's axis.
    """
    others = [other for other in storey.walls if other is not wall]
    return _reach(wall.start, others), _reach(wall.end, others)


def _reach(point: Point2, others: list[WallSpec]) -> float:
    at_end = [w for w in others if min(math.dist(point, w.start), math.dist(point, w.end)) < 1e-6]
    through = [w for w in others if w not in at_end and _distance(point, w) < 1e-6]
    return 0.0 if through or not at_end else max(w.thickness for w in at_end) / 2


def _distance(point: Point2, wall: WallSpec) -> float:
    return shapely.LineString([wall.start, wall.end]).distance(shapely.Point(point))


def wall_outline(wall: WallSpec, storey: StoreySpec) -> Polygon:
    """The wall's rectangle in plan, corners filled."""
    along, left = wall_directions(wall)
    before, after = wall_extents(wall, storey)
    a = np.array(wall.start) - before * along[:2]
    b = np.array(wall.end) + after * along[:2]
    half = wall.thickness / 2 * left[:2]
    return Polygon([a - half, b - half, b + half, a + half])


def walls_outline(storey: StoreySpec) -> BaseGeometry:
    """The union of the walls' rectangles in plan."""
    return shapely.union_all([wall_outline(wall, storey) for wall in storey.walls], grid_size=1e-7)


def footprint(storey: StoreySpec) -> BaseGeometry:
    """All that the storey's outer walls enclose, the walls included."""
    return filled(walls_outline(storey))


def room_outlines(storey: StoreySpec) -> dict[str, Polygon]:
    """The clear inner area of each room by its name; ValueError where a room's ``inside`` lies in no closed space."""
    spaces = polygons_of(footprint(storey).difference(walls_outline(storey)))
    outlines: dict[str, Polygon] = {}
    for room in storey.rooms:
        found = [space for space in spaces if space.contains(shapely.Point(room.inside))]
        if not found:
            raise ValueError(f"room {room.name}: {room.inside} lies in no space that walls enclose")
        plain = found[0].simplify(1e-6)
        outlines[room.name] = orient(plain) if isinstance(plain, Polygon) else found[0]
    return outlines
