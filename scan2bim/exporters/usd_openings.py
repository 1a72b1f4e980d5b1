"""Doors, windows and passages as prims: each placed at its opening, with the leaf on its hinge or a pane."""

from __future__ import annotations

import math
from typing import Final

from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics

from scan2bim.exporters.usd_prims import (
    GLASS_OPACITY,
    define_group,
    define_guide,
    define_mesh,
    define_xform,
    describe,
    free_path,
    write_fields,
)
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Door, Opening, Wall, Window
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import Leaf, door_leaves, leaf_body, pane_body, void_body, wall_angle

OPEN_LIMIT: Final = math.radians(110.0)
"""How far a leaf turns in the joint: past a right angle, short of the wall; further where it was found further open."""


def add_opening(stage: Usd.Stage, storey: Sdf.Path, host: Sdf.Path, wall: Wall, opening: Opening, floor: float) -> bool:
    """The prim of an opening or of what fills it. Gives whether all that should have a body (leaf, pane) has one.

    floor: z of the storey's frame. The prim's frame: origin at the sill of the jamb nearer to the wall's start, in the
    middle of the wall; x along the wall's axis, y to its left.
    """
    thing = opening.fill or opening
    kind = type(thing).__name__
    path = free_path(stage, define_group(stage, storey, f"{kind}s"), kind, thing.id)
    x, y, z = point_on_wall(wall, opening.offset.value, 0.0, opening.sill.value)
    prim = define_xform(stage, path, (x, y, z - floor), wall_angle(wall), Kind.Tokens.component)
    describe(prim, thing, "IfcOpeningElement" if opening.fill is None else f"Ifc{kind}")
    prim.CreateRelationship("s2b:host", custom=True).SetTargets([host])
    if opening.fill is not None:
        write_fields(prim, opening, "s2b:opening")
        attribute = prim.CreateAttribute("ifc:openingGlobalId", Sdf.ValueTypeNames.String, custom=True)
        attribute.Set(ifc_guid(opening.id))
    define_guide(stage, path.AppendChild("void"), void_body(wall, opening), colour_of(thing))
    if isinstance(opening.fill, Window):
        define_mesh(stage, path.AppendChild("pane"), pane_body(opening), colour_of(thing), GLASS_OPACITY)
    if not isinstance(opening.fill, Door):
        return True
    leaves = door_leaves(wall, opening)
    for number, leaf in enumerate(leaves):
        _add_leaf(stage, path, leaf, opening.fill, "" if len(leaves) == 1 else f"_{number + 1}")
    return bool(leaves)


def _add_leaf(stage: Usd.Stage, door: Sdf.Path, leaf: Leaf, fill: Door, suffix: str) -> None:
    """A leaf below an Xform on its hinge, which is turned as found; where the swing is known, with a joint."""
    hinge = door.AppendChild(f"hinge{suffix}")
    prim = define_xform(stage, hinge, (*leaf.hinge, 0.0), leaf.angle, Kind.Tokens.subcomponent)
    body = define_mesh(stage, hinge.AppendChild("leaf"), leaf_body(leaf), colour_of(fill))
    if leaf.turn == 0:
        return
    UsdPhysics.RigidBodyAPI.Apply(prim)
    UsdPhysics.CollisionAPI.Apply(body)
    UsdPhysics.MeshCollisionAPI.Apply(body).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    _add_joint(stage, door, door.AppendChild(f"joint{suffix}"), hinge, leaf)


def _add_joint(stage: Usd.Stage, door: Sdf.Path, path: Sdf.Path, hinge: Sdf.Path, leaf: Leaf) -> None:
    """A hinge about z between the door's place (at rest, since it is no rigid body) and the leaf."""
    joint = UsdPhysics.RevoluteJoint.Define(stage, path)
    joint.CreateAxisAttr(UsdGeom.Tokens.z)
    joint.CreateBody0Rel().SetTargets([door])
    joint.CreateBody1Rel().SetTargets([hinge])
    joint.CreateLocalPos0Attr(Gf.Vec3f(leaf.hinge[0], leaf.hinge[1], 0.0))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot0Attr(Gf.Quatf(1.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))
    limit = math.degrees(max(OPEN_LIMIT, abs(leaf.angle)))
    joint.CreateLowerLimitAttr(min(0.0, leaf.turn * limit))
    joint.CreateUpperLimitAttr(max(0.0, leaf.turn * limit))
    joint.CreateCollisionEnabledAttr(False)
