"""Damage to storeys, spaces, and where elements stand. See ``mutations``."""

from __future__ import annotations

from check.mutations import File, door, of, shift, solid, wall


def door_in_the_wrong_storey(f: File) -> None:
    """outside its storey"""
    _lower, upper = f.by_type("IfcBuildingStorey")
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        if door(f) in relation.RelatedElements:
            relation.RelatedElements = [e for e in relation.RelatedElements if e != door(f)]
    home = next(r for r in upper.ContainsElements)
    home.RelatedElements = [*home.RelatedElements, door(f)]


def space_in_the_wrong_storey(f: File) -> None:
    """outside its storey"""
    room = of(f, "room-attic")
    old = room.Decomposes[0]
    new = next(r for r in f.by_type("IfcBuildingStorey")[0].IsDecomposedBy)
    f.remove(old)
    new.RelatedObjects = [*new.RelatedObjects, room]


def elevation_wrong(f: File) -> None:
    """elevation unlike the placement"""
    f.by_type("IfcBuildingStorey")[1].Elevation += 0.5


def storeys_at_one_height(f: File) -> None:
    """storeys at one height"""
    shift(f, f.by_type("IfcBuildingStorey")[1], z=-2.8)


def contained_nowhere(f: File) -> None:
    """in no storey"""
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        relation.RelatedElements = [e for e in relation.RelatedElements if e != wall(f, "counter")]


def contained_twice(f: File) -> None:
    """in two storeys"""
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        if wall(f) not in relation.RelatedElements and len(relation.RelatedElements) > 3:
            relation.RelatedElements = [*relation.RelatedElements, wall(f)]


def far_away(f: File) -> None:
    """far from the building"""
    shift(f, of(f, "post"), x=500.0)


def without_a_body(f: File) -> None:
    """no body"""
    of(f, "post").Representation = None


def space_into_a_wall(f: File) -> None:
    """space in a wall"""
    shift(f, of(f, "room-store"), x=-0.2)


def space_grown_into_the_next(f: File) -> None:
    """spaces overlap"""
    for point in solid(of(f, "room-store")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (x + (1.0 if x > 2.0 else 0.0), y)


def space_too_small(f: File) -> None:
    """space leaves a gap"""
    for point in solid(of(f, "room-attic")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (min(x, 7.4), y)


def space_removed(f: File) -> None:
    """space missing"""
    room = of(f, "room-store")
    for relation in [*room.BoundedBy]:
        f.remove(relation)
    f.remove(room)
