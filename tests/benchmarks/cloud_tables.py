"""The words and tables of docs/results.md that tell how right the models of real clouds are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clouds import KINDS, LICENSED, NEAR, CloudResult
from document import ROOT, table

REMARKS = ROOT / "docs" / "real_remarks.md"
CLOUDS = f"""\
Real clouds have no exact truth. The second table sets what was found beside what somebody counted by eye in slices of
the scan; *in* means within the range seen. Openings are doors and passages. A listed opening is at its place if the
model has one whose middle is within {NEAR} m."""


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
