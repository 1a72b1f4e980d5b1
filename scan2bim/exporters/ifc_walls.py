"""Walls: axis, body cut at the joins, layers, joins."""

from __future__ import annotations

from collections.abc import Sequence

from scan2bim.exporters.ifc_draft import Draft, Level, layered_type
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_joints import relate_joints
from scan2bim.exporters.ifc_openings import add_openings
from scan2bim.exporters.ifc_properties import measure
from scan2bim.exporters.ifc_shapes import placement, representation, shape
from scan2bim.exporters.ifc_wall_shapes import axis_curve, is_curved, wall_solid
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Ring, Storey, Wall
from scan2bim.model.queries import wall_direction, wall_length
from scan2bim.model.wall_measures import measure_wall
from scan2bim.model.wall_outlines import wall_outlines

LEAST_THICKNESS = 0.001
"""Metres. Thickness is written in whole millimetres, as wall types are known by it, and never as nothing."""

_KINDS = {"PARTITIONING": "PARTITIONING", "PARAPET": "PARAPET", "SHAFT": "SHAFT"}
"""Kinds that IFC has of its own; SOLIDWALL stands for all others, since STANDARD is deprecated."""


def add_walls(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's walls with all that they host; gives the walls, doors and windows, which the storey contains."""
    found = _writable(draft, storey.walls)
    walls = [_in_millimetres(wall) for wall in found]
    outlines = wall_outlines(walls)
    made = {wall.id: _wall(draft, level, wall, outlines[wall.id]) for wall in walls}
    fills = [fill for wall in walls for fill in add_openings(draft, made[wall.id], wall)]
    relate_joints(draft, walls, outlines, made)
    for wall in found:
        _describe(draft, wall, outlines[wall.id], made[wall.id])
    return [*made.values(), *fills]


def _writable(draft: Draft, walls: Sequence[Wall]) -> list[Wall]:
    """The walls that have an extent and an id of their own."""
    kept: dict[str, Wall] = {}
    for wall in walls:
        if wall.id in kept:
            draft.notes.append(f"Two walls share the id {wall.id!r}: {wall.name!r} was left out.")
        elif wall_length(wall) < LEAST_THICKNESS or wall.height.value <= 0.0:
            draft.notes.append(f"Wall {wall.name!r} ({wall.id}) has no length or height and was left out.")
        else:
            kept[wall.id] = wall
    return list(kept.values())


def _in_millimetres(wall: Wall) -> Wall:
    thickness = max(round(wall.thickness.value, 3), LEAST_THICKNESS)
    return wall.model_copy(update={"thickness": wall.thickness.model_copy(update={"value": thickness})})


def _wall(draft: Draft, level: Level, wall: Wall, outline: Ring) -> Entity:
    ifc = draft.ifc
    if is_curved(wall) and (wall.lean or wall.profile):
        draft.notes.append(f"Wall {wall.name!r} ({wall.id}) is curved: written upright, with a level upper edge.")
        wall = wall.model_copy(update={"lean": 0.0, "profile": ()})
    solid, kind = wall_solid(ifc, wall, outline)
    draft.styles.paint([solid], colour_of(wall))
    entity = ifc.root(
        "IfcWallStandardCase" if ifc.dialect.old and not wall.lean else "IfcWall",
        wall.id,
        wall.name,
        ObjectPlacement=placement(
            ifc, level.placement, (*wall.start, wall.base - level.elevation), wall_direction(wall)
        ),
        Representation=shape(
            ifc,
            representation(ifc, draft.contexts.axis, "Curve2D", [axis_curve(ifc, wall)]),
            representation(ifc, draft.contexts.body, kind, [solid]),
        ),
        PredefinedType=_KINDS.get(wall.use, "SOLIDWALL"),
    )
    _give_type(draft, entity, wall)
    return entity


def _give_type(draft: Draft, entity: Entity, wall: Wall) -> None:
    thickness, kind = wall.thickness.value, _KINDS.get(wall.use, "SOLIDWALL")
    name = wall_type_name(wall)
    shared = draft.types.find(name) or layered_type(draft, "IfcWallType", kind, name, thickness, "AXIS2")
    shared.elements.append(entity)


def wall_type_name(wall: Wall) -> str:
    """Walls of one kind and thickness share a type."""
    kind = "Wall" if wall.use == "STANDARD" else f"{wall.use.capitalize()} wall"
    return f"{kind} {wall.thickness.value * 1000:.0f} mm"


def _describe(draft: Draft, wall: Wall, outline: Ring, entity: Entity) -> None:
    draft.classes.classify(entity)
    draft.properties.common(
        entity,
        "Pset_WallCommon",
        {
            "Reference": ("IfcIdentifier", wall_type_name(wall)),
            "IsExternal": measure("IfcBoolean", wall.external),
        },
    )
    draft.properties.evidence(entity, wall)
    measured = measure_wall(_in_millimetres(wall), outline)
    sums = {
        "Length": wall_length(wall),
        "Width": max(round(wall.thickness.value, 3), LEAST_THICKNESS),
        "Height": wall.height.value,
        "GrossFootprintArea": measured.footprint,
        "GrossSideArea": measured.gross_side,
        "NetSideArea": measured.net_side,
        "GrossVolume": measured.gross_volume,
        "NetVolume": measured.net_volume,
    }
    draft.properties.quantities(entity, "Qto_WallBaseQuantities", sums)
