"""What the writers of the parts of an IFC file work with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from scan2bim.exporters.ifc_classes import ClassBook
from scan2bim.exporters.ifc_file import Contexts, Entity, IfcFile, Shared, TypeBook
from scan2bim.exporters.ifc_properties import PropertyBook
from scan2bim.exporters.ifc_styles import StyleBook


@dataclass(frozen=True, slots=True)
class Draft:
    """The file, its contexts, its books of styles, types, properties and classes. ``notes``: what is left out."""

    ifc: IfcFile
    contexts: Contexts
    styles: StyleBook
    types: TypeBook
    properties: PropertyBook
    classes: ClassBook
    notes: list[str] = field(default_factory=list[str])


@dataclass(frozen=True, slots=True)
class Level:
    """A storey in the file: its entity and its elevation (z of its placement, metres)."""

    entity: Entity
    elevation: float

    @property
    def placement(self) -> Entity:
        """Its coordinate system, upright, at its elevation."""
        return self.entity.ObjectPlacement


def layered_type(draft: Draft, ifc_class: str, kind: str, name: str, thickness: float, direction: str) -> Shared:
    """A wall, slab or covering type of one layer of unknown material, kept under its name.

    thickness: metres. direction: AXIS2 for walls (their layers lie about the axis), AXIS3 for plates.
    """
    ifc = draft.ifc
    made = ifc.root(ifc_class, f"{ifc_class} {name}", name, PredefinedType=kind)
    layer = ifc.add("IfcMaterialLayer", unknown_material(ifc), thickness, None, "Unknown")
    layers = ifc.add("IfcMaterialLayerSet", (layer,), name)
    ifc.root("IfcRelAssociatesMaterial", f"layers of type {name}", RelatedObjects=(made,), RelatingMaterial=layers)
    offset = -thickness / 2 if direction == "AXIS2" else 0.0
    return draft.types.keep(name, made, ifc.add("IfcMaterialLayerSetUsage", layers, direction, "POSITIVE", offset))


def unknown_material(ifc: IfcFile) -> Entity:
    """The one material of the file: a scan sees surfaces, not what is behind them."""
    made = ifc.file.by_type("IfcMaterial")
    return made[0] if made else ifc.add("IfcMaterial", "Unknown", "Seen by a scanner from outside only", None)


def contain(draft: Draft, level: Level, products: Iterable[Entity], what: str = "contents") -> None:
    """Puts the products into the storey; ``what`` they are tells apart what is put there at several times."""
    listed = list(products)
    if listed:
        draft.ifc.root(
            "IfcRelContainedInSpatialStructure",
            f"{what} of {level.entity.GlobalId}",
            RelatedElements=listed,
            RelatingStructure=level.entity,
        )


def aggregate(ifc: IfcFile, whole: Entity, parts: Iterable[Entity]) -> None:
    """Makes the parts parts of the whole."""
    listed = list(parts)
    if listed:
        ifc.root("IfcRelAggregates", f"parts of {whole.GlobalId}", RelatingObject=whole, RelatedObjects=listed)
