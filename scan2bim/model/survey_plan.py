"""Where to scan next: proposed stations, what each would see, and what is missing. Its JSON form is that of a model."""

from __future__ import annotations

from typing import Literal

from scan2bim.model.elements import Point2, Point3, Record


class Sight(Record):
    """What a proposed station would see of what is missing: ``words`` for people, the element's id where it is known
    (None of a floor that nothing is known of), and square metres.
    """

    words: str
    element: str | None
    area: float


class Proposal(Record):
    """A station. position: of the scanner, in the coordinates of the scans; place: the same, local metres.

    gain: square metres of faces and unknown floor that it would see and the scans, and the proposals before it, do not.
    unknown: of these the unknown floor. behind: the closed door (its name) that must be opened to get there.
    """

    number: int
    position: Point3
    place: Point3
    storey: str
    storey_name: str
    space: str | None
    gain: float
    unknown: float
    behind: str | None
    sees: tuple[Sight, ...]


class Missing(Record):
    """A stretch of a wall's side, ``start`` to ``end`` in plan (local metres), of which this share was not seen."""

    storey: str
    wall: str
    side: Literal["left", "right"]
    start: Point2
    end: Point2
    share: float


class MissingFloor(Record):
    """Squares with these middles (local metres) and this edge: floor that was not seen, or, ``unknown``, of which it is
    not known what is there.
    """

    storey: str
    edge: float
    unknown: bool
    middles: tuple[Point2, ...]


class SurveyPlan(Record):
    """Proposals, the best first. seen: share of the building's faces that was seen; expected: with the proposals."""

    version: Literal["1.0"] = "1.0"
    building: str
    seen: float
    expected: float
    proposals: tuple[Proposal, ...]
    missing: tuple[Missing, ...]
    missing_floor: tuple[MissingFloor, ...]
    notes: tuple[str, ...] = ()
