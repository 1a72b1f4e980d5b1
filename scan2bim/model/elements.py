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


class FaceView(Record):
    """What the scans saw of one face of an element: shares of its area, openings left out, that add up to 1.

    side: of a wall, looking along its axis; or of a plate. area: square metres of it that bound spaces (of a side
    without spaces: all of it). seen: with points on it; occluded: something stood before it; unseen: no scan looked
    there. points on it, rms metres of those to the fitted plane.
    """

    side: Literal["left", "right", "top", "under"]
    area: float | None = None
    seen: Share
    occluded: Share
    unseen: Share
    points: int = 0
    rms: float | None = None


class Evidence(Record):
    """What supports an element.

    points: scan points on it. rms: root mean square distance of those to the fitted surface, metres. coverage: share
    of the visible face with points. faces_seen: how many of its faces (2 for a wall) have points. faces: what was
    seen of each. position_sigma: one standard deviation, metres, of its place across its faces; length_sigma: of a
    wall's length, None where it ends on a wall whose thickness is assumed. scans: ids of the ``ScanSource`` that see
    it. sentence: the evidence in words.
    """

    points: int = 0
    rms: float | None = None
    coverage: Share | None = None
    faces_seen: int | None = None
    faces: tuple[FaceView, ...] = ()
    position_sigma: float | None = None
    length_sigma: float | None = None
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
    leaves: how many; glazed: whether rays went through them. recess: from the wall's nearer face in to the closed
    leaf, on the side ``recess_side``. handle_height over the opening's lower edge. threshold: height of a sill that one
    steps over. lining_depth: of the frame across the wall; lining_thickness: of the frame in the wall's plane.
    """

    kind: Literal["door"] = "door"
    state: Literal["open", "ajar", "closed", "unknown"] = "unknown"
    angle: float | None = None
    hinge_side: Literal["start", "end", "unknown"] = "unknown"
    swing_side: Literal["left", "right", "unknown"] = "unknown"
    operation: str = "NOTDEFINED"
    leaves: int | None = None
    glazed: bool | None = None
    leaf_thickness: Dimension | None = None
    recess: Dimension | None = None
    recess_side: Literal["left", "right", "unknown"] = "unknown"
    handle_height: Dimension | None = None
    threshold: Dimension | None = None
    lining_depth: Dimension | None = None
    lining_thickness: Dimension | None = None


class Window(Element):
    """The fill of an opening with a sill. partitioning: IfcWindowTypePartitioningEnum.

    frame_thickness: of the frame in the wall's plane. recess: from the wall's nearer face in to the pane, on the side
    ``recess_side``.
    """

    kind: Literal["window"] = "window"
    partitioning: str = "NOTDEFINED"
    frame_thickness: Dimension | None = None
    recess: Dimension | None = None
    recess_side: Literal["left", "right", "unknown"] = "unknown"


class Opening(Element):
    """A rectangular void through its host wall, perpendicular to it.

    offset: from the wall axis's start to the opening's nearer jamb, along the axis. sill: from the wall's base up to
    the lower edge. A passage or hole has no fill. depth: of a niche, from the face on its ``side`` inwards; None of an
    opening that goes through.
    """

    offset: Dimension
    sill: Dimension
    width: Dimension
    height: Dimension
    depth: Dimension | None = None
    side: Literal["left", "right"] | None = None
    fill: Annotated[Door | Window, Field(discriminator="kind")] | None = None


class Join(Record):
    """Where a wall's end (or, with "path", its middle) meets another wall."""

    wall: str
    at: Literal["start", "end", "path"]
    other_at: Literal["start", "end", "path"]
    kind: Literal["L", "T", "X"]


class Wall(Element):
    """A wall: centre line ``start`` to ``end`` in plan, vertical, from ``base`` (z) up by ``height``.

    The faces lie half the thickness to either side of the axis. bulge: 0 of a straight wall; of a curved one the
    tangent of a quarter of its arc's angle, positive where the arc turns left (lies to the right of the chord from
    start to end). lean: angle (radians) from vertical of a slanted wall, positive to the left; the axis is that at the
    base. profile: the upper edge where it is not level, as points (distance along the axis from its start, height over
    ``base``), first at 0, last at the length; ``height`` is then the greatest. use: IFC's kind of wall, PARAPET where
    it ends below the ceiling. external: True where one side is outside the building. left_spaces, right_spaces: ids
    of spaces on the sides of the axis, looking from start to end.
    """

    start: Point2
    end: Point2
    thickness: Dimension
    base: float
    height: Dimension
    bulge: float = 0.0
    lean: float = 0.0
    profile: tuple[Point2, ...] = ()
    use: Literal["STANDARD", "PARTITIONING", "PARAPET", "SHAFT"] = "STANDARD"
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


class OpenSide(Record):
    """A stretch of a space's outline without a wall: ``start`` to ``end`` in plan, to the space with the id ``to``."""

    start: Point2
    end: Point2
    to: str


class Space(Element):
    """A room: outline and holes of its clear area, from ``base`` (z) up by ``height``. Area and volume are net.

    ceiling: plane pieces of its upper side where that is not level, as corners in space, counter-clockwise in plan,
    that cover its area once; ``height`` is then the greatest, and all of ``volume`` lies under them. open_sides: where
    it goes over into another space without a wall.
    """

    outline: Ring
    holes: tuple[Ring, ...] = ()
    base: float
    height: Dimension
    area: float
    volume: float
    ceiling: tuple[tuple[Point3, ...], ...] = ()
    open_sides: tuple[OpenSide, ...] = ()


class Column(Element):
    """A free-standing post: its section's outline, from ``base`` (z) up by ``height``."""

    outline: Ring
    base: float
    height: Dimension
    section: Literal["rectangular", "round"] = "rectangular"


class Beam(Element):
    """A downstand beam: its outline in plan, underside at ``base`` (z), up by ``height`` to the slab."""

    outline: Ring
    base: float
    height: Dimension


class Flight(Record):
    """A straight run of steps: centre line in plan from the foot of the first riser to the last, upwards.

    base (z) of the floor at its foot, height of its rise, width across, risers counted or None.
    """

    start: Point2
    end: Point2
    base: float
    height: float
    width: Dimension
    risers: int | None = None


class Stair(Element):
    """A stair as a whole: outline in plan, from ``base`` (z) up by ``height``. ``flights`` from the lowest up."""

    outline: Ring
    base: float
    height: Dimension
    shape: Literal["straight", "winding", "spiral", "unknown"] = "unknown"
    risers: int | None = None
    width: Dimension | None = None
    flights: tuple[Flight, ...] = ()


class RoofPlane(Element):
    """A sloping plane seen from below: its outline in space, counter-clockwise in plan, and thickness upwards."""

    outline: tuple[Point3, ...]
    thickness: Dimension


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
    beams: tuple[Beam, ...] = ()
    roofs: tuple[RoofPlane, ...] = ()
    stairs: tuple[Stair, ...] = ()


class ScanResidual(Record):
    """By how much a scan lies off the building's faces as the other scans see them, metres in the local frame.

    offset along x, y, z: what is to be taken off its points; None where no face across it was shared. sigma: one
    standard deviation of each. rms of what the offset leaves. patches: square metres of faces shared with other scans.
    """

    offset: tuple[float | None, float | None, float | None]
    sigma: tuple[float | None, float | None, float | None]
    rms: float
    patches: int


class ScanSource(Record):
    """A scan that the model was made from. position: the scanner's, in the local frame, None where unknown.

    residual: how well it fits the others, None where it shares too little with them.
    """

    id: str
    name: str
    file: str
    points: int
    position: Point3 | None = None
    residual: ScanResidual | None = None


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
