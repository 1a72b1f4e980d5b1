"""The parts that all prims of a USD stage are made of: names, frames, meshes, materials and attributes.

A prim's name comes from the element's id and stays the same from run to run; the element's name is its display name.
"""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt
from pxr import UsdSemantics  # pyright: ignore[reportAttributeAccessIssue]

from scan2bim import __version__

from scan2bim.geometry.meshes import Mesh, face_normals
from scan2bim.model.colours import to_linear, to_srgb
from scan2bim.model.elements import Building, Colour, Dimension, Element, Evidence, FaceView, Frame, Record, ScanResidual, ScanSource, Storey
from scan2bim.model.ids import ifc_guid

ROOT: Final = Sdf.Path("/Building")
GLASS_OPACITY: Final = 0.35
"""Of panes: so that one sees the window and through it."""
_ID_LENGTH: Final = 8  # characters of an id in a prim's name; the whole id where that is taken
_SKIPPED: Final = ("name", "colour", "kind")

WIKIDATA: Final = {
    "IfcBuilding": "Q41176",
    "IfcBuildingStorey": "Q1049476",
    "IfcWall": "Q42948",
    "IfcSlab": "Q1070114",
    "IfcCovering": "Q216635",
    "IfcSpace": "Q180516",
    "IfcDoor": "Q36794",
    "IfcWindow": "Q35473",
}
"""Names of classes that programs know across languages."""

Identified = Building | Storey | Element | ScanSource


def new_stage(path: str, root: Sdf.Path, kind: str) -> Usd.Stage:
    """A stage in a new file: z up, metres, kilograms, with this default prim."""
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = {"creator": f"scan2bim {__version__}"}
    stage.SetDefaultPrim(define_xform(stage, root, kind=kind))
    UsdGeom.Scope.Define(stage, root.AppendChild("Looks"))
    return stage


def define_xform(
    stage: Usd.Stage,
    path: Sdf.Path,
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    angle: float = 0.0,
    kind: str = "",
) -> Usd.Prim:
    """An Xform that turns by ``angle`` (radians) about z, then shifts (metres); with a kind where one is given."""
    xform = UsdGeom.Xform.Define(stage, path)
    if any(shift):
        xform.AddTranslateOp().Set(Gf.Vec3d(*shift))
    if angle:
        xform.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(angle))
    if kind:
        Usd.ModelAPI(xform.GetPrim()).SetKind(kind)
    return xform.GetPrim()


def define_group(stage: Usd.Stage, parent: Sdf.Path, name: str) -> Sdf.Path:
    """The group of this name below the parent, made where it is not there yet."""
    path = parent.AppendChild(name)
    if not stage.GetPrimAtPath(path):
        define_xform(stage, path, kind=Kind.Tokens.group)
    return path


def free_path(stage: Usd.Stage, parent: Sdf.Path, kind: str, identifier: str) -> Sdf.Path:
    """A path below the parent named after the kind and the start of the identifier."""
    safe = re.sub(r"[^A-Za-z0-9_]", "_", identifier)
    short = parent.AppendChild(f"{kind}_{safe[:_ID_LENGTH]}")
    path = parent.AppendChild(f"{kind}_{safe}") if stage.GetPrimAtPath(short) else short
    count = 1
    while stage.GetPrimAtPath(path):
        count += 1
        path = parent.AppendChild(f"{kind}_{safe}_{count}")
    return path


def define_mesh(stage: Usd.Stage, path: Sdf.Path, mesh: Mesh, colour: Colour, opacity: float = 1.0) -> Usd.Prim:
    """A polygon mesh with flat normals, extent and a material of this linear colour."""
    prim = _define_shape(stage, path, mesh, colour)
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(_material(stage, colour, opacity))
    return prim


def define_guide(stage: Usd.Stage, path: Sdf.Path, mesh: Mesh, colour: Colour) -> Usd.Prim:
    """A mesh that is shown only when guides are: no material, purpose guide."""
    prim = _define_shape(stage, path, mesh, colour)
    UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)
    return prim


def describe(prim: Usd.Prim, thing: Identified, ifc_class: str) -> None:
    """Display name, IFC identity, and all plain fields of the thing as attributes ``s2b:*``."""
    prim.SetDisplayName(thing.name)
    _attribute(prim, "ifc:GlobalId", Sdf.ValueTypeNames.String, ifc_guid(thing.id))
    label(prim, ifc_class)
    write_fields(prim, thing, "s2b")


def label(prim: Usd.Prim, ifc_class: str) -> None:
    """The IFC class as an attribute, and as semantic labels that cameras in simulators see."""
    _attribute(prim, "ifc:class", Sdf.ValueTypeNames.Token, ifc_class)
    labels: dict[str, str | None] = {"class": ifc_class.removeprefix("Ifc").lower(), "ifc": ifc_class, "wikidata_qcode": WIKIDATA.get(ifc_class)}
    for taxonomy, word in labels.items():
        if word is not None:
            UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr(Vt.TokenArray([word]))


def write_fields(prim: Usd.Prim, record: Record, prefix: str) -> None:
    """Numbers, words, dimensions, evidence and frame of a record; shapes and contained elements are not attributes."""
    for name in type(record).model_fields:
        if name not in _SKIPPED:
            _write_field(prim, f"{prefix}:{name}", getattr(record, name))


def _write_field(prim: Usd.Prim, name: str, value: object) -> None:
    types = Sdf.ValueTypeNames
    match value:
        case Dimension():
            _attribute(prim, name, types.Double, value.value)
            _attribute(prim, f"{name}:source", types.Token, value.source)
            if value.sigma is not None:
                _attribute(prim, f"{name}:sigma", types.Double, value.sigma)
        case Evidence() | Frame() | ScanResidual():
            write_fields(prim, value, name)
        case bool():
            _attribute(prim, name, types.Bool, value)
        case int():
            _attribute(prim, name, types.Int64, value)
        case float():
            _attribute(prim, name, types.Double, value)
        case str() if value:
            _attribute(prim, name, types.String, value)
        case (FaceView(), *_):
            for face in value:
                write_fields(prim, face, f"{name}:{face.side}")
        case (str(), *_):
            _attribute(prim, name, types.StringArray, Vt.StringArray(value))
        case (float(x), float(y), float(z)):
            _attribute(prim, name, types.Double3, Gf.Vec3d(x, y, z))
        case _:
            pass


def _attribute(prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    prim.CreateAttribute(name, kind, custom=True, variability=Sdf.VariabilityUniform).Set(value)


def shape_mesh(stage: Usd.Stage, path: Sdf.Path, mesh: Mesh) -> Usd.Prim:
    """A polygon mesh with flat normals and extent, without colour."""
    points, triangles = mesh.vertices.astype(np.float32), mesh.triangles.astype(np.int32)
    shape = UsdGeom.Mesh.Define(stage, path)
    shape.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    shape.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
    shape.CreateDoubleSidedAttr(False)
    shape.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    shape.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, np.int32)))
    shape.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.ravel()))
    normals = np.repeat(face_normals(mesh), 3, axis=0).astype(np.float32) + np.float32(0)  # no negative zeros
    shape.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
    shape.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    low, high = points.min(axis=0), points.max(axis=0)
    shape.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([low, high])))
    return shape.GetPrim()


def _define_shape(stage: Usd.Stage, path: Sdf.Path, mesh: Mesh, colour: Colour) -> Usd.Prim:
    prim = shape_mesh(stage, path, mesh)
    UsdGeom.Gprim(prim).CreateDisplayColorAttr([Gf.Vec3f(*colour)])
    return prim


def _material(stage: Usd.Stage, colour: Colour, opacity: float) -> UsdShade.Material:
    """The material of this colour (to a step of 8-bit sRGB) and opacity below the default prim, named after them."""
    srgb = to_srgb(colour)
    name = "Colour_{:02X}{:02X}{:02X}".format(*srgb) + ("" if opacity == 1.0 else f"_{round(opacity * 100)}")
    path = stage.GetDefaultPrim().GetPath().AppendChild("Looks").AppendChild(name)
    if stage.GetPrimAtPath(path):
        return UsdShade.Material.Get(stage, path)
    material = UsdShade.Material.Define(stage, path)
    made_of = "glass" if opacity < 1.0 else "unknown"
    UsdSemantics.LabelsAPI.Apply(material.GetPrim(), "material").CreateLabelsAttr(Vt.TokenArray([made_of]))
    shader = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*to_linear(srgb)))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.9 if opacity == 1.0 else 0.1)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(opacity)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material
