"""Where the building lies: what was taken off its coordinates at reading, given back as each version of IFC has it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import LABEL, Entity, IfcFile
from scan2bim.exporters.ifc_properties import Value
from scan2bim.model.elements import Frame

UNKNOWN_GRID = "unknown"
"""Name of the map's coordinate system where the scans do not tell it."""

_CODE = re.compile(r"EPSG:{1,2}(\d{4,6})\b")
_GRID = (
    'PROJCRS["{name}",BASEGEOGCRS["unknown",DATUM["unknown",ELLIPSOID["unknown",6400000,0]]],'
    'CONVERSION["unknown",METHOD["unknown"]],CS[Cartesian,2],AXIS["(E)",east],AXIS["(N)",north],LENGTHUNIT["metre",1]]'
)
"""A grid without an EPSG code, as well-known text: all that is known of it is its unit.

IFC4 has no place for it but the name, which readers of names (PROJ among them) then understand.
"""


def georeference(ifc: IfcFile, frame: Frame, contexts: Sequence[Entity]) -> None:
    """The map's coordinate system, and how the contexts lie in it: shifted, not turned, in metres.

    A system without an EPSG code is told in 4.3 as well-known text, and the shift to it as a rigid operation, since a
    map conversion is to a map projection that one knows.
    """
    if ifc.dialect.old:
        return
    metre = next(unit for unit in ifc.file.by_type("IfcSIUnit") if unit.UnitType == "LENGTHUNIT")
    code, words = epsg_code(frame), (frame.crs or UNKNOWN_GRID)[:LABEL]
    text = _GRID.format(name=words.replace('"', "'")[: LABEL - len(_GRID)])
    name = code or ("WKT" if ifc.dialect.new else text)
    crs = ifc.add("IfcProjectedCRS", name, words, None, None, None, None, metre)
    if ifc.dialect.new and code is None:
        ifc.add("IfcWellKnownText", text, crs)
    for context in contexts if ifc.dialect.new else contexts[:1]:  # 4.3 wants it of each context, IFC4 of one
        if ifc.dialect.new and code is None:
            east, north = (ifc.add("IfcLengthMeasure", value) for value in frame.shift[:2])
            ifc.add("IfcRigidOperation", context, crs, east, north, frame.shift[2])
        else:
            ifc.add("IfcMapConversion", context, crs, *frame.shift, 1.0, 0.0, 1.0)


def epsg_code(frame: Frame) -> str | None:
    """The code of the frame's coordinate reference system as "EPSG:25832", if it has one."""
    crs = (frame.crs or "").strip()
    found = _CODE.search(crs)
    return f"EPSG:{crs}" if crs.isdigit() else f"EPSG:{found[1]}" if found else None


def old_georeference(draft: Draft, site: Entity, frame: Frame) -> None:
    """In IFC2X3 the map conversion is a pair of property sets of the site, by buildingSMART's recommendation."""
    if not draft.ifc.dialect.old or (frame.crs is None and frame.shift == (0.0, 0.0, 0.0)):
        return
    name = epsg_code(frame) or frame.crs or UNKNOWN_GRID
    draft.properties.custom(site, "ePSet_ProjectedCRS", {"Name": ("IfcLabel", name)})
    names = ("Eastings", "Northings", "OrthogonalHeight")
    values: dict[str, Value | None] = {
        name: ("IfcLengthMeasure", value) for name, value in zip(names, frame.shift, strict=True)
    }
    turn: dict[str, Value | None] = {"XAxisAbscissa": ("IfcReal", 1.0), "XAxisOrdinate": ("IfcReal", 0.0)}
    draft.properties.custom(site, "ePSet_MapConversion", values | turn | {"Scale": ("IfcReal", 1.0)})
