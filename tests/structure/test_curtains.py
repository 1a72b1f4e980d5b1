from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from surfaces import level, plan, upright

from scan2bim.structure.faces import Face, find_faces

F64 = NDArray[np.float64]


def room_with(hung: list[F64], ceiling_to: float) -> list[Face]:
    """Faces along y = 0 of a room of 6 x 3 x 2.5 m, whose wall there was seen up to x = 4 alone: something hangs before
    the rest, behind which the ceiling was seen down to y = ``ceiling_to``.
    """
    walls = [((6.0, 0.0), (6.0, 3.0)), ((6.0, 3.0), (0.0, 3.0)), ((0.0, 3.0), (0.0, 0.0)), ((0.0, 0.0), (4.0, 0.0))]
    flat = [level(0, 0.15, 6, 3, 0.0), level(0, 0, 4, 3, 2.5), level(4, ceiling_to, 6, 3, 2.5)]
    faces = find_faces(plan([[*flat, *(upright(a, b, 0.0, 2.5) for a, b in walls), *hung]], [(2.5, 1.5)]))
    return [f for f in faces if f.normal[1] > 0.9 and abs(f.centre[1]) < 0.3]


def folds() -> list[F64]:
    """A curtain in folds, 10 to 17 cm before the wall's line, that reaches up to 10 cm below the ceiling."""
    x = np.linspace(4.05, 5.95, 39)
    y = 0.135 + 0.025 * np.sin(2 * np.pi * (x - 4) / 0.25)
    return [upright((x[k], y[k]), (x[k + 1], y[k + 1]), 0.0, 2.4) for k in range(len(x) - 1)]


def test_a_wall_goes_on_behind_a_curtain_that_hides_it_up_to_the_corner() -> None:
    faces = room_with(folds(), 0.0)
    assert len(faces) == 1
    assert abs(faces[0].centre[1]) < 0.01
    assert faces[0].ends()[:, 0].max() > 5.8


def test_an_even_face_before_a_walls_line_is_the_wall_there() -> None:
    faces = room_with([upright((4.0, 0.15), (6.0, 0.15), 0.0, 2.5)], 0.15)
    assert {round(float(f.centre[1]), 2) for f in faces} == {0.0, 0.15}
