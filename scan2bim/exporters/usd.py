"""OpenUSD: ``.usda``, ``.usdc`` and ``.usdz``, each one layer that holds the whole building.

z up, metres. ``/Building`` (assembly) > storey (group, its origin on the floor) > Walls, Doors, ... (groups) > element
(component) > meshes. Spaces, voids and the envelopes of stairs are guides. The same model gives the same bytes.
"""

from __future__ import annotations

import errno
import os
import struct
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from pxr import Kind, Sdf, Tf, Usd, UsdGeom, UsdPhysics

from scan2bim import __version__
from scan2bim.errors import StageError
from scan2bim.exporters.usd_openings import add_opening
from scan2bim.exporters.usd_prims import (
    LOOKS,
    ROOT,
    define_group,
    define_guide,
    define_mesh,
    define_xform,
    describe,
    free_path,
)
from scan2bim.geometry.meshes import Mesh, move_mesh
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Area, Building, Column, Covering, Element, ScanSource, Slab, Space, Stair, Storey
from scan2bim.model.shapes import area_body, upright_body, wall_angle, wall_bodies

_ALIGNMENT: Final = 64  # bytes; required by the usdz specification
_ZIP_HEADER: Final = 30  # bytes of a zip entry's local header before its name
_EXTRA_HEADER: Final = struct.Struct("<HH")
_PADDING_ID: Final = 0x1986  # the extra field that USD's own packer pads with

_CLASSES: Final[dict[type[Element], tuple[str, str]]] = {
    Space: ("Spaces", "IfcSpace"),
    Slab: ("Slabs", "IfcSlab"),
    Covering: ("Coverings", "IfcCovering"),
    Column: ("Columns", "IfcColumn"),
    Stair: ("Stairs", "IfcStair"),
}


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the building as the USD file ``path`` (its suffix chooses the form) and say what was left out.

    Raises OSError where the file cannot be written, StageError where the library gives up without a reason.
    """
    stage, notes = build_stage(building)
    with tempfile.TemporaryDirectory(prefix=".usd-", dir=path.parent) as folder:
        draft = Path(folder) / f"building{path.suffix.lower()}"  # a plain name: brackets mean packages to the library
        _write_layer(stage, draft)
        draft.replace(path)
    return notes


def build_stage(building: Building) -> tuple[Usd.Stage, tuple[str, ...]]:
    """The building as a stage in memory, and what it leaves out."""
    stage = _new_stage()
    prim = define_xform(stage, ROOT, kind=Kind.Tokens.assembly)
    stage.SetDefaultPrim(prim)
    describe(prim, building, "IfcBuilding")
    UsdGeom.Scope.Define(stage, LOOKS)
    left_out: list[str] = []
    for storey in building.storeys:
        left_out += _add_storey(stage, storey)
    for scan in building.scans:
        _add_scan(stage, scan)
    return stage, tuple(left_out)


def _new_stage() -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory("building.usda")
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = {"creator": f"scan2bim {__version__}"}
    return stage


def _write_layer(stage: Usd.Stage, path: Path) -> None:
    layer = stage.GetRootLayer()
    if path.suffix == ".usda":
        path.write_text(layer.ExportToString(), encoding="utf-8", newline="\n")
        return
    crate = path.with_suffix(".usdc")
    try:
        done = layer.Export(str(crate))
    except Tf.ErrorException as error:
        if os.strerror(errno.ENOSPC) in str(error):  # its message repeats that for every block
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from None
        raise
    if not done:
        raise StageError(f"The USD library could not write {path.name} and gave no reason.")
    if path.suffix == ".usdz":
        _package(crate, path)


def _package(layer: Path, path: Path) -> None:
    """Put the layer into a usdz: stored, its bytes on a multiple of 64, and dated 1980, so that reruns are equal.

    The library's own packer writes the time of day.
    """
    entry = zipfile.ZipInfo(layer.name)
    entry.external_attr = 0o644 << 16
    padding = -(_ZIP_HEADER + len(entry.filename) + _EXTRA_HEADER.size) % _ALIGNMENT
    entry.extra = _EXTRA_HEADER.pack(_PADDING_ID, padding) + bytes(padding)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as package:
        package.writestr(entry, layer.read_bytes())


def _add_storey(stage: Usd.Stage, storey: Storey) -> list[str]:
    path = free_path(stage, ROOT, "Storey", storey.id)
    prim = define_xform(stage, path, (0.0, 0.0, storey.elevation.value), kind=Kind.Tokens.group)
    describe(prim, storey, "IfcBuildingStorey")
    left_out = _add_walls(stage, path, storey)
    elements: Sequence[Area | Space | Column | Stair]
    for elements in (storey.spaces, storey.slabs, storey.coverings, storey.columns, storey.stairs):
        for element in elements:
            left_out += _add_element(stage, path, element, storey)
    return left_out


def _add_walls(stage: Usd.Stage, storey_path: Sdf.Path, storey: Storey) -> list[str]:
    bodies, floor = wall_bodies(storey), storey.elevation.value
    left_out: list[str] = []
    leafless: list[str] = []
    for wall in storey.walls:
        path = free_path(stage, define_group(stage, storey_path, "Walls"), "Wall", wall.id)
        place = (*wall.start, wall.base - floor)
        prim = define_xform(stage, path, place, wall_angle(wall), Kind.Tokens.component)
        describe(prim, wall, "IfcWall")
        left_out += _add_body(stage, path, bodies[wall.id], wall)
        for opening in wall.openings:
            if not add_opening(stage, storey_path, path, wall, opening, floor):
                leafless.append((opening.fill or opening).name)
    if leafless:
        left_out.append(f"{storey.name}: no leaf, since hinge, swing or angle is not known: {', '.join(leafless)}.")
    return left_out


def _add_element(
    stage: Usd.Stage, storey_path: Sdf.Path, element: Area | Space | Column | Stair, storey: Storey
) -> list[str]:
    group, ifc_class = _CLASSES[type(element)]
    path = free_path(stage, define_group(stage, storey_path, group), type(element).__name__, element.id)
    describe(define_xform(stage, path, kind=Kind.Tokens.component), element, ifc_class)
    body = area_body(element) if isinstance(element, Area) else upright_body(element)
    return _add_body(stage, path, move_mesh(body, 0.0, (0.0, 0.0, -storey.elevation.value)), element)


def _add_body(stage: Usd.Stage, parent: Sdf.Path, body: Mesh, element: Element) -> list[str]:
    if not len(body.triangles):
        return [f"{element.name}: no shape, since it has no extent."]
    define = define_guide if isinstance(element, Space | Stair) else define_mesh
    define(stage, parent.AppendChild("body"), body, colour_of(element))
    return [f"{element.name}: only its envelope, as a guide, since its steps are not known."] * isinstance(
        element, Stair
    )


def _add_scan(stage: Usd.Stage, scan: ScanSource) -> None:
    path = free_path(stage, define_group(stage, ROOT, "Scans"), "Scan", scan.id)
    prim = define_xform(stage, path, scan.position or (0.0, 0.0, 0.0), kind=Kind.Tokens.component)
    describe(prim, scan, "IfcAnnotation")
