"""Roofs: sloping planes as roof slabs, each in its own plane, parts of one roof a storey."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scan2bim.exporters.ifc_draft import Draft, Level, aggregate, layered_type
from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.exporters.ifc_properties import measure
from scan2bim.exporters.ifc_shapes import axes, placement, polygons, profile, representation, rings, shape
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import RoofPlane, Storey
from scan2bim.model.shapes import rise_of

LEAST_THICKNESS = 0.001
"""Metres, as of plates."""

Floats = NDArray[np.float64]


def add_roofs(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's roof with its planes; none where there are no planes."""
    if not storey.roofs:
        return []
    ifc = draft.ifc
    place = placement(ifc, level.placement, (0.0, 0.0, 0.0))
    roof = ifc.root(
        "IfcRoof", f"roof of {storey.id}", f"{storey.name} roof", ObjectPlacement=place, PredefinedType="NOTDEFINED"
    )
    made = [(plane, _plane(draft, level, roof, plane)) for plane in storey.roofs]
    parts = [part for _, part in made if part is not None]
    if not parts:
        ifc.file.remove(roof)
        return []
    aggregate(ifc, roof, (entity for entity, _, _ in parts))
    draft.properties.common(roof, "Pset_RoofCommon", {"IsExternal": ("IfcBoolean", True)})
    draft.classes.classify(roof)
    sums = {"GrossArea": sum(area for _, area, _ in parts), "ProjectedArea": sum(plan for _, _, plan in parts)}
    draft.properties.quantities(roof, "Qto_RoofBaseQuantities", sums)
    return [roof]


def plane_frame(plane: RoofPlane) -> tuple[Floats, Floats, Floats]:
    """Origin (3,), axes (3, 3) in rows (x level, y up the slope, z upwards normal), and corners (n, 2) in them."""
    points = np.array(plane.outline, np.float64)
    origin = points[0]
    normal: Floats = np.linalg.svd(points - points.mean(axis=0))[2][2].astype(np.float64)
    normal = normal if normal[2] >= 0.0 else -normal
    level = np.array([-normal[1], normal[0], 0.0])
    size = float(np.linalg.norm(level))
    x = level / size if size > 1e-9 else np.array([1.0, 0.0, 0.0])
    rows = np.stack([x, np.cross(normal, x), normal])
    origin = origin - normal * float((origin - points.mean(axis=0)) @ normal)
    return origin, rows, ((points - origin) @ rows.T)[:, :2]


def _upright(ifc: IfcFile, area: Entity, depth: float, rows: Floats) -> Entity:
    """A plane's area swept straight up, not square to it: the planes of a roof then meet at its ridge."""
    up = ifc.direction(tuple(float(c) for c in rows[:, 2]))
    return ifc.add("IfcExtrudedAreaSolid", area, axes(ifc, (0.0, 0.0, 0.0)), up, round(depth, 6))


def _plane(draft: Draft, level: Level, roof: Entity, plane: RoofPlane) -> tuple[Entity, float, float] | None:
    """The slab, its area in its plane and in plan."""
    ifc = draft.ifc
    if len(plane.outline) < 3:
        draft.notes.append(f"Roof plane {plane.name!r} ({plane.id}) has no area and was left out.")
        return None
    origin, rows, corners = plane_frame(plane)
    areas = polygons(tuple((float(x), float(y)) for x, y in corners))
    if not areas:
        draft.notes.append(f"Roof plane {plane.name!r} ({plane.id}) has no area and was left out.")
        return None
    depth = max(round(plane.thickness.value, 3), LEAST_THICKNESS)
    solids = [_upright(ifc, profile(ifc, *rings(a)), depth / rise_of(np.array(plane.outline)), rows) for a in areas]
    draft.styles.paint(solids, colour_of(plane))
    axes = ifc.add(
        "IfcAxis2Placement3D",
        ifc.point((origin[0], origin[1], origin[2] - level.elevation)),
        ifc.direction(rows[2]),
        ifc.direction(rows[0]),
    )
    entity = ifc.root(
        "IfcSlab",
        plane.id,
        plane.name,
        ObjectPlacement=ifc.add("IfcLocalPlacement", roof.ObjectPlacement, axes),
        Representation=shape(ifc, representation(ifc, draft.contexts.body, "SweptSolid", solids)),
        PredefinedType="ROOF",
    )
    name = f"Roof plane {depth * 1000:.0f} mm"
    shared = draft.types.find(name) or layered_type(draft, "IfcSlabType", "ROOF", name, depth, "AXIS3")
    shared.elements.append(entity)
    pitch = math.acos(min(1.0, float(rows[2, 2])))
    values = {"IsExternal": measure("IfcBoolean", True), "PitchAngle": measure("IfcPlaneAngleMeasure", pitch)}
    draft.properties.common(entity, "Pset_SlabCommon", values)
    draft.properties.evidence(entity, plane)
    area = sum(a.area for a in areas)
    sums = {"Width": depth, "GrossArea": area, "NetArea": area, "GrossVolume": area * depth, "NetVolume": area * depth}
    draft.properties.quantities(entity, "Qto_SlabBaseQuantities", sums)
    return entity, area, area * float(rows[2, 2])
