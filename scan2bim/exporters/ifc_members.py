"""Columns and beams: a section swept along the member, typed by it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, unknown_material
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_products import upright_product, with_area
from scan2bim.exporters.ifc_shapes import extrusion, polygons, polyline, prisms, representation, rings
from scan2bim.model.elements import Beam, Column, Point2, Storey

if TYPE_CHECKING:
    from shapely import Polygon

ROUND_ENOUGH = 8
"""Corners from which on the outline of a round column is taken to lie on its circle, not about it."""


def add_members(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's columns and beams."""
    made = [
        *(_column(draft, level, column) for column in storey.columns),
        *(_beam(draft, level, beam) for beam in storey.beams),
    ]
    return [entity for entity in made if entity is not None]


def _column(draft: Draft, level: Level, column: Column) -> Entity | None:
    areas = with_area(draft, column, polygons(column.outline) if column.height.value > 0.0 else [])
    if not areas:
        return None
    height, bottom = column.height.value, column.base - level.elevation
    section = _section(draft, column, areas[0])
    if section is None:
        entity = upright_product(
            draft, level, column, "IfcColumn", bottom, prisms(draft.ifc, areas, height, 0.0), "COLUMN"
        )
    else:
        at, x_axis = (areas[0].centroid.x, areas[0].centroid.y), (1.0, 0.0)
        if is_rectangle(areas[0]):
            x_axis = long_side(areas[0])[0]
        solids = [extrusion(draft.ifc, section, height)]
        entity = upright_product(draft, level, column, "IfcColumn", bottom, solids, "COLUMN", at, x_axis)
        _give_type(draft, entity, "IfcColumnType", "COLUMN", section)
    girth, area = sum(a.exterior.length for a in areas), sum(a.area for a in areas)
    if column.section == "round" and section is not None:
        area, girth = math.pi * section.Radius**2, math.tau * section.Radius
    draft.properties.common(entity, "Pset_ColumnCommon", {})
    draft.properties.evidence(entity, column)
    draft.classes.classify(entity)
    draft.properties.quantities(entity, "Qto_ColumnBaseQuantities", _quantities(height, area, girth))
    return entity


def _quantities(length: float, area: float, girth: float) -> dict[str, float]:
    return {
        "Length": length,
        "CrossSectionArea": area,
        "OuterSurfaceArea": girth * length,
        "GrossVolume": area * length,
        "NetVolume": area * length,
    }


def _beam(draft: Draft, level: Level, beam: Beam) -> Entity | None:
    """A beam over a rectangle is swept along its long side; over any other outline it is an upright prism."""
    areas = with_area(draft, beam, polygons(beam.outline) if beam.height.value > 0.0 else [])
    if not areas:
        return None
    ifc, height, bottom = draft.ifc, beam.height.value, beam.base - level.elevation
    if not is_rectangle(areas[0]):
        entity = upright_product(draft, level, beam, "IfcBeam", bottom, prisms(ifc, areas, height, 0.0), "BEAM")
        along = math.sqrt(max(areas[0].minimum_rotated_rectangle.area, 1e-9))
        draft.properties.common(entity, "Pset_BeamCommon", {})
    else:
        x_axis, along, across = long_side(areas[0])
        section = rectangle(draft, across, height)
        lying = ifc.add(
            "IfcAxis2Placement3D",
            ifc.point((-along / 2, 0.0, height / 2)),
            ifc.direction((1.0, 0.0, 0.0)),
            ifc.direction((0.0, 1.0, 0.0)),
        )
        solids = [extrusion(ifc, section, along, lying)]
        at = (areas[0].centroid.x, areas[0].centroid.y)
        entity = upright_product(draft, level, beam, "IfcBeam", bottom, solids, "BEAM", at, x_axis)
        axis = polyline(ifc, ((-along / 2, 0.0), (along / 2, 0.0)))
        shapes = entity.Representation
        shapes.Representations = [
            representation(ifc, draft.contexts.axis, "Curve2D", [axis]),
            *shapes.Representations,
        ]
        _give_type(draft, entity, "IfcBeamType", "BEAM", section)
        span = {"Span": ("IfcPositiveLengthMeasure", along), "Slope": ("IfcPlaneAngleMeasure", 0.0)}
        draft.properties.common(entity, "Pset_BeamCommon", span)
    draft.properties.evidence(entity, beam)
    draft.classes.classify(entity)
    area = areas[0].area * height / along
    girth = 2 * (height + area / height)
    draft.properties.quantities(entity, "Qto_BeamBaseQuantities", _quantities(along, area, girth))
    return entity


def _give_type(draft: Draft, entity: Entity, ifc_class: str, kind: str, section: Entity) -> None:
    """The type by its section; in IFC2X3, which has no profile sets, without a material."""
    name = f"{kind.capitalize()} {section.ProfileName}"
    shared = draft.types.find(name)
    if shared is None:
        ifc = draft.ifc
        made = ifc.root(ifc_class, f"{ifc_class} {name}", name, PredefinedType=kind)
        if ifc.dialect.old:
            shared = draft.types.keep(name, made)
        else:
            profile = ifc.add("IfcMaterialProfile", section.ProfileName, None, unknown_material(ifc), section)
            profiles = ifc.add("IfcMaterialProfileSet", section.ProfileName, None, (profile,))
            ifc.root(
                "IfcRelAssociatesMaterial", f"profile of {name}", RelatedObjects=(made,), RelatingMaterial=profiles
            )
            shared = draft.types.keep(name, made, ifc.add("IfcMaterialProfileSetUsage", profiles))
    shared.elements.append(entity)


def _section(draft: Draft, column: Column, area: Polygon) -> Entity | None:
    """The section as circle or rectangle about its centre, or None where it is neither."""
    if column.section == "round":
        radius = round(_radius(area), 6)
        centre = draft.ifc.add("IfcAxis2Placement2D", draft.ifc.point((0.0, 0.0)))
        return draft.ifc.add("IfcCircleProfileDef", "AREA", f"diameter {2000 * radius:.0f} mm", centre, radius)
    if not is_rectangle(area):
        return None
    _, along, across = long_side(area)
    return rectangle(draft, along, across)


def rectangle(draft: Draft, x: float, y: float) -> Entity:
    """A rectangle profile about its centre, named after its sides."""
    name = f"{1000 * x:.0f} x {1000 * y:.0f} mm"
    centre = draft.ifc.add("IfcAxis2Placement2D", draft.ifc.point((0.0, 0.0)))
    return draft.ifc.add("IfcRectangleProfileDef", "AREA", name, centre, round(x, 6), round(y, 6))


def _radius(area: Polygon) -> float:
    """Of corners on the circle their mean distance to the centre; of few corners about it the inscribed circle's."""
    corners, _ = rings(area)
    if len(corners) < ROUND_ENOUGH:
        return 2 * area.area / area.length
    centre = (area.centroid.x, area.centroid.y)
    return sum(math.dist(corner, centre) for corner in corners) / len(corners)


def is_rectangle(area: Polygon) -> bool:
    """Whether the area is a rectangle to a tenth of a millimetre."""
    corners, holes = rings(area)
    if len(corners) != 4 or holes:
        return False
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = corners
    level = math.hypot(ax + cx - bx - dx, ay + cy - by - dy)
    return level < 1e-4 and abs(math.dist(corners[0], corners[2]) - math.dist(corners[1], corners[3])) < 1e-4


def long_side(area: Polygon) -> tuple[Point2, float, float]:
    """Of a rectangle: the direction of its longer side, the length of this and of the shorter one."""
    (a, b, c, _), _ = rings(area)
    p, q, across = (a, b, math.dist(b, c)) if math.dist(a, b) >= math.dist(b, c) else (b, c, math.dist(a, b))
    length = math.dist(p, q)
    return ((q[0] - p[0]) / length, (q[1] - p[1]) / length), length, across
