"""Slabs, ceiling coverings, columns and stairs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, layered_type
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_properties import Value, measure
from scan2bim.exporters.ifc_shapes import axes, extrusion, placement, polygons, prisms, representation, rings, shape
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Area, Column, Covering, Element, Slab, Stair, Storey

if TYPE_CHECKING:
    from shapely import Polygon

LEAST_THICKNESS = 0.001
"""Metres. Thickness is written in whole millimetres, as types are known by it, and never as nothing."""

ROUND_ENOUGH = 8
"""Corners from which on the outline of a round column is taken to lie on its circle, not about it."""


def add_plates(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's slabs, coverings, columns and stairs."""
    made = [
        *(_slab(draft, level, slab) for slab in storey.slabs),
        *(_covering(draft, level, covering) for covering in storey.coverings),
        *(_column(draft, level, column) for column in storey.columns),
        *(_stair(draft, level, stair) for stair in storey.stairs),
    ]
    return [entity for entity in made if entity is not None]


def _slab(draft: Draft, level: Level, slab: Slab) -> Entity | None:
    made = _plate(draft, level, slab, "IfcSlab", slab.use)
    if made is None:
        return None
    entity, areas = made
    depth = _thickness(slab)
    net, gross = sum(a.area for a in areas), sum(_filled(a) for a in areas)
    external = {"IsExternal": measure("IfcBoolean", True if slab.use in ("ROOF", "BASESLAB") else None)}
    draft.properties.common(entity, "Pset_SlabCommon", external)
    draft.properties.quantities(
        entity,
        "Qto_SlabBaseQuantities",
        {
            "Width": depth,
            "Perimeter": sum(a.exterior.length for a in areas),
            "GrossArea": gross,
            "NetArea": net,
            "GrossVolume": gross * depth,
            "NetVolume": net * depth,
        },
    )
    return entity


def _covering(draft: Draft, level: Level, covering: Covering) -> Entity | None:
    made = _plate(draft, level, covering, "IfcCovering", "CEILING")
    if made is None:
        return None
    entity, areas = made
    draft.properties.common(entity, "Pset_CoveringCommon", {"IsExternal": ("IfcBoolean", False)})
    gross, net = sum(_filled(a) for a in areas), sum(a.area for a in areas)
    quantities = {"Width": _thickness(covering), "GrossArea": gross, "NetArea": net}
    draft.properties.quantities(entity, "Qto_CoveringBaseQuantities", quantities)
    return entity


def _plate(draft: Draft, level: Level, plate: Area, ifc_class: str, kind: str) -> tuple[Entity, list[Polygon]] | None:
    """A plate with holes, its type and its evidence; its solids rise from its lower side."""
    areas = _areas(draft, plate, polygons(plate.outline, plate.holes))
    if not areas:
        return None
    depth = _thickness(plate)
    bottom = plate.top.value - depth - level.elevation
    entity = _product(draft, level, plate, ifc_class, bottom, prisms(draft.ifc, areas, depth, 0.0))
    entity.PredefinedType = kind
    _give_type(draft, entity, f"{ifc_class}Type", kind, f"{kind.capitalize()} {depth * 1000:.0f} mm", depth)
    draft.properties.evidence(entity, plate)
    return entity, areas


def _give_type(draft: Draft, entity: Entity, ifc_class: str, kind: str, name: str, depth: float) -> None:
    if draft.types.find(name) is None:
        layered_type(draft, ifc_class, kind, name, depth, "AXIS3")
    shared = draft.types.find(name)
    if shared is not None:
        shared.elements.append(entity)


def _column(draft: Draft, level: Level, column: Column) -> Entity | None:
    areas = _areas(draft, column, polygons(column.outline) if column.height.value > 0.0 else [])
    if not areas:
        return None
    centre = areas[0].centroid
    height = column.height.value
    area = _section(draft, column, areas[0])
    place = axes(draft.ifc, (centre.x, centre.y, 0.0), _long_side(areas[0]) if _is_rectangle(areas[0]) else (1.0, 0.0))
    solids = prisms(draft.ifc, areas, height, 0.0) if area is None else [extrusion(draft.ifc, area, height, place)]
    entity = _product(draft, level, column, "IfcColumn", column.base - level.elevation, solids)
    entity.PredefinedType = "COLUMN"
    draft.properties.common(entity, "Pset_ColumnCommon", {})
    draft.properties.evidence(entity, column)
    section, girth = sum(a.area for a in areas), sum(a.exterior.length for a in areas)
    if column.section == "round" and area is not None:
        section, girth = math.pi * area.Radius**2, math.tau * area.Radius
    volume = section * height
    draft.properties.quantities(
        entity,
        "Qto_ColumnBaseQuantities",
        {
            "Length": height,
            "CrossSectionArea": section,
            "OuterSurfaceArea": girth * height,
            "GrossVolume": volume,
            "NetVolume": volume,
        },
    )
    return entity


def _section(draft: Draft, column: Column, area: Polygon) -> Entity | None:
    """The section as circle or rectangle about its centre, or None where it is neither."""
    if column.section == "round":
        return draft.ifc.add("IfcCircleProfileDef", "AREA", None, None, round(_radius(area), 6))
    if not _is_rectangle(area):
        return None
    (a, b, c, _), _ = rings(area)
    sides = sorted((math.dist(a, b), math.dist(b, c)))
    return draft.ifc.add("IfcRectangleProfileDef", "AREA", None, None, round(sides[1], 6), round(sides[0], 6))


def _radius(area: Polygon) -> float:
    """Of corners on the circle their mean distance to the centre; of few corners about it the inscribed circle's."""
    corners, _ = rings(area)
    if len(corners) < ROUND_ENOUGH:
        return 2 * area.area / area.length
    centre = (area.centroid.x, area.centroid.y)
    return sum(math.dist(corner, centre) for corner in corners) / len(corners)


def _is_rectangle(area: Polygon) -> bool:
    corners, holes = rings(area)
    if len(corners) != 4 or holes:
        return False
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = corners
    level = math.hypot(ax + cx - bx - dx, ay + cy - by - dy)
    return level < 1e-4 and abs(math.dist(corners[0], corners[2]) - math.dist(corners[1], corners[3])) < 1e-4


def _long_side(area: Polygon) -> tuple[float, float]:
    (a, b, c, _), _ = rings(area)
    p, q = (a, b) if math.dist(a, b) >= math.dist(b, c) else (b, c)
    length = math.dist(p, q)
    return ((q[0] - p[0]) / length, (q[1] - p[1]) / length)


def _stair(draft: Draft, level: Level, stair: Stair) -> Entity | None:
    """A stair as the prism over its outline: the model holds no flights."""
    areas = _areas(draft, stair, polygons(stair.outline) if stair.height.value > 0.0 else [])
    if not areas:
        return None
    solids = prisms(draft.ifc, areas, stair.height.value, 0.0)
    entity = _product(draft, level, stair, "IfcStair", stair.base - level.elevation, solids)
    entity.PredefinedType = "NOTDEFINED"
    riser = stair.height.value / stair.risers if stair.risers else None
    values: dict[str, Value | None] = {
        "NumberOfRiser": measure("IfcCountMeasure", stair.risers),
        "RiserHeight": measure("IfcPositiveLengthMeasure", riser),
    }
    draft.properties.common(entity, "Pset_StairCommon", values)
    draft.properties.evidence(entity, stair)
    return entity


def _product(
    draft: Draft, level: Level, element: Element, ifc_class: str, bottom: float, solids: list[Entity]
) -> Entity:
    draft.styles.paint(solids, colour_of(element))
    return draft.ifc.root(
        ifc_class,
        element.id,
        element.name,
        ObjectPlacement=placement(draft.ifc, level.placement, (0.0, 0.0, bottom)),
        Representation=shape(draft.ifc, representation(draft.ifc, draft.contexts.body, "SweptSolid", solids)),
    )


def _areas(draft: Draft, element: Element, areas: list[Polygon]) -> list[Polygon]:
    if not areas:
        draft.notes.append(f"{type(element).__name__} {element.name!r} ({element.id}) has no area or height: left out.")
    return areas


def _thickness(plate: Area) -> float:
    return max(round(plate.thickness.value, 3), LEAST_THICKNESS)


def _filled(area: Polygon) -> float:
    """Area without its holes taken off."""
    from shapely import Polygon

    return float(Polygon(area.exterior).area)
