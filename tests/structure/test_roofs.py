"""Roof planes over an attic, and the walls' upper edges under them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from scan2bim.cloud.surfels import PLAN
from scan2bim.model.elements import Building, Dimension, Space, Storey, Wall
from scan2bim.model.space_boundaries import space_boundaries
from scan2bim.structure.columns import Columns, Grid
from scan2bim.structure.plan import Plan
from scan2bim.structure.roofs import find_roofs, roof_of, upper_edge
from scan2bim.structure.shapes import WallShape
from scan2bim.structure.storeys import StoreyLevels

LONG, WIDE, EAVES, PITCH = 9.0, 6.0, 0.7, 0.8
ROOM = box(0.5, 0.5, 0.5 + LONG, 0.5 + WIDE)
RIDGE = EAVES + PITCH * WIDE / 2


def attic(under: NDArray[np.float64] | None = None, turned: float = 0.0, noise: float = 0.003) -> Plan:
    """The plan of a storey of 10 x 7 m of which only the underside of its roof was seen, a gable unless given."""
    rows, cols = round((WIDE + 1) / PLAN), round((LONG + 1) / PLAN)
    y, x = (np.mgrid[:rows, :cols] + 0.5) * PLAN
    rng = np.random.default_rng(5)
    height = gable(x, y) if under is None else under
    z = np.where((x > 0.5) & (x < 0.5 + LONG) & (y > 0.5) & (y < 0.5 + WIDE), height, np.nan)
    z = (z + rng.normal(0, noise, z.shape)).astype(np.float32)
    none, mask = np.zeros(0, np.int64), np.zeros(z.shape, np.uint8)
    columns = Columns(
        np.zeros((0, 2), np.int64), np.zeros((0, 2)), none, none, none, np.zeros(0), np.zeros((0, 2)), none,
        none.astype(np.uint16), np.zeros((0, 3)),
    )  # fmt: skip
    levels = StoreyLevels(0.0, 0.001, None, float(np.nanmax(z)) + 0.1, LONG * WIDE)
    grid = Grid(np.zeros(2), z.astype(np.float64), 0.0)
    xy = np.stack([x, y], -1).astype(np.float32)
    return Plan(levels, grid, mask, np.isfinite(z).astype(np.uint8), z, xy, z, mask, mask, columns, mask * 0, z)


def gable(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return EAVES + PITCH * (WIDE / 2 - np.abs(y - 0.5 - WIDE / 2))


def test_a_gable_roof_has_two_planes_that_meet_at_the_ridge() -> None:
    found = find_roofs(attic(), [ROOM])
    assert len(found) == 2
    for slope in found:
        assert slope.outline.area == pytest.approx(LONG * WIDE / 2, rel=0.02)
        corners = np.array(roof_of(slope).outline)
        assert corners[:, 2].max() == pytest.approx(RIDGE, abs=0.01)
        assert corners[:, 2].min() == pytest.approx(EAVES, abs=0.03)
        assert slope.coverage > 0.9
    assert found[0].outline.intersection(found[1].outline).area < 0.01


def test_a_gable_wall_follows_the_roof_and_an_eaves_wall_ends_under_it() -> None:
    roofs = find_roofs(attic(), [ROOM])
    gable_edge = upper_edge(np.array([0.5, 0.5]), np.array([0.5, 0.5 + WIDE]), roofs, 0.0, RIDGE)
    assert np.array(gable_edge) == pytest.approx(np.array([[0, EAVES], [WIDE / 2, RIDGE], [WIDE, EAVES]]), abs=0.03)
    eaves_edge = upper_edge(np.array([0.5, 0.5]), np.array([0.5 + LONG, 0.5]), roofs, 0.0, RIDGE)
    assert [h for _, h in eaves_edge] == pytest.approx([EAVES] * len(eaves_edge), abs=0.02)


def test_a_level_ceiling_under_the_ridge_cuts_the_gable() -> None:
    y, x = (np.mgrid[: round((WIDE + 1) / PLAN), : round((LONG + 1) / PLAN)] + 0.5) * PLAN
    roofs = find_roofs(attic(np.minimum(gable(x, y), 2.4)), [ROOM])
    assert len(roofs) == 2
    edge = upper_edge(np.array([0.5, 0.5]), np.array([0.5, 0.5 + WIDE]), roofs, 0.0, 2.4)
    assert max(h for _, h in edge) == pytest.approx(2.4, abs=0.01)
    assert len(edge) == 4


def test_level_and_vaulted_ceilings_are_no_roof_planes() -> None:
    y, x = (np.mgrid[: round((WIDE + 1) / PLAN), : round((LONG + 1) / PLAN)] + 0.5) * PLAN
    vault = 2.2 + np.sqrt(np.maximum(3.2**2 - (y - 0.5 - WIDE / 2) ** 2, 0)) - 1.2
    for under in (np.full(x.shape, 2.5), vault):
        assert not find_roofs(attic(under), [ROOM])


def test_a_wall_that_is_mostly_under_no_roof_plane_keeps_its_height() -> None:
    roofs = find_roofs(attic(), [ROOM])
    beside = np.array([20.0, 0.5]), np.array([20.0, 6.5])
    assert upper_edge(*beside, roofs, 0.0, RIDGE) == ()
    assert Polygon(ROOM).contains(roofs[0].outline.buffer(-0.1))


def test_the_wall_beside_a_gabled_attic_bounds_its_space_up_to_the_profile_alone() -> None:
    measured = Dimension(value=3.0, source="measured")
    corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)]
    walls = tuple(
        Wall(
            id=f"w{i}",
            name=f"w{i}",
            confidence=1.0,
            start=a,
            end=b,
            thickness=Dimension(value=0.2, source="measured"),
            base=0.0,
            height=measured,
            profile=((0.0, 1.0), (3.0, 3.0), (6.0, 1.0)) if i % 2 else (),
            left_spaces=("s",),
        )
        for i, (a, b) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True))
    )
    outline = ((0.1, 0.1), (7.9, 0.1), (7.9, 5.9), (0.1, 5.9))
    height = Dimension(value=2.0, source="measured")
    space = Space(id="s", name="s", confidence=1.0, outline=outline, base=0.0, height=height, area=45.24, volume=90.48)
    storey = Storey(id="1", name="1", elevation=Dimension(value=0.0, source="measured"), walls=walls, spaces=(space,))
    upright = [b for b in space_boundaries(Building(id="b", name="b", storeys=(storey,))) if b.patch.normal[2] == 0.0]
    area = {i: sum(Polygon(b.patch.outline).area for b in upright if b.element == f"w{i}") for i in range(4)}
    under = 2 * (1.4 * (1.0667 + 2.0) / 2 + 1.5 * 2.0)
    assert area[1] == pytest.approx(under, abs=0.01)
    assert area[3] == pytest.approx(under, abs=0.01)
    assert sum(Polygon(b.patch.outline).area for b in upright) == pytest.approx(2 * 2.0 * (7.8 + 5.8), abs=1e-6)


def test_what_is_seen_beyond_a_roofs_slope_is_no_opening() -> None:
    wall = WallShape(
        (0.0, 0.0), (6.0, 0.0), 0.3, None, 0.0, 3.0, True, (0,), (), 0.001, 100, 1.0, 1, (0,), (200, 200, 200),
        profile=((0.0, 1.0), (3.0, 3.0), (6.0, 1.0)),
    )  # fmt: skip
    assert wall.share_below(2.4, 0.9, 1.2, 1.2) == pytest.approx(1.0)
    assert wall.share_below(0.0, 2.0, 1.0, 0.8) == pytest.approx(0.0, abs=1e-6)
    assert 0.0 < wall.share_below(0.6, 0.9, 1.0, 1.2) < 0.9


@pytest.mark.parametrize("width", [1e-6, 0.02])
def test_a_roof_over_a_sliver_of_a_space_is_none(width: float) -> None:
    assert find_roofs(attic(), [box(1.0, 1.0, 1.0 + width, 1.0 + width)]) == []
