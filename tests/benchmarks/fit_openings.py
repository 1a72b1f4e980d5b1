"""Fit the weights of ``scan2bim.openings.confidence``, and print how well they are calibrated on other scenes.

    python tests/benchmarks/fit_openings.py --fit SCENE=WORK ... --test SCENE=WORK ...
    python tests/benchmarks/fit_openings.py --stretch BUILDING:SCENE=WORK ...

SCENE is a folder with a truth.json of simulated scans, WORK the work folder of their conversion. ``--stretch`` keeps
what the weights say of openings by each other and stretches it about even odds to how often they are right, so that an
opening for which nothing speaks stays unlikely, and prints how well each BUILDING is told by what the others give.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fitting import F64, fitted, judged, newest, tell
from numpy.typing import NDArray

from scan2bim.openings.confidence import LEAST, MOST, WEIGHTS, features
from scan2bim.openings.shapes import OpeningShape, load_openings
from scan2bim.structure.shapes import StructureShape, WallShape

RIDGE = 0.3
"""Weight of the squares of the weights: few false openings are in the scenes."""
MATCH = 0.5
"""Least overlap (intersection over union) with a true opening of its kind."""
DOOR = len(WEIGHTS) - 1
"""The feature that tells doors."""
KINDS = {"window": ("windows",), "door": ("doors",), "passage": ("openings", "doors")}


@dataclass(frozen=True, slots=True, eq=False)
class Examples:
    """Features (n, k) of openings that were looked through, which are right (n,), and which are windows (n,)."""

    rows: F64
    right: NDArray[np.bool_]
    window: NDArray[np.bool_]

    def only(self, mask: NDArray[np.bool_]) -> Examples:
        """Those of a mask (n,)."""
        return Examples(self.rows[mask], self.right[mask], self.window[mask])


def examples(scene: Path, work: Path) -> Examples:
    """Of one scene."""
    truth: dict[str, Any] = json.loads((scene / "truth.json").read_text())
    shift = np.array(json.loads(newest(work, "survey", "frame.json").read_text())["shift"])
    structure = StructureShape.load(newest(work, "structure", "structure.json"))
    rows, right, window = [], [], []
    for opening in load_openings(newest(work, "openings", "openings.json")):
        if opening.sides == 0:
            continue  # found as a closed door: that has weights of its own
        wall = structure.storeys[opening.storey].walls[opening.wall]
        overlaps = [
            overlap(opening, wall, np.array(true["corners"]) - shift)
            for kind in KINDS[opening.kind]
            for true in truth[kind]
        ]
        rows.append(features(opening, wall))
        right.append(max(overlaps, default=0.0) >= MATCH)
        window.append(opening.kind == "window")
    return Examples(np.array(rows).reshape(-1, len(WEIGHTS)), np.array(right, bool), np.array(window, bool))


def overlap(opening: OpeningShape, wall: WallShape, corners: F64) -> float:
    """Intersection over union with a true opening in the wall's plane; 0 where that is in another plane."""
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / np.linalg.norm(end - start)
    along = (corners[:, :2] - start) @ direction
    across = (corners[:, :2] - start) @ np.array([-direction[1], direction[0]])
    up = corners[:, 2] - wall.base
    if abs(across.mean()) > 0.25 or np.ptp(across) > 0.35 * np.ptp(along):
        return 0.0
    wide = min(opening.offset + opening.width, along.max()) - max(opening.offset, along.min())
    tall = min(opening.sill + opening.height, up.max()) - max(opening.sill, up.min())
    both = max(wide, 0.0) * max(tall, 0.0)
    return float(both / (opening.width * opening.height + np.ptp(along) * np.ptp(up) - both))


def main() -> None:
    """Fit on some scenes, test on others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", nargs="+", default=[], metavar="SCENE=WORK")
    parser.add_argument("--stretch", nargs="+", default=[], metavar="BUILDING:SCENE=WORK")
    parser.add_argument("--test", nargs="+", default=[], metavar="SCENE=WORK")
    arguments = parser.parse_args()
    if arguments.stretch:
        stretch(arguments.stretch)
    if not arguments.fit:
        return
    known = joined(arguments.fit)
    weights = fitted(known.rows, known.right, RIDGE)
    print("WEIGHTS = np.array(", [round(float(w), 2) for w in weights], ")")
    told("fitted on", known, weights)
    if arguments.test:
        other = joined(arguments.test)
        told("tested on", other, weights)
        told("windows of these", other.only(other.window), weights)


def stretch(pairs: list[str]) -> None:
    """Print the weights stretched to all, and how well each building is told by the others."""
    buildings = [pair.partition(":")[0] for pair in pairs]
    parts = {
        b: joined([p.partition(":")[2] for p, c in zip(pairs, buildings, strict=True) if b == c]) for b in buildings
    }
    whole = together(list(parts.values()))
    print("WEIGHTS = np.array(", [round(float(w), 2) for w in stretched(whole)], ")")
    said = [p.rows @ stretched(together([o for c, o in parts.items() if c != b])) for b, p in parts.items()]
    rows = np.concatenate(said)[:, None]
    for name, mask in (
        ("all", np.ones(len(rows), bool)),
        ("windows", whole.window),
        ("doors", whole.rows[:, DOOR] > 0),
    ):
        tell(f"held out, {name}", judged(rows[mask], whole.right[mask], np.ones(1), LEAST, MOST))


def stretched(known: Examples) -> F64:
    """The weights as they are, by one factor, to how often openings are right."""
    return WEIGHTS * fitted((known.rows @ WEIGHTS)[:, None], known.right, 0.0)[0]


def told(name: str, found: Examples, weights: F64) -> None:
    """Print how well ``weights`` are calibrated."""
    tell(name, judged(found.rows, found.right, weights, LEAST, MOST))


def joined(pairs: list[str]) -> Examples:
    """Of several SCENE=WORK."""
    return together([examples(*map(Path, pair.split("="))) for pair in pairs])


def together(found: list[Examples]) -> Examples:
    """All of several."""
    return Examples(
        np.concatenate([f.rows for f in found]),
        np.concatenate([f.right for f in found]),
        np.concatenate([f.window for f in found]),
    )


if __name__ == "__main__":
    main()
