"""Slabs and ceiling coverings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, layered_type
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_products import upright_product, with_area
from scan2bim.exporters.ifc_properties import measure
from scan2bim.exporters.ifc_shapes import polygons, prisms
from scan2bim.model.elements import Area, Covering, Slab, Storey

if TYPE_CHECKING:
    from shapely import Polygon

LEAST_THICKNESS = 0.001
"""Metres. Thickness is written in whole millimetres, as types are known by it, and never as nothing."""


def add_plates(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's slabs and coverings."""
    made = [
        *(_slab(draft, level, slab) for slab in storey.slabs),
        *(_covering(draft, level, covering) for covering in storey.coverings),
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
    areas = with_area(draft, plate, polygons(plate.outline, plate.holes))
    if not areas:
        return None
    depth = _thickness(plate)
    bottom = plate.top.value - depth - level.elevation
    entity = upright_product(draft, level, plate, ifc_class, bottom, prisms(draft.ifc, areas, depth, 0.0), kind)
    _give_type(draft, entity, f"{ifc_class}Type", kind, f"{kind.capitalize()} {depth * 1000:.0f} mm", depth)
    draft.classes.classify(entity)
    draft.properties.evidence(entity, plate)
    return entity, areas


def _give_type(draft: Draft, entity: Entity, ifc_class: str, kind: str, name: str, depth: float) -> None:
    shared = draft.types.find(name) or layered_type(draft, ifc_class, kind, name, depth, "AXIS3")
    shared.elements.append(entity)


def _thickness(plate: Area) -> float:
    return max(round(plate.thickness.value, 3), LEAST_THICKNESS)


def _filled(area: Polygon) -> float:
    """Area without its holes taken off."""
    from shapely import Polygon

    return float(Polygon(area.exterior).area)
