"""What the structure stage finds, as plain values, and its JSON form in the work folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from shapely.geometry import Polygon

Point = tuple[float, float]
Ring = tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class SpaceShape:
    """Clear inner area of a space: rings without repeated first point, floor and ceiling heights (None if never seen), local metres."""

    outline: Ring
    holes: tuple[Ring, ...]
    floor: float
    ceiling: float | None
    floor_share: float
    ceiling_share: float

    @property
    def polygon(self) -> Polygon:
        """As a shapely polygon."""
        return Polygon(self.outline, self.holes)


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

    ``rms`` metres is that of its faces' fits, ``points`` the scan points on them, ``coverage`` the share of its faces' length where
    they were seen, ``faces`` how many were (1 or 2), ``stations`` the scans that see them.
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


@dataclass(frozen=True, slots=True)
class StoreyShape:
    """A storey: floor (with sigma), ceiling and top heights, its spaces and walls."""

    floor: float
    sigma: float
    ceiling: float | None
    top: float
    spaces: tuple[SpaceShape, ...]
    walls: tuple[WallShape, ...]


@dataclass(frozen=True, slots=True)
class StructureShape:
    """All storeys, lowest first, the main wall direction (radians), and remarks for people."""

    storeys: tuple[StoreyShape, ...]
    yaw: float
    notes: tuple[str, ...] = ()

    def save(self, path: Path) -> None:
        """Write as JSON."""
        path.write_text(json.dumps(asdict(self)), encoding="utf-8")

    @staticmethod
    def load(path: Path) -> StructureShape:
        """Read what ``save`` wrote."""
        data = json.loads(path.read_text(encoding="utf-8"))
        return StructureShape(tuple(_storey(s) for s in data["storeys"]), data["yaw"], tuple(data["notes"]))


def ring_of(points: Sequence[Sequence[float]]) -> Ring:
    """Closed coordinates as a ring, to a tenth of a millimetre, first point not repeated."""
    ring = tuple((round(float(p[0]), 4), round(float(p[1]), 4)) for p in points)
    return ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring


def _storey(data: dict[str, Any]) -> StoreyShape:
    spaces = tuple(_space(s) for s in data["spaces"])
    walls = tuple(_wall(w) for w in data["walls"])
    return StoreyShape(**(data | {"spaces": spaces, "walls": walls}))


def _space(data: dict[str, Any]) -> SpaceShape:
    outline = tuple((x, y) for x, y in data["outline"])
    holes = tuple(tuple((x, y) for x, y in ring) for ring in data["holes"])
    return SpaceShape(**(data | {"outline": outline, "holes": holes}))


def _wall(data: dict[str, Any]) -> WallShape:
    tuples = {key: tuple(data[key]) for key in ("start", "end", "left", "right", "stations", "colour")}
    return WallShape(**(data | tuples | {"joins": tuple(JoinShape(**j) for j in data["joins"])}))
