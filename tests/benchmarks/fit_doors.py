"""Fit the weights of closed doors: ``fit_doors.py WORK=TRUTH.json ... [--check WORK=TRUTH.json ...]``.

Each WORK is the work folder of a conversion of a scene whose openings are told by TRUTH.json. Rectangles that overlap a
closed door by 0.7 or more are right, each door counting once however many there are; those that overlap a closed door
by 0.15 or any other by 0.5 are left out; the rest is wrong. Prints BIAS and WEIGHTS for ``openings/closed/score.py``,
and how well the probabilities of the scenes to check agree with how often they are right.
"""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from fitting import F64, fitted
from numpy.typing import NDArray

from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.scene import load_scene
from scan2bim.openings.build import near_walls
from scan2bim.openings.closed.evidence import evidence_of
from scan2bim.openings.closed.rectangles import Rectangle, candidates
from scan2bim.openings.closed.score import Features, features_of
from scan2bim.structure.shapes import StructureShape, WallShape

RIDGE = 0.3
"""Weight of the squares of the weights: as much as a third of a door's own loss a unit."""
RIGHT, PART, OTHER = 0.7, 0.15, 0.5
"""Overlaps (intersection over union) as told above."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """``features`` (n, k) of rectangles, ``right`` (n,) whether they are closed doors, ``weight`` (n,)."""

    features: F64
    right: NDArray[np.bool_]
    weight: F64


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="WORK=TRUTH")
    parser.add_argument("--check", nargs="*", default=[], metavar="WORK=TRUTH")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    sample = joined([sample_of(scene) for scene in options.scenes])
    terms = np.column_stack([np.ones(len(sample.features)), sample.features])
    weights = fitted(terms, sample.right, RIDGE, sample.weight)
    print(f"{sample.weight[sample.right].sum():.0f} doors, {(~sample.right).sum()} other rectangles")
    print("BIAS =", round(float(weights[0]), 2))
    print("WEIGHTS =", [round(float(w), 2) for w in weights[1:]])
    for field, weight in zip(fields(Features), weights[1:], strict=True):
        print(f"  {field.name:9} {weight:6.2f}")
    if options.check:
        reliability(joined([sample_of(scene) for scene in options.check]), weights)


def sample_of(scene: str) -> Sample:
    """The rectangles of one scene."""
    work, truth = (Path(part) for part in scene.split("="))
    folders = [p.parent for p in sorted(work.glob("stages/*/*/manifest.json"))]
    reads = [f for f in folders if f.parent.name == "read"]
    reads.sort(key=lambda f: ScanSummary.load(f).station)
    (structure_folder,) = (f for f in folders if f.parent.name == "structure")
    (surfels,) = (f for f in folders if f.parent.name == "surfels")
    structure, cloud = StructureShape.load(structure_folder / "structure.json"), load_scene(surfels, reads)
    (frame,) = work.glob("stages/survey/*/frame.json")
    doors = json.loads(truth.read_text(encoding="utf-8"))["doors"]
    corners = [(np.array(d["corners"]) - json.loads(frame.read_text())["shift"], d["state"]) for d in doors]
    rows: list[F64] = []
    names: list[int] = []
    for near in near_walls(structure, cloud, reads, work, lambda share: None):
        faces = near.faces(structure, cloud)
        true = [(n, box, state) for n, (c, state) in enumerate(corners) if (box := in_wall(near.wall, c)) is not None]
        for box in candidates(faces):
            overlaps = [(box.overlap(other), n, state) for n, other, state in true]
            best, number, state = max(overlaps, default=(0.0, -1, ""))
            if state == "closed" and best >= RIGHT:
                names.append(number)
            elif best >= (PART if state == "closed" else OTHER):
                continue
            else:
                names.append(-1)
            rows.append(np.nan_to_num(features_of(evidence_of(faces, box), box).vector()))
    name = np.array(names, np.int64)
    counts = np.bincount(name[name >= 0], minlength=len(doors))
    weight = np.where(name >= 0, 1 / np.maximum(counts[np.maximum(name, 0)], 1), 1.0)
    return Sample(np.array(rows).reshape(-1, len(fields(Features))), name >= 0, weight)


def in_wall(wall: WallShape, corners: F64) -> Rectangle | None:
    """A true opening (4, 3) as a rectangle of a wall, None where it is another wall's."""
    start, end = np.array(wall.start), np.array(wall.end)
    length = float(np.linalg.norm(end - start))
    direction = (end - start) / length
    offset = corners[:, :2] - start
    along, across = offset @ direction, offset @ np.array([-direction[1], direction[0]])
    low, high = float(corners[:, 2].min()) - wall.base, float(corners[:, 2].max()) - wall.base
    if np.abs(across).max() > 0.25 or along.min() < -0.3 or along.max() > length + 0.3 or not -0.5 < low < 1.0:
        return None
    return Rectangle(float(along.min()), float(along.max()), high)


def joined(samples: list[Sample]) -> Sample:
    """One after the other."""
    return Sample(
        np.concatenate([s.features for s in samples]),
        np.concatenate([s.right for s in samples]),
        np.concatenate([s.weight for s in samples]),
    )


def reliability(sample: Sample, weights: F64) -> None:
    """Print how often rectangles of each probability are right, and the expected calibration error."""
    probability = 1 / (1 + np.exp(-(weights[0] + sample.features @ weights[1:])))
    error = 0.0
    for low in np.arange(0, 1, 0.1):
        at = (probability >= low) & (probability < low + 0.1)
        if at.any():
            mean = np.average(probability[at], weights=sample.weight[at])
            right = np.average(sample.right[at], weights=sample.weight[at])
            error += abs(mean - right) * sample.weight[at].sum() / sample.weight.sum()
            print(f"  {low:.1f}-{low + 0.1:.1f}: said {mean:.2f}, right {right:.2f}, {sample.weight[at].sum():.0f}")
    print(f"expected calibration error {error:.3f}")


if __name__ == "__main__":
    main()
