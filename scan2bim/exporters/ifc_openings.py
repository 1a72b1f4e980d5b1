"""Openings and niches of walls, and what fills them."""

from __future__ import annotations

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_fills import add_fill
from scan2bim.exporters.ifc_properties import text
from scan2bim.exporters.ifc_shapes import rectangle_through, representation, shape
from scan2bim.exporters.ifc_wall_shapes import leaning_axes
from scan2bim.model.elements import Opening, Wall
from scan2bim.model.queries import wall_arc, wall_length
from scan2bim.model.wall_measures import is_opening, reach_across

PAST_END = 0.01
"""Metres. An opening that ends this near to its wall's end ends there: rounding, not a fault to tell."""


def add_openings(draft: Draft, host: Entity, wall: Wall) -> list[Entity]:
    """Cuts the wall's openings into its entity; gives the doors and windows in them."""
    fills: list[Entity] = []
    for opening in wall.openings:
        if not is_opening(opening) or (opening.depth is not None and opening.depth.value <= 0.0):
            draft.notes.append(
                f"Opening {opening.name!r} ({opening.id}) in {wall.name!r} has no size and was left out."
            )
            continue
        void = _opening(draft, host, wall, opening)
        if opening.fill is not None:
            fills.append(add_fill(draft, void, wall, opening, opening.fill))
    return fills


def _opening(draft: Draft, host: Entity, wall: Wall, opening: Opening) -> Entity:
    """The void. Its frame: origin at the lower corner on its right side, x along the wall, y to its left."""
    ifc = draft.ifc
    width, height = opening.width.value, opening.height.value
    right, depth = _across(wall, opening)
    axes = leaning_axes(ifc, wall, opening.offset.value, right, opening.sill.value, width)
    niche = opening.depth is not None
    void = ifc.root(
        "IfcOpeningElement",
        opening.id,
        opening.name,
        ObjectPlacement=ifc.add("IfcLocalPlacement", host.ObjectPlacement, axes),
        Representation=shape(
            ifc,
            representation(ifc, draft.contexts.body, "SweptSolid", [rectangle_through(ifc, width, height, depth)]),
        ),
        ObjectType="Recess" if niche and ifc.dialect.old else "Opening" if ifc.dialect.old else None,
        PredefinedType="RECESS" if niche else "OPENING",
    )
    ifc.root("IfcRelVoidsElement", f"void of {opening.id}", RelatingBuildingElement=host, RelatedOpeningElement=void)
    if opening.offset.value < -PAST_END or opening.offset.value + width > wall_length(wall) + PAST_END:
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


def _across(wall: Wall, opening: Opening) -> tuple[float, float]:
    """Where the void starts, metres to the left of the axis, and how deep it is to the left from there."""
    half = wall.thickness.value / 2
    reach = reach_across(wall_arc(wall), opening.width.value, wall.thickness.value)
    if opening.depth is None:
        return -reach, 2 * reach
    deep = min(opening.depth.value, wall.thickness.value)
    return (half - deep, reach - half + deep) if opening.side == "left" else (-reach, reach - half + deep)
