"""IFC4 from the model: walls that join and host openings, doors and windows, plates, spaces, and the evidence for each.

What IFC holds in no standard place (evidence, scans, frame, notes) goes into property sets whose names start with S2B.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from scan2bim.exporters.ifc_draft import Draft, contain
from scan2bim.exporters.ifc_file import IfcFile, TypeBook
from scan2bim.exporters.ifc_plates import add_plates
from scan2bim.exporters.ifc_project import header, project, spatial_structure
from scan2bim.exporters.ifc_properties import PropertyBook
from scan2bim.exporters.ifc_spaces import add_spaces
from scan2bim.exporters.ifc_styles import StyleBook
from scan2bim.exporters.ifc_walls import add_walls
from scan2bim.model.elements import Building


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Writes the model as IFC4 ADD2 (metres, STEP) and gives in words what of it could not be written as it is.

    The same model gives the same bytes. Raises OSError where the path cannot be written.
    """
    ifc = IfcFile()
    entity, contexts = project(ifc, building)
    scan_names = {scan.id: scan.name for scan in building.scans}
    draft = Draft(ifc, contexts, StyleBook(ifc), TypeBook(ifc), PropertyBook(ifc, scan_names))
    levels = spatial_structure(draft, entity, building)
    for level, storey in zip(levels, building.storeys, strict=True):
        contain(draft, level, [*add_walls(draft, level, storey), *add_plates(draft, level, storey)])
        add_spaces(draft, level, storey)
    draft.types.relate()
    ifc.drop_leftovers()
    header(ifc, building)
    path.write_bytes(ifc.file.to_string().encode("ascii"))  # the library would make folders and replace devices
    return (*draft.notes, *_simplified(building))


def _simplified(building: Building) -> Iterator[str]:
    """What is written more plainly than the model has it, or more definitely than it is known."""
    if any(storey.stairs for storey in building.storeys):
        yield "Stairs are written as prisms over their outline: the model holds no flights."
    fills = [o.fill for s in building.storeys for w in s.walls for o in w.openings if o.fill is not None]
    if any(fill.kind == "door" and fill.angle for fill in fills):
        yield "Doors are drawn closed, as is usual in IFC; the angle at which each was seen is in its S2B_Evidence."
    if fills:
        yield "Frames and leaves of doors and windows are drawn in usual sizes: the model holds their openings' sizes."
