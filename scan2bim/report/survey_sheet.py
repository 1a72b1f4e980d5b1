"""A plan of what was not seen (sides of walls and floor in colour), and where to scan next (by number)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from scan2bim.model.elements import Building, Storey
from scan2bim.model.shapes import wall_footprints
from scan2bim.model.survey_plan import MissingFloor, Proposal, SurveyPlan
from scan2bim.report import palette
from scan2bim.report.plan import scanner_positions
from scan2bim.report.plan_symbols import draw_opening, draw_scanner
from scan2bim.report.sheet import Mark, Rgb, Shape, Sheet, Text, View, line

UNSEEN: Final[Rgb] = (214, 20, 30)
UNSEEN_FLOOR: Final[Rgb] = (250, 176, 170)
UNKNOWN: Final[Rgb] = (206, 190, 232)
PROPOSAL: Final[Rgb] = (0, 110, 60)
_PANEL: Final = 900.0  # pixels of the longer side of a storey
_MOST_SCALE: Final = 90.0  # pixels a metre
_MARGIN: Final = 40.0
_HEAD: Final = 70.0
_RADIUS: Final = 13.0
_LEGEND: Final = (
    (UNSEEN, "side of a wall not seen (the wider, the more of its height)"),
    (UNSEEN_FLOOR, "floor not seen"),
    (UNKNOWN, "unknown: no space was found, nobody looked"),
    (palette.SCANNER, "scan"),
    (PROPOSAL, "proposal"),
)


def survey_sheet(building: Building, plan: SurveyPlan) -> Sheet:
    """The plan of all storeys that have spaces, side by side."""
    storeys = [storey for storey in building.storeys if storey.spaces]
    boxes = [_box(storey, plan) for storey in storeys]
    sides = [float((high - low).max()) for low, high in boxes]
    scale = min(_MOST_SCALE, _PANEL / max(sides, default=1.0))
    marks: list[Mark] = []
    x, bottom = _MARGIN, _HEAD + _MARGIN
    for storey, (low, high) in zip(storeys, boxes, strict=True):
        view = View(scale, x - scale * low[0], _HEAD + scale * high[1])
        marks += _storey(view, storey, building, plan)
        marks.append(Text(x, 28, f"{building.name} · {storey.name}", 18, palette.INK, bold=True))
        x += max(scale * float(high[0] - low[0]), 280.0) + _MARGIN
        bottom = max(bottom, _HEAD + scale * float(high[1] - low[1]) + _MARGIN)
    words = f"{plan.seen:.0%} of the faces inside seen; about {plan.expected:.0%} with the proposals"
    marks.append(Text(_MARGIN, 50, words, 14, palette.FAINT))
    for number, (colour, text) in enumerate(_LEGEND):
        y = bottom + 22 * number
        ring = np.array([[_MARGIN, y], [_MARGIN + 18, y], [_MARGIN + 18, y + 14], [_MARGIN, y + 14]])
        marks += [Shape((ring,), colour, palette.INK), Text(_MARGIN + 26, y + 12, text, 14, palette.INK)]
    return Sheet(math.ceil(max(x, 520.0)), math.ceil(bottom + 22 * len(_LEGEND) + 20), tuple(marks))


def _box(storey: Storey, plan: SurveyPlan) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner, metres, of all that is drawn of a storey."""
    points = [point for ring in wall_footprints(storey).values() for point in ring]
    points += [point for space in storey.spaces for point in space.outline]
    points += [p.place[:2] for p in plan.proposals if p.storey == storey.id]
    points += [m for floor in plan.missing_floor if floor.storey == storey.id for m in floor.middles]
    every = np.array(points, np.float64)
    return every.min(0) - 0.4, every.max(0) + 0.4


def _storey(view: View, storey: Storey, building: Building, plan: SurveyPlan) -> Iterator[Mark]:
    floors = [floor for floor in plan.missing_floor if floor.storey == storey.id]
    yield from (_squares(view, floor, UNKNOWN) for floor in floors if floor.unknown)
    for space in storey.spaces:
        yield Shape(tuple(view.page(r) for r in (space.outline, *space.holes)), (246, 246, 242))
    yield from (_squares(view, floor, UNSEEN_FLOOR) for floor in floors if not floor.unknown)
    for ring in wall_footprints(storey).values():
        yield Shape((view.page(ring),), palette.pale(palette.WALL, 0.6))
    for wall in storey.walls:
        for opening in wall.openings:
            yield from draw_opening(view, wall, opening)
    for stretch in (stretch for stretch in plan.missing if stretch.storey == storey.id):
        yield line(view.page((stretch.start, stretch.end)), UNSEEN, 2.0 + 5.0 * stretch.share)
    for space in storey.spaces:
        x, y = view.page(np.array(space.outline).mean(0)[None])[0].tolist()
        yield Text(x, y, space.name, 13, palette.FAINT, "middle", halo=True)
    for position in scanner_positions(storey, building):
        yield from draw_scanner(view, position)
    for proposal in (proposal for proposal in plan.proposals if proposal.storey == storey.id):
        yield from _proposal(view, proposal)


def _squares(view: View, floor: MissingFloor, colour: Rgb) -> Shape:
    half = floor.edge / 2
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    return Shape(tuple(view.page(np.array(middle) + corners) for middle in floor.middles), colour)


def _proposal(view: View, proposal: Proposal) -> Iterator[Mark]:
    x, y = view.page((proposal.place[:2],))[0].tolist()
    turns = np.linspace(0.0, 2 * math.pi, 33)[:-1]
    ring = np.column_stack([x + _RADIUS * np.cos(turns), y + _RADIUS * np.sin(turns)])
    yield Shape((ring,), PROPOSAL, (255, 255, 255), 2.0)
    yield Text(x, y + 6, str(proposal.number), 16, (255, 255, 255), "middle", bold=True)
    yield Text(x, y + _RADIUS + 15, f"{proposal.gain:.1f} m²", 13, PROPOSAL, "middle", bold=True, halo=True)
