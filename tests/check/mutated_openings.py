"""Damage to doors, windows and openings. See ``mutations``."""

from __future__ import annotations

from check.mutations import File, door, hole, of, shift, solid, wall, window


def door_beside_its_opening(f: File) -> None:
    """filling not in its opening"""
    shift(f, door(f), x=0.6)


def door_before_its_wall(f: File) -> None:
    """filling not in its opening"""
    shift(f, door(f), y=1.0)


def door_too_high(f: File) -> None:
    """filling not in its opening"""
    shift(f, door(f), z=0.7)


def window_below_its_opening(f: File) -> None:
    """filling not in its opening"""
    shift(f, window(f), z=-0.5)


def door_placed_by_the_storey(f: File) -> None:
    """filling not in its opening"""
    door(f).ObjectPlacement.PlacementRelTo = f.by_type("IfcBuildingStorey")[0].ObjectPlacement


def door_tilted(f: File) -> None:
    """filling not upright"""
    place = door(f).ObjectPlacement.RelativePlacement
    tilted = f.create_entity("IfcDirection", (0.0, 0.5, 0.866))
    along = f.create_entity("IfcDirection", (1.0, 0.0, 0.0))
    door(f).ObjectPlacement.RelativePlacement = f.create_entity("IfcAxis2Placement3D", place.Location, tilted, along)


def width_and_height_swapped(f: File) -> None:
    """width and height swapped"""
    d = door(f)
    d.OverallWidth, d.OverallHeight = d.OverallHeight, d.OverallWidth


def overall_width_wrong(f: File) -> None:
    """stated size unlike the opening"""
    window(f).OverallWidth += 0.4


def a_leaf_too_small(f: File) -> None:
    """filling smaller than its opening"""
    profile = solid(hole(f)).SweptArea
    profile.XDim *= 1.6
    door(f).OverallWidth = profile.XDim


def fills_nothing(f: File) -> None:
    """filling without an opening"""
    f.remove(door(f).FillsVoids[0])


def two_doors_in_an_opening(f: File) -> None:
    """two fillings"""
    other = of(f, "door-entrance")
    other.FillsVoids[0].RelatingOpeningElement = hole(f)


def opening_without_host(f: File) -> None:
    """opening without a host"""
    f.remove(hole(f).VoidsElements[0])


def opening_beside_its_wall(f: File) -> None:
    """opening misses its wall"""
    shift(f, hole(f), y=1.0)


def opening_above_its_wall(f: File) -> None:
    """opening misses its wall"""
    shift(f, hole(f), z=4.0)


def opening_of_another_wall(f: File) -> None:
    """opening misses its wall"""
    hole(f).VoidsElements[0].RelatingBuildingElement = wall(f, "east")


def opening_half_out_of_its_wall(f: File) -> None:
    """opening leaves its wall"""
    shift(f, hole(f), z=1.6)


def opening_past_the_end(f: File) -> None:
    """opening leaves its wall"""
    shift(f, of(f, "opening-mw"), x=2.9)


def opening_not_through(f: File) -> None:
    """opening does not pierce its wall"""
    solid(of(f, "opening-mw")).Depth *= 0.4


def opening_only_grazing(f: File) -> None:
    """opening does not pierce its wall"""
    shift(f, of(f, "opening-mw"), y=0.1)


def opening_contained_in_the_storey(f: File) -> None:
    """opening in a storey"""
    relation = f.by_type("IfcRelContainedInSpatialStructure")[0]
    relation.RelatedElements = [*relation.RelatedElements, hole(f)]
