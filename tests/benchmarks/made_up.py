"""Convert many made-up buildings, of which nobody has seen one before, and write how right the models are.

    ./run made-up [--count N] [--first SEED] [--scenes DIR] [--keep] [--print]

Each seed gives a random plan of usual dimensions (``made_up_plans``), drawn as IFC, scanned by ``scan2bim simulate``
with furniture, doors open and closed, noise and errors of registration of its own, converted with default settings and
scored with ``scan2bim evaluate``. With --print nothing is written to docs.
"""

from __future__ import annotations

import argparse
import math
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from conversion import convert
from document import ROOT, mean, number, table, write_section
from made_up_ifc import write_ifc
from made_up_plans import make_building
from scene_tables import confidences

from scan2bim.evaluate.report import Evaluation, evaluate
from scan2bim.simulate.appearance import Camera
from scan2bim.simulate.job import Wanted, simulate
from scan2bim.simulate.scanner import ScannerSpec

OUT = ROOT / "out" / "made_up"
STEP = 0.4
"""Degrees between rays: about 300 000 points a station."""
INTRODUCTION = """\
## Made-up buildings

`./run made-up`: {count} buildings with seeds from {first} on: random plans of usual dimensions (one to three storeys;
rectangles, L, U and cut corners; corridors, walls askew, passages, stairs, columns, lowered ceilings), scanned by
`scan2bim simulate` with furniture and people before a share of the walls (*hidden*), doors open and closed, and noise
and errors of registration as the table says. All as `scan2bim evaluate` measures it; settings at their defaults."""


@dataclass(frozen=True, slots=True)
class Run:
    """A building's conversion. scores: None where it failed. noise, registration: millimetres."""

    seed: int
    points: int
    noise: float
    registration: float
    clutter: float
    complaint: str
    scores: Evaluation | None


Value = Callable[[Evaluation], float | None]
COLUMNS: tuple[tuple[str, int, Value], ...] = (
    ("walls 5 cm compl.", 2, lambda e: e.walls.completeness_5cm),
    ("corr.", 2, lambda e: e.walls.correctness_5cm),
    ("walls 10 cm compl.", 2, lambda e: e.walls.completeness_10cm),
    ("corr.", 2, lambda e: e.walls.correctness_10cm),
    ("spaces F1", 2, lambda e: e.spaces.detection.f1),
    ("storeys F1", 2, lambda e: e.storeys.detection.f1),
    ("open doors recall", 2, lambda e: e.doors.open.recall),
    ("closed doors recall", 2, lambda e: e.doors.closed.recall),
    ("doors F1", 2, lambda e: e.doors.at_50.f1),
    ("windows F1", 2, lambda e: e.windows.at_50.f1),
    ("doors' width off mm", 0, lambda e: None if e.doors.errors is None else 1000 * e.doors.errors.width),
    ("height", 0, lambda e: None if e.doors.errors is None else 1000 * e.doors.errors.height),
)


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a conversion failed."""
    options = parse(arguments)
    runs = [run(seed, options.scenes, options.keep) for seed in range(options.first, options.first + options.count)]
    text = report(runs, options.first)
    if not options.print:
        write_section("made-up", text)
    print(text)
    return int(any(one.scores is None for one in runs))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="of buildings (default 20)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first building (default 1)")
    parser.add_argument("--scenes", type=Path, default=OUT / "scans", help="where scans lie or are made")
    parser.add_argument("--keep", action="store_true", help="keep the scans and work folders, some 200 MB a building")
    parser.add_argument("--print", action="store_true", help="leave docs/results.md as it is")
    return parser.parse_args(arguments)


def run(seed: int, scenes: Path, keep: bool) -> Run:
    """Make, scan, convert and score one building."""
    rng = np.random.default_rng([seed, 3])
    noise, registration, clutter = float(rng.uniform(1, 6)), float(rng.uniform(0, 4)), float(rng.uniform(0.05, 0.3))
    folder = scenes / f"building_{seed:04d}"
    if not (folder / "truth.json").exists():
        scan(seed, folder, Wanted(None, "mixed", clutter, seed, scanner(noise, registration)), rng)
    done = convert(folder.name, folder, OUT)
    scores = evaluate(done.ifc, folder / "truth.json") if done.cost.code == 0 else None
    print(f"{done.name}: exit {done.cost.code} {done.complaint}", file=sys.stderr, flush=True)
    if not keep:
        shutil.rmtree(folder)
        shutil.rmtree(done.work, ignore_errors=True)
    return Run(seed, done.points, noise, registration, clutter, done.complaint, scores)


def scan(seed: int, folder: Path, wanted: Wanted, rng: np.random.Generator) -> None:
    """Draw the building and scan it. The truth is written last, so that what was cut off is begun anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    model = folder / "model.ifc"
    write_ifc(make_building(seed), model, rng)
    simulate(model, folder, wanted, lambda _: None)


def scanner(noise: float, registration: float) -> ScannerSpec:
    """A usual scanner with these errors, millimetres: its angles are off by another millimetre at 20 m for each."""
    return ScannerSpec(
        step=math.radians(STEP),
        noise=noise / 1000,
        registration=registration / 1000,
        registration_turn=math.radians(0.003) * registration,
        growth=1.0,
        mixed=0.2,
        dropout=0.002,
        camera=Camera(exposure=0.05, tint=0.015, lighting=0.06, drift=0.025, noise=4.0),
    )


def report(runs: Sequence[Run], first: int) -> str:
    """The section."""
    scored = [(one, one.scores) for one in runs if one.scores is not None]
    head = ["seed", "storeys", "spaces", "points M", "noise mm", "registration mm", "hidden", *(c[0] for c in COLUMNS)]
    rows = [
        [
            str(one.seed),
            str(scores.storeys.detection.true),
            str(scores.spaces.detection.true),
            f"{one.points / 1e6:.1f}",
            number(one.noise, 1),
            number(one.registration, 1),
            f"{one.clutter:.0%}",
            *(number(value(scores), digits) for _, digits, value in COLUMNS),
        ]
        for one, scores in scored
    ]
    means = [number(mean(value(scores) for _, scores in scored), digits) for _, digits, value in COLUMNS]
    rows.append(["**mean**", *[""] * 6, *means])
    failed = [f"Seed {one.seed} failed: {one.complaint}" for one in runs if one.scores is None]
    parts = [INTRODUCTION.format(count=len(runs), first=first), table(head, rows), *failed]
    if scored:
        parts.append(confidences([scores for _, scores in scored]))
    return "\n\n".join(parts)


if __name__ == "__main__":
    sys.exit(main())
