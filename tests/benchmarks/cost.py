"""Measure what a conversion costs, all in one run, and write the ratios to docs/results.md.

    ./run cost [--largest MILLIONS] [--out DIR] [--keep] [--also NAME=PATH ...]

A building of up to 100 million points is simulated in out/cost (5 GB of disk at most, removed at the end). CPU seconds
are user and system time of all processes of a command, caches of compiled code warm, settings and --jobs at their
defaults.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from conversion import COMMAND, warm_up
from document import ROOT, number, table, write_section
from measure import Cost, measure

OUT = ROOT / "out" / "cost"
SIZES = (2, 4, 10, 20)
"""Flats of the buildings, about 5 million points each."""
LAZ_SIZES = (2, 4)
FLAT_MILLIONS = 5
DISK = 50.0
"""Bytes of disk for each point: the E57 files, the work folder of a conversion, the LAZ files, and some to spare."""
STARTS = 11
"""Times that a start is measured; the median counts."""
SMALL = 25e6
"""Points below which a run is done three times and the median counts: it is short, and noise counts for more."""

INTRODUCTION = """\
## What it costs

`./run cost`: everything measured in one run on one machine. CPU seconds are user and system time of all processes of a
command; compiled code was cached before. *Decoding* is only the loop that decodes the same files: E57 with pye57's
low-level loop and checksums, LAZ with lazrs. Memory is the greatest sum of what all processes held at one time, shared
pages counted for each. The building is a simulated one of equal flats with seven stations each, up to five side by side
on up to four storeys."""


@dataclass(frozen=True, slots=True)
class Compared:
    """A conversion beside the bare decoding of the same files. stages: wall seconds of each."""

    name: str
    points: int
    convert: Cost
    decode: float
    stages: dict[str, float]

    @property
    def ratio(self) -> float:
        """CPU of converting over that of decoding."""
        return self.convert.cpu / self.decode


def main(arguments: list[str] | None = None) -> int:
    """Measure and write."""
    options = parse(arguments)
    sizes = [size for size in SIZES if size * FLAT_MILLIONS <= options.largest]
    check_disk(options.out, max(sizes, default=0))
    shutil.rmtree(options.out, ignore_errors=True)
    options.out.mkdir(parents=True)
    try:
        starts = measure_starts()
        warm_up()
        e57, laz = measure_buildings(sizes, options.out)
        also = [compare(name, [Path(path)], options.out) for name, _, path in (a.partition("=") for a in options.also)]
    finally:
        if not options.keep:
            shutil.rmtree(options.out, ignore_errors=True)
    text = report(e57, laz, also, starts)
    write_section("cost", text)
    print(text)
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=float, default=100, help="millions of points of the largest building")
    parser.add_argument("--out", type=Path, default=OUT, help="where the scans are made (default out/cost)")
    parser.add_argument("--keep", action="store_true", help="keep the scans")
    parser.add_argument("--also", nargs="*", default=[], metavar="NAME=PATH", help="further E57 folders or LAZ files")
    return parser.parse_args(arguments)


def check_disk(folder: Path, flats: int) -> None:
    """Exit where the disk cannot hold it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    free, wanted = shutil.disk_usage(folder.parent).free, DISK * FLAT_MILLIONS * 1e6 * flats
    if free < wanted:
        raise SystemExit(f"{folder}: {wanted / 1e9:.0f} GB of disk are needed, {free / 1e9:.0f} are free. Try --out.")


def measure_starts() -> tuple[float, float]:
    """CPU seconds of ``scan2bim --help`` and of an interpreter that does nothing: medians, taken in turns."""
    script = Path(sys.executable).with_name("scan2bim")
    helping = [script, "--help"] if script.exists() else [*COMMAND[:-1], "--help"]
    pairs = [(measure(helping).cpu, measure([sys.executable, "-c", "pass"]).cpu) for _ in range(STARTS + 1)][1:]
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs)


def measure_buildings(sizes: Sequence[int], folder: Path) -> tuple[list[Compared], list[Compared]]:
    """The buildings as E57 files, growing, and the small ones as LAZ."""
    from tower import flat_sweeps, places, write_flat, write_laz

    sweeps = flat_sweeps()
    e57: list[Compared] = []
    laz: list[Compared] = []
    for flats in sizes:
        here = folder / f"building_{flats}"
        for place in places(flats):
            write_flat(sweeps, place, here / f"flat_{place.above}_{place.along}")
        e57.append(compare(f"{flats} flats", [here], folder))
        shutil.rmtree(here)
        if flats in LAZ_SIZES:
            file = folder / f"building_{flats}.laz"
            write_laz(sweeps, places(flats), file)
            laz.append(compare(f"{flats} flats", [file], folder))
            file.unlink()
    return e57, laz


def compare(name: str, inputs: Sequence[Path], folder: Path) -> Compared:
    """Convert and decode in turns; of several runs the median by CPU."""
    runs: list[tuple[Cost, float]] = []
    points, stages = 0, dict[str, float]()
    while len(runs) < (3 if points < SMALL else 1):
        points, decoded = decode(inputs)
        cost, stages = convert(inputs, folder)
        runs.append((cost, decoded))
        print(f"{name}: {points:,} points, {cost.cpu:.1f} CPU s, decoding {decoded:.1f}", file=sys.stderr, flush=True)
    median = sorted((cost for cost, _ in runs), key=lambda cost: cost.cpu)[len(runs) // 2]
    return Compared(name, points, median, statistics.median(decoded for _, decoded in runs), stages)


def decode(inputs: Sequence[Path]) -> tuple[int, float]:
    """Points, and CPU seconds of decoding them."""
    out = OUT.parent / "decode.json"
    cost = measure([sys.executable, Path(__file__).with_name("decode.py"), *inputs], out=out)
    if cost.code != 0:
        raise SystemExit(f"decoding {inputs[0]} ended with exit code {cost.code}")
    done = json.loads(out.read_text(encoding="utf-8"))
    return int(done["points"]), float(done["cpu"])


def convert(inputs: Sequence[Path], folder: Path) -> tuple[Cost, dict[str, float]]:
    """Cost of converting to IFC from an empty work folder, and wall seconds of its stages."""
    work, out, log = folder / "work", folder / "outcome.json", folder / "log.txt"
    shutil.rmtree(work, ignore_errors=True)
    cost = measure([*COMMAND, *inputs, "-o", folder / "out.ifc", "--work", work, "--json"], out=out, log=log)
    shutil.rmtree(work, ignore_errors=True)
    if cost.code != 0:
        raise SystemExit(f"converting {inputs[0]} ended with exit code {cost.code}: {log.read_text()[-500:]}")
    stages = json.loads(out.read_text(encoding="utf-8"))["stages"]
    return cost, {stage["stage"]: float(stage["seconds"]) for stage in stages}


def report(
    e57: Sequence[Compared], laz: Sequence[Compared], also: Sequence[Compared], starts: tuple[float, float]
) -> str:
    """The section."""
    return "\n\n".join(
        [
            INTRODUCTION,
            _verdicts(e57, laz, starts),
            _compared(e57, laz, also),
            _stages([*e57, *laz, *also]),
        ]
    )


def _verdicts(e57: Sequence[Compared], laz: Sequence[Compared], starts: tuple[float, float]) -> str:
    rows: list[list[str]] = []
    if e57:
        rows.append(_row("CPU of `convert` over decoding, E57, largest building", e57[-1].ratio, 3.0))
        rows.append(_row("the same, worst size", max(one.ratio for one in e57), 3.0))
    if laz:
        rows.append(_row("CPU of `convert` over decoding, LAZ, worst size", max(one.ratio for one in laz), 2.5))
    if len(e57) > 1:
        span = f"{e57[0].points / 1e6:.0f} M to {e57[-1].points / 1e6:.0f} M points"
        rows.append(_row(f"growth exponent of CPU, {span}", exponent(e57[0], e57[-1]), 1.1))
        rows.append(_row(f"peak memory in GB at {e57[-1].points / 1e6:.0f} M", e57[-1].convert.memory / 1e9, 2.0))
        at_20 = min(e57, key=lambda one: abs(one.points - 20e6))
        growth = e57[-1].convert.memory / at_20.convert.memory
        rows.append(_row(f"peak memory, over that at {at_20.points / 1e6:.0f} M", growth, 2.0))
    words = f"CPU of `--help` ({1000 * starts[0]:.0f} ms) over a bare interpreter's ({1000 * starts[1]:.0f} ms)"
    rows.append(_row(words, starts[0] / starts[1], 5.0))
    return table(["", "measured", "wanted, at most", ""], rows)


def _row(what: str, value: float, limit: float) -> list[str]:
    return [what, number(value), number(limit, 1), "kept" if value <= limit else "**missed**"]


def exponent(small: Compared, large: Compared) -> float:
    """Of the power of the number of points that CPU grows with."""
    return math.log(large.convert.cpu / small.convert.cpu) / math.log(large.points / small.points)


def _compared(e57: Sequence[Compared], laz: Sequence[Compared], also: Sequence[Compared]) -> str:
    marked = [(f"{one.name}, E57", one) for one in e57] + [(f"{one.name}, LAZ", one) for one in laz]
    rows = [
        [
            name,
            f"{one.points / 1e6:.1f}",
            f"{one.decode:.1f}",
            f"{one.convert.cpu:.1f}",
            number(one.ratio),
            f"{one.convert.cpu / one.points * 1e9:.0f}",
            f"{one.convert.seconds:.0f}",
            f"{one.convert.memory / 1e6:.0f}",
        ]
        for name, one in [*marked, *((one.name, one) for one in also)]
    ]
    head = ["input", "points M", "decoding CPU s", "`convert` CPU s", "ratio", "ns a point", "seconds", "memory MB"]
    return table(head, rows)


def _stages(all_of: Sequence[Compared]) -> str:
    names = list(all_of[0].stages) if all_of else []
    rows = [[f"{one.name}, {one.points / 1e6:.1f} M", *(f"{one.stages[n]:.1f}" for n in names)] for one in all_of]
    return "Wall seconds of each stage, the last run of each:\n\n" + table(["input", *names], rows)


if __name__ == "__main__":
    sys.exit(main())
