"""A copy of the model with the results as property sets and the statuses as colours; the original stays as it is."""

from __future__ import annotations

import uuid
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.element

from scan2bim.ifcfile import open_ifc
from scan2bim.verify.result import ElementResult, Report, Status

SET_NAME = "Scan2BIM_Verification"
COLOURS: dict[Status, tuple[int, int, int]] = {
    "in_tolerance": (38, 152, 80),
    "out_of_tolerance": (215, 48, 31),
    "missing": (122, 1, 119),
    "occluded": (150, 150, 150),
    "not_enough_data": (200, 200, 200),
    "not_applicable": (230, 230, 230),
}
"""sRGB of the statuses, in all outputs."""
CLEAR = 0.6
"""Transparency of what was not measured: what was stands out."""


def write_copy(source: Path, report: Report, path: Path) -> None:
    """Write the copy. Raises InputError where the source cannot be read, OSError where the copy cannot be written."""
    file = open_ifc(source)
    history = next(iter(file.by_type("IfcOwnerHistory")), None)
    coloured = {element.status for element in report.elements} - {"not_applicable"}
    styles = {status: _style(file, status) for status in COLOURS if status in coloured}
    for element in report.elements:
        product = _product(file, element.guid)
        if product is None:
            continue
        _properties(file, product, element, history)
        if element.status != "not_applicable":
            _colour(file, product, styles[element.status])
    for style in styles.values():
        _drop(file, style)
    file.write(str(path))


def _product(file: ifcopenshell.file, guid: str) -> Any:
    try:
        return file.by_guid(guid)
    except RuntimeError:
        return None


def _properties(file: ifcopenshell.file, product: Any, element: ElementResult, history: Any) -> None:
    values: dict[str, tuple[str, object]] = {
        "Status": ("IfcLabel", element.status),
        "Reason": ("IfcText", element.reason),
        "Tolerance": ("IfcReal", element.tolerance),
    }
    if element.loa is not None:
        values["LevelOfAccuracy"] = ("IfcLabel", element.loa)
    if element.deviation is not None:
        values["DeviationMedian"] = ("IfcReal", element.deviation.median)
        values["DeviationP95"] = ("IfcReal", element.deviation.p95)
        values["WithinTolerance"] = ("IfcReal", element.deviation.within)
    if element.coverage is not None:
        values["Coverage"] = ("IfcReal", element.coverage)
    if element.opening is not None:
        values["Finding"] = ("IfcLabel", element.opening.finding)
    make: Any = file.create_entity
    relation, before = (_product(file, _guid(element.guid + part)) for part in ("rel", "set"))
    if relation is not None:  # the copy of a copy
        file.remove(relation)
    if before is not None:
        _drop(file, before)
    properties = [
        make("IfcPropertySingleValue", Name=name, NominalValue=make(kind, value))
        for name, (kind, value) in values.items()
    ]
    pset = make("IfcPropertySet", _guid(element.guid + "set"), history, SET_NAME, None, properties)
    make("IfcRelDefinesByProperties", _guid(element.guid + "rel"), history, None, None, [product], pset)


def _drop(file: ifcopenshell.file, entity: Any) -> None:
    """Take out what nothing refers to any more, with all that it alone refers to: rules forbid what is left over."""
    if not file.get_total_inverses(entity):
        ifcopenshell.util.element.remove_deep2(file, entity)


def _guid(key: str) -> str:
    return ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_URL, f"scan2bim:verification:{key}").hex)


def _style(file: ifcopenshell.file, status: Status) -> Any:
    make: Any = file.create_entity
    red, green, blue = (value / 255 for value in COLOURS[status])
    colour = make("IfcColourRgb", None, red, green, blue)
    shading = make("IfcSurfaceStyleRendering", SurfaceColour=colour, ReflectanceMethod="NOTDEFINED")
    shading.Transparency = CLEAR if status in ("occluded", "not_enough_data") else 0.0
    return make("IfcSurfaceStyle", f"verification: {status.replace('_', ' ')}", "BOTH", [shading])


def _colour(file: ifcopenshell.file, product: Any, style: Any) -> None:
    """Give the product's own solids the style. What several products share as a mapped shape keeps its own."""
    if product.Representation is None:
        return
    for shape in product.Representation.Representations:
        if shape.RepresentationIdentifier != "Body":
            continue
        for item in shape.Items:
            if item.is_a("IfcMappedItem") or item.is_a("IfcRepresentationItem"):
                _restyle(file, item, style)


def _restyle(file: ifcopenshell.file, item: Any, style: Any) -> None:
    make: Any = file.create_entity
    entry = style if file.schema != "IFC2X3" else make("IfcPresentationStyleAssignment", [style])
    styled = list(item.StyledByItem) if hasattr(item, "StyledByItem") else []
    if styled:
        before = styled[0].Styles
        styled[0].Styles = [entry]
        for old in before:
            _drop(file, old)
    else:
        make("IfcStyledItem", item, [entry], None)
