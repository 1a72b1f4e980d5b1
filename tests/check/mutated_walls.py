"""Damage to walls, their layers, axes and joints. See ``mutations``."""

from __future__ import annotations

import ifcopenshell.util.element as util
from check.mutations import File, of, shift, solid, wall

from scan2bim.model.ids import ifc_guid


def layer_too_thin(f: File) -> None:
    """layers unlike the body"""
    f.by_type("IfcMaterialLayer")[0].LayerThickness = 0.02


def body_too_thick(f: File) -> None:
    """layers unlike the body"""
    for point in solid(wall(f)).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (x, 1.5 * y)


def axis_beside_the_body(f: File) -> None:
    """axis outside the body"""
    axis = wall(f).Representation.Representations[0].Items[0]
    for point in axis.Points:
        point.Coordinates = (point.Coordinates[0], point.Coordinates[1] + 0.5)


def axis_too_short(f: File) -> None:
    """axis unlike the body"""
    wall(f, "north").Representation.Representations[0].Items[0].Points[1].Coordinates = (5.0, 0.0)


def wall_made_twice(f: File) -> None:
    """made twice"""
    copy = util.copy(f, wall(f, "counter"))
    copy.GlobalId = ifc_guid("copy")
    for relation in wall(f, "counter").ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, copy]


def wall_in_another(f: File) -> None:
    """walls overlap"""
    east = wall(f, "east")
    copy = util.copy(f, east)
    copy.GlobalId = ifc_guid("copy")
    copy.ObjectPlacement = util.copy_deep(f, east.ObjectPlacement, exclude=["IfcProduct"])
    shift(f, copy, x=0.05)
    for relation in east.ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, copy]


def wall_too_short(f: File) -> None:
    """gap at a joint"""
    for relation in f.by_type("IfcRelConnectsPathElements"):
        if wall(f, "counter") in (relation.RelatingElement, relation.RelatedElement):
            f.remove(relation)
    for point in solid(wall(f, "counter")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (max(x, 0.06), y)


def joined_walls_apart(f: File) -> None:
    """related walls do not meet"""
    shift(f, wall(f, "u-south"), y=-0.5)


def joint_not_related(f: File) -> None:
    """joint without a relation"""
    for relation in f.by_type("IfcRelConnectsPathElements"):
        if {relation.RelatingElement, relation.RelatedElement} == {wall(f), wall(f, "north")}:
            f.remove(relation)


def wall_lifted(f: File) -> None:
    """stands on nothing"""
    shift(f, of(f, "post"), z=0.8)
