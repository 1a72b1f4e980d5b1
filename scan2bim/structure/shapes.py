"""What the structure stage finds, as plain values, and its JSON form in the work folder."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from shapely.geometry import LineString, Polygon, box

from scan2bim.geometry.arcs import Arc
from scan2bim.geometry.polygons import largest_valid

Point = tuple[float, float]
Ring = tuple[Point, ...]
FLAT = 0.2
"""Radians that a stretch of a curved wall may bend to be looked at as straight: 3 m by 1.5 cm."""


@dataclass(frozen=True, slots=True)
class SpaceShape:
    """Clear inner area of a space: rings without repeated first point, floor and ceiling heights (None if never seen),
    local metres. ``soffits``: plane pieces, as corners in space, that cover it where it lies under roof planes;
    ``ceiling`` is then the greatest height.
    """

    outline: Ring
    holes: tuple[Ring, ...]
    floor: float
    ceiling: float | None
    floor_share: float
    ceiling_share: float
    soffits: tuple[tuple[tuple[float, float, float], ...], ...] = ()

    @property
    def polygon(self) -> Polygon:
        """As a shapely polygon: where the outline crosses itself, the largest of its parts."""
        return largest_valid(Polygon(self.outline, self.holes))


@dataclass(frozen=True, slots=True)
class JoinShape:
    """An end ("start", "end") of a wall on another wall's end or path; ``other`` is its number in the storey."""

    other: int
    at: str
    other_at: str
    kind: str


@dataclass(frozen=True, slots=True)
class WallShape:
    """A wall: axis, thickness, heights; ``left`` and ``right`` the numbers of the spaces beside its axis.

    ``rms`` metres is that of its faces' fits, ``points`` the scan points on them, ``coverage`` the share of its faces'
    length where they were seen, ``faces`` how many were (1 or 2), ``stations`` the scans that see them. ``profile``:
    the upper edge where it is not level, as points (distance along the axis, height over the base). ``bulge``: the
    tangent of a quarter of its arc's angle, positive to the left. ``layer_of``: the thickness of all that was seen as
    one wall, where it is a layer of it.
    Standard deviations, metres: ``thickness_sigma``, None where the thickness is assumed; ``position_sigma`` of the
    axis across the wall, where one face was seen of that, None where none was.
    """

    start: Point
    end: Point
    thickness: float
    thickness_sigma: float | None
    base: float
    top: float
    top_seen: bool
    left: tuple[int, ...]
    right: tuple[int, ...]
    rms: float
    points: int
    coverage: float
    faces: int
    stations: tuple[int, ...]
    colour: tuple[int, int, int]
    joins: tuple[JoinShape, ...] = ()
    profile: tuple[Point, ...] = ()
    bulge: float = 0.0
    position_sigma: float | None = None
    layer_of: float | None = None

    @property
    def axis(self) -> Arc:
        """Its line in the frame of its chord."""
        return Arc(math.dist(self.start, self.end), self.bulge)

    @property
    def length(self) -> float:
        """Metres along its line."""
        return self.axis.length

    @property
    def chord(self) -> NDArray[np.float64]:
        """(2, 2): unit vectors from start to end and to the left."""
        x, y = (np.array(self.end) - self.start) / max(math.dist(self.start, self.end), 1e-9)
        return np.array([[x, y], [-y, x]])

    @property
    def line(self) -> LineString:
        """Its line in plan."""
        steps = 2 + int(abs(self.axis.angle) / FLAT)
        return LineString(self.place(np.linspace(0.0, self.length, steps)))

    def locate(self, xy: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How far along its line and to the left of it places (n, 2) lie, metres."""
        flat = (xy - self.start) @ self.chord.T
        return self.axis.locate(flat[:, 0], flat[:, 1])

    def place(self, along: NDArray[np.float64], left: float = 0.0) -> NDArray[np.float64]:
        """Places (n, 2) some metres along its line and ``left`` metres to the left of it."""
        return self.axis.place(along, np.full(along.shape, left)) @ self.chord + self.start

    def straight_at(self, along: float) -> WallShape:
        """The straight wall that touches a curved one some metres along its line, and has the same measure there."""
        if not self.bulge:
            return self
        turn = self.axis.direction(along)
        way = np.array([math.cos(turn), math.sin(turn)]) @ self.chord
        start = self.place(np.array([along]))[0] - along * way
        end = start + self.length * way
        return replace(self, start=(float(start[0]), float(start[1])), end=(float(end[0]), float(end[1])), bulge=0.0)

    def flat_parts(self) -> list[tuple[float, float, WallShape]]:
        """Stretches along its line, and the wall as straight there: one of a straight wall."""
        count = max(1, math.ceil(abs(self.axis.angle) / FLAT))
        ends = np.linspace(0.0, self.length, count + 1).tolist()
        return [(a, b, self.straight_at((a + b) / 2)) for a, b in pairwise(ends)]

    def share_below(self, offset: float, sill: float, width: float, height: float) -> float:
        """Share of a rectangle in the wall's plane that lies below its upper edge."""
        if not self.profile:
            return 1.0
        side = Polygon([(self.profile[0][0], 0.0), (self.profile[-1][0], 0.0), *reversed(self.profile)])
        return box(offset, sill, offset + width, sill + height).intersection(side).area / (width * height)


@dataclass(frozen=True, slots=True)
class StairShape:
    """A stair from ``base`` to ``top``: outline in plan, kind (straight, winding, spiral), mean direction upwards in
    plan, width across it (metres) and the number of risers.
    """

    outline: Ring
    base: float
    top: float
    kind: Literal["straight", "winding", "spiral"]
    climb: Point
    width: float
    risers: int


@dataclass(frozen=True, slots=True)
class ColumnShape:
    """A column from ``base`` up to ``top``: outline and kind of its section, ``size`` across its own axes (metres).

    ``rms`` metres of its surface to the outline, ``points`` the scan points on it, ``coverage`` the share of the
    outline that was seen, ``stations`` the scans that see it.
    """

    outline: Ring
    section: Literal["rectangular", "round"]
    size: Point
    base: float
    top: float
    top_seen: bool
    rms: float
    points: int
    coverage: float
    stations: tuple[int, ...]
    colour: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class BeamShape:
    """A downstand beam: outline in plan, underside at ``base``, up to ``top``, ``size`` along and across it (metres);
    ``coverage`` the share of its underside that was seen.
    """

    outline: Ring
    base: float
    top: float
    size: Point
    coverage: float


@dataclass(frozen=True, slots=True)
class RoofShape:
    """A sloping roof plane seen from below: its corners in space, counter-clockwise in plan; ``rms`` metres,
    ``coverage`` the share of it that was seen.
    """

    outline: tuple[tuple[float, float, float], ...]
    rms: float
    coverage: float


@dataclass(frozen=True, slots=True)
class StoreyShape:
    """A storey: floor (with sigma, None where it was not seen), ceiling and top heights, its spaces, walls, columns,
    beams and roof planes, the stairs that start in it, and the wells in its floor through which those below come up.
    """

    floor: float
    sigma: float | None
    ceiling: float | None
    top: float
    spaces: tuple[SpaceShape, ...]
    walls: tuple[WallShape, ...]
    stairs: tuple[StairShape, ...] = ()
    wells: tuple[Ring, ...] = ()
    columns: tuple[ColumnShape, ...] = ()
    beams: tuple[BeamShape, ...] = ()
    roofs: tuple[RoofShape, ...] = ()


@dataclass(frozen=True, slots=True)
class StructureShape:
    """All storeys, lowest first, the main wall direction (radians), and remarks for people."""

    storeys: tuple[StoreyShape, ...]
    yaw: float
    notes: tuple[str, ...] = ()

    def save(self, path: Path) -> None:
        """Write as JSON."""
        path.write_bytes(_adapter().dump_json(self))

    @staticmethod
    def load(path: Path) -> StructureShape:
        """Read what ``save`` wrote."""
        return _adapter().validate_json(path.read_bytes())


@cache
def _adapter() -> TypeAdapter[StructureShape]:
    return TypeAdapter(StructureShape)


def ring_of(points: NDArray[np.float64]) -> Ring:
    """Closed coordinates as a ring, to a tenth of a millimetre, first point not repeated."""
    ring = tuple((round(float(p[0]), 4), round(float(p[1]), 4)) for p in points)
    return ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
