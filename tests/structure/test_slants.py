"""What lies between the places at which pulses meet a floor at a slant, and walls seen in stripes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from surfaces import plan, room

from scan2bim.structure.faces import find_faces
from scan2bim.structure.slants import GAPLESS, with_gaps
from scan2bim.structure.strays import with_strays

STEP = 0.005
"""Radians between pulses."""


def row_of_floor() -> np.ndarray:
    """Places (n, 3) at which pulses down a corridor along x meet its floor, from 1.5 m over it at x = 0."""
    fall = np.arange(np.arctan(1.5 / 14), np.arctan(1.5 / 6), STEP)
    far = 1.5 / np.tan(fall)
    return np.column_stack([far, np.full(len(far), 0.52), np.zeros(len(far))])


def filled(places: np.ndarray) -> np.ndarray:
    eyes = np.tile([0.0, 0.52, 1.5], (len(places), 1))
    points = with_gaps(places, eyes, np.full(len(places), STEP), np.zeros(2), (20, 300))
    return np.sort(points[np.abs(points[:, 2]) < 0.01, 0])


def test_a_floor_seen_at_a_slant_has_no_gaps_and_does_not_go_on_past_what_was_seen() -> None:
    places = row_of_floor()
    assert np.diff(np.sort(places[:, 0])).max() > 0.5
    found = filled(places)
    assert np.diff(found).max() < GAPLESS + 0.01
    assert (found.min(), found.max()) == pytest.approx((places[:, 0].min(), places[:, 0].max()))


def test_what_hangs_or_stands_between_two_places_at_another_height_keeps_them_apart() -> None:
    places = row_of_floor()
    between = (places[0] + places[1]) / 2 + [0, 0, 0.4]
    assert np.diff(filled(np.vstack([places, between]))).max() > 0.5


def test_a_wall_seen_in_stripes_goes_on_to_the_last_of_them() -> None:
    found = plan([room(0, 0, 6, 3)], [(2, 1)], 0.0)
    (face,) = [f for f in find_faces(found) if f.normal[1] > 0.99 and f.centre[1] < 0.1]
    along = (found.columns.xy[face.columns] - face.centre) @ face.direction
    near = replace(face, columns=face.columns[along < along.min() + 3], high=face.low + 3)
    stripes = np.isin(np.arange(len(found.columns)), face.columns[np.argsort(along)][::6])
    (grown,) = with_strays(found.columns, [near], stripes & (found.columns.high >= 3))
    assert grown.high == pytest.approx(face.high, abs=0.3)
    (same,) = with_strays(found.columns, [near], np.zeros(len(found.columns), bool))
    assert same.high == near.high
