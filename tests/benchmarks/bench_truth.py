"""The truth of a bench's scene in the package's own values, for the measures of ``scan2bim evaluate``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from scan2bim.truth.ifc import read_spaces
from scan2bim.truth.values import (
    Corners,
    DoorTruth,
    Hinge,
    OpeningTruth,
    SpaceTruth,
    StationTruth,
    StoreyTruth,
    Swing,
    Truth,
    WallTruth,
    WindowTruth,
)

Known = dict[str, Any]
HINGES: dict[str, Hinge] = {"u0": "start", "u1": "end"}


def bench_truth(path: Path) -> Truth:
    """Read a scene's truth.json. Names are GlobalIds; what the bench calls not observable is wholly hidden here."""
    known: Known = json.loads(path.read_text(encoding="utf-8"))
    heights = _clear_heights(path.with_name("reference.ifc"))
    return Truth(
        scene=path.parent.name,
        storeys=tuple(_storey(s) for s in known["storeys"] if s["occupied"] and s["floor"] is not None),
        walls=tuple(_wall(w, number) for w in known["walls"] for number in range(len(w["centreline"]))),
        doors=tuple(_door(d) for d in known["doors"]),
        windows=tuple(WindowTruth(**_opening(w)) for w in known["windows"]),
        openings=tuple(OpeningTruth(**_opening(o)) for o in known["openings"]),
        spaces=tuple(_space(s, number, heights) for s in known["spaces"] for number in range(len(s["polygons"]))),
        stations=tuple(_station(s) for s in known["stations"]),
    )


def _storey(known: Known) -> StoreyTruth:
    return StoreyTruth(name=known["guid"], elevation=known["floor"])


def _wall(known: Known, number: int) -> WallTruth:
    """One stretch of a wall. A curtain wall is neither asked for nor wrong."""
    start, end, thickness = known["centreline"][number]
    seen = known["observable"] and not known["curtain"]
    return WallTruth(
        name=known["guid"] if number == 0 else f"{known['guid']} {number}",
        storey=known["storey"],
        start=(start[0], start[1]),
        end=(end[0], end[1]),
        thickness=thickness,
        base=known["z0"],
        height=known["height"],
        occlusion=min(0.99, 1 - known["seen_m2"] / max(known["exposed_m2"], 1e-9)) if seen else 1.0,
    )


def _opening(known: Known) -> Known:
    """What all openings have; one in a storey that was not scanned has no sill."""
    return {
        "name": known["guid"],
        "storey": known["storey"] or "",
        "wall": known["host_wall"] or "",
        "corners": _corners(known),
        "width": known["width"],
        "height": known["height"],
        "sill": 0.0 if known["sill"] is None else known["sill"],
        "occlusion": 1 - known["visible"] if known["observable"] else 1.0,
    }


def _corners(known: Known) -> Corners:
    a, b, c, d = ((x, y, z) for x, y, z in known["corners"])
    return a, b, c, d


def _door(known: Known) -> DoorTruth:
    (x0, y0, _), (x1, y1, _), *_ = known["corners"]
    swing: Swing = "unknown"
    if known["opens_to"] is not None:
        swing = "left" if float(np.dot(known["opens_to"], (y0 - y1, x1 - x0))) > 0 else "right"
    hinge: Hinge = HINGES.get(known["hinge"], "unknown")
    return DoorTruth(
        **_opening(known),
        state=known["state"],
        angle=None if known["angle"] is None else math.radians(known["angle"]),
        hinge="both" if known["leaves"] == 2 and hinge != "unknown" else hinge,
        swing=swing,
        leaves=known["leaves"],
    )


def _clear_heights(reference: Path) -> dict[str, float]:
    """Heights of the spaces of a scene's model under suspended ceilings, by GlobalId."""
    spaces = read_spaces(reference) if reference.exists() else ()
    return {space.name.rpartition("[")[2].rstrip("]"): space.height for space in spaces}


def _space(known: Known, number: int, heights: dict[str, float]) -> SpaceTruth:
    rings = [tuple((x, y) for x, y in ring[:-1]) for ring in known["polygons"][number]]
    return SpaceTruth(
        name=known["guid"] if number == 0 else f"{known['guid']} {number}",
        storey=known["storey"] or "",
        outline=rings[0],
        holes=tuple(rings[1:]),
        area=float(shapely.area(shapely.Polygon(rings[0], rings[1:]))),
        base=known["z0"],
        height=min(known["height"], heights.get(known["guid"], known["height"])),
    )


def _station(known: Known) -> StationTruth:
    x, y, z = known["pos"]
    return StationTruth(name=known["name"], position=(x, y, z), room=known["room"] or "")
