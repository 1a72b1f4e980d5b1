"""What differs between the versions of IFC that can be written: names of classes, attributes, sets and quantities."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Final, Literal

from scan2bim.ifcfile import ifcopenshell

Version = Literal["IFC2X3", "IFC4", "IFC4X3_ADD2"]

_CLASSES_2X3: Final[Mapping[str, str]] = {
    "IfcDoorType": "IfcDoorStyle",
    "IfcWindowType": "IfcWindowStyle",
    "IfcRelSpaceBoundary2ndLevel": "IfcRelSpaceBoundary",
}
_ATTRIBUTES_2X3: Final[Mapping[str, Mapping[str, str]]] = {
    "IfcStair": {"PredefinedType": "ShapeType"},
    "IfcRoof": {"PredefinedType": "ShapeType"},
    "IfcStairFlight": {"NumberOfRisers": "NumberOfRiser"},
    "IfcWindowStyle": {"PartitioningType": "OperationType"},
}
_REQUIRED_2X3: Final[Mapping[str, Mapping[str, Any]]] = {
    "IfcDoorStyle": {"ConstructionType": "NOTDEFINED", "Sizeable": False},
    "IfcWindowStyle": {"ConstructionType": "NOTDEFINED", "Sizeable": False},
    "IfcSpace": {"InteriorOrExteriorSpace": "INTERNAL"},
}
_ENUMERATIONS_2X3: Final[Mapping[tuple[str, str], str]] = {
    ("IfcWallType", "PredefinedType"): "STANDARD",
    ("IfcStair", "ShapeType"): "NOTDEFINED",
}
_RENAMED_4X3: Final[Mapping[str, str]] = {
    "GrossFootprintArea": "GrossFootPrintArea",
    "NetFootprintArea": "NetFootPrintArea",
    "NetHeigtht": "NetHeight",
}
_SWINGS_2X3: Final = ("SWING_FIXED_LEFT", "SWING_FIXED_RIGHT")


class Dialect:
    """One version of IFC: classes and attributes are named as in IFC4 and translated here."""

    def __init__(self, version: Version) -> None:
        self.version: Version = version
        self.old = version == "IFC2X3"
        """Without map conversion, second-level boundaries as a class of their own, door and window types."""
        self.new = version == "IFC4X3_ADD2"
        """With lining and panel sizes as property sets, and uncertainty."""

    def entity(self, ifc_class: str, values: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
        """Class and attributes as this version has them; attributes that it does not know are left out."""
        if not self.old:
            return ifc_class, dict(values)
        name = _CLASSES_2X3.get(ifc_class, ifc_class)
        renamed = _ATTRIBUTES_2X3.get(name, {})
        known = attributes(self.version, name)
        given = {renamed.get(key, key): value for key, value in values.items()}
        made = {key: value for key, value in given.items() if key in known} | dict(_REQUIRED_2X3.get(name, {}))
        for (of, attribute), value in _ENUMERATIONS_2X3.items():
            if of == name and attribute in made:
                made[attribute] = value
        if name == "IfcDoorStyle" and made["OperationType"] in _SWINGS_2X3:
            made["OperationType"] = "NOTDEFINED"
        return name, made

    def quantity_set(self, name: str) -> str:
        """The name of a set of quantities."""
        return "BaseQuantities" if self.old else name

    def quantity(self, name: str) -> str:
        """The name of a quantity."""
        return _RENAMED_4X3.get(name, name) if self.new else name


@cache
def attributes(version: str, ifc_class: str) -> tuple[str, ...]:
    """Names of a class's attributes, in order; of a measure its value."""
    entity = ifcopenshell.schema_by_name(version).declaration_by_name(ifc_class).as_entity()
    if entity is None:
        return ("wrappedValue",)
    return tuple(attribute.name() for attribute in entity.all_attributes())
