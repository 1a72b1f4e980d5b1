"""One conversion with default settings, measured, with what it left."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from document import ROOT
from measure import Cost, measure

OUT = ROOT / "out" / "results"
SAMPLE = ROOT / "samples" / "flat"


@dataclass(frozen=True, slots=True, eq=False)
class Conversion:
    """What a conversion took and left: ``ifc`` and ``model`` (JSON) where it succeeded, the work folder, its words.

    outcome: what ``--json`` prints, empty where it failed. complaint: the error it ended with, else empty.
    """

    name: str
    scans: Path
    cost: Cost
    ifc: Path
    model: Path
    work: Path
    outcome: dict[str, Any]
    complaint: str

    @property
    def points(self) -> int:
        """Points that it read."""
        return int(self.outcome.get("points", 0))

    def count(self, *kinds: str) -> int:
        """How many of these things all storeys hold together."""
        return sum(int(storey.get(kind, 0)) for storey in self.outcome.get("storeys", []) for kind in kinds)


def convert(name: str, scans: Path, folder: Path = OUT, settings: Path | None = None) -> Conversion:
    """Convert from an empty work folder, so that what is measured is the whole way."""
    folder.mkdir(parents=True, exist_ok=True)
    ifc, model, work = folder / f"{name}.ifc", folder / f"{name}.json", folder / f"{name}.work"
    out, log = folder / f"{name}.outcome.json", folder / f"{name}.log"
    for path in (ifc, model):
        path.unlink(missing_ok=True)
    shutil.rmtree(work, ignore_errors=True)
    chosen = [] if settings is None else ["--config", settings]
    cost = measure(
        [*COMMAND, scans, "-o", ifc, "-o", model, "--work", work, "--name", name, "--json", *chosen], out=out, log=log
    )
    outcome = json.loads(out.read_text(encoding="utf-8") or "{}") if cost.code == 0 else {}
    return Conversion(name, scans, cost, ifc, model, work, outcome, "" if cost.code == 0 else _complaint(log))


COMMAND = (sys.executable, "-m", "scan2bim.cli", "convert")


def warm_up(also: Sequence[Path] = ()) -> None:
    """Convert the sample once, so that compiled kernels lie in their cache: users pay for that once, not each time.

    ``also``: further clouds, of which the smallest of each format is converted, for kernels that only these need.
    """
    smallest = {path.suffix: path for path in sorted(also, key=lambda path: path.stat().st_size, reverse=True)}
    for scans in (SAMPLE, *smallest.values()):
        done = convert("warm_up", scans)
        shutil.rmtree(done.work, ignore_errors=True)
        if done.cost.code != 0 and scans == SAMPLE:
            raise SystemExit(f"the sample does not convert: {done.complaint}")


def _complaint(log: Path) -> str:
    """The last error of the run's talk, in one line."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    failed = [line for line in lines if '"event": "failed"' in line]
    text = str(json.loads(failed[-1])["text"]) if failed else "\n".join(lines[-1:])
    return " ".join(text.split())
