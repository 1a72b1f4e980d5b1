"""The surfaces of a verified model as USD: a mesh an element, its cells coloured by deviation, its status as attribute."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Kind, Sdf, Usd, UsdGeom, Vt

from scan2bim.exporters.usd_prims import ROOT, define_group, free_path, label, new_stage
from scan2bim.model.colours import to_linear


@dataclass(frozen=True, slots=True, eq=False)
class PaintedElement:
    """corners (v, 3) float64 metres, quads (q, 4) int32, counter-clockwise from outside, colours (q, 3) uint8 sRGB."""

    guid: str
    ifc_class: str
    name: str
    storey: str
    status: str
    corners: NDArray[np.float64]
    quads: NDArray[np.int32]
    colours: NDArray[np.uint8]


def write_deviations(elements: Sequence[PaintedElement], path: Path) -> None:
    """Write the stage, in the model's own axes. Raises OSError."""
    stage = new_stage(str(path), ROOT, Kind.Tokens.assembly)
    for element in elements:
        group = define_group(stage, ROOT, element.ifc_class)
        prim = _mesh(stage, free_path(stage, group, element.ifc_class.removeprefix("Ifc"), element.guid), element)
        prim.SetDisplayName(element.name or element.guid)
        label(prim, element.ifc_class)
        for name, value in (("ifc:GlobalId", element.guid), ("s2b:status", element.status), ("s2b:storey", element.storey)):
            prim.CreateAttribute(name, Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform).Set(value)
    stage.GetRootLayer().Save()


def _mesh(stage: Usd.Stage, path: Sdf.Path, element: PaintedElement) -> Usd.Prim:
    """Of square cells, each with its own colour."""
    points = element.corners.astype(np.float32)
    unique = np.unique(element.colours, axis=0)
    linear = np.array([to_linear((int(r), int(g), int(b))) for r, g, b in unique], np.float32)
    place = np.searchsorted(_key(unique), _key(element.colours))
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(element.quads), 4, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(element.quads.ravel())))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    colours = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform)
    colours.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(linear[place])))
    return mesh.GetPrim()


def _key(colours: NDArray[np.uint8]) -> NDArray[np.int64]:
    """One number (n,) a colour (n, 3), ordered as the colours are."""
    wide = colours.astype(np.int64)
    return (wide[:, 0] << 16) | (wide[:, 1] << 8) | wide[:, 2]
