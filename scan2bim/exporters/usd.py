"""OpenUSD: ``.usda`` and ``.usdc`` with a layer a storey and an asset a type of door or window; ``.usdz`` as one layer.

z up, metres. ``/Building`` (assembly) > storey (group, its origin on the floor, a payload) > Walls, Doors, ... (groups)
> element (component) > meshes. Spaces, voids, blocks that bodies meet and envelopes of stairs are guides. Layers and
assets lie in a folder beside the file, always in the binary form, since they hold the long arrays. A ``.usdz`` is flattened: browsers and telephones read neither payloads nor
variants, so its doors stand as scanned. The same model gives the same bytes.
"""

from __future__ import annotations

import errno
import os
import struct
import tempfile
import zipfile
from pathlib import Path
from typing import Final

from pxr import Kind, Sdf, Tf, Usd, UsdGeom, UsdPhysics, Vt

from scan2bim import __version__
from scan2bim.errors import StageError
from scan2bim.exporters.parts import parts_folder, replace_parts
from scan2bim.exporters.usd_assets import Assets
from scan2bim.exporters.usd_prims import ROOT, define_group, define_xform, describe, free_path, new_stage
from scan2bim.exporters.usd_storey import StoreyLayer
from scan2bim.model.elements import Building, ScanSource

_ALIGNMENT: Final = 64  # bytes; required by the usdz specification
NO_GUIDES: Final = "Spaces and simulators' blocks are not in .usdz: browsers would draw them; .usda and .usdc have them."
_ZIP_HEADER: Final = 30  # bytes of a zip entry's local header before its name
_EXTRA_HEADER: Final = struct.Struct("<HH")
_PADDING_ID: Final = 0x1986  # the extra field that USD's own packer pads with


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the building as the USD file ``path`` (its suffix chooses the form) and say what was left out.

    Raises OSError where the file cannot be written, StageError where the library gives up without a reason.
    """
    suffix = path.suffix.lower()
    parts = parts_folder(path, suffix[1:])
    with tempfile.TemporaryDirectory(prefix=".usd-", dir=path.parent) as name:
        folder = Path(name)
        layer = ".usda" if suffix == ".usda" else ".usdc"
        draft = folder / f"building{layer}"  # a plain name: brackets mean packages to the library
        try:
            notes = _write_layers(building, draft, parts.name, instances=suffix != ".usdz")
            if suffix == ".usdz":
                _package(_flatten(draft), draft := folder / "building.usdz")
        except Tf.ErrorException as error:
            if os.strerror(errno.ENOSPC) in str(error):  # its message repeats that for every block
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from None
            raise
        if suffix != ".usdz":
            replace_parts(folder / parts.name, parts)
        draft.replace(path)
    return (*notes, NO_GUIDES) if suffix == ".usdz" else notes


def _write_layers(building: Building, path: Path, parts: str, *, instances: bool) -> tuple[str, ...]:
    """The root layer at ``path``, and in the folder ``parts`` beside it what it needs."""
    folder = path.parent / parts
    folder.mkdir()
    stage = new_stage(str(path), ROOT, Kind.Tokens.assembly)
    describe(stage.GetDefaultPrim(), building, "IfcBuilding")
    UsdPhysics.Scene.Define(stage, ROOT.AppendChild("Physics"))
    assets, notes = Assets(folder / "assets"), list[str]()
    for storey in building.storeys:
        place = free_path(stage, ROOT, "Storey", storey.id)
        file = folder / f"{place.name}.usdc"
        layer = StoreyLayer(file, place.name, storey, assets, instances=instances)
        layer.write()
        notes += layer.notes
        prim = define_xform(stage, place, (0.0, 0.0, storey.elevation.value))
        prim.GetPayloads().AddPayload(f"./{parts}/{file.name}")
        UsdGeom.ModelAPI.Apply(prim).SetExtentsHint(Vt.Vec3fArray(layer.extent()))
    for scan in building.scans:
        _add_scan(stage, scan)
    stage.Save()
    return tuple(notes)


def _flatten(path: Path) -> Path:
    """All layers as one, composed."""
    flat = path.with_name("flat.usdc")
    layer = Usd.Stage.Open(str(path)).Flatten(addSourceFileComment=False)
    layer.customLayerData = {"creator": f"scan2bim {__version__}"}
    _drop_guides(Usd.Stage.Open(layer))
    if not layer.Export(str(flat)):
        raise StageError(f"The USD library could not write {path.name} and gave no reason.")
    return flat


def _drop_guides(stage: Usd.Stage) -> None:
    """Without spaces, voids and simulators' blocks: browsers know no purposes and would draw them over the building."""
    guides: list[Sdf.Path] = []
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot()))
    for prim in walk:
        shown = UsdGeom.Imageable(prim)
        if shown and shown.ComputePurpose() == UsdGeom.Tokens.guide:
            guides.append(prim.GetPath())
            walk.PruneChildren()
    for path in guides:
        stage.RemovePrim(path)


def _package(layer: Path, path: Path) -> None:
    """Put the layer into a usdz: stored, its bytes on a multiple of 64, and dated 1980, so that reruns are equal.

    The library's own packer writes the time of day.
    """
    entry = zipfile.ZipInfo("building.usdc")
    entry.external_attr = 0o644 << 16
    padding = -(_ZIP_HEADER + len(entry.filename) + _EXTRA_HEADER.size) % _ALIGNMENT
    entry.extra = _EXTRA_HEADER.pack(_PADDING_ID, padding) + bytes(padding)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as package:
        package.writestr(entry, layer.read_bytes())


def _add_scan(stage: Usd.Stage, scan: ScanSource) -> None:
    path = free_path(stage, define_group(stage, ROOT, "Scans"), "Scan", scan.id)
    prim = define_xform(stage, path, scan.position or (0.0, 0.0, 0.0), kind=Kind.Tokens.component)
    describe(prim, scan, "IfcAnnotation")
