"""The words and tables of docs/results.md that tell how right the models are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bench import SceneScore
from clouds import KINDS, LICENSED, NEAR, CloudResult
from document import ROOT, mean, number, table

REMARKS = ROOT / "docs" / "real_remarks.md"
Column = tuple[str, Callable[[SceneScore], float | None], int]
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
OPENINGS: tuple[Column, ...] = (
    ("open doors recall", lambda s: s.open_doors.recall, 2),
    ("precision", lambda s: s.open_doors.precision, 2),
    ("F1", lambda s: s.open_doors.f1, 2),
    ("closed doors recall", lambda s: s.value("doors", "closed", "recall"), 2),
    ("all doors F1", lambda s: s.value("doors", "f1"), 2),
    ("windows F1", lambda s: s.value("windows", "f1"), 2),
    ("hosted", lambda s: s.value("hosting", "share"), 2),
)
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
- CPU: user and system seconds of all processes. Memory: the greatest sum of what all processes held at one time,
  shared pages counted for each."""

CLOUDS = f"""\
Real clouds have no exact truth. The second table sets what was found beside what somebody counted by eye in slices of
the scan; *in* means within the range seen. Openings are doors and passages. A listed opening is at its place if the
model has one whose middle is within {NEAR} m."""


def scene_tables(scores: Sequence[SceneScore], scans: str) -> str:
    """Walls, spaces and storeys; openings and cost; means."""
    pooled = _pooled(scores)
    return "\n\n".join(
        [
            f"Scenes: laser scans simulated in models of real buildings, with exact truth; input {scans.upper()}, all "
            "settings at their defaults.",
            MEASURES,
            _scored(scores, WALLS),
            _scored(scores, OPENINGS),
            pooled,
            _costs(scores),
        ]
    )


def _scored(scores: Sequence[SceneScore], columns: Sequence[Column]) -> str:
    rows = [[s.conversion.name, *(number(value(s), digits) for _, value, digits in columns)] for s in scores]
    rows.append(["**mean**", *(number(mean(value(s) for s in scores), digits) for _, value, digits in columns)])
    return table(["scene", *(head for head, _, _ in columns)], rows)


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


def cloud_tables(results: Sequence[CloudResult]) -> str:
    """What was found in real clouds, and how it stands to what was seen by eye."""
    head = ["cloud", "points M", "exit", "storeys", "spaces", "walls", "doors", "of them open", "windows", "passages"]
    rows = [_cloud_row(result) for result in results]
    return "\n\n".join(
        [CLOUDS, table([*head, "seconds", "CPU s", "memory MB"], rows), table(["cloud", "by eye"], _by_eye(results))]
    )


def _cloud_row(result: CloudResult) -> list[str]:
    c = result.conversion
    counts = [c.count(*kinds) for kinds in (KINDS["rooms"], KINDS["walls"], KINDS["doors"])]
    more = [c.count("doors_open"), c.count("windows"), c.count("passages")]
    done = [str(len(c.outcome.get("storeys", []))), *map(str, counts + more)] if c.cost.code == 0 else ["–"] * 7
    points = f"{c.points / 1e6:.2f}" if c.points else "–"
    return [
        c.name,
        points,
        str(c.cost.code),
        *done,
        f"{c.cost.seconds:.0f}",
        f"{c.cost.cpu:.1f}",
        f"{c.cost.memory / 1e6:.0f}",
    ]


def _by_eye(results: Sequence[CloudResult]) -> list[list[str]]:
    return [[r.name, "; ".join(_against(r)) or "nothing counted"] for r in results if r.conversion.cost.code == 0]


def _against(result: CloudResult) -> list[str]:
    """Each count beside the range seen by eye, and how many of the listed openings are there."""
    texts: list[str] = []
    for kind, seen in result.rough.counts.items():
        storeys = len(result.conversion.outcome.get("storeys", []))
        came = storeys if kind == "storeys" else result.conversion.count(*KINDS[kind])
        verdict = "in" if seen.least <= came <= seen.most else "below" if came < seen.least else "above"
        texts.append(f"{kind} {came} of {seen} ({verdict})")
    texts += [f"{met} of {len(one.places)} listed {one.what} at their places" for one, met in result.found]
    return texts


def cloud_pages(results: Sequence[CloudResult], pictures: dict[str, list[Path]]) -> str:
    """For each cloud what is wrong, by hand, and its pictures where its licence allows."""
    remarks = read_remarks()
    return "\n\n".join(part for result in results for part in _page(result, remarks, pictures.get(result.name, [])))


def _page(result: CloudResult, remarks: dict[str, str], pictures: Sequence[Path]) -> list[str]:
    text = remarks.get(result.name, "Not looked at yet.")
    if result.conversion.complaint:
        text = f"Refused with exit code {result.conversion.cost.code}: {result.conversion.complaint}\n\n{text}"
    parts = [f"### {result.name}", text]
    if result.name in LICENSED:
        parts += [f"![{path.stem}](img/{path.name})" for path in pictures]
        parts.append(f"Scan: {LICENSED[result.name]}.")
    return parts


def read_remarks(path: Path = REMARKS) -> dict[str, str]:
    """What was written by hand: the text under each second-level heading, by the heading."""
    if not path.exists():
        return {}
    parts = path.read_text(encoding="utf-8").split("\n## ")[1:]
    return {head.strip(): text.strip() for head, _, text in (part.partition("\n") for part in parts)}
