"""Property sets and quantities: the standard's own, and the evidence for each element."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from scan2bim.exporters.ifc_file import LABEL, Entity, IfcFile
from scan2bim.model.elements import Dimension, Element, Evidence, Record

Value = tuple[str, Any]
"""An IFC measure and its value, as ("IfcLengthMeasure", 2.5)."""

ENUMERATED = "enumerated"
"""In place of a measure: the value is one of an enumeration of the standard."""

EVIDENCE = "S2B_Evidence"
LEVELS_OF_ACCURACY = ((0.05, "LOA10"), (0.015, "LOA20"), (0.005, "LOA30"), (0.001, "LOA40"))
"""USIBD levels by the least deviation that they stand for, metres at two standard deviations; below all: LOA50."""

STATUS = ("NEW", "EXISTING", "DEMOLISH", "TEMPORARY", "OTHER", "NOTKNOWN", "UNSET")
WITHOUT_STATUS = ("Pset_SpaceCommon", "Pset_BuildingStoreyCommon", "Pset_BuildingCommon")

_QUANTITIES = {
    "length": ("IfcQuantityLength", ("Length", "Width", "Height", "Depth", "Perimeter", "Heigtht")),
    "area": ("IfcQuantityArea", ("Area",)),
    "volume": ("IfcQuantityVolume", ("Volume",)),
}


class PropertyBook:
    """Writes property sets and quantities; values that are None are left out, sets that end up empty too."""

    def __init__(self, ifc: IfcFile, scan_names: Mapping[str, str]) -> None:
        self._ifc = ifc
        self._scan_names = scan_names
        self._status: Entity | None = None

    def common(self, product: Entity, name: str, values: Mapping[str, Value | None]) -> None:
        """A standard set such as Pset_WallCommon, with the status of what stands already."""
        made = self._made(values)
        if name not in WITHOUT_STATUS:
            made.insert(0, self._existing())
        self._set(product, name, made)

    def custom(self, product: Entity, name: str, values: Mapping[str, Value | None]) -> None:
        """A set of our own."""
        self._set(product, name, self._made(values))

    def evidence(self, product: Entity, element: Element, extra: Mapping[str, Value | None] | None = None) -> None:
        """What supports the element, and of each of its dimensions whether it was measured and how well."""
        found = element.evidence
        scans = tuple(self._scan_names.get(scan, scan) for scan in found.scans)
        values: dict[str, Value | None] = {
            "Confidence": ("IfcNormalisedRatioMeasure", element.confidence),
            "LOA": text(level_of_accuracy(found.rms)),
            "Points": ("IfcInteger", found.points),
            "RmsDeviation": measure("IfcLengthMeasure", found.rms),
            "PositionSigma": measure("IfcLengthMeasure", found.position_sigma),
            "LengthSigma": measure("IfcLengthMeasure", found.length_sigma),
            "Coverage": measure("IfcNormalisedRatioMeasure", found.coverage),
            "FacesSeen": measure("IfcInteger", found.faces_seen),
            "SourceScans": ("IfcLabel", scans) if scans else None,
            "Evidence": ("IfcText", found.sentence) if found.sentence else None,
            **_faces(found),
            **dimensions(element),
            **(extra or {}),
        }
        self.custom(product, EVIDENCE, values)
        if self._ifc.dialect.new:
            self._uncertainty(product, found)

    def _uncertainty(self, product: Entity, found: Evidence) -> None:
        """4.3's own set: across its faces an element is as uncertain as its place, along them as its points."""
        sigma, rms = found.position_sigma, found.rms
        values: dict[str, Value | None] = {
            "UncertaintyBasis": (ENUMERATED, "MEASUREMENT" if found.points else "ESTIMATE"),
            "UncertaintyDescription": ("IfcText", found.sentence) if found.sentence else None,
            "OrthogonalUncertainty": measure("IfcPositiveLengthMeasure", sigma or None),
            "LinearUncertainty": measure("IfcPositiveLengthMeasure", rms or None),
        }
        self._set(product, "Pset_Uncertainty", self._made(values))

    def definition(self, key: str, name: str, values: Mapping[str, Value | None]) -> Entity:
        """A property set that belongs to a type."""
        return self._ifc.root("IfcPropertySet", key, name, HasProperties=self._made(values))

    def quantities(self, product: Entity, name: str, values: Mapping[str, float | None]) -> None:
        """A standard set such as Qto_WallBaseQuantities; the kind of a quantity follows from its name."""
        made = [
            self._ifc.add(_quantity_class(key), self._ifc.dialect.quantity(key), None, None, round(float(value), 6))
            for key, value in values.items()
            if value is not None
        ]
        if made:
            key = f"{name} of {product.GlobalId}"
            called = self._ifc.dialect.quantity_set(name)
            definition = self._ifc.root(
                "IfcElementQuantity", key, called, MethodOfMeasurement="BaseQuantities", Quantities=made
            )
            self._define(product, key, definition)

    def _made(self, values: Mapping[str, Value | None]) -> list[Entity]:
        return [self._property(key, value) for key, value in values.items() if value is not None]

    def _property(self, name: str, value: Value) -> Entity:
        kind, content = value
        if kind == ENUMERATED:
            return self._ifc.add("IfcPropertyEnumeratedValue", name, None, (self._ifc.add("IfcLabel", content),), None)
        if isinstance(content, tuple):
            listed = [self._ifc.add(kind, _cut(kind, part)) for part in content]
            return self._ifc.add("IfcPropertyListValue", name, None, listed, None)
        return self._ifc.add("IfcPropertySingleValue", name, None, self._ifc.add(kind, _cut(kind, content)), None)

    def _existing(self) -> Entity:
        if self._status is None:
            values = [self._ifc.add("IfcLabel", status) for status in STATUS]
            self._status = self._ifc.add("IfcPropertyEnumeration", "PEnum_ElementStatus", values, None)
        chosen = [self._ifc.add("IfcLabel", "EXISTING")]
        return self._ifc.add("IfcPropertyEnumeratedValue", "Status", None, chosen, self._status)

    def _set(self, product: Entity, name: str, made: Iterable[Entity]) -> None:
        properties = list(made)
        if properties:
            key = f"{name} of {product.GlobalId}"
            self._define(product, key, self._ifc.root("IfcPropertySet", key, name, HasProperties=properties))

    def _define(self, product: Entity, key: str, definition: Entity) -> None:
        self._ifc.root(
            "IfcRelDefinesByProperties",
            f"relation to {key}",
            RelatedObjects=(product,),
            RelatingPropertyDefinition=definition,
        )


def level_of_accuracy(rms: float | None) -> str | None:
    """USIBD's level of represented accuracy of an element whose points leave its faces by this, metres."""
    if rms is None:
        return None
    return next((name for least, name in LEVELS_OF_ACCURACY if 2 * rms >= least), "LOA50")


def _faces(found: Evidence) -> dict[str, Value | None]:
    """What was seen of each face."""
    out: dict[str, Value | None] = {}
    for face in found.faces:
        name = f"{face.side.capitalize()}Face"
        out[f"{name}Area"] = measure("IfcAreaMeasure", face.area)
        for share in ("seen", "occluded", "unseen"):
            out[f"{name}{share.capitalize()}"] = ("IfcNormalisedRatioMeasure", getattr(face, share))
        out[f"{name}Points"] = ("IfcInteger", face.points)
        out[f"{name}RmsDeviation"] = measure("IfcLengthMeasure", face.rms)
    return out


def measure(kind: str, value: float | None) -> Value | None:
    """A value that may be missing."""
    return None if value is None else (kind, value)


def text(value: str | None) -> Value | None:
    """A label that may be missing."""
    return None if value is None else ("IfcLabel", value)


def dimensions(record: Record) -> dict[str, Value | None]:
    """Each dimension of the record: its value as found, measured or assumed, and its standard deviation."""
    out: dict[str, Value | None] = {}
    for field, value in record:
        if isinstance(value, Dimension):
            name = "".join(word.capitalize() for word in field.split("_"))
            out[name] = ("IfcLengthMeasure", value.value)
            out[f"{name}Source"] = ("IfcLabel", value.source)
            out[f"{name}Sigma"] = measure("IfcLengthMeasure", value.sigma)
    return out


def _cut(kind: str, value: object) -> object:
    return value[:LABEL] if kind in ("IfcLabel", "IfcIdentifier") and isinstance(value, str) else value


def _quantity_class(name: str) -> str:
    return next(kind for kind, ends in _QUANTITIES.values() if name.endswith(ends))
