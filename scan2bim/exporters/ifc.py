"""IFC from the model: walls that join and host openings, doors and windows, plates, spaces, and the evidence for each.

What IFC holds in no standard place (evidence, scans, frame, notes) goes into property sets whose names start with S2B.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc_boundaries import add_boundaries
from scan2bim.exporters.ifc_classes import ClassBook
from scan2bim.exporters.ifc_draft import Draft, contain
from scan2bim.exporters.ifc_file import IfcFile, TypeBook
from scan2bim.exporters.ifc_members import add_members
from scan2bim.exporters.ifc_plates import add_plates
from scan2bim.exporters.ifc_project import header, project, spatial_structure
from scan2bim.exporters.ifc_properties import PropertyBook
from scan2bim.exporters.ifc_roofs import add_roofs
from scan2bim.exporters.ifc_spaces import add_spaces
from scan2bim.exporters.ifc_stairs import add_stairs
from scan2bim.exporters.ifc_styles import StyleBook
from scan2bim.exporters.ifc_walls import add_walls
from scan2bim.model.elements import Building, Door, Window


def export(building: Building, path: Path, settings: ExportSettings = ExportSettings()) -> tuple[str, ...]:
    """Writes the model as IFC (metres, STEP) and gives in words what of it could not be written as it is.

    The same model gives the same bytes. Raises OSError where the path cannot be written.
    """
    ifc = IfcFile(settings.ifc_version)
    entity, contexts = project(ifc, building)
    scan_names = {scan.id: scan.name for scan in building.scans}
    books = StyleBook(ifc), TypeBook(ifc), PropertyBook(ifc, scan_names), ClassBook(ifc)
    draft = Draft(ifc, contexts, *books)
    levels = spatial_structure(draft, entity, building)
    for level, storey in zip(levels, building.storeys, strict=True):
        parts = (add_walls, add_plates, add_members, add_stairs, add_roofs)
        contain(draft, level, [product for add in parts for product in add(draft, level, storey)])
        add_spaces(draft, level, storey)
    add_boundaries(draft, building, levels)
    draft.types.relate()
    draft.classes.relate()
    ifc.drop_leftovers()
    header(ifc, building)
    path.write_bytes(ifc.file.to_string().encode("ascii"))  # the library would make folders and replace devices
    return (*draft.notes, *_simplified(building))


def _simplified(building: Building) -> Iterator[str]:
    """What is written more plainly than the model has it, or more definitely than it is known."""
    if any(not stair.flights for storey in building.storeys for stair in storey.stairs):
        yield "Stairs without flights in the model are written as prisms over their outline."
    fills = [o.fill for s in building.storeys for w in s.walls for o in w.openings if o.fill is not None]
    if any(fill.kind == "door" and fill.angle for fill in fills):
        yield "Doors are drawn closed, as is usual in IFC; the angle at which each was seen is in its S2B_Evidence."
    if any(_drawn_as_usual(fill) for fill in fills):
        yield "Frames and leaves of doors and windows are drawn in usual sizes where they were not measured."


def _drawn_as_usual(fill: Door | Window) -> bool:
    sizes = (fill.frame_thickness,) if isinstance(fill, Window) else (fill.lining_depth, fill.lining_thickness)
    return any(size is None for size in sizes)
