"""The words and tables of docs/results.md that tell how right the models of the bench's scenes are."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from bench import SceneScore
from document import mean, number, table

from scan2bim.evaluate.corners import WITHIN
from scan2bim.evaluate.openings import Share
from scan2bim.evaluate.reliability import BINS, pooled
from scan2bim.evaluate.report import Evaluation

Column = tuple[str, Callable[[SceneScore], float | None], int]
Own = Callable[[Evaluation], float | None]


def own(value: Own, times: float = 1.0) -> Callable[[SceneScore], float | None]:
    """A figure of our own measures."""

    def scaled(s: SceneScore) -> float | None:
        found = None if s.own is None else value(s.own)
        return None if found is None else times * found

    return scaled


def corner(kind: Literal["space", "plan"], number: int) -> Callable[[SceneScore], float | None]:
    """F1 of wall corners within a distance, by its number."""
    return own(lambda e: f[number].f1 if (f := e.boxes.space if kind == "space" else e.boxes.plan) else None)


def share(of: Callable[[Evaluation], Share]) -> Callable[[SceneScore], float | None]:
    """Right of those stated."""
    return own(lambda e: of(e).right / of(e).stated if of(e).stated else None)


def false_doors_per_wall(s: SceneScore) -> float | None:
    """Predicted doors that stand where there is none, over predicted walls."""
    walls = s.value("walls", "predicted_walls")
    return len(s.score["doors"]["false"]) / walls if walls else None


WALLS: tuple[Column, ...] = (
    ("walls 5 cm compl.", lambda s: s.value("walls", "5cm", "completeness"), 2),
    ("corr.", lambda s: s.value("walls", "5cm", "correctness"), 2),
    ("walls 10 cm compl.", lambda s: s.value("walls", "10cm", "completeness"), 2),
    ("corr.", lambda s: s.value("walls", "10cm", "correctness"), 2),
    ("faces 5 cm compl.", lambda s: s.value("walls", "faces", "5cm", "completeness"), 2),
    ("corr.", lambda s: s.value("walls", "faces", "5cm", "correctness"), 2),
    ("spaces F1", lambda s: s.value("spaces", "f1"), 2),
    ("either", lambda s: s.value("spaces_either", "f1"), 2),
    ("mean IoU", lambda s: s.value("spaces", "mean_iou_matched"), 2),
    ("storeys F1", lambda s: s.value("storeys", "f1"), 2),
    ("elevation mm", lambda s: s.value("storeys", "elevation_error_mm"), 0),
)
SIZES: tuple[Column, ...] = (
    ("faces off mm", own(lambda e: e.faces.position_error, 1000), 1),
    ("thickness off mm", own(lambda e: e.faces.thickness_error, 1000), 1),
    ("space area off %", own(lambda e: e.spaces.area_share, 100), 1),
    ("space height off mm", own(lambda e: e.spaces.height_error, 1000), 0),
    ("columns F1", lambda s: s.value("columns", "f1"), 2),
    ("stairs recall", lambda s: s.value("stairs", "recall"), 2),
    ("precision", lambda s: s.value("stairs", "precision"), 2),
)
CORNERS: tuple[Column, ...] = (
    *((f"corners {100 * d:.0f} cm F1", corner("space", i), 2) for i, d in enumerate(WITHIN)),
    ("IoU", own(lambda e: e.boxes.iou), 2),
    *((f"in plan {100 * d:.0f} cm F1", corner("plan", i), 2) for i, d in enumerate(WITHIN)),
    ("IoU", own(lambda e: e.boxes.plan_iou), 2),
)
OPENINGS: tuple[Column, ...] = (
    ("open doors recall", lambda s: s.open_doors.recall, 2),
    ("precision", lambda s: s.open_doors.precision, 2),
    ("F1", lambda s: s.open_doors.f1, 2),
    ("closed doors recall", lambda s: s.value("doors", "closed", "recall"), 2),
    ("all doors F1", lambda s: s.value("doors", "f1"), 2),
    ("windows F1", lambda s: s.value("windows", "f1"), 2),
    ("hosted", lambda s: s.value("hosting", "share"), 2),
)
LEAVES: tuple[Column, ...] = (
    ("doors: width off mm", own(lambda e: e.doors.errors.width if e.doors.errors else None, 1000), 0),
    ("height", own(lambda e: e.doors.errors.height if e.doors.errors else None, 1000), 0),
    ("windows: width off mm", own(lambda e: e.windows.errors.width if e.windows.errors else None, 1000), 0),
    ("height", own(lambda e: e.windows.errors.height if e.windows.errors else None, 1000), 0),
    ("state right", share(lambda e: e.doors.state), 2),
    ("hinge right", share(lambda e: e.doors.hinge), 2),
    ("swing right", share(lambda e: e.doors.swing), 2),
    ("angle off deg", own(lambda e: e.doors.angle_error, 180 / math.pi), 1),
    ("false doors per wall", false_doors_per_wall, 2),
)


@dataclass(frozen=True, slots=True)
class Aim:
    """A value that the mean over the scenes, or with ``worst`` each scene, is to reach: at least it, or at most."""

    name: str
    column: Column
    value: float
    least: bool = True
    worst: bool = False


FOUR = ("5 cm completeness", "5 cm correctness", "10 cm completeness", "10 cm correctness")
AIMS = (
    Aim("walls 10 cm completeness", WALLS[2], 0.95),
    Aim("walls 10 cm correctness", WALLS[3], 0.95),
    Aim("walls 5 cm completeness", WALLS[0], 0.90),
    Aim("walls 5 cm correctness", WALLS[1], 0.90),
    *(Aim(f"walls {name}, worst scene", WALLS[i], 0.88, worst=True) for i, name in enumerate(FOUR)),
    Aim("faces off, mm", SIZES[0], 8.0, least=False),
    Aim("thickness off, mm", SIZES[1], 10.0, least=False),
    Aim("spaces F1", WALLS[6], 0.95),
    Aim("spaces mean IoU", WALLS[8], 0.93),
    Aim("space area off, %", SIZES[2], 2.0, least=False),
    Aim("storeys F1", WALLS[9], 1.0),
    Aim("storey elevation off, mm", WALLS[10], 10.0, least=False),
    Aim("columns F1", SIZES[4], 0.9),
    Aim("stairs recall", SIZES[5], 1.0),
    Aim("open doors F1", OPENINGS[2], 0.92),
    Aim("closed doors recall", OPENINGS[3], 0.92),
    Aim("all doors F1", OPENINGS[4], 0.95),
    Aim("windows F1", OPENINGS[5], 0.9),
    Aim("doors' width off, mm", LEAVES[0], 15.0, least=False),
    Aim("doors' height off, mm", LEAVES[1], 15.0, least=False),
    Aim("windows' width off, mm", LEAVES[2], 15.0, least=False),
    Aim("windows' height off, mm", LEAVES[3], 15.0, least=False),
    Aim("state right", LEAVES[4], 0.97),
    Aim("hinge right", LEAVES[5], 0.9),
    Aim("swing right", LEAVES[6], 0.9),
    Aim("false doors per wall", LEAVES[8], 0.05, least=False),
)
"""What the project wants to reach, as means over the scenes."""
MEASURES = """\
- Walls: share of the centre lines that were scanned which the model has within 5 or 10 cm (completeness), share of
  the model's that are in the building (correctness). Faces: the same for the sides of walls that were scanned, so
  that a wall of which one side was seen counts for that side.
- Spaces: right with an IoU of at least 0.7 in plan. *either*: rooms without a wall between them may come as one.
  *mean IoU*: of the right ones.
- Storeys: right within 0.5 m; *elevation* is the mean error of the right ones.
- Doors, windows: right with an IoU of at least 0.5 in the wall's plane, within 0.25 m of it.
- Open doors: recall is the share of the open doors that were found; precision is found / (found + false), where false
  is any predicted door that stands where there is none. A predicted door that is a closed one counts neither way here.
- *hosted*: share of doors and windows in an opening of a wall.
- *faces off*, *thickness off*: medians over places each 5 cm along true faces that look into rooms, of the distance to
  the model's face, and of the wall's thickness where it has rooms on both sides. *space area*, *height off*: medians
  over the right spaces.
- Columns, stairs: by the scorer, at an IoU of 0.3 in plan or middles within 0.25 m (stairs 0.5 m); a dash where a scene
  has none and none is claimed.
- Corners: the CV4AEC challenge's measures, storey by storey: the eight corners of the walls' boxes in pairs of least
  total distance, F1 within 5, 10 and 20 cm; mean IoU of the boxes of true walls in the assignment of the greatest sum.
  With Euclidean distances, true wall normals and whole heights, where the challenge's published code measures along x
  alone, sets corners of oblique walls off their normals and halves heights. Ours: ends that lie in another wall are
  drawn to its axis on both sides, and *in plan* leaves heights out: true walls reach into slabs and roofs, a
  model from scans ends at floor and ceiling.
- Doors and windows, *off*: medians over the found ones. *state*, *hinge*, *swing*: right ones of those that are stated.
- Confidence: of all scenes together. *said* is the mean confidence, *right* the share that is right: doors and windows
  by their IoU, walls if 70 % of what they show to rooms is within 5 cm of a true face.
- CPU: user and system seconds of all processes. Memory: the greatest sum of what all processes held at one time,
  shared pages counted for each."""


def scene_tables(scores: Sequence[SceneScore], scans: str) -> str:
    """Walls, spaces and storeys; openings and cost; means."""
    return "\n\n".join(
        [
            f"Scenes: laser scans simulated in models of real buildings, with exact truth; input {scans.upper()}, all "
            "settings at their defaults.",
            MEASURES,
            _scored(scores, WALLS),
            _scored(scores, SIZES),
            _scored(scores, CORNERS),
            _scored(scores, OPENINGS),
            _scored(scores, LEAVES),
            _pooled(scores),
            confidences([s.own for s in scores if s.own is not None]),
            _aims(scores),
            _costs(scores),
        ]
    )


def _scored(scores: Sequence[SceneScore], columns: Sequence[Column]) -> str:
    rows = [[s.conversion.name, *(number(value(s), digits) for _, value, digits in columns)] for s in scores]
    rows.append(["**mean**", *(number(mean(value(s) for s in scores), digits) for _, value, digits in columns)])
    return table(["scene", *(head for head, _, _ in columns)], rows)


def _aims(scores: Sequence[SceneScore]) -> str:
    """What is wanted beside what is reached."""
    rows: list[list[str]] = []
    for aim in AIMS:
        _, value, digits = aim.column
        values = [v for s in scores if (v := value(s)) is not None]
        if not values:
            continue
        worst = min(values) if aim.least else max(values)
        average = sum(values) / len(values)
        reached = worst if aim.worst else average
        met = reached >= aim.value if aim.least else reached <= aim.value
        wanted = f"{'≥' if aim.least else '≤'} {aim.value:g}"
        rows.append([aim.name, wanted, number(average, digits), number(worst, digits), "yes" if met else "**no**"])
    return "Aims, as means over the scenes:\n\n" + table(["", "aim", "mean", "worst scene", "met"], rows)


def confidences(found: Sequence[Evaluation]) -> str:
    """Reliability of all models' elements together."""
    kinds = (
        ("walls", pooled([e.wall_reliability for e in found])),
        ("doors", pooled([e.doors.reliability for e in found])),
        ("windows", pooled([e.windows.reliability for e in found])),
    )
    known = [(name, one) for name, one in kinds if one is not None]
    rows: list[list[str]] = []
    for low in sorted({b.low for _, one in known for b in one.bins}):
        row = [f"{low:.1f} to {low + 1 / BINS:.1f}"]
        for _, one in known:
            b = next((b for b in one.bins if b.low == low), None)
            row += ["0", "–", "–"] if b is None else [str(b.count), f"{b.confidence:.2f}", f"{b.right:.2f}"]
        rows.append(row)
    errors = ", ".join(f"{name} {one.expected_calibration_error:.3f}" for name, one in known)
    head = ["confidence", *(h for name, _ in known for h in (name, "said", "right"))]
    return f"{table(head, rows)}\n\nExpected calibration error: {errors}."


def _pooled(scores: Sequence[SceneScore]) -> str:
    """All open doors of all scenes as one, since some scenes have few or none."""
    doors = [s.open_doors for s in scores]
    found, truth, false = sum(d.found for d in doors), sum(d.truth for d in doors), sum(d.false for d in doors)
    f1 = 2 * found / (found + truth + false) if truth else None
    return f"Open doors of all scenes together: {found} of {truth} found, {false} false, F1 {number(f1)}."


def _costs(scores: Sequence[SceneScore]) -> str:
    rows = [
        [s.conversion.name, f"{s.points / 1e6:.1f}", str(s.conversion.cost.code), *_cost(s.conversion.cost.seconds, s)]
        for s in scores
    ]
    return table(["scene", "points M", "exit code", "seconds", "CPU s", "memory MB"], rows)


def _cost(seconds: float, s: SceneScore) -> list[str]:
    return [f"{seconds:.0f}", f"{s.conversion.cost.cpu:.1f}", f"{s.conversion.cost.memory / 1e6:.0f}"]
