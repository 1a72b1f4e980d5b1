"""Colours of elements as IFC surface styles."""

from __future__ import annotations

from collections.abc import Iterable

from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.model.colours import to_srgb
from scan2bim.model.elements import Colour

FRAME: Colour = (0.72, 0.72, 0.72)
"""Linear colour of a window's frame where the scan gave none."""

GLASS: Colour = (0.32, 0.60, 0.79)
GLASS_TRANSPARENCY = 0.6
SPACE_TRANSPARENCY = 0.8


class StyleBook:
    """Surface styles, each made once."""

    def __init__(self, ifc: IfcFile) -> None:
        self._ifc = ifc
        self._styles: dict[tuple[tuple[int, ...], float], Entity] = {}

    def paint(self, items: Iterable[Entity], colour: Colour, transparency: float = 0.0) -> None:
        """Gives the items this linear colour."""
        style = self._style(to_srgb(colour), transparency)
        for item in items:
            self._ifc.add("IfcStyledItem", item, (style,), None)

    def glaze(self, items: Iterable[Entity]) -> None:
        """Makes the items glass."""
        self.paint(items, GLASS, GLASS_TRANSPARENCY)

    def _style(self, rgb: tuple[int, ...], transparency: float) -> Entity:
        key = (rgb, transparency)
        if key not in self._styles:
            colour = self._ifc.add("IfcColourRgb", None, *(round(c / 255, 4) for c in rgb))
            shade = self._ifc.add(
                "IfcSurfaceStyleRendering", colour, transparency, None, None, None, None, None, None, "NOTDEFINED"
            )
            name = "#{:02x}{:02x}{:02x}".format(*rgb) + (" glass" if transparency else "")
            style = self._ifc.add("IfcSurfaceStyle", name, "BOTH", (shade,))
            old = self._ifc.dialect.old
            self._styles[key] = self._ifc.add("IfcPresentationStyleAssignment", (style,)) if old else style
        return self._styles[key]
