"""Damage to boundaries, identifiers, units, maps, quantities and bodies. See ``mutations``."""

from __future__ import annotations

import numpy as np
from check.mutations import File, boundaries, of, solid, wall, window


def boundary_removed(f: File) -> None:
    """boundaries do not close"""
    f.remove(max(boundaries(f, "room-store", "wall-west"), key=lambda r: r.id()))


def boundaries_of_a_space_removed(f: File) -> None:
    """space without boundaries"""
    for relation in [*of(f, "room-attic").BoundedBy]:
        f.remove(relation)


def boundary_off_the_surface(f: File) -> None:
    """boundary off its space"""
    plane = boundaries(f, "room-store", "wall-inner")[0].ConnectionGeometry.SurfaceOnRelatingElement.BasisSurface
    x, y, z = plane.Position.Location.Coordinates
    plane.Position.Location = f.create_entity("IfcCartesianPoint", (x + 0.5, y, z))


def boundary_turned(f: File) -> None:
    """boundary inside out"""
    surface = boundaries(f, "room-attic", "wall-u-west")[0].ConnectionGeometry.SurfaceOnRelatingElement
    place = surface.BasisSurface.Position
    place.Axis = f.create_entity("IfcDirection", tuple(-r for r in place.Axis.DirectionRatios))
    x, y, z = np.array(place.Location.Coordinates)
    run = np.array(place.RefDirection.DirectionRatios)
    length = max(p.Coordinates[0] for p in surface.OuterBoundary.Points)
    place.Location = f.create_entity("IfcCartesianPoint", tuple(float(v) for v in (x, y, z) + run * length))
    place.RefDirection = f.create_entity("IfcDirection", tuple(-float(r) for r in run))


def boundary_of_another_wall(f: File) -> None:
    """boundary off its element"""
    boundaries(f, "room-store", "wall-west")[0].RelatedBuildingElement = wall(f, "east")


def door_boundary_without_parent(f: File) -> None:
    """boundary without its parent"""
    boundaries(f, "room-store", "door-measured")[0].ParentBoundary = None


def other_side_unanswered(f: File) -> None:
    """other side does not answer"""
    for one in boundaries(f, "room-store", "door-measured") + boundaries(f, "room-hall", "door-measured"):
        one.CorrespondingBoundary = boundaries(f, "room-hall", "opening-pass")[0]


def other_side_of_another(f: File) -> None:
    """other side of another thing"""
    one, two = boundaries(f, "room-store", "door-measured")[0], boundaries(f, "room-hall", "opening-pass")[0]
    for boundary in f.by_type("IfcRelSpaceBoundary2ndLevel"):
        boundary.CorrespondingBoundary = None
    one.CorrespondingBoundary = two


def identifier_twice(f: File) -> None:
    """GlobalId used twice"""
    wall(f).GlobalId = wall(f, "east").GlobalId


def identifier_malformed(f: File) -> None:
    """GlobalId malformed"""
    wall(f).GlobalId = "7" * 22


def length_unit_wrong(f: File) -> None:
    """unit implausible"""
    unit = next(u for u in f.by_type("IfcSIUnit") if u.UnitType == "LENGTHUNIT")
    unit.Prefix = "MILLI"


def map_direction_wrong(f: File) -> None:
    """map direction no unit vector"""
    f.by_type("IfcMapConversion")[0].XAxisAbscissa = 5.0


def two_maps(f: File) -> None:
    """two places on the map"""
    one = f.by_type("IfcMapConversion")[0]
    f.create_entity("IfcMapConversion", one.SourceCRS, one.TargetCRS, one.Eastings + 10.0, 0.0, 0.0)


def volume_wrong(f: File) -> None:
    """quantity unlike the body"""
    sets = [d.RelatingPropertyDefinition for d in wall(f).IsDefinedBy if d.is_a("IfcRelDefinesByProperties")]
    (quantities,) = [s for s in sets if s.is_a("IfcElementQuantity")]
    next(q for q in quantities.Quantities if q.Name == "GrossVolume").VolumeValue *= 1.2


def floor_area_wrong(f: File) -> None:
    """quantity unlike the body"""
    sets = [d.RelatingPropertyDefinition for d in of(f, "room-attic").IsDefinedBy]
    (quantities,) = [s for s in sets if s.is_a("IfcElementQuantity")]
    next(q for q in quantities.Quantities if q.Name == "NetFloorArea").AreaValue *= 0.8


def body_taller_than_stated(f: File) -> None:
    """quantity unlike the body"""
    solid(wall(f, "counter")).Depth += 0.3


def wall_tilted(f: File) -> None:
    """placed askew"""
    place = wall(f, "counter").ObjectPlacement.RelativePlacement
    place.Axis = f.create_entity("IfcDirection", (0.3, 0.0, 0.954))
    place.RefDirection = f.create_entity("IfcDirection", (0.0, -1.0, 0.0))


def external_window_in_an_inner_wall(f: File) -> None:
    """external unlike its wall"""
    sets = [d.RelatingPropertyDefinition for d in window(f).IsDefinedBy if d.is_a("IfcRelDefinesByProperties")]
    (common,) = [s for s in sets if s.Name == "Pset_WindowCommon"]
    flag = next(p for p in common.HasProperties if p.Name == "IsExternal")
    flag.NominalValue = f.create_entity("IfcBoolean", False)


def body_with_a_face_missing(f: File) -> None:
    """body not closed"""
    post = of(f, "post")
    corners = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.3, 0.0), (0.0, 0.3, 0.0)]
    points = f.create_entity("IfcCartesianPointList3D", [*corners, *((x, y, 2.6) for x, y, _ in corners)])
    faces = ((4, 3, 2, 1), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))
    made = [f.create_entity("IfcIndexedPolygonalFace", face) for face in faces]
    body = next(r for r in post.Representation.Representations if r.RepresentationIdentifier == "Body")
    body.Items = [f.create_entity("IfcPolygonalFaceSet", points, False, made)]
    body.RepresentationType = "Tessellation"
