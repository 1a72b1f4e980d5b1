"""Damage to a sound IFC file: each mutation does one kind, and its docstring names the check that is to find it.

The mutations are the functions of the ``mutated_*`` modules; here is what they have in common.
"""

from __future__ import annotations

from typing import Any

import ifcopenshell

from scan2bim.model.ids import ifc_guid

File = ifcopenshell.file
Entity = Any
"""An ifcopenshell.entity_instance: its attributes are known at run time only."""


def of(f: File, identifier: str) -> Entity:
    return f.by_guid(ifc_guid(identifier))


def shift(f: File, element: Entity, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
    """Moves the element in the frame that it is placed in; what is placed by it goes along."""
    place = element.ObjectPlacement.RelativePlacement
    old = place.Location.Coordinates
    new = f.create_entity("IfcCartesianPoint", (old[0] + x, old[1] + y, old[2] + z))
    made = f.create_entity("IfcAxis2Placement3D", new, place.Axis, place.RefDirection)
    element.ObjectPlacement.RelativePlacement = made


def solid(element: Entity) -> Entity:
    body = next(r for r in element.Representation.Representations if r.RepresentationIdentifier == "Body")
    item = body.Items[0]
    while item.is_a("IfcBooleanResult"):
        item = item.FirstOperand
    return item


def door(f: File) -> Entity:
    return of(f, "door-measured")


def window(f: File) -> Entity:
    return of(f, "window-measured")


def hole(f: File) -> Entity:
    return of(f, "opening-md")


def wall(f: File, key: str = "inner") -> Entity:
    return of(f, f"wall-{key}")


def boundaries(f: File, space: str, element: str) -> list[Entity]:
    return [r for r in of(f, space).BoundedBy if r.RelatedBuildingElement == of(f, element)]
