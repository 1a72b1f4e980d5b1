"""What simulators need: blocks that bodies meet, leaves with mass, hinges."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from scan2bim.exporters.usd_prims import define_xform, shape_mesh
from scan2bim.geometry.meshes import Floats
from scan2bim.geometry.wall_meshes import BOX_CORNERS, WallForm, piece_mesh, wall_pieces
from scan2bim.model.shapes import Leaf

LEAF_DENSITY: Final = 350.0
"""Kilograms a cubic metre: of a door leaf with a chipboard core, 25 kg at 0.9 x 2.0 x 0.04 m."""
DAMPING: Final = 0.05
"""Newton metres a degree a second, at the hinge: a pushed leaf comes to rest within seconds."""
_STRAIGHT: Final = 1e-6  # metres by which a block's corners may stray from a box's


def collide(prim: Usd.Prim, approximation: str) -> None:
    """Make a mesh something that bodies meet; convexHull for what moves, none for what stands."""
    UsdPhysics.CollisionAPI.Apply(prim)
    UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(approximation)


def add_wall_blocks(stage: Usd.Stage, wall: Sdf.Path, form: WallForm) -> None:
    """Blocks round a wall's openings: simulators make meshes convex, which would close every doorway."""
    blocks = wall_pieces(form)
    if not len(blocks):
        return
    group = define_xform(stage, wall.AppendChild("collision"))
    UsdGeom.Imageable(group).CreatePurposeAttr(UsdGeom.Tokens.guide)
    for number, block in enumerate(blocks):
        _add_block(stage, group.GetPath().AppendChild(f"block_{number}"), block)


def _add_block(stage: Usd.Stage, path: Sdf.Path, block: Floats) -> None:
    """A cube where the block is a box along the frame's axes, else its convex hull. block: (8, 3)."""
    low, high = block.min(axis=0), block.max(axis=0)
    if np.abs(block - np.where(np.array(BOX_CORNERS), high, low)).max() > _STRAIGHT:
        collide(shape_mesh(stage, path, piece_mesh(block)), UsdPhysics.Tokens.convexHull)
        return
    cube = UsdGeom.Cube.Define(stage, path)
    cube.CreateSizeAttr(1.0)
    cube.CreateExtentAttr([Gf.Vec3f(-0.5), Gf.Vec3f(0.5)])
    cube.AddTranslateOp().Set(Gf.Vec3d(*((low + high) / 2).tolist()))
    cube.AddScaleOp().Set(Gf.Vec3f(*(high - low).tolist()))
    UsdPhysics.CollisionAPI.Apply(cube.GetPrim())


def give_mass(prim: Usd.Prim, leaf: Leaf) -> None:
    """Make the prim on a leaf's hinge a rigid body with the leaf's mass and inertia, as of a box."""
    UsdPhysics.RigidBodyAPI.Apply(prim)
    size = np.array([abs(leaf.reach), leaf.depth[1] - leaf.depth[0], leaf.height])
    mass = LEAF_DENSITY * float(np.prod(size))
    squares = size**2
    inertia = mass / 12 * (squares.sum() - squares)
    middle = (leaf.reach / 2, (leaf.depth[0] + leaf.depth[1]) / 2, leaf.bottom + leaf.height / 2)
    api = UsdPhysics.MassAPI.Apply(prim)
    api.CreateMassAttr(mass)
    api.CreateCenterOfMassAttr(Gf.Vec3f(*middle))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(*inertia.tolist()))
    api.CreatePrincipalAxesAttr(Gf.Quatf(1.0))


def add_hinge(stage: Usd.Stage, path: Sdf.Path, frame: Sdf.Path, body: Sdf.Path, leaf: Leaf, limit: float) -> None:
    """A hinge about z between the frame and the leaf, from closed to ``limit`` (radians) on the side it swings to."""
    joint = UsdPhysics.RevoluteJoint.Define(stage, path)
    joint.CreateAxisAttr(UsdGeom.Tokens.z)
    joint.CreateBody0Rel().SetTargets([frame])
    joint.CreateBody1Rel().SetTargets([body])
    joint.CreateLocalPos0Attr(Gf.Vec3f(leaf.hinge[0], leaf.hinge[1], 0.0))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot0Attr(Gf.Quatf(1.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))
    degrees = leaf.turn * math.degrees(limit)
    joint.CreateLowerLimitAttr(min(0.0, degrees))
    joint.CreateUpperLimitAttr(max(0.0, degrees))
    joint.CreateCollisionEnabledAttr(False)
    drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "angular")
    drive.CreateTypeAttr("force")
    drive.CreateDampingAttr(DAMPING)
    drive.CreateStiffnessAttr(0.0)


def fix(stage: Usd.Stage, path: Sdf.Path, root: Sdf.Path, body: Sdf.Path) -> None:
    """Hold a body where the asset's root stands, which is no body itself: the asset can be placed anywhere."""
    joint = UsdPhysics.FixedJoint.Define(stage, path)
    joint.CreateBody0Rel().SetTargets([root])
    joint.CreateBody1Rel().SetTargets([body])
    for attribute in (joint.CreateLocalPos0Attr, joint.CreateLocalPos1Attr):
        attribute(Gf.Vec3f(0.0))
    for attribute in (joint.CreateLocalRot0Attr, joint.CreateLocalRot1Attr):
        attribute(Gf.Quatf(1.0))
