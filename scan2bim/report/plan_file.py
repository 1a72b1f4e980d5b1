"""The plans of all storeys side by side as a file: ``.svg`` or ``.png``."""

from __future__ import annotations

from pathlib import Path

from scan2bim.model.elements import Building
from scan2bim.report.plan import building_sheet
from scan2bim.report.raster import encode_png, sheet_image
from scan2bim.report.svg import sheet_svg


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the plans as ``path``, whose suffix chooses the form, and say what they leave out. Raises OSError."""
    sheet = building_sheet(building)
    if path.suffix.lower() == ".svg":
        path.write_text(sheet_svg(sheet), encoding="utf-8", newline="\n")
    else:
        path.write_bytes(encode_png(sheet_image(sheet)))
    return ("Slabs and ceilings are not drawn in a plan.",)
