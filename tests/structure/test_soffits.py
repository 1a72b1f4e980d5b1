"""Spaces under roof planes: the pieces of their upper side, their volume, boundaries, raster and quantities."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import numpy as np
import pytest
from shapely.geometry import Polygon, box
from structure.test_roofs import LONG, WIDE, attic, gable

from scan2bim.coverage.panels import panels_of
from scan2bim.coverage.rooms import rooms_of
from scan2bim.exporters.ifc import export
from scan2bim.model.ceilings import space_body
from scan2bim.model.elements import Building, Covering, Dimension, RoofPlane, Space, Storey, Wall
from scan2bim.model.space_boundaries import space_boundaries
from scan2bim.structure.roofs import Slope, find_roofs
from scan2bim.structure.soffits import soffits_of, volume_under

SOUTH = Slope(np.array([0.0, 0.8, 0.7]), box(0, 0, 9, 3), 0.001, 1.0)
NORTH = Slope(np.array([0.0, -0.8, 5.5]), box(0, 3, 9, 6), 0.001, 1.0)
ROOM = box(0.0, 0.0, 9.0, 6.0)


def area_of(soffits: tuple[tuple[tuple[float, float, float], ...], ...]) -> float:
    return sum(Polygon([c[:2] for c in s]).area for s in soffits)


def test_the_pieces_cover_a_space_once_and_give_its_volume() -> None:
    found = soffits_of(ROOM, [SOUTH, NORTH], 3.1)
    assert len(found) == 2
    assert area_of(found) == pytest.approx(54.0)
    assert volume_under(found, 0.0) == pytest.approx(54.0 * (0.7 + 3.1) / 2)


def test_beside_a_roof_plane_the_ceiling_is_level() -> None:
    found = soffits_of(box(0, 0, 9, 5), [SOUTH], 2.3)
    assert sorted(len({z for _, _, z in s}) for s in found) == [1, 2]
    assert volume_under(found, 0.0) == pytest.approx(9 * 3 * 1.9 + 9 * 2 * 2.3)


def test_slivers_beside_planes_belong_to_them_and_holes_stay_open() -> None:
    pierced = Polygon(box(-0.1, 0, 9, 6.05).exterior, [box(4, 1, 5, 2).exterior])
    found = soffits_of(pierced, [SOUTH, NORTH], 3.1)
    assert area_of(found) == pytest.approx(pierced.area)
    assert max(z for s in found for _, _, z in s) == pytest.approx(3.1)
    assert min(z for s in found for _, _, z in s) == pytest.approx(0.66, abs=0.001)


def test_a_sliver_between_three_planes_goes_to_the_lowest() -> None:
    hip = Slope(np.array([-0.8, 0.0, 4.0]), box(4.002, 0, 9, 3), 0.001, 1.0)
    north = Slope(NORTH.plane + np.array([0.0, 0.0, 0.1]), box(0, 3, 9, 6), 0.001, 1.0)
    planes = [Slope(SOUTH.plane, box(0, 0, 4, 3), 0.001, 1.0), hip, north]
    found = soffits_of(ROOM, planes, 3.1)
    assert area_of(found) == pytest.approx(54.0)


def test_a_roof_that_touches_the_space_beside_its_area_takes_the_area_alone() -> None:
    outline = Polygon([(-2, 0), (3, 0), (3, 3), (-1, 3), (-1, 4), (0, 4), (0, 5), (-2, 5)])
    assert area_of(soffits_of(ROOM, [Slope(SOUTH.plane, outline, 0.001, 1.0)], 3.1)) == pytest.approx(54.0)


def test_a_space_without_roof_planes_over_it_has_no_pieces() -> None:
    assert soffits_of(box(20, 0, 25, 5), [SOUTH, NORTH], 2.4) == ()


def test_a_roof_goes_on_over_the_wall_between_two_spaces() -> None:
    spaces = [box(0.5, 0.5, 4.5, 0.5 + WIDE), box(4.7, 0.5, 0.5 + LONG, 0.5 + WIDE)]
    found = find_roofs(attic(), spaces)
    assert len(found) == 2
    assert all(slope.outline.area == pytest.approx(LONG * WIDE / 2, rel=0.02) for slope in found)


def test_planes_end_at_the_level_ceiling_under_the_ridge() -> None:
    y, x = (np.mgrid[: round((WIDE + 1) / 0.05), : round((LONG + 1) / 0.05)] + 0.5) * 0.05
    found = find_roofs(attic(np.minimum(gable(x, y), 2.4)), [box(0.5, 0.5, 0.5 + LONG, 0.5 + WIDE)], 2.4)
    for slope in found:
        heights = slope.height(np.array(slope.outline.exterior.coords))
        assert heights.max() == pytest.approx(2.4, abs=0.01)


def measured(value: float) -> Dimension:
    return Dimension(value=value, source="measured")


def house() -> Building:
    """A room of 9 x 6 m under a gable, eaves at 0.7 m, ridge at 3.1 m, with a level piece in the last two metres."""
    shorter = [Slope(s.plane, box(*s.outline.bounds[:2], 7.0, s.outline.bounds[3]), 0.001, 1.0) for s in (SOUTH, NORTH)]
    soffits = soffits_of(ROOM, shorter, 2.3)
    outline = ((0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (0.0, 6.0))
    corners = ((-0.1, -0.1), (9.1, -0.1), (9.1, 6.1), (-0.1, 6.1))
    profile = ((0.0, 0.62), (3.1, 3.1), (6.2, 0.62))
    walls = tuple(
        Wall(
            id=f"w{i}", name=f"w{i}", confidence=1.0, start=a, end=b, thickness=measured(0.2), base=0.0,
            height=measured((0.7, 2.3, 0.7, 3.1)[i]), profile=profile if i == 3 else (), left_spaces=("s",),
        )
        for i, (a, b) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True))
    )  # fmt: skip
    space = Space(
        id="s", name="s", confidence=1.0, outline=outline, base=0.0, height=measured(3.1), area=54.0,
        volume=volume_under(soffits, 0.0), ceiling=soffits,
    )  # fmt: skip
    roofs = tuple(
        RoofPlane(id=f"r{i}", name="r", confidence=1.0, outline=s, thickness=measured(0.2))
        for i, s in enumerate(soffits)
        if len({z for _, _, z in s}) > 1
    )
    level = Covering(
        id="c", name="c", confidence=1.0, outline=((7.0, 0.0), (9.0, 0.0), (9.0, 6.0), (7.0, 6.0)), top=measured(2.32),
        thickness=measured(0.02),
    )  # fmt: skip
    storey = Storey(
        id="1", name="1", elevation=measured(0.0), walls=walls, spaces=(space,), roofs=roofs, coverings=(level,)
    )
    return Building(id="b", name="b", storeys=(storey,))


def test_boundaries_of_a_space_under_a_roof_cover_its_surface_but_for_the_step() -> None:
    building = house()
    (space,) = building.storeys[0].spaces
    found = [b for b in space_boundaries(building) if b.parent is None]
    corners = space_body(space).corners
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    step = (np.abs(corners[:, :, 0] - 7.0) < 1e-6).all(1)
    surface = float(np.linalg.norm(cross[~step], axis=1).sum() / 2)
    assert sum(Polygon(b.patch.outline).area for b in found) == pytest.approx(surface, rel=1e-3)
    assert {"r0", "r1", "c", "w0", "w1", "w2", "w3"} <= {b.element for b in found}
    gable_side = next(b for b in found if b.element == "w3")
    assert Polygon(gable_side.patch.outline).area == pytest.approx(6.0 * (0.7 + 3.1) / 2, abs=0.01)


def test_the_air_under_a_roof_ends_at_its_planes_which_are_faces_that_may_be_seen() -> None:
    (storey,) = house().storeys
    rooms = rooms_of(storey, 0.0)
    assert rooms is not None
    row, col = rooms.pixels(np.array([[2.0, 0.525], [2.0, 2.975], [8.0, 1.0]]))
    assert rooms.high[row, col] == pytest.approx(np.array([0.7 + 0.8 * 0.525, 0.7 + 0.8 * 2.975, 2.3]), abs=0.03)
    faces = {f.element: f for f in panels_of(storey, rooms).faces}
    assert faces["r0"].area == pytest.approx(7 * 3 * np.hypot(1, 0.8), rel=0.05)


def test_the_file_has_the_body_and_the_volume_and_no_height_under_a_roof(tmp_path: Path) -> None:
    building = house()
    export(building, tmp_path / "attic.ifc")
    file: Any = ifcopenshell.open(str(tmp_path / "attic.ifc"))
    (space,) = file.by_type("IfcSpace")
    sums = ifcopenshell.util.element.get_psets(space, qtos_only=True)["Qto_SpaceBaseQuantities"]
    assert sums["NetVolume"] == pytest.approx(7 * 6 * 1.9 + 2 * 6 * 2.3)
    assert "Height" not in sums
    body = next(r for r in space.Representation.Representations if r.RepresentationIdentifier == "Body")
    assert body.RepresentationType == "Brep"
    assert body.Items[0].is_a("IfcFacetedBrep")
