"""Repeat the founding paper's simulated experiments over many variants, and write Table I and figure 7 beside ours.

    ./run experiments [--variants N] [--first SEED] [--scenes DIR] [--only office|hall|sweep] [--keep]

Scenes of samples/make_experiments.py are made where they are missing, converted with all evidence and with the paper's
method alone (openings.method = "paper"), and scored with ``scan2bim evaluate``. With --only nothing is written to docs.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "samples"))

from conversion import convert
from document import ROOT, mean, number, table, write_section
from figures import Axis, Series, write_diagram
from make_experiments import KINDS, make

from scan2bim.config import load_settings
from scan2bim.errors import Scan2BimError
from scan2bim.evaluate.areas import BETAS, f_beta
from scan2bim.evaluate.openings import FoundOpening
from scan2bim.evaluate.report import Evaluation, evaluate
from scan2bim.simulate.cases import CASES

OUT = ROOT / "out" / "experiments"
IMAGES = ROOT / "docs" / "img"
METHODS = ("full", "paper")
STEP = 0.1
"""Of the sweep's bins of hidden outline."""
PAPER_TABLE = (
    ("wall 1 door 1", 0.9930, 0.9957, 0.0375, 0.0113),
    ("wall 2 door 1", 1.0000, 0.9888, 0.0376, 0.0114),
    ("wall 3 door 1", 1.0000, 0.9917, 0.0370, 0.0084),
    ("wall 4 door 1", 1.0000, 0.9849, 0.0570, 0.0153),
    ("wall 5 door 1", 1.0000, 0.8771, 0.4052, 0.1402),
    ("wall 5 door 2", 1.0000, 0.8604, 0.4660, 0.1623),
    ("wall 6 door 1", 0.9897, 0.9951, 0.0301, 0.0151),
    ("wall 7 door 1", 0.9938, 0.9918, 0.0562, 0.0144),
    ("wall 8 door 1", 0.9912, 0.9949, 0.0309, 0.0139),
    ("wall 8 door 2", 1.0000, 0.9760, 0.0527, 0.0245),
    ("wall 9 door 1", 1.0000, 0.9818, 0.0624, 0.0185),
    ("wall 9 door 2", 0.9587, 0.9959, 0.1321, 0.0453),
    ("wall 9 door 3", 0.9853, 1.0000, 0.0241, 0.0147),
    ("wall 10 door 1", 1.0000, 0.9815, 0.0430, 0.0188),
    ("wall 10 door 2", 1.0000, 0.9581, 0.0961, 0.0437),
    ("wall 11 door 1", 1.0000, 0.9863, 0.0316, 0.0138),
    ("wall 11 door 2", 1.0000, 0.9863, 0.0315, 0.0139),
    ("wall 12 door 1", 0.9945, 0.9952, 0.0388, 0.0103),
)
"""The paper's Table I: area precision and recall, absolute (m2) and relative error of each door of its real hall."""
PAPER_OFFICE = (0.979, 0.949, 0.259, 0.081)
PAPER_HALL = (0.9948, 0.9745, 0.0928, 0.0331)
INTRODUCTION = """\
## The paper's experiments

`./run experiments`: the simulated office and the hall of the founding paper in our own modelling, {variants} variants
of each with seeds from {first} on, and a sweep of {cases} rooms. *full* uses all evidence, *paper* the paper's method
alone. The paper's office was simulated by its authors, its hall was real; its figures stand beside ours, not on the
same scans. Precision, recall and errors are of the areas of found doors, by the paper's equations (1) to (5)."""
ABSENT = 'This version has no `openings.method = "paper"` yet: the paper\'s method alone was not run.'


@dataclass(frozen=True, slots=True)
class Run:
    """A variant converted by a method; ``scores`` is None where the conversion failed."""

    kind: str
    seed: int
    method: str
    scores: Evaluation | None
    complaint: str


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a conversion failed."""
    options = parse(arguments)
    methods = [method for method in METHODS if method == "full" or has_method(method)]
    runs: list[Run] = []
    for kind in options.only or list(KINDS):
        seeds = range(CASES) if kind == "sweep" else range(options.first, options.first + options.variants)
        for seed in seeds:
            scans = make(kind, seed, options.scenes)
            runs += [score(kind, seed, scans, method) for method in methods]
            if not options.keep:
                shutil.rmtree(scans)
    text = report(runs, options.variants, options.first)
    if options.only is None:
        write_section("experiments", text)
    print(text)
    return int(any(run.scores is None for run in runs))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=10, help="of office and hall (default 10)")
    parser.add_argument("--first", type=int, default=101, help="seed of the first variant (default 101)")
    parser.add_argument("--scenes", type=Path, default=OUT / "scans", help="where scans lie or are made")
    parser.add_argument("--only", choices=sorted(KINDS), action="append", help="just this kind; may be given again")
    parser.add_argument("--keep", action="store_true", help="keep the scans, some 150 MB a variant")
    return parser.parse_args(arguments)


def has_method(method: str) -> bool:
    """Whether this version knows a method."""
    try:
        load_settings(_settings(method), {})
    except Scan2BimError:
        return False
    return True


def _settings(method: str) -> Path:
    path = OUT / f"{method}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'[openings]\nmethod = "{method}"\n', encoding="utf-8")
    return path


def score(kind: str, seed: int, scans: Path, method: str) -> Run:
    """Convert one variant by a method, and score it."""
    done = convert(f"{scans.name}_{method}", scans, OUT, _settings(method))
    shutil.rmtree(done.work, ignore_errors=True)
    scores = evaluate(done.ifc, scans / "truth.json") if done.cost.code == 0 else None
    print(f"{done.name}: exit {done.cost.code} {done.complaint}", file=sys.stderr, flush=True)
    return Run(kind, seed, method, scores, done.complaint)


def report(runs: Sequence[Run], variants: int, first: int) -> str:
    """The section."""
    parts = [INTRODUCTION.format(variants=variants, first=first, cases=CASES)]
    if all(run.method == "full" for run in runs):
        parts.append(ABSENT)
    parts += [_means(runs), _table_one(runs), _figure_seven(runs), _sweep(runs)]
    failed = [f"{run.kind} {run.seed} ({run.method}): {run.complaint}" for run in runs if run.scores is None]
    return "\n\n".join(part for part in [*parts, *failed] if part)


def of(runs: Sequence[Run], kind: str, method: str) -> list[Evaluation]:
    """The scores of one kind by one method."""
    return [run.scores for run in runs if run.kind == kind and run.method == method and run.scores is not None]


def doors_of(scores: Sequence[Evaluation]) -> list[FoundOpening]:
    """All true doors of several models."""
    return [door for one in scores for door in one.doors.each]


def _means(runs: Sequence[Run]) -> str:
    """Each kind by each method, pooled over the variants."""
    head = ["", "variants", "doors found", "false", "precision", "recall", "F 1", "abs. error m²", "rel. error"]
    rows = [
        ["office, the paper", "1", "6 of 6", "–", *_numbers(PAPER_OFFICE, 0.988)],
        ["hall, the paper (real)", "1", "18 of 18", "–", *_numbers(PAPER_HALL, None)],
    ]
    for kind in ("office", "hall"):
        for method in METHODS:
            found = of(runs, kind, method)
            if found:
                rows.append([f"{kind}, {method}", str(len(found)), *_pooled(found)])
    lines = [table([*head, "windows found", "false"], [[*row, *["–"] * (11 - len(row))] for row in rows])]
    full = {kind: of(runs, kind, "full") for kind in ("office", "hall")}
    for kind, scores in full.items():
        whole = sum(one.doors.at_50.found == one.doors.at_50.true and not one.doors.false for one in scores)
        if scores:
            lines.append(f"{kind.capitalize()}: all doors found and none false in {whole} of {len(scores)} variants.")
    return "\n\n".join(lines)


def _numbers(values: tuple[float, float, float, float], f1: float | None) -> list[str]:
    precision, recall, absolute, relative = values
    return [number(precision, 4), number(recall, 4), number(f1, 3), number(absolute, 3), number(relative, 4)]


def _pooled(found: Sequence[Evaluation]) -> list[str]:
    doors = doors_of(found)
    hit = [door.measures for door in doors if door.measures is not None]
    values = [
        mean(m.precision for m in hit),
        mean(m.recall for m in hit),
        mean(f_beta(m.precision, m.recall, 1.0) for m in hit),
    ]
    errors = [mean(m.absolute_error for m in hit), mean(m.relative_error for m in hit)]
    windows = [one.windows.at_50 for one in found]
    return [
        f"{len(hit)} of {len(doors)}",
        str(sum(len(one.doors.false) for one in found)),
        *(number(value, 4) for value in values),
        number(errors[0], 3),
        number(errors[1], 4),
        f"{sum(w.found for w in windows)} of {sum(w.true for w in windows)}",
        str(sum(len(one.windows.false) for one in found)),
    ]


def _table_one(runs: Sequence[Run]) -> str:
    """The paper's table, and for the doors of the same sizes in our hall the means over the variants."""
    methods = [method for method in METHODS if of(runs, "hall", method)]
    if not methods:
        return ""
    head = ["door", "paper: precision", "recall", "abs. error m²", "rel. error"]
    for method in methods:
        head += [f"{method}: found", "precision", "recall", "abs. error m²", "rel. error"]
    rows: list[list[str]] = []
    for name, *values in PAPER_TABLE:
        row = [name, *(number(value, 4) for value in values)]
        for method in methods:
            mine = [door for door in doors_of(of(runs, "hall", method)) if door.name == name]
            hit = [door.measures for door in mine if door.measures is not None]
            row += [f"{len(hit)} of {len(mine)}"]
            row += [number(mean(m.precision for m in hit), 4), number(mean(m.recall for m in hit), 4)]
            row += [number(mean(m.absolute_error for m in hit), 4), number(mean(m.relative_error for m in hit), 4)]
        rows.append(row)
    return "Table I: each door of the hall, and of ours those made of the same sizes.\n\n" + table(head, rows)


def _figure_seven(runs: Sequence[Run]) -> str:
    """Precision over recall of the office's doors, and the F-measure over beta."""
    methods = [method for method in METHODS if of(runs, "office", method)]
    if not methods:
        return ""
    scatter, curves = list[Series](), list[Series]()
    for method in methods:
        hit = [d.measures for d in doors_of(of(runs, "office", method)) if d.measures is not None]
        scatter.append(Series(method, [(m.precision, m.recall) for m in hit], joined=False))
        curve = [(beta, mean(f_beta(m.precision, m.recall, beta) for m in hit) or 0.0) for beta in BETAS]
        curves.append(Series(method, curve))
    scatter.append(Series("the paper's mean", [PAPER_OFFICE[:2]], joined=False))
    curves.append(Series("from the paper's means", [(b, f_beta(*PAPER_OFFICE[:2], b)) for b in BETAS]))
    write_diagram(IMAGES / "experiments_7b.svg", Axis("precision", 0.8, 1.0), Axis("recall", 0.8, 1.0), scatter)
    write_diagram(IMAGES / "experiments_7c.svg", Axis("beta", 0.0, 3.0), Axis("F", 0.9, 1.0), curves)
    return (
        "Figure 7, b and c: the office's doors.\n\n![precision and recall](img/experiments_7b.svg) "
        "![F over beta](img/experiments_7c.svg)"
    )


def _sweep(runs: Sequence[Run]) -> str:
    """Recall and area precision over the hidden share of the door's outline."""
    methods = [method for method in METHODS if of(runs, "sweep", method)]
    if not methods:
        return ""
    head, rows = ["hidden outline", "doors"], list[list[str]]()
    recalls: dict[str, list[tuple[float, float]]] = {method: [] for method in methods}
    precisions: dict[str, list[tuple[float, float]]] = {method: [] for method in methods}
    for low in [STEP * i for i in range(8)]:
        row = [f"{low:.0%} to {low + STEP:.0%}"]
        for method in methods:
            inside = [
                d
                for d in doors_of(of(runs, "sweep", method))
                if d.occlusion is not None and low <= d.occlusion < low + STEP
            ]
            hit = [d.measures for d in inside if d.measures is not None]
            if method == methods[0]:
                row.append(str(len(inside)))
            precision = mean(m.precision for m in hit)
            row += [str(len(hit)), number(precision, 4), number(mean(m.recall for m in hit), 4)]
            if inside:
                recalls[method].append((low + STEP / 2, len(hit) / len(inside)))
            if precision is not None:
                precisions[method].append((low + STEP / 2, precision))
        rows.append(row)
    for method in methods:
        head += [f"{method}: found", "area precision", "area recall"]
    x, y = Axis("hidden share of the door's outline", 0.0, 0.8), Axis("", 0.0, 1.0)
    series = [Series(f"{m}: found", recalls[m]) for m in methods]
    series += [Series(f"{m}: area precision", precisions[m]) for m in methods]
    write_diagram(IMAGES / "experiments_sweep.svg", x, y, series)
    lines = ["Sweep: one wall with two closed doors in each room, 0 to 50 % of it hidden.", table(head, rows)]
    for method in methods:
        scores = of(runs, "sweep", method)
        seen = [s.doors.visible for s in scores if s.doors.visible is not None]
        lines.append(
            f"{method}: {sum(v.found for v in seen)} of {sum(v.true for v in seen)} doors with at most 30 % of their "
            f"outline hidden found; {sum(len(s.doors.false) for s in scores)} false doors in {len(scores)} rooms."
        )
    return "\n\n".join([*lines, "![sweep](img/experiments_sweep.svg)"])


if __name__ == "__main__":
    sys.exit(main())
