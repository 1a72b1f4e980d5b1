"""What a building has, in scan coordinates: metres and radians, z up. Frozen; unknown keys are refused.

None, or "unknown", is what is not known, as where the truth was read from an IFC file that does not say.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Point2 = tuple[float, float]
Point3 = tuple[float, float, float]
Corners = tuple[Point3, Point3, Point3, Point3]
TRUTH_FORMAT = "scan2bim truth 2"

State = Literal["closed", "ajar", "open", "passage", "unknown"]
Hinge = Literal["start", "end", "both", "unknown"]
Swing = Literal["left", "right", "both", "unknown"]


class Fact(BaseModel):
    """Frozen, and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str
    storey: str


class WallTruth(Fact):
    """A wall's centre line, thickness, underside and height. occlusion: share of its inner faces never seen.
    confidence: of a model that was made from scans, that it is there; a truth's file has none.
    """

    start: Point2
    end: Point2
    thickness: float
    base: float
    height: float
    external: bool | None = None
    occlusion: float | None = None
    confidence: float | None = None


class OpeningTruth(Fact):
    """An opening in a wall, filled or not.

    wall: its name, "" where it is in none. corners: of the opening in the middle of the wall: lower start, lower end,
    upper end, upper start, as the wall runs. sill: above the storey's floor. occlusion: share of its outline on the
    walls' faces that no station saw. confidence: of a model that was made from scans, that it is there.
    """

    wall: str
    corners: Corners
    width: float
    height: float
    sill: float
    occlusion: float | None = None
    confidence: float | None = None


class DoorTruth(OpeningTruth):
    """A door or passage.

    spaces: on the wall's left and right there, "" outside. hinge: at the start's or the end's jamb, both where two
    leaves hang. swing: to the wall's left or right. angle: of the leaf from closed. recess: of the closed leaf's outer
    side behind the wall's face on the swing side. leaves: how many. contrast: greatest difference of a channel
    between the leaf's colour and the wall's on the swing side, in 0-1.
    """

    state: State = "unknown"
    angle: float | None = None
    hinge: Hinge = "unknown"
    swing: Swing = "unknown"
    recess: float | None = None
    leaves: int | None = None
    contrast: float | None = None
    spaces: tuple[str, str] = ("", "")


class WindowTruth(OpeningTruth):
    """A window."""


class SpaceTruth(Fact):
    """A room's clear inner outline (counter-clockwise, first point not repeated), holes, net area, extent in z: up to
    the greatest height under its ceiling, a suspended one where there is one.
    """

    outline: tuple[Point2, ...]
    holes: tuple[tuple[Point2, ...], ...] = ()
    area: float
    base: float
    height: float


class StoreyTruth(BaseModel):
    """Elevation of the floor's upper side, and clear height."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str
    elevation: float
    height: float | None = None


class StationTruth(BaseModel):
    """Where the scanner stood; ``room`` is the space round it, "" outside."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str
    position: Point3
    room: str


class Truth(BaseModel):
    """All that is known of a building. yaw: by which its own axes are turned in scan coordinates."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    scene: str
    yaw: float = 0.0
    storeys: tuple[StoreyTruth, ...] = ()
    walls: tuple[WallTruth, ...] = ()
    doors: tuple[DoorTruth, ...] = ()
    windows: tuple[WindowTruth, ...] = ()
    openings: tuple[OpeningTruth, ...] = ()
    spaces: tuple[SpaceTruth, ...] = ()
    stations: tuple[StationTruth, ...] = ()
