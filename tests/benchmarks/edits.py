"""Seeded changes to models of simulated scenes, verified against the scans of the unchanged ones.

    ./run edits SCENES_DIR [--scenes NAME ...] [--runs N] [--edits N] [--out DIR]

A scene is a folder with e57/ and reference.ifc, the model in scan coordinates. Each run makes some changes to walls,
slabs, doors and windows of one model, verifies it at 10 mm, and compares what was found with what was changed. The
table goes to docs/results.md.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.placement as placement_util
import ifcopenshell.util.unit as unit_util
import numpy as np
from conversion import COMMAND
from document import ROOT, table, write_section

from scan2bim.verify.ifc_model import read_model
from scan2bim.verify.patches import main_direction
from scan2bim.verify.result import FAULTS, ElementResult, Report, load_report

OUT = ROOT / "out" / "edits"
TOLERANCE = 0.010
BORDER = 0.002
"""Metres round the tolerance within which either status is right."""
SHIFT_LIMIT, TURN_LIMIT = 0.003, math.radians(0.1)

INTRODUCTION = """\
## Verification

`./run edits`: seeded changes to the scenes' models, verified at 10 mm against the scans of the unchanged buildings. An
element counts as seen if the unchanged model's verification measured it (in a moved or added door's wall: the wall).
*Shift* and *turn*: of the right ones, those told within 3 mm and 0.1 degrees. False findings: elements out of tolerance
or missing that were not changed, over all unchanged ones that were measured."""


@dataclass(frozen=True, slots=True)
class Edit:
    """A change: kind, GlobalId of the element, host (of a door), size (m or radians), extent of what deviates (m), box
    (JSON) of what is no longer drawn.
    """

    kind: str
    guid: str
    host: str
    size: float
    extent: float
    box: str = ""


def main() -> int:
    """Edit, verify, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes_dir", type=Path)
    parser.add_argument("--scenes", nargs="*", default=["duplex_mixed", "fzk_house", "jasmin_asmodelled"])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--edits", type=int, default=10)
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    outcomes: list[Outcome] = []
    bases: dict[str, Report] = {}
    for number in range(options.runs):
        name = options.scenes[number % len(options.scenes)]
        scene, work = options.scenes_dir / name, options.out / name
        if name not in bases:
            bases[name] = verified(scene / "reference.ifc", scene, work, "base")
        model = work / f"edited_{number}.ifc"
        edits = edit_model(scene / "reference.ifc", model, bases[name], options.edits, number)
        outcomes.append(compare(bases[name], verified(model, scene, work, f"run_{number}"), edits, name))
        print(name, *outcomes[-1].lines, sep="\n  ", file=sys.stderr, flush=True)
    text = "\n\n".join([INTRODUCTION, edits_table(outcomes), unedited_table(bases), false_line(outcomes)])
    write_section("edits", text)
    print(text)
    return 0


def verified(model: Path, scene: Path, work: Path, name: str) -> Report:
    """The report of a verification."""
    folder = work / name
    command = [*COMMAND[:-1], "verify", str(model), str(scene / "e57"), "-o", str(folder)]
    command += [
        "--work",
        str(work / "work"),
        "--tolerance",
        f"{1000 * TOLERANCE:g}mm",
        "--placing",
        "stated",
        "--quiet",
    ]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
    return load_report(folder / "report.json")


def edit_model(source: Path, target: Path, base: Report, count: int, seed: int) -> list[Edit]:
    """Write a changed copy and tell the changes: of seen elements, no two of one wall."""
    rng = np.random.default_rng(1000 + seed)
    file: Any = ifcopenshell.open(str(source))
    boxes = {e.guid: e.vertices for e in read_model(source).elements}
    seen = {e.guid: e for e in base.elements if e.status in ("in_tolerance", "out_of_tolerance")}
    used: set[str] = set()
    edits: list[Edit] = []
    kinds = list(MAKERS)
    for attempt in range(60 * count):
        if len(edits) == count:
            break
        kind = kinds[(len(edits) + seed + attempt // 40) % len(kinds)]
        pool = [g for g, e in seen.items() if _fits(kind, e) and g not in used and _host(e) not in used]
        if not pool:
            continue
        guid = pool[int(rng.integers(len(pool)))]
        edit = MAKERS[kind](file, file.by_guid(guid), boxes[guid], rng)
        if edit is not None:
            box = edit.host
            edits.append(replace(edit, kind=kind, host=_host(seen[guid]), box=box))
            used |= {guid, _host(seen[guid])} - {""}
    target.parent.mkdir(parents=True, exist_ok=True)
    file.write(str(target))
    return edits


def _host(element: ElementResult) -> str:
    return (element.opening.host or "") if element.opening else ""


def _fits(kind: str, element: ElementResult) -> bool:
    """Walls of which at least 1.5 m2 were measured; slabs and ceilings; doors and windows that were seen."""
    if kind.startswith("slab"):
        return element.ifc_class in ("IfcSlab", "IfcCovering") and element.measured > 1
    if kind.startswith("door"):
        return element.ifc_class in ("IfcDoor", "IfcWindow") and bool(_host(element))
    return "Wall" in element.ifc_class and element.measured > 1.5 and (element.coverage or 0) > 0.3


def _move(file: Any, product: Any, motion: np.ndarray) -> None:
    """By a motion (4, 4) of the world, metres, without changing other products' placements of the same entity."""
    scale = unit_util.calculate_unit_scale(file)
    place = product.ObjectPlacement
    parent = place.PlacementRelTo
    outer = placement_util.get_local_placement(parent) if parent is not None else np.eye(4)
    own = placement_util.get_local_placement(place)
    in_units = motion.copy()
    in_units[:3, 3] /= scale
    local = np.linalg.inv(outer) @ in_units @ own
    make = file.create_entity
    place.RelativePlacement = make(
        "IfcAxis2Placement3D",
        make("IfcCartesianPoint", tuple(float(x) for x in local[:3, 3])),
        make("IfcDirection", tuple(float(x) for x in local[:3, 2])),
        make("IfcDirection", tuple(float(x) for x in local[:3, 0])),
    )


def _shifted(by: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, 3] = by
    return out


def _along(points: np.ndarray) -> np.ndarray:
    return main_direction(points[:, :2] - points[:, :2].mean(axis=0))


def shift_wall(file: Any, wall: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """Across itself by 10 to 100 mm."""
    size = float(rng.uniform(0.010, 0.100)) * float(rng.choice([-1, 1]))
    along = _along(points)
    _move(file, wall, _shifted(np.array([-along[1], along[0], 0]) * size))
    return Edit("", wall.GlobalId, "", abs(size), abs(size))


def turn_wall(file: Any, wall: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """About the vertical through its middle by 0.5 to 2 degrees."""
    angle = math.radians(float(rng.uniform(0.5, 2.0))) * float(rng.choice([-1, 1]))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    c, s = math.cos(angle), math.sin(angle)
    motion = np.eye(4)
    motion[:2, :2] = [[c, -s], [s, c]]
    motion[:3, 3] = middle - motion[:3, :3] @ middle
    _move(file, wall, motion)
    return Edit("", wall.GlobalId, "", angle, abs(angle) * float(np.ptp(points[:, :2] @ _along(points))) / 2)


def thicken_wall(file: Any, wall: Any, points: np.ndarray, rng: np.random.Generator) -> Edit | None:
    """By 30 to 80 mm, half on each side, where it is an extruded rectangle or outline."""
    size = float(rng.uniform(0.030, 0.080))
    scale = unit_util.calculate_unit_scale(file)
    solids = [i for r in wall.Representation.Representations for i in r.Items if i.is_a("IfcExtrudedAreaSolid")]
    if len(solids) != 1 or not solids[0].SweptArea.is_a("IfcArbitraryClosedProfileDef"):
        return None
    curve = solids[0].SweptArea.OuterCurve
    if not curve.is_a("IfcPolyline"):
        return None
    own = np.array([p.Coordinates[:2] for p in curve.Points])
    middle = (own[:, 1].min() + own[:, 1].max()) / 2
    if np.ptp(own[:, 1]) * scale > 0.6:
        return None
    wider = own.copy()
    wider[:, 1] += np.sign(own[:, 1] - middle) * size / 2 / scale
    make = file.create_entity
    first = [make("IfcCartesianPoint", (float(x), float(y))) for x, y in wider[:-1]]
    solids[0].SweptArea = make("IfcArbitraryClosedProfileDef", "AREA", None, make("IfcPolyline", [*first, first[0]]))
    return Edit("", wall.GlobalId, "", size / 2, size / 2)


def delete_wall(file: Any, wall: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """Out of the drawing: the scans show a wall that it lacks. What it hosts goes too."""
    low, high = points.min(axis=0), points.max(axis=0)
    edit = Edit("", wall.GlobalId, json.dumps([low.tolist(), high.tolist()]), 0.0, 1.0)
    for relation in wall.HasOpenings:
        for filling in relation.RelatedOpeningElement.HasFillings:
            filling.RelatedBuildingElement.Representation = None
    wall.Representation = None
    return edit


def add_wall(file: Any, wall: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """A copy of it, 0.6 to 0.9 m beside it: drawn, not built."""
    along = _along(points)
    size = float(rng.uniform(0.6, 0.9)) * float(rng.choice([-1, 1]))
    copy = _copied(file, wall)
    _move(file, copy, _shifted(np.array([-along[1], along[0], 0]) * size))
    return Edit("", copy.GlobalId, "", abs(size), abs(size))


def _copied(file: Any, product: Any) -> Any:
    copy = file.create_entity(product.is_a(), GlobalId=ifcopenshell.guid.new(), Name=f"copy of {product.Name}")
    copy.Representation = product.Representation
    place = product.ObjectPlacement
    copy.ObjectPlacement = file.create_entity("IfcLocalPlacement", place.PlacementRelTo, place.RelativePlacement)
    for relation in product.ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, copy]
    return copy


def lower_slab(file: Any, slab: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """By 20 to 100 mm."""
    size = float(rng.uniform(0.020, 0.100))
    _move(file, slab, _shifted(np.array([0.0, 0.0, -size])))
    return Edit("", slab.GlobalId, "", size, size)


def move_door(file: Any, door: Any, points: np.ndarray, rng: np.random.Generator) -> Edit | None:
    """With its opening along the wall by 100 to 400 mm."""
    opening = door.FillsVoids[0].RelatingOpeningElement
    size = float(rng.uniform(0.1, 0.4)) * float(rng.choice([-1, 1]))
    motion = _shifted(np.array([*(_along(points) * size), 0.0]))
    hangs = door.ObjectPlacement.PlacementRelTo == opening.ObjectPlacement
    _move(file, opening, motion)
    if not hangs:
        _move(file, door, motion)
    return Edit("", door.GlobalId, "", abs(size), abs(size))


def add_door(file: Any, door: Any, points: np.ndarray, rng: np.random.Generator) -> Edit | None:
    """A copy of it beside it in its wall: drawn, walled up in the building."""
    opening = door.FillsVoids[0].RelatingOpeningElement
    wall = opening.VoidsElements[0].RelatingBuildingElement
    width = float(np.ptp(points[:, :2] @ _along(points)))
    motion = _shifted(np.array([*(_along(points) * (width + 0.3) * float(rng.choice([-1, 1]))), 0.0]))
    hole, copy = _copied(file, opening), _copied(file, door)
    if door.ObjectPlacement.PlacementRelTo == opening.ObjectPlacement:
        copy.ObjectPlacement.PlacementRelTo = hole.ObjectPlacement
        _move(file, hole, motion)
    else:
        _move(file, hole, motion)
        _move(file, copy, motion)
    make = file.create_entity
    make("IfcRelVoidsElement", ifcopenshell.guid.new(), RelatingBuildingElement=wall, RelatedOpeningElement=hole)
    make("IfcRelFillsElement", ifcopenshell.guid.new(), RelatingOpeningElement=hole, RelatedBuildingElement=copy)
    return Edit("", copy.GlobalId, "", width, width)


def delete_door(file: Any, door: Any, points: np.ndarray, rng: np.random.Generator) -> Edit:
    """With its opening out of the drawing: the scans show one that it lacks."""
    opening = door.FillsVoids[0].RelatingOpeningElement
    low, high = points.min(axis=0), points.max(axis=0)
    opening.Representation = None
    door.Representation = None
    return Edit("", door.GlobalId, json.dumps([low.tolist(), high.tolist()]), 0.0, 1.0)


MAKERS: dict[str, Callable[[Any, Any, np.ndarray, np.random.Generator], Edit | None]] = {
    "wall shifted": shift_wall,
    "wall turned": turn_wall,
    "wall thickened": thicken_wall,
    "wall not drawn": delete_wall,
    "wall not built": add_wall,
    "slab lowered": lower_slab,
    "door moved": move_door,
    "door walled up": add_door,
    "door not drawn": delete_door,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """Of a run: for each change its kind, whether it was seen, right, and its size told (None: none to tell); then the
    unchanged elements that were measured and those of them that were found at fault; lines for people.
    """

    judged: tuple[tuple[str, bool, bool, bool | None], ...]
    unchanged: int
    false: int
    lines: tuple[str, ...]


def compare(base: Report, report: Report, edits: Sequence[Edit], name: str) -> Outcome:
    """What was found of the changes and beside them."""
    results = {e.guid: e for e in report.elements}
    judged = [(edit.kind, *_judge(edit, results.get(edit.guid), report)) for edit in edits]
    touched = ({e.guid for e in edits} | {e.host for e in edits}) - {""}
    measured = {e.guid for e in base.elements if e.status == "in_tolerance"}
    rest = [e for e in report.elements if e.guid in measured - touched and _host(e) not in touched]
    false = [e for e in rest if e.status in FAULTS]
    lines = [f"{kind}: seen {seen}, right {right}, told {told}" for kind, seen, right, told in judged]
    lines += [f"FALSE {e.ifc_class} {e.name} {e.status} {e.reason}" for e in false]
    return Outcome(tuple(judged), len(rest), len(false), tuple(lines))


def _judge(edit: Edit, found: ElementResult | None, report: Report) -> tuple[bool, bool, bool | None]:
    if edit.kind.endswith("not drawn"):
        low, high = json.loads(edit.box)
        return True, _is_added(np.array(low), np.array(high), edit.kind, report), None
    if found is None or found.status in ("occluded", "not_enough_data", "not_applicable"):
        return False, False, None
    if edit.kind.endswith(("not built", "walled up")):
        return True, found.status == "missing", None
    either = abs(edit.extent - TOLERANCE) < BORDER
    right = either or (found.status in FAULTS) == (edit.extent > TOLERANCE)
    return True, right, _told(edit, found) if right else None


def _told(edit: Edit, found: ElementResult) -> bool | None:
    if edit.kind == "door moved":
        shift = found.opening.shift_along if found.opening else None
        return shift is not None and abs(abs(shift) - edit.size) <= SHIFT_LIMIT
    if found.fit is None:
        return False
    if edit.kind == "wall turned":
        return abs(found.fit.turn + edit.size) <= TURN_LIMIT
    if edit.kind == "wall thickened":
        medians = [abs(f.median) for f in found.faces if f.median is not None and f.measured > 0.5]
        return any(abs(m - edit.size) <= SHIFT_LIMIT for m in medians)
    return abs(math.hypot(*found.fit.shift) - edit.size) <= SHIFT_LIMIT


def _is_added(low: np.ndarray, high: np.ndarray, kind: str, report: Report) -> bool:
    """Whether the additions hold something of the right kind where the element was."""
    kinds = ("door", "window", "passage") if kind.startswith("door") else ("wall", "slab", "column")
    for addition in report.additions:
        a, b = np.array(addition.lower), np.array(addition.upper)
        overlap = np.minimum(b, high + 0.1) - np.maximum(a, low - 0.1)
        if addition.guess in kinds and (overlap > 0).all():
            return True
    return False


def edits_table(outcomes: Sequence[Outcome]) -> str:
    """A row a kind."""
    rows: list[list[str]] = []
    every = [entry for outcome in outcomes for entry in outcome.judged]
    for kind in [*MAKERS, "all"]:
        mine = [entry for entry in every if kind in (entry[0], "all")]
        seen = [entry for entry in mine if entry[1]]
        told = [entry[3] for entry in seen if entry[3] is not None]
        right = sum(entry[2] for entry in seen)
        rows.append([kind, str(len(mine)), str(len(seen)), str(right), f"{sum(told)} of {len(told)}" if told else "–"])
    return table(["change", "made", "seen", "right status", "shift, turn told"], rows)


def unedited_table(bases: dict[str, Report]) -> str:
    """The unchanged models: statuses and accuracy."""
    rows: list[list[str]] = []
    for name, base in bases.items():
        counts = base.counts()
        loa = Counter(e.loa for e in base.elements if e.loa)
        good = sum(loa[band] for band in ("LOA50", "LOA40", "LOA30"))
        faults = counts["out_of_tolerance"] + counts["missing"]
        rows.append([name, str(counts["in_tolerance"]), str(faults), f"{good} of {sum(loa.values())}"])
    return "The unchanged models:\n\n" + table(["scene", "in tolerance", "at fault", "LOA30 or better"], rows)


def false_line(outcomes: Sequence[Outcome]) -> str:
    """False findings over all runs."""
    false, unchanged = sum(o.false for o in outcomes), sum(o.unchanged for o in outcomes)
    return f"False findings on unchanged elements: {false} of {unchanged} ({100 * false / max(unchanged, 1):.1f} %)."


if __name__ == "__main__":
    sys.exit(main())
