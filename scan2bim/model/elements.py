"""The semantic model of a building: the one truth from which everything that leaves the program is made.

Metres, z up, right-handed, in the building's local frame: scan coordinates (unit and up axis applied) less
``Frame.shift``. Values are frozen pydantic models; unknown keys are refused. ``id`` is stable from run to run on the
same input, ``name`` is for people.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Point2 = tuple[float, float]
Point3 = tuple[float, float, float]
Ring = tuple[Point2, ...]
"""A closed outline in plan: the first point is not repeated; counter-clockwise outside, clockwise for holes."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Colour = tuple[Share, Share, Share]
"""Linear red, green, blue in 0-1, sampled from the scan (median of the element's points)."""

MODEL_VERSION = "1.0"


class Record(BaseModel):
    """Frozen, and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Dimension(Record):
    """A length in metres, with where it comes from. ``sigma`` is one standard deviation, only where measured."""

    value: float
    source: Literal["measured", "assumed"]
    sigma: float | None = None


class Evidence(Record):
    """What supports an element.

    points: scan points on it. rms: root mean square distance of those to the fitted surface, metres. coverage: share
    of the visible face with points. faces_seen: how many of its faces (2 for a wall) have points. scans: ids of the
    ``ScanSource`` that see it. sentence: the evidence in words.
    """

    points: int = 0
    rms: float | None = None
    coverage: Share | None = None
    faces_seen: int | None = None
    scans: tuple[str, ...] = ()
    sentence: str = ""


class Element(Record):
    """What all elements have. ``confidence`` is the calibrated probability that the element is right."""

    id: str
    name: str
    confidence: Share
    evidence: Evidence = Evidence()
    colour: Colour | None = None


class Door(Element):
    """The fill of an opening. What cannot be known is None or "unknown", never guessed.

    angle: of the leaf from closed, radians. hinge_side: seen from the side on the left of the wall's axis direction
    (start to end), at which end of the opening (start = nearer to the wall's start) the leaf hangs. swing_side: the
    side of the wall axis, looking from start to end, that the leaf swings to. operation: IfcDoorTypeOperationEnum.
    """

    kind: Literal["door"] = "door"
    state: Literal["open", "ajar", "closed", "unknown"] = "unknown"
    angle: float | None = None
    hinge_side: Literal["start", "end", "unknown"] = "unknown"
    swing_side: Literal["left", "right", "unknown"] = "unknown"
    operation: str = "NOTDEFINED"
    leaf_thickness: Dimension | None = None


class Window(Element):
    """The fill of an opening with a sill. partitioning: IfcWindowTypePartitioningEnum."""

    kind: Literal["window"] = "window"
    partitioning: str = "NOTDEFINED"


class Opening(Element):
    """A rectangular void through its host wall, perpendicular to it.

    offset: from the wall axis's start to the opening's nearer jamb, along the axis. sill: from the wall's base up to
    the lower edge. A passage or hole has no fill.
    """

    offset: Dimension
    sill: Dimension
    width: Dimension
    height: Dimension
    fill: Annotated[Door | Window, Field(discriminator="kind")] | None = None


class Join(Record):
    """Where a wall's end (or, with "path", its middle) meets another wall."""

    wall: str
    at: Literal["start", "end", "path"]
    other_at: Literal["start", "end", "path"]
    kind: Literal["L", "T", "X"]


class Wall(Element):
    """A straight wall: centre line ``start`` to ``end`` in plan, vertical, from ``base`` (z) up by ``height``.

    The faces lie half the thickness to either side of the axis. external: True where one side is outside the building.
    left_space, right_space: ids of spaces on the sides of the axis, looking from start to end.
    """

    start: Point2
    end: Point2
    thickness: Dimension
    base: float
    height: Dimension
    external: bool | None = None
    left_spaces: tuple[str, ...] = ()
    right_spaces: tuple[str, ...] = ()
    joins: tuple[Join, ...] = ()
    openings: tuple[Opening, ...] = ()


class Area(Element):
    """A horizontal plate: outline and holes in plan, ``top`` (z) of its upper side, thickness downwards."""

    outline: Ring
    holes: tuple[Ring, ...] = ()
    top: Dimension
    thickness: Dimension


class Slab(Area):
    """A floor slab, or with "ROOF" the slab over the topmost storey."""

    use: Literal["FLOOR", "ROOF", "BASESLAB"] = "FLOOR"


class Covering(Area):
    """A ceiling covering: ``top - thickness`` is the ceiling that one sees."""


class Space(Element):
    """A room: outline and holes of its clear area, from ``base`` (z) up by ``height``. Area and volume are net."""

    outline: Ring
    holes: tuple[Ring, ...] = ()
    base: float
    height: Dimension
    area: float
    volume: float


class Column(Element):
    """A free-standing post: its section's outline, from ``base`` (z) up by ``height``."""

    outline: Ring
    base: float
    height: Dimension
    section: Literal["rectangular", "round"] = "rectangular"


class Stair(Element):
    """A stair as a whole: outline in plan, from ``base`` (z) up by ``height``."""

    outline: Ring
    base: float
    height: Dimension
    risers: int | None = None
    width: Dimension | None = None


class Storey(Record):
    """A storey: ``elevation`` is the z of its main floor, ``height`` up to its main ceiling, or None if unseen."""

    id: str
    name: str
    elevation: Dimension
    height: Dimension | None = None
    walls: tuple[Wall, ...] = ()
    spaces: tuple[Space, ...] = ()
    slabs: tuple[Slab, ...] = ()
    coverings: tuple[Covering, ...] = ()
    columns: tuple[Column, ...] = ()
    stairs: tuple[Stair, ...] = ()


class ScanSource(Record):
    """A scan that the model was made from. position: the scanner's, in the local frame, None where unknown."""

    id: str
    name: str
    file: str
    points: int
    position: Point3 | None = None


class Frame(Record):
    """How file coordinates became local: scaled by ``unit`` (metres a file unit), ``up`` turned up, less ``shift``.

    yaw: angle (radians) of the building's main wall direction to local x. crs: name or code of the coordinate
    reference system.
    """

    unit: float = 1.0
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    yaw: float = 0.0
    shift: Point3 = (0.0, 0.0, 0.0)
    crs: str | None = None


class Building(Record):
    """The whole building. ``notes`` say in words what was lost, assumed or not looked at."""

    version: Literal["1.0"] = "1.0"
    id: str
    name: str
    frame: Frame = Frame()
    scans: tuple[ScanSource, ...] = ()
    storeys: tuple[Storey, ...] = ()
    notes: tuple[str, ...] = ()
