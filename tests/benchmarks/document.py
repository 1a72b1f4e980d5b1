"""docs/results.md: a frame of words, and sections that commands write between marks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "docs" / "results.md"
EMPTY = """# Results

Made by `./run results`, `cost`, `exports`, `edits`, `own`, `experiments`, `made-up` and `ablation`: each writes its own
section and leaves the others as they are. Only what is said to be wrong in real clouds is written by hand, in
[real_remarks.md](real_remarks.md).

<!-- results: begin -->
<!-- results: end -->

<!-- cost: begin -->
<!-- cost: end -->
"""


def write_section(name: str, text: str, path: Path = RESULTS) -> None:
    """Replace what stands between the marks of a section; a file without them gets the frame first."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    whole = path.read_text(encoding="utf-8") if path.exists() else EMPTY
    if begin not in whole or end not in whole:
        whole = f"{whole.rstrip()}\n\n{begin}\n{end}\n"
    before, _, rest = whole.partition(begin)
    _, _, after = rest.partition(end)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{before}{begin}\n{text.strip()}\n{end}{after}", encoding="utf-8")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [list(head), ["---"] * len(head), *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def number(value: float | None, digits: int = 2) -> str:
    """A number with so many digits after the point; a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"


def mean(values: Iterable[float | None]) -> float | None:
    """The mean of those that are there."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None
