"""What an IFC model says that a building has: any tool's, IFC2X3, IFC4 or IFC4X3.

Openings are IfcOpeningElement in their walls, whatever fills them; doors and windows in none are taken by their own
shape. A model made from scans may state how sure it is of an element: the property ``Confidence`` of ``EVIDENCE``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ifcopenshell.util.element
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.truth.ifc_file import Entity, IfcModel, Mesh, stacked
from scan2bim.truth.ifc_shapes import Strip, corners_in, ends_of, flat_strip, outline_of, ring_of, wall_strip
from scan2bim.truth.values import (
    Corners,
    DoorTruth,
    Hinge,
    OpeningTruth,
    SpaceTruth,
    State,
    StoreyTruth,
    Swing,
    Truth,
    WallTruth,
    WindowTruth,
)

F64 = NDArray[np.float64]

LOWEST_CEILING = 1.8
"""Metres over the floor from which on a covering hangs as a ceiling."""
EVIDENCE = "S2B_Evidence"
"""The property set in which scan2bim's models state confidence and a door's state."""
STATES: dict[str, State] = {
    "closed": "closed",
    "ajar": "ajar",
    "half-open": "ajar",
    "half_open": "ajar",
    "open": "open",
}


@dataclass(frozen=True, slots=True, eq=False)
class HostedOpening:
    """An opening, or what fills it, with the stretch of wall that it is in."""

    void: Entity | None
    fill: Entity | None
    wall: Entity | None
    strip: Strip
    corners: Corners


@dataclass(frozen=True, slots=True, eq=False)
class IfcReading:
    """All of an IFC file that the truth and the simulator need."""

    model: IfcModel
    hosted: tuple[HostedOpening, ...]
    walls: dict[int, Mesh]
    truth: Truth


def read_ifc(path: Path) -> IfcReading:
    """Read a model. Raises InputError where it is no IFC file."""
    model = IfcModel(path)
    walls = {e.id(): mesh for e, mesh in model.meshes(model.of("IfcWall"), voids=False)}
    parts = model.of("IfcOpeningElement", "IfcDoor", "IfcWindow")
    shapes = {e.id(): mesh for e, mesh in model.meshes(parts, voids=False)}
    hosted = tuple(_hosted(model, walls, shapes))
    storeys = _storeys(model)
    spaces = _spaces(model)
    truth = Truth(
        scene=path.stem,
        storeys=tuple(_with_height(storey, spaces) for storey in storeys.values()),
        walls=tuple(_wall(model, model.file.by_id(number), mesh) for number, mesh in walls.items()),
        doors=tuple(_door(model, one, storeys) for one in hosted if _is(one, "IfcDoor")),
        windows=tuple(_window(model, one, storeys) for one in hosted if _is(one, "IfcWindow")),
        openings=(
            *(_opening(model, one, storeys) for one in hosted if one.fill is None),
            *(_opening(model, one, storeys) for one in _curtain_walls(model)),
        ),
        spaces=tuple(spaces),
    )
    return IfcReading(model, hosted, walls, truth)


def label(element: Entity | None) -> str:
    """A name for people that is unlike that of other elements: its name and its GlobalId."""
    if element is None:
        return ""
    return f"{element.Name or element.is_a()[3:]} [{element.GlobalId}]"


def _is(one: HostedOpening, name: str) -> bool:
    return one.fill is not None and bool(one.fill.is_a(name))


def _hosted(model: IfcModel, walls: dict[int, Mesh], shapes: dict[int, Mesh]) -> list[HostedOpening]:
    found: list[HostedOpening] = []
    filled: set[int] = set()
    for void in model.of("IfcOpeningElement"):
        host = void.VoidsElements[0].RelatingBuildingElement if void.VoidsElements else None
        if host is None or host.id() not in walls or getattr(void, "PredefinedType", None) == "RECESS":
            continue
        fills = [relation.RelatedBuildingElement for relation in void.HasFillings or ()]
        fills = [fill for fill in fills if fill.is_a("IfcDoor") or fill.is_a("IfcWindow")]
        filled.update(fill.id() for fill in fills)
        mesh = shapes.get(void.id()) or next((shapes[f.id()] for f in fills if f.id() in shapes), None)
        if mesh is None:
            continue
        middle = (mesh.vertices[:, :2].min(axis=0) + mesh.vertices[:, :2].max(axis=0)) / 2
        strip = wall_strip(walls[host.id()], middle, _axis(model, fills[0] if fills else host))
        if strip is None:
            continue
        if len(fills) <= 1:
            found.append(HostedOpening(void, fills[0] if fills else None, host, strip, corners_in(strip, mesh)))
            continue
        # Several doors and windows in one opening: each by its own shape.
        found += [_filling(void, f, host, strip, shapes[f.id()]) for f in fills if f.id() in shapes]
    for fill in model.of("IfcDoor", "IfcWindow"):
        if fill.id() not in filled and fill.id() in shapes:
            strip = flat_strip(shapes[fill.id()], _axis(model, fill))
            found.append(_filling(None, fill, None, strip, shapes[fill.id()]))
    return found


def _curtain_walls(model: IfcModel) -> list[HostedOpening]:
    """Glazed fronts that are no walls, as openings without a wall: by their own shape or by all their parts'."""
    owner = {
        part.id(): wall
        for wall in model.of("IfcCurtainWall")
        for part in (wall, *(p for relation in wall.IsDecomposedBy or () for p in relation.RelatedObjects))
    }
    parts: dict[int, list[Mesh]] = {}
    for element, mesh in model.meshes([model.file.by_id(number) for number in owner], voids=False):
        parts.setdefault(owner[element.id()].id(), []).append(mesh)
    found: list[HostedOpening] = []
    for number, meshes in parts.items():
        whole = stacked(meshes)
        strip = flat_strip(whole)
        found.append(HostedOpening(model.file.by_id(number), None, None, strip, corners_in(strip, whole)))
    return found


def _filling(void: Entity | None, fill: Entity, wall: Entity | None, strip: Strip, mesh: Mesh) -> HostedOpening:
    return HostedOpening(void, fill, wall, strip, corners_in(strip, mesh))


def _axis(model: IfcModel, element: Entity) -> F64 | None:
    """The element's own x axis in plan."""
    return model.placement(element)[:2, 0] if element.ObjectPlacement is not None else None


def _wall(model: IfcModel, wall: Entity, mesh: Mesh) -> WallTruth:
    strip = wall_strip(mesh, like=_axis(model, wall)) or flat_strip(mesh)
    start, end = ends_of(strip, mesh)
    base, top = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    known = model.properties(wall)
    external, sure = known.get("Pset_WallCommon.IsExternal"), known.get(f"{EVIDENCE}.Confidence")
    return WallTruth(
        name=label(wall),
        storey=label(model.storey(wall)),
        start=start,
        end=end,
        thickness=strip.thickness,
        base=base,
        height=top - base,
        external=external if isinstance(external, bool) else None,
        confidence=float(sure) if isinstance(sure, int | float) else None,
    )


def _common(model: IfcModel, one: HostedOpening, storeys: dict[int, StoreyTruth]) -> dict[str, Any]:
    """What all openings have; keywords of OpeningTruth."""
    element = one.fill if one.fill is not None else one.void
    storey = model.storey(element)
    floor = storeys[storey.id()].elevation if storey is not None and storey.id() in storeys else one.corners[0][2]
    sure = model.properties(element).get(f"{EVIDENCE}.Confidence")
    low, high = np.array(one.corners[0]), np.array(one.corners[2])
    return {
        "name": label(element),
        "storey": label(storey),
        "wall": label(one.wall),
        "corners": one.corners,
        "width": float(np.linalg.norm((high - low)[:2])),
        "height": float(high[2] - low[2]),
        "sill": float(low[2] - floor),
        "confidence": float(sure) if isinstance(sure, int | float) else None,
    }


def _opening(model: IfcModel, one: HostedOpening, storeys: dict[int, StoreyTruth]) -> OpeningTruth:
    return OpeningTruth(**_common(model, one, storeys))


def _window(model: IfcModel, one: HostedOpening, storeys: dict[int, StoreyTruth]) -> WindowTruth:
    return WindowTruth(**_common(model, one, storeys))


def _door(model: IfcModel, one: HostedOpening, storeys: dict[int, StoreyTruth]) -> DoorTruth:
    known = model.properties(one.fill)
    hinge, swing, leaves = _hanging(model, one)
    angle = known.get(f"{EVIDENCE}.LeafAngle")
    return DoorTruth(
        **_common(model, one, storeys),
        state=STATES.get(str(known.get(f"{EVIDENCE}.State")), "unknown"),
        angle=float(angle) if isinstance(angle, int | float) else None,
        hinge=hinge,
        swing=swing,
        leaves=leaves,
    )


def _hanging(model: IfcModel, one: HostedOpening) -> tuple[Hinge, Swing, int | None]:
    """Hinge, swing and number of leaves from the operation type and the door's own axes.

    A door's own y axis points where its leaf swings to; left and right are those of one who looks along it.
    """
    door = one.fill
    operation = None if door is None else operation_of(door)
    if door is None or operation is None or door.ObjectPlacement is None:
        return "unknown", "unknown", None
    axes = model.placement(door)
    swing: Swing = "left" if float(axes[:2, 1] @ one.strip.left) > 0 else "right"
    if operation in ("SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT"):
        at_own_start = operation.endswith("LEFT")
        same_way = float(axes[:2, 0] @ one.strip.along) > 0
        return ("start" if at_own_start == same_way else "end"), swing, 1
    if operation.startswith("DOUBLE_DOOR"):
        return "both", swing if "DOUBLE_SWING" not in operation else "both", 2
    return "unknown", "unknown", None


def operation_of(door: Entity) -> str | None:
    """The door's OperationType, its own or its type's or style's; None where nothing is said."""
    own = getattr(door, "OperationType", None)
    kind = ifcopenshell.util.element.get_type(door)
    found = own if own not in (None, "NOTDEFINED") else getattr(kind, "OperationType", None)
    return None if found in (None, "NOTDEFINED", "USERDEFINED") else str(found)


def _storeys(model: IfcModel) -> dict[int, StoreyTruth]:
    """By entity number, from the lowest up."""
    found: dict[int, StoreyTruth] = {}
    for storey in model.of("IfcBuildingStorey"):
        if storey.ObjectPlacement is not None:
            level = float(model.placement(storey)[2, 3])
        else:
            level = float(storey.Elevation or 0.0) * model.unit
        found[storey.id()] = StoreyTruth(name=label(storey), elevation=level)
    return dict(sorted(found.items(), key=lambda item: item[1].elevation))


def _with_height(storey: StoreyTruth, spaces: list[SpaceTruth]) -> StoreyTruth:
    heights = [space.height for space in spaces if space.storey == storey.name]
    return storey.model_copy(update={"height": float(np.median(heights))}) if heights else storey


def read_spaces(path: Path) -> tuple[SpaceTruth, ...]:
    """The spaces of a model alone. Raises InputError where it is no IFC file."""
    return tuple(_spaces(IfcModel(path)))


def _ceilings(model: IfcModel) -> list[tuple[BaseGeometry, float]]:
    """Outline and underside (z) of each ceiling covering."""
    found: list[tuple[BaseGeometry, float]] = []
    ceilings = [c for c in model.of("IfcCovering") if c.PredefinedType in (None, "CEILING", "NOTDEFINED")]
    for _, mesh in model.meshes(ceilings, voids=False):
        outline = outline_of(mesh)
        if outline is not None:
            found.append((outline, float(mesh.vertices[:, 2].min())))
    return found


def _clear_top(outline: Polygon, base: float, top: float, ceilings: Sequence[tuple[BaseGeometry, float]]) -> float:
    """Up to where a room is open: to the suspended ceiling that most of it has, where a space goes up to the slab."""
    lower = [
        under
        for area, under in ceilings
        if base + LOWEST_CEILING < under < top and area.intersection(outline).area > outline.area / 2
    ]
    return min(lower, default=top)


def _spaces(model: IfcModel) -> list[SpaceTruth]:
    found: list[SpaceTruth] = []
    ceilings = _ceilings(model)
    for space, mesh in model.meshes(model.of("IfcSpace"), voids=False):
        outline = outline_of(mesh)
        if outline is None:
            continue
        base, top = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
        top = _clear_top(outline, base, top, ceilings)
        found.append(
            SpaceTruth(
                name=label(space),
                storey=label(model.storey(space)),
                outline=ring_of(outline.exterior),
                holes=tuple(ring_of(hole) for hole in outline.interiors),
                area=shapely.area(outline),
                base=base,
                height=top - base,
            )
        )
    return found
