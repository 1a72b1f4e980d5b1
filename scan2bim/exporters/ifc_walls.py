"""Walls: axis, body cut at the joins, layers, joins."""

from __future__ import annotations

from collections.abc import Sequence

from scan2bim.exporters.ifc_draft import Draft, Level, layered_type
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_openings import add_openings, openings_area
from scan2bim.exporters.ifc_properties import measure
from scan2bim.exporters.ifc_shapes import extrusion, placement, polyline, profile, representation, shape
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Join, Ring, Storey, Wall
from scan2bim.model.queries import wall_direction, wall_length
from scan2bim.model.wall_outlines import outline_area, wall_outlines

LEAST_THICKNESS = 0.001
"""Metres. Thickness is written in whole millimetres, as wall types are known by it, and never as nothing."""

_CONNECTION = {"start": "ATSTART", "end": "ATEND", "path": "ATPATH"}
_JOINT = {"L": "MITRE", "T": "BUTT", "X": "CROSS"}


def add_walls(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's walls with all that they host; gives the walls, doors and windows, which the storey contains."""
    found = _writable(draft, storey.walls)
    walls = [_in_millimetres(wall) for wall in found]
    outlines = wall_outlines(walls)
    made = {wall.id: _wall(draft, level, wall, outlines[wall.id]) for wall in walls}
    fills = [fill for wall in walls for fill in add_openings(draft, made[wall.id], wall)]
    _connect(draft, walls, made)
    _describe(draft, found, outlines, made)
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
    axis = polyline(ifc, ((0.0, 0.0), (wall_length(wall), 0.0)))
    solid = extrusion(ifc, profile(ifc, outline), wall.height.value)
    draft.styles.paint([solid], colour_of(wall))
    entity = ifc.root(
        "IfcWall",
        wall.id,
        wall.name,
        ObjectPlacement=placement(
            ifc, level.placement, (*wall.start, wall.base - level.elevation), wall_direction(wall)
        ),
        Representation=shape(
            ifc,
            representation(ifc, draft.contexts.axis, "Curve2D", [axis]),
            representation(ifc, draft.contexts.body, "SweptSolid", [solid]),
        ),
        PredefinedType="SOLIDWALL",
    )
    _give_type(draft, entity, wall.thickness.value)
    return entity


def _give_type(draft: Draft, entity: Entity, thickness: float) -> None:
    name = f"Wall {thickness * 1000:.0f} mm"
    if draft.types.find(name) is None:
        layered_type(draft, "IfcWallType", "SOLIDWALL", name, thickness, "AXIS2")
    shared = draft.types.find(name)
    if shared is not None:
        shared.elements.append(entity)


def _connect(draft: Draft, walls: Sequence[Wall], made: dict[str, Entity]) -> None:
    """The joins, each once, whichever of its walls names it."""
    done: set[frozenset[tuple[str, str]]] = set()
    for wall in walls:
        for join in wall.joins:
            pair = frozenset(((wall.id, join.at), (join.wall, join.other_at)))
            if pair in done:
                continue
            done.add(pair)
            if join.wall not in made or join.wall == wall.id:
                draft.notes.append(f"Wall {wall.name!r} joins a wall {join.wall!r} that is not in its storey.")
                continue
            _path_relation(draft, wall, join, made)


def _path_relation(draft: Draft, wall: Wall, join: Join, made: dict[str, Entity]) -> None:
    draft.ifc.root(
        "IfcRelConnectsPathElements",
        f"join of {wall.id} {join.at} to {join.wall} {join.other_at}",
        Description=_JOINT[join.kind],
        RelatingElement=made[wall.id],
        RelatedElement=made[join.wall],
        RelatingPriorities=(),
        RelatedPriorities=(),
        RelatingConnectionType=_CONNECTION[join.at],
        RelatedConnectionType=_CONNECTION[join.other_at],
    )


def _describe(draft: Draft, walls: Sequence[Wall], outlines: dict[str, Ring], made: dict[str, Entity]) -> None:
    for wall in walls:
        entity = made[wall.id]
        draft.properties.common(
            entity,
            "Pset_WallCommon",
            {
                "Reference": ("IfcIdentifier", f"Wall {wall.thickness.value * 1000:.0f} mm"),
                "IsExternal": measure("IfcBoolean", wall.external),
            },
        )
        draft.properties.evidence(entity, wall)
        draft.properties.quantities(entity, "Qto_WallBaseQuantities", _quantities(wall, outlines[wall.id]))


def _quantities(wall: Wall, outline: Ring) -> dict[str, float]:
    """Gross as if nothing were cut out; net less the openings, as far as these lie in the wall."""
    length, height = wall_length(wall), wall.height.value
    thickness = max(round(wall.thickness.value, 3), LEAST_THICKNESS)
    foot, void = outline_area(outline), openings_area(wall)
    return {
        "Length": length,
        "Width": thickness,
        "Height": height,
        "GrossFootprintArea": foot,
        "GrossSideArea": length * height,
        "NetSideArea": length * height - void,
        "GrossVolume": foot * height,
        "NetVolume": foot * height - void * thickness,
    }
