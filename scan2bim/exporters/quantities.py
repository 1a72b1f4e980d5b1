"""Quantities of all elements: ``.xlsx`` with a sheet a kind, a summary and what was seen, ``.csv`` with all of them in one table.

Lengths in metres, areas in square metres, volumes in cubic metres. Net areas and volumes are without openings. A
quantity that hangs on an assumed length is marked as assumed.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from scan2bim.geometry.meshes import mesh_volume
from scan2bim.model.coverage import BuildingCoverage, coverage_of
from scan2bim.model.elements import (
    Area,
    Beam,
    Building,
    Column,
    Dimension,
    Door,
    Element,
    Opening,
    Ring,
    RoofPlane,
    Space,
    Stair,
    Storey,
    Wall,
)
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import wall_length
from scan2bim.model.shapes import roof_body
from scan2bim.model.wall_measures import WallMeasures, measure_wall
from scan2bim.model.wall_outlines import wall_outlines

if TYPE_CHECKING:
    from xlsxwriter.format import Format
    from xlsxwriter.worksheet import Worksheet

_UNITS: Final = {"length": "m", "width": "m", "height": "m", "perimeter": "m", "gross_area": "m²", "net_area": "m²"}
_EPOCH: Final = datetime(1980, 1, 1)  # noqa: DTZ001 - written into files in place of the time of day


@dataclass(frozen=True, slots=True)
class Row:
    """The quantities of one element; None where it has none of that kind.

    width: across: a wall's thickness, an opening's width, a plate's thickness. area: of a wall, of one side; of an
    opening, a space or a plate, of its outline. basis: whether all lengths behind it were measured.
    """

    kind: str
    storey: str
    name: str
    global_id: str
    length: float | None = None
    width: float | None = None
    height: float | None = None
    perimeter: float | None = None
    gross_area: float | None = None
    net_area: float | None = None
    gross_volume: float | None = None
    net_volume: float | None = None
    basis: str = "measured"
    state: str = ""
    confidence: float = 1.0


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the quantities as ``path``, whose suffix chooses the form. Raises OSError."""
    rows = [row for storey in building.storeys for row in storey_rows(storey)]
    if path.suffix.lower() == ".csv":
        _write_csv(rows, path)
    else:
        _write_xlsx(building, rows, path)
    return ()


def storey_rows(storey: Storey) -> Iterator[Row]:
    """A row for each element of a storey: walls with their openings, spaces, plates, columns, beams, stairs, roofs."""
    outlines = wall_outlines(storey.walls)
    for wall in storey.walls:
        yield _wall_row(wall, storey, measure_wall(wall, outlines[wall.id]))
        for opening in wall.openings:
            yield _opening_row(opening, storey)
    for space in storey.spaces:
        yield _space_row(space, storey)
    for area in (*storey.slabs, *storey.coverings):
        yield _area_row(area, storey)
    for upright in (*storey.columns, *storey.beams):
        yield _upright_row(upright, storey)
    for stair in storey.stairs:
        yield _stair_row(stair, storey)
    for roof in storey.roofs:
        yield _roof_row(roof, storey)


def _row(element: Element, storey: Storey, basis: Sequence[Dimension], *, state: str = "", **values: float | None) -> Row:
    assumed = any(length.source == "assumed" for length in basis)
    kind = type(element).__name__.removesuffix("Plane")
    rounded = {name: None if value is None else round(value, 4) for name, value in values.items()}
    return Row(
        kind,
        storey.name,
        element.name,
        ifc_guid(element.id),
        basis="assumed" if assumed else "measured",
        state=state,
        confidence=element.confidence,
        **rounded,
    )


def _wall_row(wall: Wall, storey: Storey, measures: WallMeasures) -> Row:
    return _row(
        wall,
        storey,
        (wall.thickness, wall.height),
        length=wall_length(wall),
        width=wall.thickness.value,
        height=wall.height.value,
        gross_area=measures.gross_side,
        net_area=measures.net_side,
        gross_volume=measures.gross_volume,
        net_volume=measures.net_volume,
    )


def _opening_row(opening: Opening, storey: Storey) -> Row:
    thing: Element = opening.fill or opening
    width, height = opening.width.value, opening.height.value
    return _row(
        thing,
        storey,
        (opening.width, opening.height),
        state=thing.state if isinstance(thing, Door) else "",
        width=width,
        height=height,
        perimeter=2 * (width + height),
        gross_area=width * height,
    )


def _space_row(space: Space, storey: Storey) -> Row:
    return _row(
        space,
        storey,
        (space.height,),
        height=space.height.value,
        perimeter=_perimeter(space.outline, space.holes),
        net_area=space.area,
        net_volume=space.volume,
    )


def _area_row(area: Area, storey: Storey) -> Row:
    gross, net = _plan_area(area.outline), _plan_area(area.outline, area.holes)
    return _row(
        area,
        storey,
        (area.thickness,),
        width=area.thickness.value,
        perimeter=_perimeter(area.outline),
        gross_area=gross,
        net_area=net,
        gross_volume=gross * area.thickness.value,
        net_volume=net * area.thickness.value,
    )


def _upright_row(element: Column | Beam, storey: Storey) -> Row:
    section, height = _plan_area(element.outline), element.height.value
    length = max(_box_sides(element.outline)) if isinstance(element, Beam) else height
    return _row(
        element,
        storey,
        (element.height,),
        length=length,
        height=height,
        perimeter=_perimeter(element.outline),
        gross_area=section,
        net_volume=section * height,
    )


def _stair_row(stair: Stair, storey: Storey) -> Row:
    basis = (stair.height, *((stair.width,) if stair.width else ()))
    width = stair.width.value if stair.width else None
    return _row(stair, storey, basis, width=width, height=stair.height.value, gross_area=_plan_area(stair.outline))


def _roof_row(roof: RoofPlane, storey: Storey) -> Row:
    corners = np.array(roof.outline)
    area = float(np.linalg.norm(np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0))) / 2
    volume = mesh_volume(roof_body(roof))
    return _row(roof, storey, (roof.thickness,), width=roof.thickness.value, gross_area=area, net_volume=volume)


def _plan_area(outline: Ring, holes: tuple[Ring, ...] = ()) -> float:
    return shapely.make_valid(shapely.Polygon(outline, holes)).area if len(outline) > 2 else 0.0


def _perimeter(outline: Ring, holes: tuple[Ring, ...] = ()) -> float:
    return shapely.Polygon(outline, holes).length if len(outline) > 2 else 0.0


def _box_sides(outline: Ring) -> tuple[float, float]:
    """Sides of the smallest rectangle round an outline."""
    box = shapely.Polygon(outline).minimum_rotated_rectangle
    corners = list(box.exterior.coords) if isinstance(box, shapely.Polygon) else [(0.0, 0.0)] * 3
    return math.dist(corners[0], corners[1]), math.dist(corners[1], corners[2])


def _heading(name: str) -> str:
    unit = _UNITS.get(name) or ("m³" if name.endswith("volume") else "")
    words = name.replace("_", " ").replace("global id", "GlobalId")
    return f"{words} [{unit}]" if unit else words


_COLUMNS: Final = tuple(field.name for field in fields(Row))


def _write_csv(rows: Sequence[Row], path: Path) -> None:
    with path.open("w", encoding="utf-8-sig", newline="") as file:  # the mark lets spreadsheets see the encoding
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([_heading(name) for name in _COLUMNS])
        writer.writerows([["" if (v := getattr(row, n)) is None else v for n in _COLUMNS] for row in rows])


def _write_xlsx(building: Building, rows: Sequence[Row], path: Path) -> None:
    import xlsxwriter

    with xlsxwriter.Workbook(str(path), {"constant_memory": False, "in_memory": True}) as book:
        book.set_properties({"title": building.name, "author": "scan2bim", "created": _EPOCH})
        bold, number = book.add_format({"bold": True, "bottom": 1}), book.add_format({"num_format": "#,##0.00"})
        kinds = list(dict.fromkeys(row.kind for row in rows))
        _write_summary(book.add_worksheet("Summary"), rows, kinds, bold, number)
        if (covered := coverage_of(building)) is not None:
            _write_coverage(book.add_worksheet("Coverage"), covered, bold, number)
        for kind in kinds:
            own = [row for row in rows if row.kind == kind]
            names = [n for n in _COLUMNS if n != "kind" and any(getattr(row, n) not in (None, "") for row in own)]
            sheet = book.add_worksheet(f"{kind}s")
            sheet.write_row(0, 0, [_heading(name) for name in names], bold)
            for at, row in enumerate(own, 1):
                for column, name in enumerate(names):
                    _write_cell(sheet, at, column, getattr(row, name), number)
            sheet.freeze_panes(1, 0)
            sheet.autofilter(0, 0, len(own), len(names) - 1)
            sheet.autofit()


def _write_summary(
    sheet: Worksheet, rows: Sequence[Row], kinds: Sequence[str], bold: Format, number: Format
) -> None:
    """Count and sums of each kind in each storey."""
    sums = ("net_area", "gross_area", "net_volume")
    sheet.write_row(0, 0, ["storey", "kind", "count", *(_heading(name) for name in sums)], bold)
    at = 1
    for storey in dict.fromkeys(row.storey for row in rows):
        for kind in kinds:
            own = [row for row in rows if row.storey == storey and row.kind == kind]
            if own:
                sheet.write_row(at, 0, [storey, kind])
                sheet.write_number(at, 2, len(own))
                for column, name in enumerate(sums, 3):
                    values = [value for row in own if (value := getattr(row, name)) is not None]
                    _write_cell(sheet, at, column, math.fsum(values) if values else None, number)
                at += 1
    sheet.freeze_panes(1, 0)
    sheet.autofit()


def _write_coverage(sheet: Worksheet, covered: BuildingCoverage, bold: Format, number: Format) -> None:
    """What the scans saw of the faces that bound spaces."""
    sheet.write_row(0, 0, ["faces of", "area [m²]", "seen", "hidden by things", "never seen"], bold)
    parts = (("all", covered.total), ("walls", covered.walls), ("floors", covered.floors), ("ceilings", covered.ceilings))
    for at, (name, part) in enumerate(parts, 1):
        sheet.write_string(at, 0, name)
        for column, value in enumerate((part.area, part.seen, part.occluded, part.unseen), 1):
            sheet.write_number(at, column, value, number)
    sheet.autofit()


def _write_cell(sheet: Worksheet, row: int, column: int, value: object, number: Format) -> None:
    if isinstance(value, float):
        sheet.write_number(row, column, value, number)
    elif value not in (None, ""):
        sheet.write_string(row, column, str(value))  # a name that begins with "=" is no formula
