"""Classification of elements by Uniclass, so that trades and estimators find them."""

from __future__ import annotations

from typing import Final

from scan2bim.exporters.ifc_file import Entity, IfcFile

SYSTEM: Final = "Uniclass 2015"
_ELEMENTS: Final = {
    "IfcWall": ("EF_25_10", "Walls"),
    "IfcDoor": ("EF_25_30", "Doors and windows"),
    "IfcWindow": ("EF_25_30", "Doors and windows"),
    "IfcSlab": ("EF_30_20", "Floors"),
    "IfcRoof": ("EF_30_10", "Roofs"),
    "IfcStair": ("EF_35_10", "Stairs and ramps"),
    "IfcColumn": ("EF_20_10", "Superstructure"),
    "IfcBeam": ("EF_20_10", "Superstructure"),
}
"""Uniclass 2015, table of elements and functions (EF)."""


class ClassBook:
    """Collects the elements of each class; relates them once all are known."""

    def __init__(self, ifc: IfcFile) -> None:
        self._ifc = ifc
        self._elements: dict[tuple[str, str], list[Entity]] = {}

    def classify(self, entity: Entity) -> None:
        """Puts the element into its class, where there is one for its kind."""
        name = next((name for name in _ELEMENTS if entity.is_a(name)), None)
        if name == "IfcSlab" and entity.PredefinedType == "ROOF":
            name = "IfcRoof"
        if name is not None:
            self._elements.setdefault(_ELEMENTS[name], []).append(entity)

    def relate(self) -> None:
        """Writes the classification and the relations between its classes and their elements."""
        if not self._elements:
            return
        ifc = self._ifc
        old = ifc.dialect.old
        names = {"Source": "NBS", "Edition": "2015", "Name": SYSTEM}
        system = ifc.file.create_entity("IfcClassification", **names)
        for (code, title), elements in sorted(self._elements.items()):
            known = {"ItemReference" if old else "Identification": code, "Name": title, "ReferencedSource": system}
            reference = ifc.file.create_entity("IfcClassificationReference", **known)
            ifc.root(
                "IfcRelAssociatesClassification",
                f"class {code}",
                RelatedObjects=elements,
                RelatingClassification=reference,
            )
