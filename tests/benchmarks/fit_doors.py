"""Fit the weights of closed doors: ``fit_doors.py WORK=TRUTH.json ... [--kept WORK=TRUTH.json ...]``.

Each WORK is the work folder of a conversion of a scene whose openings are told by TRUTH.json. Rectangles that overlap a
closed door by 0.7 or more are right, each door counting once however many there are; those that overlap a closed door
by 0.15 or any other by 0.5 are left out; the rest is wrong. Prints BIAS and WEIGHTS for ``openings/closed/score.py``.

With ``--kept`` also SCALE and SHIFT: of other scenes, by the weights that stand there now, from the rectangles that are
kept of those that overlap; and how often what is then taken for a door is one. The second half of these scenes is
judged by what the first half gives.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from fitting import F64, fitted, judged, newest, tell
from numpy.typing import NDArray

from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.scene import load_scene
from scan2bim.openings.build import near_walls
from scan2bim.openings.closed.evidence import evidence_of
from scan2bim.openings.closed.find import judged as judgement
from scan2bim.openings.closed.find import kept
from scan2bim.openings.closed.rectangles import Face, Rectangle, candidates
from scan2bim.openings.closed.score import SUREST, Features, features_of
from scan2bim.structure.shapes import StructureShape, WallShape

RIDGE = 0.3
"""Weight of the squares of the weights: as much as a third of a door's own loss a unit."""
RIGHT, PART, OTHER = 0.7, 0.15, 0.5
"""Overlaps (intersection over union) as told above."""
FOUND, LEAST = 0.5, 0.03
"""Overlap of a door that is found, and probability from which on rectangles that are kept are calibrated."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """``features`` (n, k) of rectangles, ``right`` (n,) whether they are closed doors, ``weight`` (n,)."""

    features: F64
    right: NDArray[np.bool_]
    weight: F64


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="WORK=TRUTH")
    parser.add_argument("--kept", nargs="*", default=[], metavar="WORK=TRUTH")
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
    if options.kept:
        half = len(options.kept) // 2
        first, second = (joined_kept(part) for part in (options.kept[:half], options.kept[half:]))
        shift, scale = fitted(*first, RIDGE)
        told(f"by the first half: SCALE, SHIFT = {scale:.2f}, {shift:.2f}", second, np.array([shift, scale]))
        every = np.concatenate([first[0], second[0]]), np.concatenate([first[1], second[1]])
        shift, scale = fitted(*every, RIDGE)
        told(f"SCALE, SHIFT = {scale:.2f}, {shift:.2f}", every, np.array([shift, scale]))


def told(name: str, sample: tuple[F64, NDArray[np.bool_]], weights: F64) -> None:
    """Print the reliability of those that are taken for doors."""
    taken = sample[0] @ weights > 0
    tell(name, judged(sample[0][taken], sample[1][taken], weights, 0.0, SUREST))


def joined_kept(scenes: Sequence[str]) -> tuple[F64, NDArray[np.bool_]]:
    """1 and the logarithm of the odds (n, 2) of the rectangles kept in scenes, and whether they are closed doors; those
    in the place of another door are left out.
    """
    rows: list[tuple[float, float]] = []
    right: list[bool] = []
    for scene in scenes:
        for faces, true in walls_of(scene):
            for door in kept([judgement(faces, box) for box in candidates(faces)], 0.0):
                best, state = max(((door.box.overlap(box), state) for _, box, state in true), default=(0.0, ""))
                if door.probability > LEAST and (state == "closed" or best < OTHER):
                    rows.append((1.0, float(np.log(door.probability / (1 - door.probability)))))
                    right.append(state == "closed" and best >= FOUND)
    return np.array(rows).reshape(-1, 2), np.array(right, bool)


def walls_of(scene: str) -> Iterator[tuple[list[Face], list[tuple[int, Rectangle, str]]]]:
    """The faces of a scene's walls, and the true doors in each: number, rectangle, state."""
    work, truth = (Path(part) for part in scene.split("="))
    folders = {p.parent for p in work.glob("stages/read/*/manifest.json")}
    reads = sorted(folders, key=lambda f: ScanSummary.load(f).station)
    structure = StructureShape.load(newest(work, "structure", "structure.json"))
    cloud = load_scene(newest(work, "surfels", "manifest.json").parent, reads)
    shift = json.loads(newest(work, "survey", "frame.json").read_text())["shift"]
    doors = json.loads(truth.read_text(encoding="utf-8"))["doors"]
    corners = [(np.array(d["corners"]) - shift, d["state"]) for d in doors]
    for near in near_walls(structure, cloud, reads, work, lambda share: None):
        true = [(n, box, state) for n, (c, state) in enumerate(corners) if (box := in_wall(near.wall, c)) is not None]
        yield near.faces(structure, cloud), true


def sample_of(scene: str) -> Sample:
    """The rectangles of one scene."""
    rows: list[F64] = []
    names: list[int] = []
    for faces, true in walls_of(scene):
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
    counts = np.bincount(name[name >= 0], minlength=1)
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


if __name__ == "__main__":
    main()
