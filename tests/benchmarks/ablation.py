"""What each kind of evidence adds to the doors that are found: some of it alone, and all without some.

    ./run ablation SCENE ... [--dry]

SCENE is a folder with a truth.json of simulated scans and with E57 files, in itself or in e57/. Each is converted once;
then its openings are found again with each choice of evidence, in the same walls. With --dry docs stay as they are.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from conversion import convert
from document import ROOT, mean, number, table, write_section
from fit_openings import overlap
from fitting import newest

from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.scene import Scene, load_scene
from scan2bim.config import OpeningSettings
from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.openings.alike import completed
from scan2bim.openings.build import NearWall, near_walls, virtual_stations, with_leaf, without_overlaps
from scan2bim.openings.closed.find import closed_openings
from scan2bim.openings.closed.rectangles import Face
from scan2bim.openings.confidence import probability
from scan2bim.openings.door_frames import with_frame, with_pane
from scan2bim.openings.paper.closed import paper_openings
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import StructureShape

OUT = ROOT / "out" / "ablation"
RIGHT = 0.5
"""Least overlap (intersection over union) of a found door with a true one."""
GREY = 128


@dataclass(frozen=True, slots=True)
class Choice:
    """Which evidence is used: both faces' fitted model (else the paper's section V on each face alone), the labels of
    free space in it, the leaf of open doors, colour, and the stations' positions and panoramas.
    """

    name: str
    both: bool = True
    labels: bool = True
    leaf: bool = True
    colour: bool = True
    stations: bool = True


CHOICES = (
    Choice("the paper's method only", both=False, labels=False, leaf=False),
    Choice("+ both faces", labels=False, leaf=False),
    Choice("+ free-space labels", leaf=False),
    Choice("+ leaf: all evidence"),
    Choice("all without colour", colour=False),
    Choice("all without stations", stations=False),
)
TEXT = """\
## What each kind of evidence adds

`./run ablation`, on {scenes}: doors found in the same walls with more and more evidence, and with all but one kind. A
door is found with an IoU of at least 0.5 in its wall's plane; *false* is a door where there is none. *state* is the
share of the found ones that are rightly open or closed, *IoU* their mean. Openings that were looked through are found
by the paper's section IV in every row; *free-space labels* are those that the model of closed doors weighs."""


@dataclass(frozen=True, slots=True)
class Count:
    """Doors of a scene: found and true ones, open and closed; false ones; of the found ones, which have the right
    state, and their overlaps.
    """

    found_open: int
    true_open: int
    found_closed: int
    true_closed: int
    false: int
    state: int
    overlaps: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """What a conversion left in its work folder, and the true doors with corners (4, 3) in its coordinates."""

    structure: StructureShape
    scene: Scene
    reads: list[Path]
    doors: list[tuple[dict[str, Any], Any]]


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a conversion failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--dry", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    counts: dict[str, list[Count]] = {choice.name: [] for choice in CHOICES}
    for folder in options.scenes:
        done = convert(folder.name, folder / "e57" if (folder / "e57").is_dir() else folder, OUT)
        if done.cost.code != 0:
            print(f"{folder}: {done.complaint}", file=sys.stderr)
            return 1
        kept = load(done.work, folder / "truth.json")
        for choice in CHOICES:
            found = without_overlaps(completed(list(openings_by(choice, kept))), kept.structure.storeys)
            counts[choice.name].append(count(found, kept))
    text = report(counts, [folder.name for folder in options.scenes])
    if not options.dry:
        write_section("ablation", text)
    print(text)
    return 0


def load(work: Path, truth: Path) -> Kept:
    """From the work folder of a conversion."""
    reads = sorted(
        (p.parent for p in work.glob("stages/read/*/manifest.json")), key=lambda f: ScanSummary.load(f).station
    )
    shift = np.array(json.loads(newest(work, "survey", "frame.json").read_text())["shift"])
    doors = json.loads(truth.read_text(encoding="utf-8"))["doors"]
    surfels = newest(work, "surfels", "surfels.bin").parent
    structure = StructureShape.load(newest(work, "structure", "structure.json"))
    return Kept(structure, load_scene(surfels, reads), reads, [(d, np.array(d["corners"]) - shift) for d in doors])


def openings_by(choice: Choice, kept: Kept) -> Iterator[OpeningShape]:
    """The openings of all walls by a choice of evidence."""
    scene = kept.scene
    if not choice.stations:
        scene = replace(scene, panoramas={}, stations=np.full_like(scene.stations, np.nan))
    virtual = virtual_stations(kept.structure, scene)
    index = PlanIndex(scene.surfels.xyz)
    for wall in near_walls(kept.structure, scene, kept.reads, OUT, lambda share: None):
        grey = replace(wall.points, rgb=np.full_like(wall.points.rgb, GREY))
        near = wall if choice.colour else replace(wall, points=grey)
        seen = near.looked_through(scene, virtual)
        faces = (near if choice.labels else replace(near, panoramas={})).faces(kept.structure, scene)
        hung = [with_leaf(o, near.wall, scene.surfels, index) for o in seen] if choice.leaf else seen
        if choice.both:
            hung = [with_frame(with_pane(o, near.wall, faces), near.wall, faces, near.points) for o in hung]
        yield from (replace(o, confidence=probability(o, near.wall)) for o in hung)
        yield from closed_by(choice, near, faces)


def closed_by(choice: Choice, near: NearWall, faces: Sequence[Face]) -> list[OpeningShape]:
    """The closed doors of a wall by a choice of evidence."""
    if not choice.both:
        return paper_openings(near.storey, near.place, faces, OpeningSettings(method="paper"))
    return closed_openings(near.storey, near.place, near.wall, faces, near.points)


def count(found: Sequence[OpeningShape], kept: Kept) -> Count:
    """Doors found, missed and false."""
    doors = [o for o in found if o.kind == "door"]
    walls = [kept.structure.storeys[o.storey].walls[o.wall] for o in doors]
    over = np.array([[overlap(o, w, c) for o, w in zip(doors, walls, strict=True)] for _, c in kept.doors])
    over = over.reshape(len(kept.doors), len(doors))
    asked = [k for k, (d, _) in enumerate(kept.doors) if d.get("observable", True) and d["state"] != "passage"]
    shut = {k: kept.doors[k][0]["state"] == "closed" for k in asked}
    hits = {k: int(over[k].argmax()) for k in asked if over[k].max(initial=0.0) >= RIGHT}
    return Count(
        sum(not shut[k] for k in hits),
        sum(not shut[k] for k in asked),
        sum(shut[k] for k in hits),
        sum(shut[k] for k in asked),
        int((over.max(0, initial=0.0) < RIGHT).sum()),
        sum((doors[j].state == "closed") == shut[k] for k, j in hits.items()),
        tuple(float(over[k, j]) for k, j in hits.items()),
    )


def report(counts: dict[str, list[Count]], scenes: Sequence[str]) -> str:
    """The section."""
    rows: list[list[str]] = []
    for name, each in counts.items():
        found = sum(c.found_open + c.found_closed for c in each)
        false, true = sum(c.false for c in each), sum(c.true_open + c.true_closed for c in each)
        rows.append(
            [
                name,
                f"{sum(c.found_open for c in each)} of {sum(c.true_open for c in each)}",
                f"{sum(c.found_closed for c in each)} of {sum(c.true_closed for c in each)}",
                str(false),
                number(2 * found / (true + found + false) if found else 0.0),
                number(sum(c.state for c in each) / found if found else None),
                number(mean(o for c in each for o in c.overlaps)),
            ]
        )
    head = ["evidence", "open doors found", "closed doors found", "false", "F1", "state right", "IoU"]
    return TEXT.format(scenes=", ".join(scenes)) + "\n\n" + table(head, rows)


if __name__ == "__main__":
    sys.exit(main())
