"""What belongs together is told so: walls at every joint, boundaries with parents and other sides, symbols, status."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element as util
import ifcopenshell.util.placement
import numpy as np
import pytest
import shapely
from buildings import building, door, measured, wall
from every_shape import every_shape, straight
from ifc_help import entity, one_storey, written

from scan2bim.model.elements import Building, Join, Wall
from scan2bim.model.shapes import wall_footprints

Pair = frozenset[str]


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return written(every_shape(), tmp_path_factory.mktemp("every"))


def related(file: Any) -> set[Pair]:
    relations = file.by_type("IfcRelConnectsPathElements")
    pairs = [frozenset((r.RelatingElement.Name, r.RelatedElement.Name)) for r in relations]
    assert len(pairs) == len(set(pairs))
    return set(pairs)


def meeting(walls: Building) -> set[Pair]:
    """Walls of which one ends in the other."""
    found: set[Pair] = set()
    for storey in walls.storeys:
        bodies = {key: shapely.Polygon(ring) for key, ring in wall_footprints(storey).items()}
        for one, other in itertools.permutations(storey.walls, 2):
            level = min(one.base + one.height.value, other.base + other.height.value) > max(one.base, other.base)
            ends = shapely.MultiPoint([one.start, one.end])
            if level and bodies[other.id].distance(ends) < 0.005:
                found.add(frozenset((one.name, other.name)))
    return found


@pytest.mark.parametrize("house", [building(), every_shape()], ids=["house", "every shape"])
def test_every_wall_that_ends_in_another_is_related_to_it(tmp_path: Path, house: Building):
    assert meeting(house) <= related(written(house, tmp_path))


def test_all_walls_of_a_knot_are_related_though_the_model_joins_them_in_pairs(tmp_path: Path):
    def spoke(key: str, end: tuple[float, float], *to: str) -> Wall:
        joins = tuple(Join(wall=f"wall-{other}", at="start", other_at="start", kind="L") for other in to)
        return straight(key, (0.0, 0.0), end, joins=joins)

    walls = (spoke("a", (4.0, 0.0), "b"), spoke("b", (0.0, 4.0)), spoke("c", (-4.0, 0.0), "d"), spoke("d", (0.0, -4.0)))
    assert len(related(written(one_storey(*walls), tmp_path))) == 6


def test_a_pier_beside_a_wall_and_walls_that_touch_at_an_edge_are_not_joined(tmp_path: Path):
    long = straight("long", (0.0, 0.0), (6.0, 0.0), 0.2)
    pier = straight("pier", (2.0, 0.25), (3.0, 0.25), 0.3)
    edge = straight("edge", (6.0, 0.25), (9.0, 0.25), 0.3)
    assert related(written(one_storey(long, pier, edge), tmp_path)) == set()


def test_walls_one_above_the_other_are_not_joined(tmp_path: Path):
    low = straight("low", (0.0, 0.0), (6.0, 0.0)).model_copy(update={"height": measured(1.0)})
    high = straight("high", (3.0, 0.0), (3.0, 4.0), base=1.5)
    assert related(written(one_storey(low, high), tmp_path)) == set()


def symbol(found: Any) -> list[np.ndarray[Any, Any]]:
    """The curves of a door's symbol in plan, in the building's frame, (n, 2) each."""
    settings = ifcopenshell.geom.settings()
    settings.set("dimensionality", ifcopenshell.ifcopenshell_wrapper.CURVES_SURFACES_AND_SOLIDS)
    matrix = ifcopenshell.util.placement.get_local_placement(found.ObjectPlacement)
    (plan,) = (r for r in found.Representation.Representations if r.ContextOfItems.TargetView == "PLAN_VIEW")
    assert plan.RepresentationIdentifier == "FootPrint"
    curves: list[np.ndarray[Any, Any]] = []
    for item in plan.Items[0].MappingSource.MappedRepresentation.Items:
        made: Any = ifcopenshell.geom.create_shape(settings, item)
        corners = np.array(made.verts).reshape(-1, 3)
        curves.append((np.column_stack([corners, np.ones(len(corners))]) @ matrix.T)[:, :2])
    return curves


@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("hinge", ["start", "end"])
def test_the_symbol_in_plan_swings_about_the_hinge_to_its_side(tmp_path: Path, hinge: str, swing: str):
    opening = door("d", 2.0, 1.0, hinge_side=hinge, swing_side=swing)
    host = wall("host", (0.0, 0.0), (8.0, 0.0), 0.2, 0.0, openings=(opening,))
    host = host.model_copy(update={"start": (0.0, 0.0), "end": (8.0, 0.0)})
    curves = symbol(entity(written(one_storey(host), tmp_path), "door-d"))
    arc = max(curves, key=len)
    assert len(arc) > 20
    side = 1.0 if swing == "left" else -1.0
    x, other = (2.065, 2.975) if hinge == "start" else (2.935, 2.025)  # hinge and latch within the lining
    radius = np.hypot(arc[:, 0] - x, arc[:, 1] - side * 0.1)
    assert np.ptp(radius) < 0.05
    ends = arc[[0, -1]] if abs(arc[0, 1]) < abs(arc[-1, 1]) else arc[[-1, 0]]
    assert ends[0] == pytest.approx((other, side * 0.1), abs=0.01)
    assert ends[1] == pytest.approx((x, side * 1.05), abs=0.06)


def boundaries(file: Any, space: str, element: str) -> list[Any]:
    found = entity(file, element)
    return [r for r in entity(file, space).BoundedBy if r.RelatedBuildingElement == found]


def test_a_doors_boundary_has_the_walls_as_parent_and_the_other_rooms_as_other_side(every: Any):
    (store,) = boundaries(every, "room-store", "door-measured")
    (hall,) = boundaries(every, "room-hall", "door-measured")
    for side in (store, hall):
        assert side.is_a("IfcRelSpaceBoundary2ndLevel") and side.Description == "2a"
        assert side.PhysicalOrVirtualBoundary == "PHYSICAL" and side.InternalOrExternalBoundary == "INTERNAL"
        assert side.ParentBoundary.RelatedBuildingElement == entity(every, "wall-inner")
        assert side.ParentBoundary.RelatingSpace == side.RelatingSpace
    assert store in (hall.CorrespondingBoundary, *hall.Corresponds)


def test_every_filling_between_spaces_lies_in_a_wall_s_boundary(every: Any):
    fills = [r for r in every.by_type("IfcRelSpaceBoundary2ndLevel") if r.RelatedBuildingElement.is_a() in ("IfcDoor", "IfcWindow")]
    assert len(fills) >= 4
    for boundary in fills:
        host = boundary.RelatedBuildingElement.FillsVoids[0].RelatingOpeningElement.VoidsElements[0]
        assert boundary.ParentBoundary.RelatedBuildingElement == host.RelatingBuildingElement


def test_spaces_that_are_open_to_each_other_share_a_virtual_element_in_the_storey(every: Any):
    hall, kitchen = entity(every, "room-hall"), entity(every, "room-kitchen")
    open_ = [
        {b.RelatedBuildingElement for b in space.BoundedBy if b.RelatedBuildingElement.is_a("IfcVirtualElement")}
        for space in (hall, kitchen)
    ]
    shared = open_[0] & open_[1]
    assert shared
    for gap in shared:
        assert {b.PhysicalOrVirtualBoundary for b in gap.ProvidesBoundaries} == {"VIRTUAL"}
        storey: Any = util.get_container(gap)
        assert storey.is_a("IfcBuildingStorey")


def test_every_space_has_a_footprint_of_its_area(every: Any):
    for space in every.by_type("IfcSpace"):
        (plan,) = (r for r in space.Representation.Representations if r.RepresentationIdentifier == "FootPrint")
        outer, *holes = ([p.Coordinates for p in curve.Points] for curve in plan.Items[0].Elements)
        stated = util.get_pset(space, "Qto_SpaceBaseQuantities", "NetFloorArea")
        assert shapely.Polygon(outer, holes).area == pytest.approx(stated, rel=1e-3)


def test_whatever_has_a_status_stands_already(every: Any):
    sets = [s for s in every.by_type("IfcPropertySet") if s.Name.startswith("Pset_") and s.Name.endswith("Common")]
    told = [p for s in sets for p in s.HasProperties if p.Name == "Status"]
    assert len(told) > 25
    assert {tuple(v.wrappedValue for v in p.EnumerationValues) for p in told} == {("EXISTING",)}
    for kind in ("IfcWall", "IfcDoor", "IfcWindow", "IfcSlab", "IfcColumn", "IfcBeam", "IfcStair", "IfcRoof"):
        assert every.by_type(kind)
        for element in every.by_type(kind):
            common = f"Pset_{'Slab' if kind == 'IfcSlab' else kind[3:]}Common"
            assert util.get_pset(element, common, "Status") == ["EXISTING"], element.Name


def test_a_stair_is_made_of_two_flights_and_the_landing_between(every: Any):
    (stair,) = every.by_type("IfcStair")
    parts = [part.is_a() for part in util.get_parts(stair)]
    assert (parts.count("IfcStairFlight"), parts.count("IfcSlab")) == (2, 1)
