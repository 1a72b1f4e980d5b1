"""Fit the weights of ``scan2bim.structure.confidence``, and print how well they are calibrated on other scenes.

    python tests/benchmarks/fit_walls.py --fit SCENE=WORK ... --test SCENE=WORK ...

SCENE is a folder with a truth.json of simulated scans, ours or a bench's; WORK the work folder of their conversion.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from bench_truth import bench_truth
from fitting import F64, fitted, judged, newest, tell
from numpy.typing import NDArray

from scan2bim.evaluate.faces import right_walls
from scan2bim.structure.confidence import LEAST, MOST, features
from scan2bim.structure.shapes import StructureShape
from scan2bim.truth.io import read_truth
from scan2bim.truth.values import TRUTH_FORMAT, SpaceTruth, Truth, WallTruth

RIDGE = 0.1
"""Weight of the squares of the weights: few wrong walls are in the scenes."""


def truth_of(scene: Path) -> Truth:
    """A scene's truth, in either form."""
    path = scene / "truth.json"
    ours = json.loads(path.read_text(encoding="utf-8")).get("format") == TRUTH_FORMAT
    return read_truth(path) if ours else bench_truth(path)


def examples(scene: Path, work: Path) -> tuple[F64, NDArray[np.bool_]]:
    """Features (n, k) of the walls that were found, and which are right (n,)."""
    shift = np.array(json.loads(newest(work, "survey", "frame.json").read_text())["shift"])
    structure = StructureShape.load(newest(work, "structure", "structure.json"))
    found = [wall for storey in structure.storeys for wall in storey.walls]
    walls = [
        WallTruth(
            name="",
            storey="",
            start=(w.start[0] + shift[0], w.start[1] + shift[1]),
            end=(w.end[0] + shift[0], w.end[1] + shift[1]),
            thickness=w.thickness,
            base=w.base + shift[2],
            height=max(w.top - w.base, 0.3),
        )
        for w in found
    ]
    rooms = [
        SpaceTruth(
            name="",
            storey="",
            outline=tuple((x + shift[0], y + shift[1]) for x, y in s.outline),
            area=s.polygon.area,
            base=s.floor + shift[2],
            height=max((s.ceiling or storey.top) - s.floor, 0.3),
        )
        for storey in structure.storeys
        for s in storey.spaces
    ]
    return np.array([features(w) for w in found]), right_walls(walls, rooms, truth_of(scene).walls)


def joined(pairs: list[str]) -> tuple[F64, NDArray[np.bool_]]:
    """Examples of several SCENE=WORK."""
    found = [examples(*map(Path, pair.split("="))) for pair in pairs]
    return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])


def main() -> None:
    """Fit on some scenes, test on others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", nargs="+", required=True, metavar="SCENE=WORK")
    parser.add_argument("--test", nargs="+", default=[], metavar="SCENE=WORK")
    options = parser.parse_args()
    rows, right = joined(options.fit)
    weights = fitted(rows, right, RIDGE)
    print("WEIGHTS = np.array(", [round(float(w), 2) for w in weights], ")")
    tell("fitted on", judged(rows, right, weights, LEAST, MOST))
    if options.test:
        tell("tested on", judged(*joined(options.test), weights, LEAST, MOST))


if __name__ == "__main__":
    main()
