"""Spaces, and which walls, doors and windows bound them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, aggregate
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_shapes import placement, polygons, polyline, prisms, representation, rings, shape
from scan2bim.exporters.ifc_styles import SPACE_TRANSPARENCY
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Opening, Space, Storey, Wall
from scan2bim.model.queries import opening_corners

if TYPE_CHECKING:
    from shapely import Polygon

BESIDE = 0.15
"""Metres. A door or window bounds the space that lies this far from the wall's face, at its middle."""


def add_spaces(draft: Draft, level: Level, storey: Storey) -> None:
    """The storey's spaces as its parts, after the walls that bound them."""
    made: dict[str, Entity] = {}
    areas: dict[str, list[Polygon]] = {}
    for space in storey.spaces:
        areas[space.id] = polygons(space.outline, space.holes)
        if not areas[space.id] or space.height.value <= 0.0:
            draft.notes.append(f"Space {space.name!r} ({space.id}) has no area or height and was left out.")
            continue
        made[space.id] = _space(draft, level, space, areas[space.id])
    aggregate(draft.ifc, level.entity, made.values())
    for wall in storey.walls:
        _bound(draft, wall, made, areas)


def _space(draft: Draft, level: Level, space: Space, areas: list[Polygon]) -> Entity:
    ifc = draft.ifc
    solids = prisms(ifc, areas, space.height.value, 0.0)
    draft.styles.paint(solids, colour_of(space), SPACE_TRANSPARENCY)
    outline = ifc.add("IfcGeometricCurveSet", [c for area in areas for c in _curves(draft, area)])
    entity = ifc.root(
        "IfcSpace",
        space.id,
        space.name,
        ObjectPlacement=placement(ifc, level.placement, (0.0, 0.0, space.base - level.elevation)),
        Representation=shape(
            ifc,
            representation(ifc, draft.contexts.footprint, "GeometricCurveSet", [outline]),
            representation(ifc, draft.contexts.body, "SweptSolid", solids),
        ),
        CompositionType="ELEMENT",
        PredefinedType="SPACE",
    )
    draft.properties.common(entity, "Pset_SpaceCommon", {"IsExternal": ("IfcBoolean", False)})
    draft.properties.evidence(entity, space)
    draft.properties.quantities(entity, "Qto_SpaceBaseQuantities", _quantities(space, areas))
    return entity


def _curves(draft: Draft, area: Polygon) -> list[Entity]:
    outline, holes = rings(area)
    return [polyline(draft.ifc, ring, closed=True) for ring in (outline, *holes)]


def _quantities(space: Space, areas: list[Polygon]) -> dict[str, float]:
    from shapely import Polygon

    gross = sum(Polygon(area.exterior).area for area in areas)
    return {
        "Height": space.height.value,
        "GrossPerimeter": sum(area.exterior.length for area in areas),
        "GrossFloorArea": gross,
        "NetFloorArea": space.area,
        "GrossVolume": gross * space.height.value,
        "NetVolume": space.volume,
    }


def _bound(draft: Draft, wall: Wall, spaces: dict[str, Entity], areas: dict[str, list[Polygon]]) -> None:
    """Relates the wall and what fills its openings to the spaces on its two sides."""
    reach = wall.thickness.value / 2 + BESIDE
    for named, left in ((wall.left_spaces, reach), (wall.right_spaces, -reach)):
        beside = [name for name in named if name in spaces]
        if len(beside) < len(named):
            draft.notes.append(f"Wall {wall.name!r} ({wall.id}) borders spaces that are not in its storey.")
        for name in beside:
            _boundary(draft, spaces[name], name, wall, wall.id)
        for opening in wall.openings:
            for name in beside:
                if opening.fill is not None and _is_beside(areas[name], wall, opening, left):
                    _boundary(draft, spaces[name], name, wall, opening.fill.id)


def _is_beside(areas: list[Polygon], wall: Wall, opening: Opening, left: float) -> bool:
    from shapely import Point

    first, second, _, _ = opening_corners(wall, opening, left)
    middle = Point((first[0] + second[0]) / 2, (first[1] + second[1]) / 2)
    return any(area.contains(middle) for area in areas)


def _boundary(draft: Draft, space: Entity, name: str, wall: Wall, element: str) -> None:
    """One relation a pair; the walls and fills that were left out have none."""
    entity = draft.ifc.made(element)
    if entity is None:
        return
    side = "NOTDEFINED" if wall.external is None else "EXTERNAL" if wall.external else "INTERNAL"
    draft.ifc.root(
        "IfcRelSpaceBoundary",
        f"boundary of {name} by {element}",
        RelatingSpace=space,
        RelatedBuildingElement=entity,
        PhysicalOrVirtualBoundary="PHYSICAL",
        InternalOrExternalBoundary=side,
    )
