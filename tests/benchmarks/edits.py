"""Seeded changes to models of simulated scenes, verified against the scans of the unchanged ones.

    ./run edits SCENES_DIR [--scenes NAME ...] [--unedited PATH ...] [--runs N] [--edits N] [--out DIR]

A scene is a folder with e57/ and reference.ifc, the model in scan coordinates, and what tells which element each point
lies on: labels.npz, ply/merged.ply, truth.json. Each run makes some changes to walls, slabs, columns, doors and windows
of one model, verifies it at 10 mm, and compares what was found with what was changed. Models of other scenes (with
e57/, reference.ifc and truth.json) are verified unchanged. The tables go to docs/results.md.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np
from conversion import COMMAND
from document import ROOT, table, write_section
from edit_kinds import MAKERS, Edit, Subject
from edit_truth import Seen, load_seen, load_truth

from scan2bim.verify.ifc_model import IfcModel, read_model
from scan2bim.verify.result import FAULTS, Addition, ElementResult, Report, load_report

OUT = ROOT / "out" / "edits"
TOLERANCE = 0.010
BORDER = 0.002
"""Metres round the tolerance within which either status is right."""
SHIFT_LIMIT, TURN_LIMIT = 0.003, math.radians(0.1)
LEAST_SEEN = 1.5
"""Square metres of a wall or slab that the scans show, of those that are changed."""
SHOWN = 0.5
"""Share of what is drawn and was not built that rays went through, or of what is walled up that points lie on, on one
side of it, from which on it counts as seen."""

INTRODUCTION = """\
## Verification

`./run edits`: seeded changes to the scenes' models, verified at 10 mm against the scans of the unchanged buildings.
*Seen* is told by the scenes' labelled points, not by the program: of walls and slabs 1.5 m2, doors and windows that are
observable, and of moved and resized ones half of what lies between a drawn and a built side that rays came to on one
face of the wall, of what was not built half of one side that rays went through, of what is walled up half of it with
points.
*Right* is the status: out of tolerance where it was shifted, turned, thickened, lowered, moved or resized by more than
10 mm, missing where it was not built or is walled up; what is not drawn must be an addition of the right kind at its
place. Slabs are not lowered into others that they lie on, nor ceilings that are drawn twice. *Told*: of the right ones,
those told within 3 mm and 0.1 degrees, of moved openings if both sides can be seen; of a sloping roof the part across
it. The scenes hang some doors by chance otherwise than the models draw them:
that is a finding, and no false one."""


def main() -> int:
    """Edit, verify, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes_dir", type=Path)
    parser.add_argument("--scenes", nargs="*", default=["duplex_mixed", "fzk_house", "jasmin_asmodelled"])
    parser.add_argument("--unedited", nargs="*", type=Path, default=[Path("quick_house")])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--edits", type=int, default=10)
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    outcomes: list[Outcome] = []
    bases: dict[str, Report] = {}
    scenes: dict[str, Original] = {}
    for number in range(options.runs):
        name = options.scenes[number % len(options.scenes)]
        scene, work = options.scenes_dir / name, options.out / name
        if name not in bases:
            bases[name] = verified(scene / "reference.ifc", scene, work, "base")
            scenes[name] = Original(scene / "reference.ifc", read_model(scene / "reference.ifc"), load_seen(scene))
        model = work / f"edited_{number}.ifc"
        edits = edit_model(scenes[name], model, options.edits, number)
        outcomes.append(compare(scenes[name], verified(model, scene, work, f"run_{number}"), edits))
        print(name, *outcomes[-1].lines, sep="\n  ", file=sys.stderr, flush=True)
    for scene in (options.scenes_dir / path for path in options.unedited):
        model = scene / "reference.ifc"
        bases[scene.name] = verified(model, scene, options.out / scene.name, "base")
        scenes[scene.name] = Original(model, read_model(model), load_truth(scene))
    text = section(outcomes, bases, scenes)
    write_section("edits", text)
    print(text)
    return 0


def section(outcomes: Sequence[Outcome], bases: dict[str, Report], scenes: dict[str, Original]) -> str:
    """The text for docs/results.md."""
    return "\n\n".join([INTRODUCTION, edits_table(outcomes), unedited_table(bases, scenes), false_line(outcomes)])


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


@dataclass(frozen=True, slots=True, eq=False)
class Original:
    """The unchanged model of a scene, and what its scans show."""

    path: Path
    model: IfcModel
    seen: Seen

    def host(self, guid: str) -> str:
        """GlobalId of the wall of a door, window or opening, "" for none."""
        holders = {e.guid: e.host for e in self.model.elements if e.host}
        while guid in holders:
            guid = holders[guid] or ""
        return guid

    def hung_otherwise(self) -> set[str]:
        """Doors that the scene hangs otherwise than the model draws them, by chance: open ones show it."""
        return self.seen.hung_otherwise({e.guid: e.hanging for e in self.model.elements if e.hanging is not None})

    def pool(self, kind: str) -> list[str]:
        """GlobalIds of the seen elements that a change may be made to."""
        if kind.startswith("door"):
            fills = [e.guid for e in self.model.elements if e.role == "fill" and e.host]
            return sorted(g for g in fills if self.seen.is_seen_opening(g) and self.host(g) != g)
        classes = ("IfcWall", "IfcWallStandardCase") if kind.startswith("wall") else ("IfcSlab", "IfcCovering")
        of_class = [e.guid for e in self.model.elements if e.ifc_class in classes]
        return sorted(guid for guid in of_class if self.seen.area(guid) > LEAST_SEEN)


def edit_model(original: Original, target: Path, count: int, seed: int) -> list[Edit]:
    """Write a changed copy and tell the changes: of seen elements, no two of one wall."""
    rng = np.random.default_rng(1000 + seed)
    file: Any = ifcopenshell.open(str(original.path))
    bodies = {e.guid: e.vertices for e in original.model.elements}
    pools = {kind: original.pool(kind) for kind in MAKERS}
    used: set[str] = set()
    edits: list[Edit] = []
    kinds = list(MAKERS)
    for attempt in range(60 * count):
        if len(edits) == count:
            break
        kind = kinds[(len(edits) + count * seed + attempt // 40) % len(kinds)]
        pool = [g for g in pools[kind] if original.host(g) not in used]
        if not pool:
            continue
        guid = pool[int(rng.integers(len(pool)))]
        edit = MAKERS[kind](Subject(file, file.by_guid(guid), bodies, original.seen, rng))
        if edit is not None:
            host = original.host(guid)
            edits.append(replace(edit, kind=kind, host="" if host == guid else host))
            used |= {host} if kind != "column not built" else set()
    target.parent.mkdir(parents=True, exist_ok=True)
    file.write(str(target))
    return edits


@dataclass(frozen=True, slots=True)
class Outcome:
    """Of a run: for each change its kind, whether it was seen, right, and its size told (None: none to tell); then the
    unchanged elements with a verdict and those of them that were found at fault; additions that are no change; lines
    for people.
    """

    judged: tuple[tuple[str, bool, bool, bool | None], ...]
    unchanged: int
    false: int
    added: int
    lines: tuple[str, ...]


def compare(original: Original, report: Report, edits: Sequence[Edit]) -> Outcome:
    """What was found of the changes and beside them."""
    seen, otherwise = original.seen, original.hung_otherwise()
    results = {e.guid: e for e in report.elements}
    judged = [_entry(seen, edit, results.get(edit.guid), report) for edit in edits]
    touched = ({e.guid for e in edits} | {e.host for e in edits}) - {""}
    rest = [e for e in report.elements if e.guid not in touched and _host(e) not in touched]
    verdicts = [e for e in rest if e.status in ("in_tolerance", *FAULTS)]
    false = [e for e in verdicts if e.status in FAULTS and not (e.guid in otherwise and _swings_otherwise(e))]
    added = [a for a in report.additions if a.guess != "object" and not any(_meets(a, edit) for edit in edits)]
    lines = [_line(edit, entry, results.get(edit.guid)) for edit, entry in zip(edits, judged, strict=True)]
    lines += [f"FALSE {e.ifc_class} {e.name} {e.guid} {e.status} {e.reason}" for e in false]
    lines += [f"ADDED {a.guess} {a.lower} {a.upper} {a.sentence}" for a in added]
    return Outcome(tuple(judged), len(verdicts), len(false), len(added), tuple(lines))


def _entry(seen: Seen, edit: Edit, found: ElementResult | None, report: Report) -> tuple[str, bool, bool, bool | None]:
    """As in ``Outcome.judged``. How far an opening was moved is told where both of its sides can be seen."""
    right, told = _judge(edit, found, report)
    hidden = bool(edit.strips) and min(reached(seen, edit)) < SHOWN
    return edit.kind, is_seen(seen, edit), right, None if hidden else told


def _swings_otherwise(element: ElementResult) -> bool:
    return element.opening is not None and element.opening.finding == "other_swing"


def _host(element: ElementResult) -> str:
    return (element.opening.host or "") if element.opening else ""


def is_seen(seen: Seen, edit: Edit) -> bool:
    """Whether the scans show that it was changed: all that is changed is seen, of what is drawn anew its place."""
    if edit.kind == "door walled up":
        return max(seen.covered(r) for r in edit.rectangles) >= SHOWN
    if edit.strips:
        return max(reached(seen, edit)) >= SHOWN
    if not edit.rectangles:
        return True
    covered = max(seen.covered(r) for r in edit.rectangles)
    return covered < 0.2 and max(seen.crossed(r) for r in edit.rectangles) >= SHOWN


def reached(seen: Seen, edit: Edit) -> list[float]:
    """Which share of each strip between drawn and built sides rays came to, on the face where it is more."""
    return [max(seen.reached(face) for face in strip) for strip in edit.strips]


def _line(edit: Edit, entry: tuple[str, bool, bool, bool | None], found: ElementResult | None) -> str:
    kind, seen, right, told = entry
    text = f"{kind} {edit.guid} {edit.size:.4f}: seen {seen}, right {right}, told {told}"
    if (not seen or right) and told is not False:
        return text
    what = found.opening.model_dump(exclude_none=True) if found and found.opening else found and found.fit
    return f"{text}: {found.ifc_class if found else edit.box} {found.status if found else ''} {what}"


def _judge(edit: Edit, found: ElementResult | None, report: Report) -> tuple[bool, bool | None]:
    if edit.box is not None:
        return any(_is_it(addition, edit) for addition in report.additions), None
    if found is None:
        return False, None
    if edit.kind.endswith(("not built", "walled up")):
        return found.status == "missing", None
    if found.status not in ("in_tolerance", *FAULTS):
        return False, None
    either = abs(edit.extent - TOLERANCE) < BORDER
    right = either or (found.status in FAULTS) == (edit.extent > TOLERANCE)
    return right, _told(edit, found) if right else None


def _told(edit: Edit, found: ElementResult) -> bool:
    if edit.kind in ("door moved", "door resized"):
        opening = found.opening
        size = opening and (opening.shift_along if edit.kind == "door moved" else opening.width_change)
        return size is not None and abs(abs(size) - edit.size) <= SHIFT_LIMIT
    if found.fit is None:
        return False
    if edit.kind == "wall turned":
        return abs(found.fit.turn + edit.size) <= TURN_LIMIT
    if edit.kind == "wall thickened":
        medians = [abs(f.median) for f in found.faces if f.median is not None and f.measured > 0.5]
        return any(abs(m - edit.size) <= SHIFT_LIMIT for m in medians)
    told = math.hypot(*found.fit.shift)
    # What moves along its own surface looks as before: of a sloping roof that was lowered one sees the part across it.
    shown = abs(found.fit.shift[2]) / max(told, 1e-9) if edit.kind == "slab lowered" else 1.0
    return abs(told - edit.size * shown) <= SHIFT_LIMIT


def _is_it(addition: Addition, edit: Edit) -> bool:
    """Whether an addition is what is not drawn: of the right kind, the middle of one in the box of the other."""
    kinds = ("door", "window", "passage") if edit.kind.startswith("door") else ("wall",)
    assert edit.box is not None
    a, b = np.array([addition.lower, addition.upper]), edit.box
    inside = [((x.mean(axis=0) > y[0] - 0.1) & (x.mean(axis=0) < y[1] + 0.1)).all() for x, y in ((a, b), (b, a))]
    return addition.guess in kinds and any(inside) and _meets(addition, edit)


def _meets(addition: Addition, edit: Edit) -> bool:
    """Whether an addition overlaps what is not drawn."""
    if edit.box is None:
        return False
    low, high = np.array(addition.lower) - 0.1, np.array(addition.upper) + 0.1
    return bool((np.minimum(high, edit.box[1]) > np.maximum(low, edit.box[0])).all())


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


def unedited_table(bases: dict[str, Report], scenes: dict[str, Original]) -> str:
    """The unchanged models: statuses and accuracy, and doors that the scenes hang otherwise than drawn."""
    rows: list[list[str]] = []
    for name, base in bases.items():
        counts = base.counts()
        loa = Counter(e.loa for e in base.elements if e.loa)
        good = sum(loa[band] for band in ("LOA50", "LOA40", "LOA30"))
        swings = {e.guid for e in base.elements if _swings_otherwise(e)}
        otherwise = scenes[name].hung_otherwise()
        faults = counts["out_of_tolerance"] + counts["missing"] - len(swings & otherwise)
        told = f"{len(swings & otherwise)} of {len(otherwise)}"
        rows.append([name, str(counts["in_tolerance"]), str(faults), f"{good} of {sum(loa.values())}", told])
    head = ["scene", "in tolerance", "at fault", "LOA30 or better", "open doors hung otherwise, told"]
    return "The unchanged models:\n\n" + table(head, rows)


def false_line(outcomes: Sequence[Outcome]) -> str:
    """False findings over all runs."""
    false, unchanged = sum(o.false for o in outcomes), sum(o.unchanged for o in outcomes)
    share = 100 * false / max(unchanged, 1)
    added = sum(o.added for o in outcomes)
    return (
        f"False findings: {false} of {unchanged} unchanged elements with a verdict ({share:.1f} %). Additions told as "
        f"more than an object where nothing was changed: {added} in {len(outcomes)} runs."
    )


if __name__ == "__main__":
    sys.exit(main())
