"""The graph of spaces that a robot moves in: which door, passage, open side or stair leads from which to which.

Metres, radians, the model's frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np
import shapely
from pydantic import BaseModel, ConfigDict

from scan2bim.model.elements import Building, Door, Opening, Point2, Point3, Ring, Space, Stair, Storey, Wall
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import door_leaves, opening_angle
from scan2bim.model.swing import Obstacles

STEP_OVER: Final = 0.15
"""Metres: an opening whose lower edge is higher than this is none that one goes through."""
DUCK: Final = 1.5
"""Metres: nor is one whose head is lower than this over the floor."""
APPROACH: Final = 0.6
"""Metres from the wall's face: where a robot stands before it goes through."""
_REACH: Final = 0.4  # metres from the wall's face in which the space that an opening leads to must begin


class Part(BaseModel):
    """Frozen, and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class MapFile(Part):
    """A storey's occupancy map in the form of the ROS map_server; paths are relative to the graph's file.

    resolution: metres a pixel. origin: x, y of the lower left pixel's corner, and its yaw.
    """

    yaml: str
    image: str
    resolution: float
    origin: Point3


class SpaceNode(Part):
    """A space. guid: as in IFC and USD. centre: a point in its widest part. clear: metres from there to the nearest wall."""

    id: str
    guid: str
    name: str
    storey: str
    area: float
    height: float
    centre: Point3
    clear: float
    outline: Ring
    holes: tuple[Ring, ...] = ()


class DoorPose(Part):
    """A door or passage. position: the middle of its lower edge; yaw: of the wall there, so the door looks to yaw + 90°.

    approach: where to stand before it, to the left and right of the wall. hinges: of each leaf its axis; limits: how
    far it turns, signed; angles: how it was found.
    """

    id: str
    guid: str
    opening: str
    name: str
    storey: str
    kind: Literal["door", "passage"]
    position: Point3
    yaw: float
    width: float
    height: float
    threshold: float
    state: str
    hinges: tuple[Point2, ...] = ()
    limits: tuple[float, ...] = ()
    angles: tuple[float, ...] = ()
    approach: tuple[Point3, Point3]


class Edge(Part):
    """A way from a space to another, or outside (None). via: id of the door, passage or stair; None of an open side."""

    spaces: tuple[str | None, str | None]
    kind: Literal["door", "passage", "open side", "stair"]
    via: str | None = None
    width: float | None = None


class SpaceGraph(Part):
    """All spaces, doors and passages of a building, the ways between them, and the storeys' maps."""

    version: Literal["1.0"] = "1.0"
    building: str
    name: str
    crs: str | None
    shift: Point3
    maps: tuple[MapFile, ...]
    spaces: tuple[SpaceNode, ...]
    doors: tuple[DoorPose, ...]
    edges: tuple[Edge, ...]


def space_graph(building: Building, maps: tuple[MapFile, ...]) -> SpaceGraph:
    """The graph of a building, whose storeys have these maps."""
    nodes, doors, edges = list[SpaceNode](), list[DoorPose](), list[Edge]()
    for storey in building.storeys:
        nodes += [_node(space, storey) for space in storey.spaces]
        obstacles, finder = Obstacles(storey), _Finder(storey)
        for wall in storey.walls:
            for opening in filter(is_way, wall.openings):
                pose = _pose(wall, opening, storey, obstacles)
                doors.append(pose)
                sides = [finder.at(point_on_wall(wall, _middle(opening), side, 0.0)) for side in _beside(wall)]
                edges.append(Edge(spaces=(sides[0], sides[1]), kind=pose.kind, via=pose.id, width=pose.width))
        edges += _open_sides(storey)
    edges += _stairs(building.storeys)
    return SpaceGraph(
        building=building.id,
        name=building.name,
        crs=building.frame.crs,
        shift=building.frame.shift,
        maps=maps,
        spaces=tuple(nodes),
        doors=tuple(doors),
        edges=tuple(edges),
    )


def is_way(opening: Opening) -> bool:
    """Whether one can go through an opening, its door open: it reaches down to the floor and up over one's head."""
    low, head = opening.sill.value, opening.sill.value + opening.height.value
    fills = opening.fill is None or isinstance(opening.fill, Door)
    return fills and opening.depth is None and low <= STEP_OVER and head >= DUCK


def centre_of(space: Space) -> tuple[Point3, float]:
    """The middle of a space's widest part, on its floor, and how far from there its nearest border is, metres."""
    circle = shapely.maximum_inscribed_circle(shapely.Polygon(space.outline, space.holes).buffer(0.0))
    (x, y), (x1, y1) = shapely.get_coordinates(circle).tolist()
    return (round(x, 4), round(y, 4), space.base), round(math.hypot(x1 - x, y1 - y), 4)


def _middle(opening: Opening) -> float:
    return opening.offset.value + opening.width.value / 2


def _beside(wall: Wall) -> tuple[float, float]:
    reach = wall.thickness.value / 2 + _REACH
    return reach, -reach


class _Finder:
    """Finds the space at a point of a storey."""

    def __init__(self, storey: Storey) -> None:
        self._ids = [space.id for space in storey.spaces]
        shapes = [shapely.make_valid(shapely.Polygon(space.outline, space.holes)) for space in storey.spaces]
        self._tree = shapely.STRtree(shapes)

    def at(self, point: Point3) -> str | None:
        """The id of the space that holds the point, or that lies within ``_REACH`` of it; None where there is none."""
        found = self._tree.query_nearest(shapely.Point(point[:2]), max_distance=_REACH, all_matches=False)
        return self._ids[int(found[0])] if len(found) else None


def _node(space: Space, storey: Storey) -> SpaceNode:
    centre, clear = centre_of(space)
    return SpaceNode(
        id=space.id,
        guid=ifc_guid(space.id),
        name=space.name,
        storey=storey.id,
        area=space.area,
        height=space.height.value,
        centre=centre,
        clear=clear,
        outline=space.outline,
        holes=space.holes,
    )


def _pose(wall: Wall, opening: Opening, storey: Storey, obstacles: Obstacles) -> DoorPose:
    door, thing = opening.fill if isinstance(opening.fill, Door) else None, opening.fill or opening
    middle, yaw = _middle(opening), opening_angle(wall, opening)
    leaves = [leaf for leaf in door_leaves(wall, opening) if leaf.turn]
    x0, y0, _ = point_on_wall(wall, opening.offset.value, 0.0, opening.sill.value)
    turned = [complex(x0, y0) + complex(*leaf.hinge) * np.exp(1j * yaw) for leaf in leaves]
    reach = wall.thickness.value / 2 + APPROACH
    before, behind = (point_on_wall(wall, middle, side, opening.sill.value) for side in (reach, -reach))
    return DoorPose(
        id=thing.id,
        guid=ifc_guid(thing.id),
        opening=opening.id,
        name=thing.name,
        storey=storey.id,
        kind="passage" if door is None else "door",
        position=_rounded(point_on_wall(wall, middle, 0.0, opening.sill.value)),
        yaw=round(yaw, 6),
        width=opening.width.value,
        height=opening.height.value,
        threshold=0.0 if door is None or door.threshold is None else door.threshold.value,
        state="none" if door is None else door.state,
        hinges=tuple((round(float(point.real), 4), round(float(point.imag), 4)) for point in turned),
        limits=tuple(round(leaf.turn * obstacles.swing_limit(wall, opening, leaf), 4) for leaf in leaves),
        angles=tuple(round(leaf.angle, 4) for leaf in leaves),
        approach=(_rounded(before), _rounded(behind)),
    )


def _rounded(point: Point3) -> Point3:
    x, y, z = (round(value, 4) for value in point)
    return x, y, z


def _open_sides(storey: Storey) -> Iterator[Edge]:
    """Each open side once, though both spaces name it."""
    seen = set[frozenset[str]]()
    for space in storey.spaces:
        for side in space.open_sides:
            pair = frozenset((space.id, side.to))
            if pair not in seen:
                seen.add(pair)
                yield Edge(spaces=(space.id, side.to), kind="open side", width=round(math.dist(side.start, side.end), 4))


def _stairs(storeys: Sequence[Storey]) -> Iterator[Edge]:
    """A stair leads from the space at its foot to the one at its head, in the next storey up."""
    for below, above in zip(storeys, storeys[1:], strict=False):
        lower, upper = _Finder(below), _Finder(above)
        for stair in below.stairs:
            foot, head = _ends(stair)
            width = stair.width.value if stair.width is not None else None
            yield Edge(spaces=(lower.at(foot), upper.at(head)), kind="stair", via=stair.id, width=width)


def _ends(stair: Stair) -> tuple[Point3, Point3]:
    """Foot and head of a stair; of one without flights, the middle of its outline for both."""
    if stair.flights:
        first, last = stair.flights[0], stair.flights[-1]
        return (*first.start, first.base), (*last.end, last.base + last.height)
    x, y = shapely.get_coordinates(shapely.Polygon(stair.outline).representative_point())[0].tolist()
    return (x, y, stair.base), (x, y, stair.base + stair.height.value)
