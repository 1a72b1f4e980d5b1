"""Space boundaries of the second level, with their surfaces; virtual elements where spaces are open to each other."""

from __future__ import annotations

from collections.abc import Sequence

from scan2bim.exporters.ifc_draft import Draft, Level, contain
from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.exporters.ifc_shapes import placement, polyline
from scan2bim.model.elements import Building, Slab
from scan2bim.model.queries import everything
from scan2bim.model.space_boundaries import Boundary, Patch, space_boundaries


def add_boundaries(draft: Draft, building: Building, levels: Sequence[Level]) -> None:
    """The boundaries of all spaces that were written."""
    homes: dict[str, tuple[Level, float]] = {}
    for level, storey in zip(levels, building.storeys, strict=True):
        homes |= {space.id: (level, space.base) for space in storey.spaces}
    buried = {thing.id for thing in everything(building) if isinstance(thing, Slab) and thing.use == "BASESLAB"}
    made: dict[str, Entity] = {}
    virtual: dict[str, Entity] = {}
    gaps: dict[str, list[Entity]] = {}
    boundaries = space_boundaries(building)
    for boundary in boundaries:
        level, base = homes[boundary.space]
        element = _element(draft, boundary, level, virtual, gaps)
        space = draft.ifc.made(boundary.space)
        if element is not None and space is not None:
            made[boundary.key] = _relation(draft.ifc, boundary, space, element, base, boundary.element in buried, made)
    for boundary in boundaries:
        # A pair is stated once: the inverse attribute leads back, and who follows references upwards comes to an end.
        if boundary.twin in made and boundary.twin > boundary.key and not draft.ifc.dialect.old:
            made[boundary.key].CorrespondingBoundary = made[boundary.twin]
    for level in levels:
        contain(draft, level, gaps.get(level.entity.GlobalId, ()), "virtual elements")


def _element(
    draft: Draft, boundary: Boundary, level: Level, virtual: dict[str, Entity], gaps: dict[str, list[Entity]]
) -> Entity | None:
    """The element that the boundary is of; of a virtual one an element that both its sides share."""
    if boundary.element is not None:
        return draft.ifc.made(boundary.element)
    key = min(boundary.key, boundary.twin or boundary.key)
    if key not in virtual:
        virtual[key] = draft.ifc.root(
            "IfcVirtualElement",
            f"gap at {key}",
            "Open side" if boundary.beyond else "Side without a known element",
            ObjectPlacement=placement(draft.ifc, level.placement, (0.0, 0.0, 0.0)),
        )
        gaps.setdefault(level.entity.GlobalId, []).append(virtual[key])
    return virtual[key]


def _relation(
    ifc: IfcFile,
    boundary: Boundary,
    space: Entity,
    element: Entity,
    base: float,
    buried: bool,
    made: dict[str, Entity],
) -> Entity:
    side = "NOTDEFINED" if boundary.external is None else "EXTERNAL" if boundary.external else "INTERNAL"
    if buried and side == "EXTERNAL" and not ifc.dialect.old:
        side = "EXTERNAL_EARTH"
    # IFC2X3 knows no virtual boundary of an opening.
    open_ = element.is_a("IfcVirtualElement") or (element.is_a("IfcOpeningElement") and not ifc.dialect.old)
    values = {"ParentBoundary": made[boundary.parent]} if boundary.parent in made else {}
    return ifc.root(
        "IfcRelSpaceBoundary2ndLevel",
        boundary.key,
        "2ndLevel",
        Description="2a" if boundary.beyond is not None else "2b",
        RelatingSpace=space,
        RelatedBuildingElement=element,
        ConnectionGeometry=ifc.add("IfcConnectionSurfaceGeometry", _surface(ifc, boundary.patch, base), None),
        PhysicalOrVirtualBoundary="VIRTUAL" if open_ else "PHYSICAL",
        InternalOrExternalBoundary=side,
        **values,
    )


def _surface(ifc: IfcFile, patch: Patch, base: float) -> Entity:
    """The bounded plane in the space's own frame, which lies at its base, not turned."""
    x, y, z = patch.origin
    place = ifc.add(
        "IfcAxis2Placement3D", ifc.point((x, y, z - base)), ifc.direction(patch.normal), ifc.direction(patch.x_axis)
    )
    outer = polyline(ifc, patch.outline, closed=True)
    inner = [polyline(ifc, hole, closed=True) for hole in patch.holes]
    return ifc.add("IfcCurveBoundedPlane", ifc.add("IfcPlane", place), outer, inner)

