"""The program's own models of simulated scenes, verified against the scans that they were made from.

    ./run own SCENES_DIR [--scenes NAME ...] [--out DIR]

A scene is a folder with e57/. For each class of element: how many have a verdict, the share of each measured band of
accuracy, and the CPU time of the verification beside that of the conversion. The table goes to docs/results.md.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from conversion import COMMAND
from document import ROOT, table, write_section
from large_models import large_table
from measure import measure

from scan2bim.verify.result import FAULTS, Report, load_report

OUT = ROOT / "out" / "own"
BANDS = ("LOA50", "LOA40", "LOA30", "LOA20", "LOA10")
INTRODUCTION = """\
## Own models against their scans

`./run own`: each scene is converted with default settings and the model verified at 10 mm against the same scans. Bands
are those measured at 95 % of an element's surface; doors and windows have none, they are judged by their openings."""
LARGE = "The model of {} with rows of walls of 3 m more, verified against its scans, from the files on:"


def main() -> int:
    """Convert, verify, count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes_dir", type=Path)
    parser.add_argument(
        "--scenes", nargs="*", default=["quick_house", "duplex_mixed", "fzk_house", "jasmin_asmodelled"]
    )
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    rows: list[list[str]] = []
    times: list[list[str]] = []
    for name in options.scenes:
        report, seconds = verified(options.scenes_dir / name / "e57", options.out / name)
        rows += class_rows(name, report)
        convert, verify = seconds
        times.append([name, f"{convert:.1f}", f"{verify:.1f}", f"{verify / convert:.1f}"])
        print(name, convert, verify, file=sys.stderr, flush=True)
    bands = table(["scene", "class", "in tolerance", "at fault", "no verdict", *BANDS, "LOA30 or better"], rows)
    cost = table(["scene", "convert, CPU s", "verify, CPU s", "ratio"], times)
    words = "CPU seconds of both from the files on, each in a new work folder:"
    large = large_table(options.scenes_dir / options.scenes[0], options.out)
    write_section("own", "\n\n".join([INTRODUCTION, bands, words, cost, LARGE.format(options.scenes[0]), large]))
    return 0


def verified(scans: Path, work: Path) -> tuple[Report, tuple[float, float]]:
    """The report of a scene's own model, and CPU seconds of conversion and verification."""
    work.mkdir(parents=True, exist_ok=True)
    model, folder = work / "own.ifc", work / "report"
    afresh = ["--rerun-from", "survey", "--quiet"]
    first = measure([*COMMAND, str(scans), "-o", str(model), "--work", str(work / "convert"), *afresh])
    command = [*COMMAND[:-1], "verify", str(model), str(scans), "-o", str(folder), "--tolerance", "10mm"]
    second = measure([*command, "--work", str(work / "verify"), *afresh])
    return load_report(folder / "report.json"), (first.cpu, second.cpu)


def class_rows(name: str, report: Report) -> list[list[str]]:
    """A row for each class."""
    rows: list[list[str]] = []
    for ifc_class in sorted({e.ifc_class for e in report.elements}):
        mine = [e for e in report.elements if e.ifc_class == ifc_class and e.status != "not_applicable"]
        if not mine:
            continue
        bands = Counter(e.loa for e in mine if e.loa)
        rows.append([name, ifc_class.removeprefix("Ifc"), *_counts([e.status for e in mine]), *_bands(bands)])
    return rows


def _counts(statuses: Sequence[str]) -> list[str]:
    right, wrong = statuses.count("in_tolerance"), sum(s in FAULTS for s in statuses)
    return [str(right), str(wrong), str(len(statuses) - right - wrong)]


def _bands(bands: Counter[str]) -> list[str]:
    every = sum(bands.values())
    good = sum(bands[band] for band in ("LOA50", "LOA40", "LOA30"))
    return [*(str(bands[band]) for band in BANDS), f"{100 * good / every:.0f} %" if every else "–"]


if __name__ == "__main__":
    sys.exit(main())
