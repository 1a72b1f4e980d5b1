"""How far the faces of a model take points."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.verify.assign import (
    LEAST_REACH,
    REACH,
    TOP_REACH,
    _owner,  # pyright: ignore[reportPrivateUsage]
    face_arrays,
    reach_of,
)
from scan2bim.verify.faces import BODY, Plane, make_faces


def rectangle(
    normal: tuple[float, float, float], u: tuple[float, float, float], v: tuple[float, float, float]
) -> Plane:
    """With edges u and v from the origin."""
    a, b, c = np.zeros(3), np.array(u), np.array(v)
    return Plane(0, np.array(normal), np.array([[a, b, b + c], [a, b + c, c]]), False, False, BODY)


@pytest.mark.parametrize(
    ("plane", "reach"),
    [
        (rectangle((0.0, -1.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 2.5)), REACH),
        (rectangle((0.0, -1.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 0.1)), 0.1),
        (rectangle((0.0, -1.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 0.024)), LEAST_REACH),
        (rectangle((0.0, 0.0, 1.0), (4.0, 0.0, 0.0), (0.0, 0.3, 0.0)), TOP_REACH),
        (rectangle((0.0, 0.0, -1.0), (4.0, 0.0, 0.0), (0.0, 0.3, 0.0)), REACH),
        (rectangle((0.0, 0.0, 1.0), (4.0, 0.0, 0.0), (0.0, 3.0, 0.0)), REACH),
    ],
    ids=["a wall", "a narrow face", "a handrail", "the top of a wall", "the underside of a beam", "a floor"],
)
def test_narrow_faces_and_tops_of_walls_take_points_from_less_far(plane: Plane, reach: float) -> None:
    assert reach_of(make_faces([plane])) == pytest.approx([reach])


def test_what_is_seen_past_the_end_of_a_wall_says_nothing_of_it() -> None:
    wall = rectangle((0.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 2.5))
    point, steps = (1.9, 0.12, 1.0), 0.12 + 1.0
    faces, flush = face_arrays(make_faces([wall])), np.array([0.0, -1.0, 0.0], np.float32)
    found = []
    for x in (1.0, 4.0):  # from there the ray meets the wall's plane on the wall, and beside its end
        station = np.array([x, -1.0, 1.0])
        found.append(_owner(*point, flush, station, 0, 1, np.array([0]), *faces))
        crossing = point[0] + (x - point[0]) * 0.12 / steps
        assert (crossing < 2.0) == (x == 1.0)
    assert found[0][1] >= 0
    assert found[0][2] == pytest.approx(-0.12)
    assert found[1][:2] == (-2, -1)
