"""Damage to a sound IFC file: each function does one kind, and its docstring names the check that is to find it."""

from __future__ import annotations

from collections.abc import Callable

import ifcopenshell
import ifcopenshell.util.placement
import numpy as np

from scan2bim.model.ids import ifc_guid

File = ifcopenshell.file
MUTATIONS: dict[str, Callable[[File], None]] = {}


def mutation(function: Callable[[File], None]) -> Callable[[File], None]:
    MUTATIONS[function.__name__] = function
    return function


def of(f: File, identifier: str):
    return f.by_guid(ifc_guid(identifier))


def shift(f: File, element, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
    """Moves the element in the frame that it is placed in; what is placed by it goes along."""
    place = element.ObjectPlacement.RelativePlacement
    old = place.Location.Coordinates
    new = f.create_entity("IfcCartesianPoint", (old[0] + x, old[1] + y, old[2] + z))
    made = f.create_entity("IfcAxis2Placement3D", new, place.Axis, place.RefDirection)
    element.ObjectPlacement.RelativePlacement = made


def solid(element):
    body = next(r for r in element.Representation.Representations if r.RepresentationIdentifier == "Body")
    item = body.Items[0]
    while item.is_a("IfcBooleanResult"):
        item = item.FirstOperand
    return item


def door(f: File):
    return of(f, "door-measured")


def window(f: File):
    return of(f, "window-measured")


def hole(f: File):
    return of(f, "opening-md")


def wall(f: File, key: str = "inner"):
    return of(f, f"wall-{key}")


def boundaries(f: File, space: str, element: str):
    return [r for r in of(f, space).BoundedBy if r.RelatedBuildingElement == of(f, element)]


@mutation
def door_beside_its_opening(f):
    """filling not in its opening"""
    shift(f, door(f), x=0.6)


@mutation
def door_before_its_wall(f):
    """filling not in its opening"""
    shift(f, door(f), y=1.0)


@mutation
def door_too_high(f):
    """filling not in its opening"""
    shift(f, door(f), z=0.7)


@mutation
def window_below_its_opening(f):
    """filling not in its opening"""
    shift(f, window(f), z=-0.5)


@mutation
def door_placed_by_the_storey(f):
    """filling not in its opening"""
    door(f).ObjectPlacement.PlacementRelTo = f.by_type("IfcBuildingStorey")[0].ObjectPlacement


@mutation
def door_tilted(f):
    """filling not upright"""
    place = door(f).ObjectPlacement.RelativePlacement
    tilted = f.create_entity("IfcDirection", (0.0, 0.5, 0.866))
    along = f.create_entity("IfcDirection", (1.0, 0.0, 0.0))
    door(f).ObjectPlacement.RelativePlacement = f.create_entity("IfcAxis2Placement3D", place.Location, tilted, along)


@mutation
def width_and_height_swapped(f):
    """width and height swapped"""
    d = door(f)
    d.OverallWidth, d.OverallHeight = d.OverallHeight, d.OverallWidth


@mutation
def overall_width_wrong(f):
    """stated size unlike the opening"""
    window(f).OverallWidth += 0.4


@mutation
def a_leaf_too_small(f):
    """filling smaller than its opening"""
    profile = solid(hole(f)).SweptArea
    profile.XDim *= 1.6
    door(f).OverallWidth = profile.XDim


@mutation
def fills_nothing(f):
    """filling without an opening"""
    f.remove(door(f).FillsVoids[0])


@mutation
def two_doors_in_an_opening(f):
    """two fillings"""
    other = of(f, "door-entrance")
    other.FillsVoids[0].RelatingOpeningElement = hole(f)


@mutation
def opening_without_host(f):
    """opening without a host"""
    f.remove(hole(f).VoidsElements[0])


@mutation
def opening_beside_its_wall(f):
    """opening misses its wall"""
    shift(f, hole(f), y=1.0)


@mutation
def opening_above_its_wall(f):
    """opening misses its wall"""
    shift(f, hole(f), z=4.0)


@mutation
def opening_of_another_wall(f):
    """opening misses its wall"""
    hole(f).VoidsElements[0].RelatingBuildingElement = wall(f, "east")


@mutation
def opening_half_out_of_its_wall(f):
    """opening leaves its wall"""
    shift(f, hole(f), z=1.6)


@mutation
def opening_past_the_end(f):
    """opening leaves its wall"""
    shift(f, of(f, "opening-mw"), x=2.9)


@mutation
def opening_not_through(f):
    """opening does not pierce its wall"""
    solid(of(f, "opening-mw")).Depth *= 0.4


@mutation
def opening_only_grazing(f):
    """opening does not pierce its wall"""
    shift(f, of(f, "opening-mw"), y=0.1)


@mutation
def opening_contained_in_the_storey(f):
    """opening in a storey"""
    relation = f.by_type("IfcRelContainedInSpatialStructure")[0]
    relation.RelatedElements = [*relation.RelatedElements, hole(f)]


@mutation
def layer_too_thin(f):
    """layers unlike the body"""
    f.by_type("IfcMaterialLayer")[0].LayerThickness = 0.02


@mutation
def body_too_thick(f):
    """layers unlike the body"""
    for point in solid(wall(f)).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (x, 1.5 * y)


@mutation
def axis_beside_the_body(f):
    """axis outside the body"""
    axis = wall(f).Representation.Representations[0].Items[0]
    for point in axis.Points:
        point.Coordinates = (point.Coordinates[0], point.Coordinates[1] + 0.5)


@mutation
def axis_too_short(f):
    """axis unlike the body"""
    wall(f, "north").Representation.Representations[0].Items[0].Points[1].Coordinates = (5.0, 0.0)


@mutation
def wall_made_twice(f):
    """made twice"""
    import ifcopenshell.util.element as util

    copy = util.copy(f, wall(f, "counter"))
    copy.GlobalId = ifc_guid("copy")
    for relation in wall(f, "counter").ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, copy]


@mutation
def wall_in_another(f):
    """walls overlap"""
    east = wall(f, "east")
    import ifcopenshell.util.element as util

    copy = util.copy(f, east)
    copy.GlobalId = ifc_guid("copy")
    copy.ObjectPlacement = util.copy_deep(f, east.ObjectPlacement, exclude=["IfcProduct"])
    shift(f, copy, x=0.05)
    for relation in east.ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, copy]


@mutation
def wall_too_short(f):
    """gap at a joint"""
    for relation in f.by_type("IfcRelConnectsPathElements"):
        if wall(f, "counter") in (relation.RelatingElement, relation.RelatedElement):
            f.remove(relation)
    for point in solid(wall(f, "counter")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (max(x, 0.06), y)


@mutation
def joined_walls_apart(f):
    """related walls do not meet"""
    shift(f, wall(f, "u-south"), y=-0.5)


@mutation
def joint_not_related(f):
    """joint without a relation"""
    for relation in f.by_type("IfcRelConnectsPathElements"):
        if {relation.RelatingElement, relation.RelatedElement} == {wall(f), wall(f, "north")}:
            f.remove(relation)


@mutation
def wall_lifted(f):
    """stands on nothing"""
    shift(f, of(f, "post"), z=0.8)


@mutation
def door_in_the_wrong_storey(f):
    """outside its storey"""
    _lower, upper = f.by_type("IfcBuildingStorey")
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        if door(f) in relation.RelatedElements:
            relation.RelatedElements = [e for e in relation.RelatedElements if e != door(f)]
    home = next(r for r in upper.ContainsElements)
    home.RelatedElements = [*home.RelatedElements, door(f)]


@mutation
def space_in_the_wrong_storey(f):
    """outside its storey"""
    room = of(f, "room-attic")
    old = room.Decomposes[0]
    new = next(r for r in f.by_type("IfcBuildingStorey")[0].IsDecomposedBy)
    f.remove(old)
    new.RelatedObjects = [*new.RelatedObjects, room]


@mutation
def elevation_wrong(f):
    """elevation unlike the placement"""
    f.by_type("IfcBuildingStorey")[1].Elevation += 0.5


@mutation
def storeys_at_one_height(f):
    """storeys at one height"""
    shift(f, f.by_type("IfcBuildingStorey")[1], z=-2.8)


@mutation
def contained_nowhere(f):
    """in no storey"""
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        relation.RelatedElements = [e for e in relation.RelatedElements if e != wall(f, "counter")]


@mutation
def contained_twice(f):
    """in two storeys"""
    for relation in f.by_type("IfcRelContainedInSpatialStructure"):
        if wall(f) not in relation.RelatedElements and len(relation.RelatedElements) > 3:
            relation.RelatedElements = [*relation.RelatedElements, wall(f)]


@mutation
def far_away(f):
    """far from the building"""
    shift(f, of(f, "post"), x=500.0)


@mutation
def without_a_body(f):
    """no body"""
    of(f, "post").Representation = None


@mutation
def space_into_a_wall(f):
    """space in a wall"""
    shift(f, of(f, "room-store"), x=-0.2)


@mutation
def space_grown_into_the_next(f):
    """spaces overlap"""
    for point in solid(of(f, "room-store")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (x + (1.0 if x > 2.0 else 0.0), y)


@mutation
def space_too_small(f):
    """space leaves a gap"""
    for point in solid(of(f, "room-attic")).SweptArea.OuterCurve.Points:
        x, y = point.Coordinates
        point.Coordinates = (min(x, 7.4), y)


@mutation
def space_removed(f):
    """space missing"""
    room = of(f, "room-store")
    for relation in [*room.BoundedBy]:
        f.remove(relation)
    f.remove(room)


@mutation
def boundary_removed(f):
    """boundaries do not close"""
    f.remove(max(boundaries(f, "room-store", "wall-west"), key=lambda r: r.id()))


@mutation
def boundaries_of_a_space_removed(f):
    """space without boundaries"""
    for relation in [*of(f, "room-attic").BoundedBy]:
        f.remove(relation)


@mutation
def boundary_off_the_surface(f):
    """boundary off its space"""
    plane = boundaries(f, "room-store", "wall-inner")[0].ConnectionGeometry.SurfaceOnRelatingElement.BasisSurface
    x, y, z = plane.Position.Location.Coordinates
    plane.Position.Location = f.create_entity("IfcCartesianPoint", (x + 0.5, y, z))


@mutation
def boundary_turned(f):
    """boundary inside out"""
    surface = boundaries(f, "room-attic", "wall-u-west")[0].ConnectionGeometry.SurfaceOnRelatingElement
    place = surface.BasisSurface.Position
    place.Axis = f.create_entity("IfcDirection", tuple(-r for r in place.Axis.DirectionRatios))
    x, y, z = np.array(place.Location.Coordinates)
    run = np.array(place.RefDirection.DirectionRatios)
    length = max(p.Coordinates[0] for p in surface.OuterBoundary.Points)
    place.Location = f.create_entity("IfcCartesianPoint", tuple(float(v) for v in (x, y, z) + run * length))
    place.RefDirection = f.create_entity("IfcDirection", tuple(-float(r) for r in run))


@mutation
def boundary_of_another_wall(f):
    """boundary off its element"""
    boundaries(f, "room-store", "wall-west")[0].RelatedBuildingElement = wall(f, "east")


@mutation
def door_boundary_without_parent(f):
    """boundary without its parent"""
    boundaries(f, "room-store", "door-measured")[0].ParentBoundary = None


@mutation
def other_side_unanswered(f):
    """other side does not answer"""
    for one in boundaries(f, "room-store", "door-measured") + boundaries(f, "room-hall", "door-measured"):
        one.CorrespondingBoundary = boundaries(f, "room-hall", "opening-pass")[0]


@mutation
def other_side_of_another(f):
    """other side of another thing"""
    one, two = boundaries(f, "room-store", "door-measured")[0], boundaries(f, "room-hall", "opening-pass")[0]
    for boundary in f.by_type("IfcRelSpaceBoundary2ndLevel"):
        boundary.CorrespondingBoundary = None
    one.CorrespondingBoundary = two


@mutation
def identifier_twice(f):
    """GlobalId used twice"""
    wall(f).GlobalId = wall(f, "east").GlobalId


@mutation
def identifier_malformed(f):
    """GlobalId malformed"""
    wall(f).GlobalId = "7" * 22


@mutation
def length_unit_wrong(f):
    """unit implausible"""
    unit = next(u for u in f.by_type("IfcSIUnit") if u.UnitType == "LENGTHUNIT")
    unit.Prefix = "MILLI"


@mutation
def map_direction_wrong(f):
    """map direction no unit vector"""
    f.by_type("IfcMapConversion")[0].XAxisAbscissa = 5.0


@mutation
def two_maps(f):
    """two places on the map"""
    one = f.by_type("IfcMapConversion")[0]
    f.create_entity("IfcMapConversion", one.SourceCRS, one.TargetCRS, one.Eastings + 10.0, 0.0, 0.0)


@mutation
def volume_wrong(f):
    """quantity unlike the body"""
    sets = [d.RelatingPropertyDefinition for d in wall(f).IsDefinedBy if d.is_a("IfcRelDefinesByProperties")]
    (quantities,) = [s for s in sets if s.is_a("IfcElementQuantity")]
    next(q for q in quantities.Quantities if q.Name == "GrossVolume").VolumeValue *= 1.2


@mutation
def floor_area_wrong(f):
    """quantity unlike the body"""
    sets = [d.RelatingPropertyDefinition for d in of(f, "room-attic").IsDefinedBy]
    (quantities,) = [s for s in sets if s.is_a("IfcElementQuantity")]
    next(q for q in quantities.Quantities if q.Name == "NetFloorArea").AreaValue *= 0.8


@mutation
def body_taller_than_stated(f):
    """quantity unlike the body"""
    solid(wall(f, "counter")).Depth += 0.3


@mutation
def wall_tilted(f):
    """placed askew"""
    place = wall(f, "counter").ObjectPlacement.RelativePlacement
    place.Axis = f.create_entity("IfcDirection", (0.3, 0.0, 0.954))
    place.RefDirection = f.create_entity("IfcDirection", (0.0, -1.0, 0.0))


@mutation
def external_window_in_an_inner_wall(f):
    """external unlike its wall"""
    sets = [d.RelatingPropertyDefinition for d in window(f).IsDefinedBy if d.is_a("IfcRelDefinesByProperties")]
    (common,) = [s for s in sets if s.Name == "Pset_WindowCommon"]
    flag = next(p for p in common.HasProperties if p.Name == "IsExternal")
    flag.NominalValue = f.create_entity("IfcBoolean", False)


@mutation
def body_with_a_face_missing(f):
    """body not closed"""
    post = of(f, "post")
    corners = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.3, 0.0), (0.0, 0.3, 0.0)]
    points = f.create_entity("IfcCartesianPointList3D", [*corners, *((x, y, 2.6) for x, y, _ in corners)])
    faces = ((4, 3, 2, 1), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))
    made = [f.create_entity("IfcIndexedPolygonalFace", face) for face in faces]
    body = next(r for r in post.Representation.Representations if r.RepresentationIdentifier == "Body")
    body.Items = [f.create_entity("IfcPolygonalFaceSet", points, False, made)]
    body.RepresentationType = "Tessellation"
