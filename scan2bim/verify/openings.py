"""Doors and windows of the model beside what the scans show in their walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.detected import Detected
from scan2bim.verify.hanging import difference
from scan2bim.verify.ifc_model import ModelElement
from scan2bim.verify.jambs import Change, built_face, detected_change, extent_change, outline_change
from scan2bim.verify.outlines import Outline, Profiles, find_extent, find_outline
from scan2bim.verify.outlines import Side as JambSide
from scan2bim.verify.patches import Gap
from scan2bim.verify.result import ElementResult, OpeningResult, Status
from scan2bim.verify.status import Surface, result_of
from scan2bim.verify.visibility import BLOCKED, LOOKED_THROUGH, SAW, VISIBLE

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]
Finding = Literal["matched", "moved", "resized", "other_swing", "walled_up", "unseen"]

FLUSH = 0.006
"""Metres from the wall's face within which a surface in an opening continues the wall: noise of a cell's mean and
registration. Leaves and frames mostly lie deeper."""
CLOSED_UP = 0.85
"""Share of what was seen in an opening that continues the wall, on each side, from which on it is walled up."""
SEEN = 0.30
"""Share of an opening that must be seen on a side for that side to speak."""
SIDEWAYS = 1.2
"""Metres along the wall within which a detected opening is looked for."""
PLANE = 0.35
"""Metres across the wall within which a detected opening lies in the same wall."""
ANGLE = 0.97
"""Cosine of the angle between walls that count as one, 14 degrees."""
ALIKE = 0.3
"""Share of a detected and a drawn opening's common area in both together, from which on they are one."""
SAME_SIZE = 0.2
"""Difference in width and height, of the drawn ones, up to which openings beside each other are one that was moved."""
SURE = 0.6
"""Confidence from which on a detected opening counts as seen."""
OPEN = 0.5
"""Share of a detected opening's place in a drawn wall that shows no wall, for the opening to be an addition; or of what
was seen of the wall beside a drawn one, for that to be wider.
"""
LEAST_LOOKED, LEAST_AREA = 0.05, 0.05
"""Metres of drawn wall beside an opening, a cell at the least, and square metres of it, that stations must look through
for the opening to be wider.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """What one side of an opening shows, as shares of what was measured or looked through: flush with the wall, deeper,
    through.

    seen, blocked and visible are shares of its area; what stands before the wall's face is blocked, not seen.
    """

    flush: float
    deeper: float
    through: float
    seen: float
    blocked: float
    visible: float


@dataclass(frozen=True, slots=True, eq=False)
class OpeningContext:
    """All that openings are judged by: the surface, where each element's cells are (``cells_of``), the placed gaps with
    the places of their patches, the detected openings, and the points along the walls near the gaps.
    """

    surface: Surface
    order: NDArray[np.int64]
    ends: NDArray[np.int64]
    gaps: tuple[Gap, ...]
    patches: tuple[int, ...]
    hosts: tuple[int, ...]
    detected: tuple[Detected, ...]
    profiles: Profiles

    def cells_of(self, element: int) -> NDArray[np.int64]:
        """Numbers of an element's cells."""
        return self.order[self.ends[element] : self.ends[element + 1]]


def judge_openings(
    context: OpeningContext, elements: Sequence[ModelElement], tolerances: Sequence[float]
) -> tuple[list[ElementResult], set[int]]:
    """Results of the doors and windows, and which detected openings they are."""
    pairs = _pairs(context)
    place = {e.guid: i for i, e in enumerate(elements)}
    gap_of = {g.fill.guid: n for n, g in enumerate(context.gaps) if g.fill is not None}
    results: list[ElementResult] = []
    for element in elements:
        if element.role != "fill":
            continue
        tolerance = tolerances[place[element.guid]]
        number = gap_of.get(element.guid)
        if number is None:
            results.append(result_of(element, "not_applicable", "It stands in no opening of a wall.", tolerance))
            continue
        found = context.detected[pairs[number]] if number in pairs else None
        results.append(_judge(context, number, element, tolerance, found))
    return results, set(pairs.values())


def _pairs(context: OpeningContext) -> dict[int, int]:
    """The detected opening of each gap: nearest first, each once."""
    costs: list[tuple[float, int, int]] = []
    for g, gap in enumerate(context.gaps):
        for d, found in enumerate(context.detected):
            offset = found.middle[:2] - gap.middle[:2]
            away = abs(float(offset @ gap.across))
            if away < PLANE and abs(float(found.along @ gap.along)) > ANGLE and _is_one(gap, found):
                sideways, up = float(offset @ gap.along), float(found.middle[2] - gap.middle[2])
                costs.append((abs(sideways) + abs(up) + 0.3 * abs(found.width - gap.width), g, d))
    pairs: dict[int, int] = {}
    for _, g, d in sorted(costs):
        if g not in pairs and d not in pairs.values():
            pairs[g] = d
    return pairs


def _is_one(gap: Gap, found: Detected) -> bool:
    """Whether both may be the same opening: over each other, or of one size and not far apart."""
    sideways = abs(float((found.middle[:2] - gap.middle[:2]) @ gap.along))
    up = abs(float(found.middle[2] - gap.middle[2]))
    common = max(0.0, min(gap.width, found.width, (gap.width + found.width) / 2 - sideways))
    common *= max(0.0, min(gap.height, found.height, (gap.height + found.height) / 2 - up))
    alike = common / (gap.width * gap.height + found.width * found.height - common)
    same = (
        abs(found.width - gap.width) < SAME_SIZE * gap.width
        and abs(found.height - gap.height) < SAME_SIZE * gap.height
        and sideways < SIDEWAYS
        and up < 0.3
    )
    return alike > ALIKE or same


def _judge(
    context: OpeningContext, number: int, element: ModelElement, tolerance: float, found: Detected | None
) -> ElementResult:
    gap = context.gaps[number]
    sides = _sides(context, number)
    outline = _outline(context, number, found)
    aside = None if found is None else float((found.middle[:2] - gap.middle[:2]) @ gap.along)
    change = outline_change(outline, tolerance, aside) if outline else _hidden_change(context, number, found)
    finding = _finding([side for side in sides if side.seen >= SEEN], found, change, element)
    otherwise = _hung_otherwise(gap, found)
    if finding == "matched" and otherwise:
        finding = "other_swing"
    told = finding in ("moved", "resized", "matched", "other_swing")
    up = None if found is None else float(found.middle[2] - found.height / 2 - (gap.middle[2] - gap.height / 2))
    opening = OpeningResult(
        finding=finding,
        host=gap.host,
        shift_along=None if change.shift is None or not told else round(change.shift, 4),
        shift_up=None if up is None or not told else round(up, 4),
        width_change=None if change.width is None or not told else round(change.width, 4),
        height_change=None if found is None or not told else round(found.height - gap.height, 4),
        built_state=_state(found),
        other_swing=told and bool(otherwise),
    )
    status, reason = _status(opening, sides)
    if opening.other_swing:
        reason += f" Its leaf {otherwise}."
    return result_of(element, status, reason, tolerance).model_copy(update={"opening": opening})


def _outline(context: OpeningContext, number: int, found: Detected | None) -> Outline | None:
    """The built sides of an opening, looked for at its drawn place and where one was detected."""
    gap = context.gaps[number]
    faces = _built_faces(context, number)
    if found is None:
        outline = find_outline(context.profiles, number, faces, [0.0], None)
    else:
        aside, wider = float((found.middle[:2] - gap.middle[:2]) @ gap.along), (found.width - gap.width) / 2
        sides = (aside - wider, -aside - wider) if found.tells_place else None
        outline = find_outline(context.profiles, number, faces, [0.0, aside], sides)
    if outline is None:
        return None
    sides = ((outline.start, -1), (outline.end, 1))
    start, end = (_looked(context, number, _confirmed(context, number, side, sign), sign) for side, sign in sides)
    return replace(outline, start=start, end=end)


def _confirmed(context: OpeningContext, number: int, side: JambSide, sign: int) -> JambSide:
    """The side at the start (``sign`` -1) or end of an opening; as drawn if a detected one alone brings it in, where no
    wall was seen to go on: what stands before an opening hides a part of it.
    """
    if not side.detected or side.wall <= 0.0:
        return side
    gap, surface = context.gaps[number], context.surface
    cells = context.cells_of(context.patches[number])
    inwards = gap.width / 2 - sign * ((surface.table.centres(cells) - gap.middle)[:, :2] @ gap.along)
    strip = cells[(inwards > 0) & (inwards < side.wall)]
    faces = surface.table.cell_face[strip]
    shown = [_side(surface, strip[faces == face]) for face in np.unique(faces)]
    if any(part.seen >= SEEN and part.flush >= CLOSED_UP for part in shown):
        return side
    return JambSide(0.0, 0.0, 0.0, hollow=False)


def _looked(context: OpeningContext, number: int, side: JambSide, sign: int) -> JambSide:
    """The side at the start (``sign`` -1) or end of an opening, hollow also where stations looked through the wall that
    is drawn between it and the built one.
    """
    if side.hollow or side.wall > -LEAST_LOOKED:
        return side
    gap, surface = context.gaps[number], context.surface
    cells = context.cells_of(context.hosts[number])
    offset = surface.table.centres(cells) - gap.middle
    along = sign * (offset[:, :2] @ gap.along) - gap.width / 2
    on_face = np.abs(surface.table.normal[surface.table.cell_face[cells]][:, :2] @ gap.across) > ANGLE
    strip = on_face & (along > 0) & (along < -side.wall - LEAST_LOOKED / 2) & (np.abs(offset[:, 2]) < gap.height / 2)
    through = ~surface.is_measured[cells] & ((surface.bits[cells] & LOOKED_THROUGH) > 0)
    seen = surface.is_measured[cells] | through
    told = float((strip & through).sum()) / max(int((strip & seen).sum()), 1)
    area = float(surface.table.area(cells[strip & through]).sum())
    return replace(side, hollow=True, inside=side.wall) if told > OPEN and area > LEAST_AREA else side


def _built_faces(context: OpeningContext, number: int) -> tuple[F64, F64]:
    wall, gap = context.cells_of(context.hosts[number]), context.gaps[number]
    return built_face(context.surface, wall, gap, -1.0), built_face(context.surface, wall, gap, 1.0)


def _hidden_change(context: OpeningContext, number: int, found: Detected | None) -> Change:
    """Of an opening beside which no wall was seen: from what was seen inside the wall, else from the detected one."""
    gap = context.gaps[number]
    extent = None if found is None else find_extent(context.profiles, number, _built_faces(context, number))
    change = None if found is None or extent is None else extent_change(extent, gap, found)
    return change or detected_change(gap, found)


def _finding(
    speaking: Sequence[Side],
    found: Detected | None,
    change: Change,
    element: ModelElement,
) -> Finding:
    sure = found is not None and found.confidence >= SURE
    if speaking and all(side.flush >= CLOSED_UP for side in speaking) and not sure:
        # A closed leaf may be flush with one face of its wall, never with both.
        sure = len(speaking) > 1 or element.ifc_class != "IfcDoor"
        return "walled_up" if sure else "unseen"
    if change.width:
        return "resized"
    if change.shift:
        return "moved"
    if found is not None or any(side.deeper + side.through >= OPEN for side in speaking):
        return "matched"
    return "unseen"


def _hung_otherwise(gap: Gap, found: Detected | None) -> str:
    """In words how an open door's leaf hangs otherwise than drawn, empty where it does not or was not seen."""
    if found is None or found.confidence < SURE:
        return ""
    return difference(gap.hanging, found.hanging)


def _sides(context: OpeningContext, number: int) -> list[Side]:
    """Both sides of a gap's patch."""
    surface = context.surface
    cells = context.cells_of(context.patches[number])
    face = surface.table.cell_face[cells]
    return [_side(surface, cells[face == f]) for f in np.unique(face)]


def _side(surface: Surface, cells: NDArray[np.int64]) -> Side:
    bits = surface.bits[cells]
    measured = surface.is_measured[cells]
    offset = np.where(measured, surface.measured.mean[cells], 0.0)
    flush = measured & (np.abs(offset) < FLUSH)
    through = ~measured & ((bits & LOOKED_THROUGH) > 0)
    before = measured & (offset >= FLUSH)
    saw = (measured | through | ((bits & SAW) > 0)) & ~before
    total = max(len(cells), 1)
    told = flush | (measured & (offset <= -FLUSH)) | through
    seen = max(int(told.sum()), 1)
    return Side(
        flush=float(flush.sum()) / seen,
        deeper=float((measured & (offset <= -FLUSH)).sum()) / seen,
        through=float(through.sum()) / seen,
        seen=float(told.sum()) / total,
        blocked=float((before | (~saw & ((bits & BLOCKED) > 0))).sum()) / total,
        visible=float((measured | ((bits & VISIBLE) > 0)).sum()) / total,
    )


def _state(found: Detected | None) -> Literal["open", "ajar", "closed", "unknown"]:
    return found.state if found is not None else "unknown"


def _status(opening: OpeningResult, sides: Sequence[Side]) -> tuple[Status, str]:
    match opening.finding:
        case "walled_up":
            return "missing", "The wall's surface goes on where the opening is drawn."
        case "moved":
            return "out_of_tolerance", f"It was built {1000 * abs(opening.shift_along or 0):.0f} mm aside."
        case "resized":
            change = 1000 * (opening.width_change or 0)
            return "out_of_tolerance", f"It was built {abs(change):.0f} mm {_than(change)} than drawn."
        case "matched" | "other_swing":
            status: Status = "out_of_tolerance" if opening.other_swing else "in_tolerance"
            return status, "The scans show it where it is drawn."
        case _:
            blocked = max((side.blocked for side in sides), default=0.0)
            if blocked > 0.3:
                return "occluded", f"Something stood before {100 * blocked:.0f} % of it."
            return "not_enough_data", "Too little of it was seen."


def _than(change: float) -> str:
    return "wider" if change > 0 else "narrower"


def placed_gap(gap: Gap, matrix: F64, anchor: F64) -> Gap:
    """In the local frame, by the placing of the anchored model."""
    middle = matrix[:3, :3] @ (gap.middle - anchor) + matrix[:3, 3]
    along = matrix[:2, :2] @ gap.along
    hanging = None if gap.hanging is None else gap.hanging.turned(matrix[:2, :2])
    return replace(gap, middle=middle, along=along / math.hypot(*along), hanging=hanging)
