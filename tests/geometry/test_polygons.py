"""Shapes of the plane as polygons."""

from __future__ import annotations

import shapely

from scan2bim.geometry.polygons import area_outside

SHAPE = shapely.from_wkt(
    "MULTIPOLYGON (((8.7164 6.7798, 11.732871 6.373563, 11.247 6.3736, 11.2469 6.194, 8.716326 6.194057, "
    "8.7164 6.7798)), ((12.5631 2.8003, 8.7159 2.8008, 8.716123 4.576891, 12.563305 4.5767, 12.5631 2.8003)))"
)
OTHER = shapely.from_wkt(
    "POLYGON ((11.73287 6.373563, 8.7164 6.7798, 8.716349 6.37367, 11.2469 6.3736, 11.247 6.3736, 11.73287 6.373563))"
)
GRID = 1e-6


def test_area_outside_leaves_out_the_line_that_the_grid_makes_of_a_sliver():
    assert shapely.difference(SHAPE, OTHER, grid_size=GRID).geom_type == "GeometryCollection"
    rest = area_outside(SHAPE, OTHER, GRID)
    assert rest.geom_type == "MultiPolygon"
    assert abs(rest.area - shapely.difference(SHAPE, OTHER).area) < 1e-5
    assert not shapely.intersection(rest, SHAPE, grid_size=GRID).is_empty  # GEOS refuses mixed shapes here


def test_area_outside_of_what_is_apart_is_all():
    far = shapely.box(100, 100, 101, 101)
    assert area_outside(far, OTHER, GRID).equals(far)
    assert area_outside(far, far, GRID).is_empty


def test_area_outside_of_nothing_is_nothing():
    assert area_outside(shapely.GeometryCollection(), OTHER, GRID).is_empty
