"""What a made-up building consists of. Metres, z up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from shapely.geometry import LineString, Polygon


@dataclass(frozen=True, slots=True)
class Style:
    """What a building's parts have in common. Metres."""

    outer: float
    inner: float
    bearing: float
    height: float
    slab: float
    door_height: float
    sill: float
    head: float


@dataclass(frozen=True, slots=True)
class Hole:
    """An opening of a wall. along: from the start of the wall's axis to its nearer side; sill above the floor."""

    kind: Literal["door", "passage", "window"]
    along: float
    width: float
    sill: float
    height: float


@dataclass(frozen=True, slots=True)
class Piece:
    """A wall: its outline in plan, and its axis."""

    outline: Polygon
    axis: LineString
    thickness: float
    holes: tuple[Hole, ...] = ()


@dataclass(frozen=True, slots=True)
class Stair:
    """A straight flight: its outline in plan, whether it climbs along x or y, and its number of risers."""

    outline: Polygon
    along_x: bool
    risers: int


@dataclass(frozen=True, slots=True)
class Level:
    """A storey. rooms: their outlines, and the heights of their ceilings. floor: the slab's outline below it."""

    elevation: float
    walls: tuple[Piece, ...]
    rooms: tuple[tuple[Polygon, float], ...]
    columns: tuple[Polygon, ...]
    floor: Polygon
    stair: Stair | None


@dataclass(frozen=True, slots=True)
class Building:
    """All of it."""

    style: Style
    outline: Polygon
    levels: tuple[Level, ...]
