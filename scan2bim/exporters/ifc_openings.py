"""Openings of walls, and what fills them."""

from __future__ import annotations

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_fills import add_fill
from scan2bim.exporters.ifc_properties import text
from scan2bim.exporters.ifc_shapes import placement, rectangle_through, representation, shape
from scan2bim.model.elements import Opening, Wall
from scan2bim.model.queries import wall_length

LEAST_SIZE = 0.01
"""Metres. Nothing narrower or lower is an opening."""


def add_openings(draft: Draft, host: Entity, wall: Wall) -> list[Entity]:
    """Cuts the wall's openings into its entity; gives the doors and windows in them."""
    fills: list[Entity] = []
    for opening in wall.openings:
        if min(opening.width.value, opening.height.value) < LEAST_SIZE:
            draft.notes.append(
                f"Opening {opening.name!r} ({opening.id}) in {wall.name!r} has no size and was left out."
            )
            continue
        void = _opening(draft, host, wall, opening)
        if opening.fill is not None:
            fills.append(add_fill(draft, void, wall, opening, opening.fill))
    return fills


def openings_area(wall: Wall) -> float:
    """Area of the wall's side that its openings take away, square metres; what two share counts once."""
    import shapely

    boxes = [
        shapely.box(o.offset.value, o.sill.value, o.offset.value + o.width.value, o.sill.value + o.height.value)
        for o in wall.openings
        if min(o.width.value, o.height.value) >= LEAST_SIZE
    ]
    side = shapely.box(0.0, 0.0, wall_length(wall), wall.height.value)
    return float(shapely.union_all(boxes).intersection(side).area) if boxes else 0.0


def _opening(draft: Draft, host: Entity, wall: Wall, opening: Opening) -> Entity:
    """The void. Its frame: origin at the lower corner on the wall's right face, x along the wall, y to its left."""
    ifc = draft.ifc
    width, height, depth = opening.width.value, opening.height.value, wall.thickness.value
    place = placement(ifc, host.ObjectPlacement, (opening.offset.value, -depth / 2, opening.sill.value))
    solid = rectangle_through(ifc, width, height, depth)
    void = ifc.root(
        "IfcOpeningElement",
        opening.id,
        opening.name,
        ObjectPlacement=place,
        Representation=shape(ifc, representation(ifc, draft.contexts.body, "SweptSolid", [solid])),
        PredefinedType="OPENING",
    )
    ifc.root("IfcRelVoidsElement", f"void of {opening.id}", RelatingBuildingElement=host, RelatedOpeningElement=void)
    if opening.offset.value < 0.0 or opening.offset.value + width > wall_length(wall):
        draft.notes.append(f"Opening {opening.name!r} ({opening.id}) reaches past the end of {wall.name!r}.")
    purpose = None if opening.fill is None else opening.fill.kind.upper()
    draft.properties.common(void, "Pset_OpeningElementCommon", {"Purpose": text(purpose)})
    draft.properties.evidence(void, opening)
    draft.properties.quantities(
        void,
        "Qto_OpeningElementBaseQuantities",
        {"Width": width, "Height": height, "Depth": depth, "Area": width * height, "Volume": width * height * depth},
    )
    return void
