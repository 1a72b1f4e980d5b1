"""What the elements that are no walls have in common: a placed body, and a type by its material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scan2bim.exporters.ifc_draft import Draft, Level
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_shapes import placement, representation, shape
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Element, Point2

if TYPE_CHECKING:
    from shapely import Polygon


def upright_product(
    draft: Draft,
    level: Level,
    element: Element,
    ifc_class: str,
    bottom: float,
    solids: list[Entity],
    kind: str,
    at: Point2 = (0.0, 0.0),
    x_axis: Point2 = (1.0, 0.0),
    **values: Any,
) -> Entity:
    """An element whose solids stand on ``bottom`` (metres over the storey) at a place in plan, turned to ``x_axis``."""
    draft.styles.paint(solids, colour_of(element))
    return draft.ifc.root(
        ifc_class,
        element.id,
        element.name,
        ObjectPlacement=placement(draft.ifc, level.placement, (*at, bottom), x_axis),
        Representation=shape(draft.ifc, representation(draft.ifc, draft.contexts.body, "SweptSolid", solids)),
        PredefinedType=kind,
        **values,
    )


def with_area(draft: Draft, element: Element, areas: list[Polygon]) -> list[Polygon]:
    """The areas; where there are none, a note says that the element was left out."""
    if not areas:
        draft.notes.append(f"{type(element).__name__} {element.name!r} ({element.id}) has no area or height: left out.")
    return areas
