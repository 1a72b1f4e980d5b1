"""Spaces: body, footprint, properties and quantities."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, aggregate
from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.exporters.ifc_shapes import placement, polygons, polyline, prisms, representation, rings, shape
from scan2bim.exporters.ifc_styles import SPACE_TRANSPARENCY
from scan2bim.model.ceilings import space_body
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Space, Storey

if TYPE_CHECKING:
    from shapely import Polygon

def add_spaces(draft: Draft, level: Level, storey: Storey) -> None:
    """The storey's spaces as its parts."""
    made: dict[str, Entity] = {}
    areas: dict[str, list[Polygon]] = {}
    for space in storey.spaces:
        areas[space.id] = polygons(space.outline, space.holes)
        if not areas[space.id] or space.height.value <= 0.0:
            draft.notes.append(f"Space {space.name!r} ({space.id}) has no area or height and was left out.")
            continue
        made[space.id] = _space(draft, level, space, areas[space.id])
    aggregate(draft.ifc, level.entity, made.values())


def _space(draft: Draft, level: Level, space: Space, areas: list[Polygon]) -> Entity:
    ifc = draft.ifc
    solids = [_under_slopes(ifc, space)] if space.ceiling else prisms(ifc, areas, space.height.value, 0.0)
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
            representation(ifc, draft.contexts.body, "Brep" if space.ceiling else "SweptSolid", solids),
        ),
        CompositionType="ELEMENT",
        PredefinedType="SPACE",
    )
    draft.properties.common(entity, "Pset_SpaceCommon", {"IsExternal": ("IfcBoolean", False)})
    draft.properties.evidence(entity, space)
    draft.properties.quantities(entity, "Qto_SpaceBaseQuantities", _quantities(space, areas))
    return entity


def _under_slopes(ifc: IfcFile, space: Space) -> Entity:
    """The body of a space whose ceiling is not level, in its own frame."""
    body = space_body(space)
    points = [ifc.point((x, y, z - space.base)) for x, y, z in body.vertices.tolist()]
    faces = [
        ifc.add("IfcFace", [ifc.add("IfcFaceOuterBound", ifc.add("IfcPolyLoop", [points[i] for i in corners]), True)])
        for corners in body.triangles.tolist()
    ]
    return ifc.add("IfcFacetedBrep", ifc.add("IfcClosedShell", faces))


def _curves(draft: Draft, area: Polygon) -> list[Entity]:
    outline, holes = rings(area)
    return [polyline(draft.ifc, ring, closed=True) for ring in (outline, *holes)]


def _quantities(space: Space, areas: list[Polygon]) -> dict[str, float]:
    from shapely import Polygon

    gross = sum(Polygon(area.exterior).area for area in areas)
    made = {
        "GrossPerimeter": sum(area.exterior.length for area in areas),
        "GrossFloorArea": gross,
        "NetFloorArea": space.area,
        "GrossVolume": space.volume if space.ceiling else gross * space.height.value,
        "NetVolume": space.volume,
    }
    # The schema has a height only of spaces that are as high everywhere.
    return made if space.ceiling else {"Height": space.height.value, **made}
