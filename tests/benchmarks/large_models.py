"""Models of many elements round a scanned scene: what verifying them costs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.unit as unit_util
from conversion import COMMAND
from document import table
from measure import measure

SIZES = (1000, 10_000)
"""Numbers of walls that are drawn beside the scene's own elements."""
LENGTH, THICKNESS, HEIGHT = 3.0, 0.1, 2.7
NONE = "none"
APART = {"beyond the scans' reach": (4.0, 3.0, 3.0), "within 25 m of a station": (3.2, 0.4, 3.0)}
"""Metres from a wall to the next along, across and above, for each way of drawing."""
SHAPE = {"beyond the scans' reach": (100, 100), "within 25 m of a station": (10, 100)}
"""Walls along and across on each level."""
START = {"beyond the scans' reach": (100.0, 100.0), "within 25 m of a station": (-16.0, -20.0)}


def large_table(scene: Path, work: Path) -> str:
    """A row for each size and place of the walls; the scene has e57/ and reference.ifc."""
    rows: list[list[str]] = []
    # The first run fills the caches of compiled code.
    for place, size in [(NONE, 0), (NONE, 0), *((place, size) for place in SHAPE for size in SIZES)]:
        model = work / f"walls_{size}.ifc"
        elements = write_walls(scene / "reference.ifc", model, place, size)
        command = [*COMMAND[:-1], "verify", str(model), str(scene / "e57"), "-o", str(work / "large")]
        command += ["--tolerance", "10mm", "--placing", "stated", "--work", str(work / "verify"), "--quiet"]
        cost = measure([*command, "--rerun-from", "survey"])
        rows.append([place, str(elements), f"{cost.cpu:.1f}", f"{cost.memory / 2**20:.0f}"])
        print(*rows[-1], file=sys.stderr, flush=True)
    return table(["walls drawn", "elements", "verify, CPU s", "memory MiB"], rows[1:])


def write_walls(source: Path, target: Path, place: str, count: int) -> int:
    """A copy of a model with more walls in rows and levels; gives the number of its elements."""
    file: Any = ifcopenshell.open(str(source))
    scale, make = unit_util.calculate_unit_scale(file), file.create_entity
    bodies = [r for w in file.by_type("IfcWall") if w.Representation for r in w.Representation.Representations]
    context = next(r.ContextOfItems for r in bodies if r.RepresentationIdentifier == "Body")
    flat = make("IfcAxis2Placement2D", make("IfcCartesianPoint", (0.0, 0.0)), make("IfcDirection", (1.0, 0.0)))
    profile = make("IfcRectangleProfileDef", "AREA", None, flat, LENGTH / scale, THICKNESS / scale)
    for number in range(count):
        along, across = SHAPE[place]
        level, inside = divmod(number, along * across)
        steps = (inside % along, inside // along, level)
        start = (*START[place], 0.0)
        corner = [(s + k * a) / scale for s, k, a in zip(start, steps, APART[place], strict=True)]
        solid = make("IfcExtrudedAreaSolid", profile, _axes(make, [0.0, 0.0, 0.0]), _up(make), HEIGHT / scale)
        shape = make("IfcShapeRepresentation", context, "Body", "SweptSolid", [solid])
        wall = make("IfcWall", ifcopenshell.guid.new(), Name=f"wall {number}")
        wall.ObjectPlacement = make("IfcLocalPlacement", None, _axes(make, corner))
        wall.Representation = make("IfcProductDefinitionShape", None, None, [shape])
    target.parent.mkdir(parents=True, exist_ok=True)
    file.write(str(target))
    return len(file.by_type("IfcBuildingElement"))


def _axes(make: Any, corner: list[float]) -> Any:
    return make(
        "IfcAxis2Placement3D", make("IfcCartesianPoint", corner), _up(make), make("IfcDirection", (1.0, 0.0, 0.0))
    )


def _up(make: Any) -> Any:
    return make("IfcDirection", (0.0, 0.0, 1.0))
