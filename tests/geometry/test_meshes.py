"""Meshes of walls and prisms: closed, wound outwards, of the right volume."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scan2bim.geometry.arcs import Arc
from scan2bim.geometry.meshes import (
    box_mesh,
    face_normals,
    flat_mesh,
    is_closed,
    merge_meshes,
    mesh_volume,
    move_mesh,
    prism_mesh,
)
from scan2bim.geometry.wall_meshes import WallEnds, WallForm
from scan2bim.geometry.wall_meshes import wall_mesh as mesh_of

SQUARE = WallEnds(0.0, 5.0, 0.0, 5.0)


def wall_form(ends, thickness, height, rows, niches=(), chord=5.0, bulge=0.0, **more) -> WallForm:
    cut = np.array(niches, float).reshape(-1, 6)
    return WallForm(ends, thickness, height, rows, cut, Arc(chord, bulge), **more)


def wall_mesh(ends, thickness, height, rows, **more):
    return mesh_of(wall_form(ends, thickness, height, rows, **more))


def openings(*rows: tuple[float, float, float, float]) -> np.ndarray:
    return np.array(rows, float).reshape(-1, 4)


def assert_sound(mesh, volume: float) -> None:
    assert is_closed(mesh)
    assert mesh_volume(mesh) == pytest.approx(volume, abs=1e-9)
    corners = mesh.corners
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.min() > 1e-9


def test_a_wall_without_openings_is_a_box():
    mesh = wall_mesh(SQUARE, 0.2, 2.5, openings())
    assert len(mesh.triangles) == 12
    assert_sound(mesh, 5 * 0.2 * 2.5)


def test_a_door_and_a_window_are_cut_out_of_the_wall():
    mesh = wall_mesh(SQUARE, 0.2, 2.5, openings((1, 2, 0, 2.1), (3, 4.2, 0.9, 2.1)))
    assert_sound(mesh, (5 * 2.5 - 2.1 - 1.2 * 1.2) * 0.2)


def test_no_triangle_spans_an_opening():
    mesh = wall_mesh(SQUARE, 0.2, 2.5, openings((3, 4.2, 0.9, 2.1)))
    middles = mesh.corners.mean(axis=1)
    inside = (middles[:, 0] > 3) & (middles[:, 0] < 4.2) & (middles[:, 2] > 0.9) & (middles[:, 2] < 2.1)
    assert not np.any(inside & (np.abs(middles[:, 1]) > 0.0999))


def test_overlapping_openings_unite_and_those_outside_are_ignored():
    mesh = wall_mesh(SQUARE, 0.2, 2.5, openings((1, 2, 0, 2), (1.5, 2.5, 0, 2), (6, 7, 0, 2), (4.5, 5.5, -1, 1)))
    assert_sound(mesh, (5 * 2.5 - 1.5 * 2 - 0.5 * 1) * 0.2)


def test_an_opening_of_the_full_height_leaves_two_pieces():
    assert_sound(wall_mesh(SQUARE, 0.2, 2.5, openings((2, 3, 0, 2.5))), 4 * 0.2 * 2.5)


def test_openings_that_touch_in_a_corner_leave_a_closed_mesh():
    assert_sound(wall_mesh(SQUARE, 0.2, 2.5, openings((1, 2, 0, 1), (2, 3, 1, 2))), (5 * 2.5 - 2) * 0.2)


def test_mitred_ends_keep_volume_and_corners():
    mesh = wall_mesh(WallEnds(0.1, 4.9, -0.1, 5.1), 0.2, 2.5, openings((1, 2, 0, 2)))
    assert_sound(mesh, (5 * 2.5 - 2) * 0.2)
    assert mesh.vertices[:, 0].min() == -0.1
    assert mesh.vertices[mesh.vertices[:, 1] > 0][:, 0].max() == 4.9


@pytest.mark.parametrize("tip_end", [5.2, 4.9, None])
@pytest.mark.parametrize("tip_start", [-0.1, 0.2])
def test_pointed_ends_run_by_their_tip(tip_start, tip_end):
    mesh = wall_mesh(WallEnds(0.05, 5.0, 0.1, 5.0, tip_start, tip_end), 0.2, 2.5, openings((1, 2, 0, 2)))
    ends = 0.0 if tip_end is None else (tip_end - 5.0) / 2
    assert_sound(mesh, ((4.925 + (0.075 - tip_start) / 2 + ends) * 2.5 - 2) * 0.2)
    assert len(wall_mesh(WallEnds(0.05, 5.0, 0.1, 5.0, tip_start, tip_end), 0.2, 2.5, openings()).triangles) > 12


def test_a_wall_without_extent_is_empty():
    for thickness, height, ends in ((0.2, 0.0, SQUARE), (0.0, 2.0, SQUARE), (0.2, 2.0, WallEnds(0, 0, 0, 0))):
        assert len(wall_mesh(ends, thickness, height, openings()).triangles) == 0


@settings(max_examples=60, deadline=None, database=None)
@given(
    st.lists(st.tuples(*[st.floats(-1, 6), st.floats(0, 3), st.floats(-0.5, 3), st.floats(0, 3)]), max_size=6),
    st.tuples(*[st.floats(-0.3, 0.3)] * 4),
    st.tuples(*[st.one_of(st.none(), st.floats(-0.3, 0.3))] * 2),
)
def test_any_openings_and_ends_leave_a_closed_mesh_wound_outwards(boxes, ends, tips):
    rows = openings(*((x, x + w, z, z + h) for x, w, z, h in boxes))
    tip_end = None if tips[1] is None else 5 + tips[1]
    mesh = wall_mesh(WallEnds(ends[0], 5 + ends[1], ends[2], 5 + ends[3], tips[0], tip_end), 0.2, 2.5, rows)
    assert is_closed(mesh)
    assert mesh_volume(mesh) >= 0


def test_a_prism_with_a_hole_is_closed():
    outline = ((0, 0), (4, 0), (4, 3), (2, 1), (0, 3))
    hole = ((0.5, 0.5), (0.5, 0.8), (0.8, 0.8), (0.8, 0.5))
    assert_sound(prism_mesh(outline, (hole,), 1.0, 1.5), (12 - 4 - 0.09) * 0.5)


def test_a_prism_does_not_care_about_the_winding_of_its_outline():
    outline = ((0, 0), (0, 1), (1, 1), (1, 0))
    assert_sound(prism_mesh(outline, (), 0, 1), 1)


def test_a_hole_that_touches_the_outline_leaves_a_closed_mesh():
    assert_sound(prism_mesh(((0, 0), (2, 0), (2, 2), (0, 2)), (((1, 0), (1.5, 1), (0.5, 1)),), 0, 1), 3.5)


def test_an_outline_that_crosses_itself_becomes_two_prisms():
    assert_sound(prism_mesh(((0, 0), (1, 1), (1, 0), (0, 1)), (), 0, 1), 0.5)


def test_a_prism_without_area_or_height_is_empty():
    assert len(prism_mesh(((0, 0), (1, 0), (2, 0)), (), 0, 1).triangles) == 0
    assert len(prism_mesh(((0, 0), (1, 0)), (), 0, 1).triangles) == 0
    assert len(prism_mesh(((0, 0), (1, 0), (1, 1)), (), 1, 1).triangles) == 0


def test_a_flat_sheet_looks_up():
    assert np.allclose(face_normals(flat_mesh(((0, 0), (0, 1), (1, 1), (1, 0)), (), 2.0)), [0, 0, 1])


def test_moving_and_merging_keep_the_volume():
    box = box_mesh((0, 0, 0), (1, 2, 3))
    moved = move_mesh(box, math.pi / 2, (10, 0, 0))
    assert moved.vertices.min(axis=0) == pytest.approx([8, 0, 0])
    assert_sound(merge_meshes([box, moved]), 12)
