"""Doors and windows: types by size and operation, occurrences in their openings."""

from __future__ import annotations

from dataclasses import replace

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity, Shared
from scan2bim.exporters.ifc_fill_types import DOOR_OPERATIONS, WINDOW_PARTITIONINGS, Form, door_type, window_type
from scan2bim.exporters.ifc_properties import Value, measure, text
from scan2bim.exporters.ifc_shapes import axes, representation, shape
from scan2bim.exporters.ifc_styles import FRAME
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Colour, Door, Opening, Wall, Window
from scan2bim.model.queries import wall_arc
from scan2bim.model.wall_measures import reach_across

DEEPEST_FRAME = 0.25
"""Metres. In thicker walls the frame is not taken to fill the wall's depth but to stand at one of its faces."""

WINDOW_FRAME = 0.08
"""Metres. Depth of a window's frame, unless the wall is thinner."""

LEAF = 0.04
"""Metres. A leaf's thickness where it was not measured."""

_HANDED = ("NOTDEFINED", "SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT", "DOUBLE_SWING_LEFT", "DOUBLE_SWING_RIGHT")


def add_fill(draft: Draft, void: Entity, wall: Wall, opening: Opening, fill: Door | Window) -> Entity:
    """The door or window in an opening, with its type, relations and properties."""
    if isinstance(fill, Door):
        entity = _door(draft, void, wall, opening, fill)
    else:
        entity = _window(draft, void, wall, opening, fill)
    draft.ifc.root(
        "IfcRelFillsElement", f"fill of {opening.id}", RelatingOpeningElement=void, RelatedBuildingElement=entity
    )
    width, height = opening.width.value, opening.height.value
    name = "Door" if isinstance(fill, Door) else "Window"
    draft.properties.common(
        entity,
        f"Pset_{name}Common",
        {
            "Reference": ("IfcIdentifier", f"{name} {width * 1000:.0f} x {height * 1000:.0f} mm"),
            "IsExternal": measure("IfcBoolean", wall.external),
        },
    )
    draft.classes.classify(entity)
    draft.properties.evidence(entity, fill, _door_words(fill) if isinstance(fill, Door) else None)
    draft.properties.quantities(
        entity,
        f"Qto_{name}BaseQuantities",
        {"Width": width, "Height": height, "Perimeter": 2 * (width + height), "Area": width * height},
    )
    return entity


def door_operation(door: Door) -> tuple[str, bool]:
    """The door's operation, and whether it is turned about so that its leaf swings to the right of the wall's axis.

    A door's own y axis points where the leaf swings to; left and right are those of one who looks along it. Not
    turned, x and y are the wall's.
    """
    turned = door.swing_side == "right"
    known = door.hinge_side != "unknown" and door.swing_side != "unknown"
    if known and door.operation in _HANDED:
        side = "LEFT" if (door.hinge_side == "start") != turned else "RIGHT"
        return f"{'DOUBLE' if door.operation.startswith('DOUBLE') else 'SINGLE'}_SWING_{side}", turned
    return (door.operation if door.operation in DOOR_OPERATIONS else "NOTDEFINED"), turned


def _door(draft: Draft, void: Entity, wall: Wall, opening: Opening, door: Door) -> Entity:
    operation, turned = door_operation(door)
    if operation == "NOTDEFINED" and door.operation not in ("NOTDEFINED", *_HANDED):
        draft.notes.append(
            f"Door {door.name!r}: operation {door.operation!r} is none of IFC4's, written as NOTDEFINED."
        )
    thickness = wall.thickness.value
    leaf = LEAF if door.leaf_thickness is None else min(door.leaf_thickness.value, thickness)
    front = _leaf_front(door, thickness, leaf, turned)
    start, depth = _lining_place(door, thickness, leaf, front)
    inset = max(0.0, min(front - start, depth - leaf))
    form = _form("door", opening, depth, leaf, operation, colour_of(door))
    form = replace(
        form,
        inset=round(1000 * inset),
        lining=0 if door.lining_thickness is None else round(1000 * door.lining_thickness.value),
        threshold=0 if door.threshold is None else round(1000 * door.threshold.value),
        leaves=2 if door.leaves == 2 and operation == "NOTDEFINED" else 0,
    )
    shared = draft.types.find(form.key) or door_type(draft, form)
    aside = reach_across(wall_arc(wall), opening.width.value, thickness) - thickness / 2
    location = (
        (opening.width.value, aside + start + depth, 0.0) if turned else (0.0, aside + thickness - start - depth, 0.0)
    )
    return _occurrence(draft, "IfcDoor", shared, void, opening, door, location, turned)


def _leaf_front(door: Door, thickness: float, leaf: float, turned: bool) -> float:
    """How far the leaf's front lies behind the face that it swings to (the left one where that is not known)."""
    if door.recess is None or door.recess_side == "unknown":
        return 0.0
    recess = door.recess.value
    same = (door.recess_side == "right") == turned
    return max(0.0, min(recess if same else thickness - recess - leaf, thickness - leaf))


def _lining_place(door: Door, thickness: float, leaf: float, front: float) -> tuple[float, float]:
    """How far the lining starts behind the face that the leaf swings to, and its depth.

    Where it was not measured: the whole wall, in a thick wall a part of it at the leaf's front.
    """
    if door.lining_depth is not None:
        depth = max(min(door.lining_depth.value, thickness), leaf)
        return max(0.0, min(front, thickness - depth)), depth
    if thickness <= DEEPEST_FRAME:
        return 0.0, thickness
    depth = DEEPEST_FRAME / 2
    return max(0.0, min(front, thickness - depth)), depth


def _window(draft: Draft, void: Entity, wall: Wall, opening: Opening, window: Window) -> Entity:
    partitioning = window.partitioning if window.partitioning in WINDOW_PARTITIONINGS else "NOTDEFINED"
    if partitioning != window.partitioning:
        draft.notes.append(
            f"Window {window.name!r}: partitioning {window.partitioning!r} is none of IFC4's, written as NOTDEFINED."
        )
    thickness = wall.thickness.value
    depth = min(thickness, WINDOW_FRAME)
    form = _form("window", opening, depth, depth / 2, partitioning, window.colour or FRAME)
    if window.frame_thickness is not None:
        form = replace(form, lining=round(1000 * window.frame_thickness.value))
    shared = draft.types.find(form.key) or window_type(draft, form)
    pane = thickness / 2
    if window.recess is not None and window.recess_side != "unknown":
        pane = window.recess.value if window.recess_side == "right" else thickness - window.recess.value
    aside = reach_across(wall_arc(wall), opening.width.value, thickness) - thickness / 2
    location = (0.0, aside + max(0.0, min(pane - depth / 2, thickness - depth)), 0.0)
    return _occurrence(draft, "IfcWindow", shared, void, opening, window, location, False)


def _form(kind: str, opening: Opening, depth: float, leaf: float, use: str, colour: Colour) -> Form:
    millimetres = [max(round(1000 * x), 1) for x in (opening.width.value, opening.height.value, depth, leaf)]
    width, height, deep, thick = millimetres
    return Form(kind, width, height, deep, thick, use, colour)


def _occurrence(
    draft: Draft,
    ifc_class: str,
    shared: Shared,
    void: Entity,
    opening: Opening,
    fill: Door | Window,
    location: tuple[float, float, float],
    turned: bool,
) -> Entity:
    ifc = draft.ifc
    place = axes(ifc, location, (-1.0, 0.0) if turned else (1.0, 0.0))
    entity = ifc.root(
        ifc_class,
        fill.id,
        fill.name,
        ObjectPlacement=ifc.add("IfcLocalPlacement", void.ObjectPlacement, place),
        Representation=shape(ifc, *(_mapped(draft, source) for source in shared.entity.RepresentationMaps)),
        OverallWidth=round(opening.width.value, 6),
        OverallHeight=round(opening.height.value, 6),
        PredefinedType=fill.kind.upper(),
    )
    shared.elements.append(entity)
    return entity


def _mapped(draft: Draft, source: Entity) -> Entity:
    ifc = draft.ifc
    target = ifc.add("IfcCartesianTransformationOperator3D", None, None, ifc.point((0.0, 0.0, 0.0)), 1.0, None)
    item = ifc.add("IfcMappedItem", source, target)
    return representation(ifc, source.MappedRepresentation.ContextOfItems, "MappedRepresentation", [item])


def _door_words(door: Door) -> dict[str, Value | None]:
    return {
        "State": text(door.state),
        "LeafAngle": measure("IfcPlaneAngleMeasure", door.angle),
        "HingeSide": text(door.hinge_side),
        "SwingSide": text(door.swing_side),
        "RecessSide": text(door.recess_side),
        "Leaves": measure("IfcInteger", door.leaves),
        "Glazed": measure("IfcBoolean", door.glazed),
    }
