"""The view shows what is nearest, looks into the rooms, and hides roof and ceilings."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from buildings import building, ground_floor, measured

from scan2bim.geometry.meshes import box_mesh, mesh_volume
from scan2bim.model.elements import Building, Storey
from scan2bim.report import palette
from scan2bim.report.view3d import draw_view, export, storey_bodies
from scan2bim.report.zbuffer import Body, Camera, render

TOP = Camera(-math.pi / 2, math.pi / 2)
RED, BLUE = (200, 0, 0), (0, 0, 200)


def look(bodies: list[Body], camera: Camera) -> np.ndarray:
    return render(bodies, camera, 10.0, np.array([-5.0, -5.0]), (100, 100))


def test_the_nearer_body_hides_the_other_whatever_their_order():
    low, high = Body(box_mesh((-2, -2, 0), (2, 2, 1)), RED), Body(box_mesh((-1, -1, 2), (1, 1, 3)), BLUE)
    for bodies in ([low, high], [high, low]):
        image = look(bodies, TOP)
        assert image[50, 50, 2] > image[50, 50, 0]
        assert image[50, 35, 0] > image[50, 35, 2]
        assert image[5, 5].tolist() == [255, 255, 255]


def test_from_above_x_runs_right_and_y_up():
    image = look([Body(box_mesh((1, 2, 0), (3, 4, 1)), RED)], TOP)
    rows, columns = np.nonzero(image[..., 2] < 128)
    assert (columns.min(), columns.max()) == pytest.approx((60, 79), abs=1)
    assert (rows.min(), rows.max()) == pytest.approx((10, 29), abs=1)


def test_a_cap_colours_the_top_alone():
    image = look([Body(box_mesh((-2, -2, 0), (2, 2, 1)), RED, cap=BLUE)], Camera(-math.pi / 2, math.radians(45)))
    assert BLUE in {tuple(colour) for colour in image.reshape(-1, 3).tolist()}
    assert any(colour[0] > 50 and colour[2] == 0 for colour in image.reshape(-1, 3).tolist())


def test_a_storey_shows_no_ceiling_and_no_roof():
    storey = ground_floor()
    highest = max(body.mesh.vertices[:, 2].max() for body in storey_bodies(storey))
    assert highest == pytest.approx(2.6)
    assert all(mesh_volume(body.mesh) < 60 for body in storey_bodies(storey))


def test_the_view_shows_each_rooms_floor_and_each_doors_state():
    image = draw_view(building(), panel=(300, 240))
    colours = {tuple(colour) for colour in np.unique(image.reshape(-1, 3), axis=0).tolist()}
    assert set(palette.SPACES[:3]) <= colours
    green = palette.DOORS["open"]
    assert any(g > 1.5 * max(r, b) and g <= green[1] for r, g, b in colours)


def test_the_view_is_the_same_on_every_run(tmp_path):
    small = building().model_copy(update={"storeys": building().storeys[:1]})
    assert np.array_equal(draw_view(small, panel=(200, 160)), draw_view(small, panel=(200, 160)))
    export(Building(id="b", name="B", storeys=(Storey(id="s", name="S", elevation=measured(0)),)), tmp_path / "v.png")
    assert cv2.imread(str(tmp_path / "v.png")) is not None
