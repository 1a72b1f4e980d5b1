from __future__ import annotations

import numpy as np
import pytest
from shapely.geometry import box
from surfaces import plan, room, upright

from scan2bim.structure.faces import Face, find_faces
from scan2bim.structure.plan import Plan
from scan2bim.structure.risers import without_risers
from scan2bim.structure.stairs import FoundStair

STAIR = FoundStair(box(2.0, 0.0, 5.0, 1.0), 0.0, 2.5, np.array([1.0, 0.0]), "straight", 14, 1.0)


def across(wall: float, riser: float) -> tuple[list[Face], Plan]:
    """Faces across a stair at x = 3 with one from y = ``riser`` to 0.95, and one in its line from there to ``wall``."""
    parts = [upright((3.0, wall), (3.0, riser), 0.0, 2.5)]
    whole = plan([[*room(0.0, 0.0, 6.0, 4.0), *parts]], [(1.0, 2.0)])
    return [f for f in find_faces(whole) if f.normal[0] < -0.99 and abs(f.centre[0] - 3.0) < 0.05], whole


def test_a_riser_is_no_wall() -> None:
    faces, whole = across(0.95, 0.05)
    assert len(faces) == 1
    assert without_risers(faces, [STAIR], whole.columns) == []


def test_a_wall_in_line_with_a_riser_ends_beside_the_stair() -> None:
    faces, whole = across(3.5, 0.05)
    (wall,) = without_risers(faces, [STAIR], whole.columns)
    assert wall.ends()[:, 1].min() == pytest.approx(0.9, abs=0.1)
    assert wall.ends()[:, 1].max() == pytest.approx(3.5, abs=0.1)


def test_a_wall_along_a_stair_stays() -> None:
    whole = plan([[*room(0.0, 0.0, 6.0, 4.0), upright((5.0, 1.0), (2.0, 1.0), 0.0, 2.5)]], [(1.0, 2.5)])
    faces = [f for f in find_faces(whole) if abs(f.centre[1] - 1.0) < 0.05]
    assert len(without_risers(faces, [STAIR], whole.columns)) == len(faces) > 0
