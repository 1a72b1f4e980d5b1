"""The plans of all storeys to scale: side by side as ``.svg`` or ``.png``, or a page each as ``.pdf``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from scan2bim.model.elements import Building
from scan2bim.report.pdf import write_pdf
from scan2bim.report.plan import building_sheet, storey_sheet
from scan2bim.report.raster import encode_png, sheet_image
from scan2bim.report.svg import sheet_svg

_LEFT_OUT: Final = ("Slabs and ceilings are not drawn in a plan.",)


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the plans as ``path``, whose suffix chooses the form, and say what they leave out. Raises OSError."""
    if path.suffix.lower() == ".pdf":
        write_pdf([storey_sheet(storey, building) for storey in building.storeys], path, building.name)
        return _LEFT_OUT
    sheet = building_sheet(building)
    if path.suffix.lower() == ".svg":
        path.write_text(sheet_svg(sheet), encoding="utf-8", newline="\n")
    else:
        path.write_bytes(encode_png(sheet_image(sheet)))
    return _LEFT_OUT
