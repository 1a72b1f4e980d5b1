"""Open plans parted where the floor changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate
from shapely.geometry import LineString, Polygon
from surfaces import F64, level, surfels_of, turned

from scan2bim.structure.flooring import flooring_of, split_at_floors
from scan2bim.structure.plan import plan_of
from scan2bim.structure.storeys import StoreyLevels, layers_of

ROOM = shapely.box(0, 0, 8, 4)
WOOD, TILES = (120, 90, 60), (100, 98, 102)
Split = tuple[list[Polygon], list[LineString]]


def split(points: F64, other: F64, yaw: float = 0.0) -> Split:
    """The parts of ROOM, turned by ``yaw``, whose floor is ``points`` (n, 3) of wood and ``other`` of tiles."""
    rng = np.random.default_rng(1)
    parts = [surfels_of(turned(xyz, yaw)) for xyz in (points, other) if len(xyz)]
    colours = [rng.normal(c, 6, (len(p), 3)) for p, c in zip(parts, (WOOD, TILES), strict=False)]
    bright = rng.uniform(0.7, 1.3, (sum(map(len, parts)), 1))
    whole = [np.concatenate([getattr(p, name) for p in parts]) for name in ("xyz", "count", "station", "spread")]
    rgb = (np.concatenate(colours) * bright).clip(0, 255).astype(np.uint8)
    surfels = replace(parts[0], xyz=whole[0], count=whole[1], rgb=rgb, station=whole[2], spread=whole[3])
    layers = layers_of(surfels)
    plan = plan_of(StoreyLevels(0.0, 0.002, None, 2.5, 32.0), surfels, layers, np.zeros((0, 3)))
    return split_at_floors(rotate(ROOM, yaw, origin=(0, 0), use_radians=True), flooring_of(plan.grid, surfels, layers))


def without(points: F64, *boxes: Polygon) -> F64:
    """Points that no box hides."""
    hidden = [shapely.contains_xy(box, points[:, 0], points[:, 1]) for box in boxes]
    return points[~np.any(hidden, axis=0)] if boxes else points


@pytest.mark.parametrize("yaw", [0.0, 0.4, 2.0])
def test_a_space_is_parted_where_its_floor_has_another_tint(yaw: float) -> None:
    parts, (border,) = split(level(0, 0, 5, 4, 0.0), level(5, 0, 8, 4, 0.0), yaw)
    assert sorted(p.area for p in parts) == pytest.approx([12, 20], abs=0.3)
    assert border.length == pytest.approx(4.0, abs=0.01)


def test_a_space_is_parted_where_its_floor_lies_a_little_higher_and_a_counter_hides_most_of_the_border() -> None:
    raised, counter = level(5, 0, 8, 4, 0.006), shapely.box(4.95, 0, 5.7, 3.0)
    lower = level(0, 0, 5, 4, 0.0)
    parts, _ = split(np.concatenate([without(lower, counter), without(raised, counter)]), np.zeros((0, 3)))
    assert sorted(p.area for p in parts) == pytest.approx([12, 20], abs=0.3)


def test_a_rug_a_mat_and_a_floor_that_rises_part_nothing() -> None:
    rug = shapely.box(4.5, 0.6, 7.5, 3.4)
    assert len(split(without(level(0, 0, 8, 4, 0.0), rug), level(4.5, 0.6, 7.5, 3.4, 0.008))[0]) == 1
    assert len(split(level(0, 0, 7.2, 4, 0.0), level(7.2, 0, 8, 4, 0.0))[0]) == 1
    rising = level(0, 0, 8, 4, 0.0)
    rising[:, 2] += 0.02 * (rising[:, 0] / 8 - 0.5)
    assert len(split(rising, np.zeros((0, 3)))[0]) == 1
