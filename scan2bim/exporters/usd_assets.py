"""Assets of doors and windows: a layer for each type, which all places of that type refer to.

The frame of an asset: origin at the lower edge of the jamb nearer to the wall's start, in the middle of the wall; x
along the wall, y to its left, z up.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics

from scan2bim.exporters.usd_physics import add_hinge, collide, fix, give_mass
from scan2bim.exporters.usd_prims import (
    GLASS_OPACITY,
    WIKIDATA,
    define_guide,
    define_mesh,
    define_xform,
    label,
    new_stage,
)
from scan2bim.exporters.usd_thumbnail import write_thumbnail
from scan2bim.geometry.meshes import Mesh
from scan2bim.model.colours import colour_of, to_srgb
from scan2bim.model.elements import Colour, Door, Opening, Wall
from scan2bim.model.shapes import (
    Leaf,
    door_leaves,
    frame_body,
    leaf_body,
    lining_body,
    pane_body,
    void_body,
)

STATE: Final = "doorState"
"""The variant set of doors: closed, ajar, open, and at their places as_scanned; without a hinge closed and open."""
_AJAR: Final = math.radians(30.0)
_OPEN: Final = math.radians(90.0)
_FRAME_MASS: Final = 15.0
"""Kilograms of a door's frame; it is fixed, so that nothing hangs on it."""


@dataclass(frozen=True, slots=True)
class Hung:
    """A leaf and how far it turns, radians."""

    leaf: Leaf
    limit: float

    @property
    def turns(self) -> bool:
        """Whether it has a hinge."""
        return self.leaf.turn != 0


@dataclass(frozen=True, slots=True)
class Asset:
    """A written asset: the file's path below the assets' folder, and its leaves' names in the order of the door's leaves."""

    path: str
    leaves: tuple[str, ...]


class Assets:
    """The assets of a building, each written once into ``folder``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: dict[str, Asset] = {}

    def of(self, wall: Wall, opening: Opening, limit_of: Callable[[Leaf], float]) -> Asset:
        """The asset for what fills an opening, written if it is the first of its type."""
        leaves = tuple(Hung(leaf, limit_of(leaf) if leaf.turn else 0.0) for leaf in door_leaves(wall, opening))
        kind, key = type(opening.fill).__name__, _key(wall, opening, leaves)
        if key not in self._written:
            name = f"{kind}_{_millimetres(opening.width.value)}x{_millimetres(opening.height.value)}"
            name += "_" + hashlib.sha256(key.encode()).hexdigest()[:6]
            file = self._folder / name / "usd" / f"{name}.usdc"  # the folders that asset libraries expect
            file.parent.mkdir(parents=True)
            stage = new_stage(str(file), Sdf.Path(f"/{name}"), Kind.Tokens.component)
            label(stage.GetDefaultPrim(), f"Ifc{kind}")
            names = _fill(stage, wall, opening, leaves)
            _describe_asset(stage, kind)
            stage.Save()
            write_thumbnail(stage, file.parent / ".thumbs" / "256x256" / f"{file.name}.png")
            self._written[key] = Asset(file.relative_to(self._folder).as_posix(), names)
        return self._written[key]


def _millimetres(length: float) -> int:
    return round(1000 * length)


def _key(wall: Wall, opening: Opening, leaves: tuple[Hung, ...]) -> str:
    """What makes a type: all that its shape hangs on, in millimetres and degrees, and the colour as it is shown."""
    fill = opening.fill
    assert fill is not None
    lengths = [opening.width.value, opening.height.value, wall.thickness.value]
    bodies = (lining_body if isinstance(fill, Door) else frame_body)(wall, opening).vertices
    lengths += [*bodies.ravel().tolist(), *([] if isinstance(fill, Door) else pane_body(wall, opening).vertices[0])]
    words = [type(fill).__name__, str(to_srgb(colour_of(fill))), str(isinstance(fill, Door) and fill.glazed)]
    for hung in leaves:
        leaf = hung.leaf
        lengths += [*leaf.hinge, leaf.reach, *leaf.depth, leaf.bottom, leaf.height]
        words.append(f"{leaf.turn} {math.degrees(hung.limit):.0f}")
    return " ".join([*words, *(str(_millimetres(length)) for length in lengths)])


def _describe_asset(stage: Usd.Stage, kind: str) -> None:
    """What libraries of assets for simulators (SimReady) ask of one, in the layer's data. No date: reruns are equal."""
    root = stage.GetDefaultPrim()
    bodies = [prim for prim in stage.Traverse() if prim.HasAPI("PhysicsRigidBodyAPI")]
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    size = cache.ComputeWorldBound(root).ComputeAlignedRange().GetSize()
    weighed = [UsdPhysics.MassAPI(prim).GetMassAttr().Get() for prim in bodies]
    facts = {
        "asset_name": root.GetName(),
        "asset_type": "Prop",
        "author": "scan2bim",
        "asset_license": "not stated",
        "category": kind,
        "source_file": "laser scan",
        "usd_date_generated": "not recorded",
        "qcode": WIKIDATA[f"Ifc{kind}"],
        "rigid_body_count": len(bodies),
        "asset_extents": Gf.Vec3f(*(max(length, 0.0) for length in size)),
        "mass": sum(weighed) or _FRAME_MASS,
    }
    layer = stage.GetRootLayer()
    layer.customLayerData = {**layer.customLayerData, "SimReady_Metadata": facts}


def _fill(stage: Usd.Stage, wall: Wall, opening: Opening, leaves: tuple[Hung, ...]) -> tuple[str, ...]:
    """Write the shapes of what fills an opening; gives the leaves' names."""
    root, fill = stage.GetDefaultPrim(), opening.fill
    assert fill is not None
    colour = colour_of(fill)
    define_guide(stage, root.GetPath().AppendChild("void"), void_body(wall, opening), colour)
    if not isinstance(fill, Door):
        _add_standing(stage, "frame", frame_body(wall, opening), colour)
        _add_standing(stage, "pane", pane_body(wall, opening), colour, GLASS_OPACITY)
        return ()
    _add_standing(stage, "frame", lining_body(wall, opening), colour)
    opacity = GLASS_OPACITY if fill.glazed else 1.0
    names = tuple("leaf" if len(leaves) == 1 else f"leaf_{number}" for number in range(1, len(leaves) + 1))
    for name, hung in zip(names, leaves, strict=True):
        _add_leaf(stage, name, hung, colour, opacity)
    if any(hung.turns for hung in leaves):
        UsdPhysics.ArticulationRootAPI.Apply(root)
        frame = define_xform(stage, root.GetPath().AppendChild("frame"))
        UsdPhysics.RigidBodyAPI.Apply(frame)
        UsdPhysics.MassAPI.Apply(frame).CreateMassAttr(_FRAME_MASS)
        fix(stage, root.GetPath().AppendChild("fixed"), root.GetPath(), frame.GetPath())
        _add_states(root, dict(zip(names, leaves, strict=True)))
    elif names:
        _add_absence(root, names)
    return names


def _add_standing(stage: Usd.Stage, name: str, body: Mesh, colour: Colour, opacity: float = 1.0) -> None:
    """A part that does not move, with a mesh, where there is anything of it."""
    if not len(body.triangles):
        return
    path = stage.GetDefaultPrim().GetPath().AppendChild(name)
    define_xform(stage, path)
    collide(define_mesh(stage, path.AppendChild("mesh"), body, colour, opacity), "convexDecomposition")


def _add_leaf(stage: Usd.Stage, name: str, hung: Hung, colour: Colour, opacity: float) -> None:
    """A leaf in a frame on its hinge; one that turns has mass and a joint."""
    root, leaf = stage.GetDefaultPrim().GetPath(), hung.leaf
    path = root.AppendChild(name)
    prim = define_xform(stage, path, (*leaf.hinge, 0.0))
    collide(define_mesh(stage, path.AppendChild("panel"), leaf_body(leaf), colour, opacity), "convexHull")
    give_mass(prim, leaf)
    if not hung.turns:
        fix(stage, root.AppendChild(name.replace("leaf", "fixed")), root, path)
        return
    UsdGeom.Xformable(prim).AddRotateZOp(UsdGeom.XformOp.PrecisionDouble)
    add_hinge(stage, root.AppendChild(name.replace("leaf", "hinge")), root.AppendChild("frame"), path, leaf, hung.limit)


def _add_states(root: Usd.Prim, leaves: dict[str, Hung]) -> None:
    """Variants that set the leaves' angles, the closed one chosen."""
    for state, angle in (("closed", 0.0), ("ajar", _AJAR), ("open", _OPEN)):
        angles = {name: hung.leaf.turn * min(angle, hung.limit) for name, hung in leaves.items() if hung.turns}
        add_state(root, state, angles)
    root.GetVariantSets().GetVariantSet(STATE).SetVariantSelection("closed")


def _add_absence(root: Usd.Prim, names: tuple[str, ...]) -> None:
    """States of a door whose hinge is not known: closed, or open with its leaves away, since where to is not known."""
    variants = root.GetVariantSets().AddVariantSet(STATE)
    for state in ("closed", "open"):
        variants.AddVariant(state)
        variants.SetVariantSelection(state)
        with variants.GetVariantEditContext():
            for name in (part for leaf in names for part in (leaf, leaf.replace("leaf", "fixed"))):
                root.GetStage().OverridePrim(root.GetPath().AppendChild(name)).SetActive(state == "closed")
    variants.SetVariantSelection("closed")


def add_state(root: Usd.Prim, state: str, angles: dict[str, float]) -> None:
    """A variant of the door at ``root`` in which its leaves, by name, are turned by signed angles, radians."""
    variants = root.GetVariantSets().AddVariantSet(STATE)
    variants.AddVariant(state)
    variants.SetVariantSelection(state)
    with variants.GetVariantEditContext():
        for name, angle in angles.items():
            leaf = root.GetStage().OverridePrim(root.GetPath().AppendChild(name))
            attribute = leaf.CreateAttribute("xformOp:rotateZ", Sdf.ValueTypeNames.Double)
            attribute.Set(math.degrees(angle))
