"""The next best scans, as the founding paper's robot asks for (its section III): where further stations would see most
of what is missing.

Greedy: of the places where a scanner can stand, the one that would see most square metres of faces not seen yet and of
unknown floor; then, less what that one sees, the next.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.frame import up_rotation
from scan2bim.cloud.scene import Scene
from scan2bim.coverage.faces import look_at_faces
from scan2bim.coverage.panels import CELL
from scan2bim.coverage.sights import chances
from scan2bim.coverage.standing import FLOOR_EDGE, Prospect, missing_cells, prospect_of
from scan2bim.coverage.voxels import field_of
from scan2bim.model.coverage import coverage_of
from scan2bim.model.elements import Building, Frame, Point3
from scan2bim.model.survey_plan import Missing, MissingFloor, Proposal, Sight, SurveyPlan

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

RIM = 6.0
"""Metres round the spaces that are looked at: a room that no station stood in."""
WORTH = 1.0
"""Square metres that a further station must add: setting it up takes minutes."""
MOST_SIGHTS = 8
"""Of what a station would see, as many are named."""
STRETCH = 0.5
"""Metres of a wall that are told as one stretch."""
LEAST_MISSING = 0.1
"""Share of a stretch that must be missing to be told."""
NO_STATIONS = "No scanner positions are known: what is free cannot be told from what was never looked at."


def plan_scans(building: Building, scene: Scene, count: int) -> SurveyPlan:
    """Up to ``count`` proposals for a building and the scans that it was made from."""
    prospects: list[Prospect] = []
    for storey, faces in zip(building.storeys, look_at_faces(building, scene, RIM, holes=True), strict=True):
        if faces is not None:
            prospects.append(prospect_of(building, storey, field_of(storey, faces, scene), told=bool(scene.panoramas)))
    proposals = _chosen(building, prospects, count)
    covered = coverage_of(building)
    seen, area = (covered.total.seen, covered.total.area) if covered else (0.0, 1.0)
    more = sum(p.gain - p.unknown for p in proposals) / area
    return SurveyPlan(
        building=building.name,
        seen=round(seen, 4),
        expected=round(min(1.0, seen + more), 4),
        proposals=tuple(proposals),
        missing=tuple(stretch for prospect in prospects for stretch in _missing_walls(prospect)),
        missing_floor=tuple(floor for prospect in prospects for floor in _missing_floor(prospect)),
        notes=() if scene.panoramas else (NO_STATIONS,),
    )


def _chosen(building: Building, prospects: Sequence[Prospect], count: int) -> list[Proposal]:
    chance = [_chances(prospect) for prospect in prospects]
    done = [np.zeros(len(prospect.targets), np.float32) for prospect in prospects]
    out: list[Proposal] = []
    while len(out) < count:
        gains = [
            np.maximum(c - d, 0.0) @ p.targets.area.astype(np.float32)
            for c, d, p in zip(chance, done, prospects, strict=True)
        ]
        at = max(range(len(gains)), key=lambda i: gains[i].max(initial=0.0), default=None)
        if at is None or gains[at].max(initial=0.0) < WORTH:
            break
        place = int(gains[at].argmax())
        new = np.maximum(chance[at][place] - done[at], 0.0)
        out.append(_proposal(building, prospects[at], place, new, len(out) + 1))
        done[at] = np.maximum(done[at], chance[at][place])
    return out


def _chances(prospect: Prospect) -> F32:
    """(places, targets) chance of each place to see each target."""
    rows = [chances(eye, prospect.targets, prospect.obstacles) for eye in prospect.places.points]
    return np.array(rows, np.float32).reshape(len(rows), len(prospect.targets))


def _proposal(building: Building, prospect: Prospect, place: int, new: F32, number: int) -> Proposal:
    targets, rooms = prospect.targets, prospect.faces.rooms
    gained = new * targets.area
    point = prospect.places.points[place]
    row, col = rooms.pixels(point[None, :2])
    space = int(rooms.space[row[0], col[0]])
    return Proposal(
        number=number,
        position=scan_coordinates(point, building.frame),
        place=_three(point),
        storey=prospect.storey.id,
        storey_name=prospect.storey.name,
        space=prospect.storey.spaces[space].name if space >= 0 else None,
        gain=round(float(gained.sum()), 2),
        unknown=round(float(gained[targets.owner < 0].sum()), 2),
        behind=prospect.places.behind[place],
        sees=_sights(prospect, gained),
    )


def _sights(prospect: Prospect, gained: F64) -> tuple[Sight, ...]:
    """What is gained, by element and space, the most first."""
    faces, storey, targets = prospect.faces.panels.faces, prospect.storey, prospect.targets
    names = {part.id: part.name for part in (*storey.walls, *storey.slabs, *storey.coverings, *storey.roofs)}
    row, col = prospect.faces.rooms.pixels(targets.points[:, :2])
    space = prospect.faces.rooms.space[row, col]
    sums: dict[tuple[str | None, int], float] = defaultdict(float)
    for owner in np.unique(targets.owner[gained > 0.0]).tolist():
        mine = (targets.owner == owner) & (gained > 0.0)
        for number in np.unique(space[mine]).tolist() if owner >= 0 else [-1]:
            here = mine & (space == number) if owner >= 0 else mine
            sums[faces[owner].element if owner >= 0 else None, number] += float(gained[here].sum())
    out: list[Sight] = []
    for (element, number), area in sorted(sums.items(), key=lambda item: -item[1])[:MOST_SIGHTS]:
        if area >= CELL:
            room = f" ({storey.spaces[number].name})" if number >= 0 else ""
            words = f"{names[element]}{room}" if element is not None else "unknown floor (unscanned room, or outdoors)"
            out.append(Sight(words=words, element=element, area=round(area, 2)))
    return tuple(out)


def scan_coordinates(point: F64, frame: Frame) -> Point3:
    """A local place (3,) in the coordinates and the unit of the scans' files."""
    return _three((point + np.array(frame.shift)) @ up_rotation(frame.up) / frame.unit)


def _three(point: F64) -> Point3:
    x, y, z = (round(float(v), 3) for v in point)
    return x, y, z


def _missing_walls(prospect: Prospect) -> list[Missing]:
    """Stretches of walls that were not seen."""
    panels, missing = prospect.faces.panels, missing_cells(prospect.faces)
    out: list[Missing] = []
    for p in range(len(panels)):
        face = panels.faces[int(panels.face[p])]
        if panels.level[p] or not face.inner or face.side not in ("left", "right"):
            continue
        cols, rows, first = panels.cells[p].tolist()
        mine = slice(first, first + cols * rows)
        asked, lost = (mask[mine].reshape(rows, cols).sum(0) for mask in (panels.asked, missing))
        edges = np.unique(np.linspace(0, cols, max(1, round(cols * panels.plane[p, 12] / STRETCH)) + 1).astype(int))
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            share = lost[a:b].sum() / max(int(asked[a:b].sum()), 1)
            if share >= LEAST_MISSING:
                start, end = (panels.plane[p, :2] + k * panels.plane[p, 12] * panels.plane[p, 3:5] for k in (a, b))
                out.append(
                    Missing(
                        storey=prospect.storey.id,
                        wall=face.element,
                        side=face.side,
                        start=_two(start),
                        end=_two(end),
                        share=round(float(share), 2),
                    )
                )
    return out


def _missing_floor(prospect: Prospect) -> list[MissingFloor]:
    """Floor that was not seen, and squares of which nothing is known."""
    panels, missing = prospect.faces.panels, missing_cells(prospect.faces)
    unseen = [np.zeros((0, 2))]
    for p in np.flatnonzero(panels.level & (panels.plane[:, 11] > 0.0)).tolist():
        mine = slice(int(panels.cells[p, 2]), int(panels.cells[p, 2] + panels.cells[p, 0] * panels.cells[p, 1]))
        unseen.append(panels.centres(p)[missing[mine], :2])
    return [
        MissingFloor(storey=prospect.storey.id, edge=edge, unknown=unknown, middles=tuple(_two(m) for m in middles))
        for edge, unknown, middles in ((CELL, False, np.concatenate(unseen)), (FLOOR_EDGE, True, prospect.unknown))
    ]


def _two(point: F64) -> tuple[float, float]:
    return round(float(point[0]), 2), round(float(point[1]), 2)
