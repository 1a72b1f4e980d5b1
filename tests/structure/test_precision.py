"""How precisely walls are known, and how sure they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from scan2bim.structure.confidence import LEAST, MOST, probability
from scan2bim.structure.precision import BETWEEN_SCANS, FREE_END, face_sigma, length_sigma, wall_sigmas
from scan2bim.structure.shapes import JoinShape, WallShape

WALL = WallShape(
    start=(0.0, 0.0),
    end=(4.0, 0.0),
    thickness=0.12,
    thickness_sigma=0.002,
    base=0.0,
    top=2.5,
    top_seen=True,
    left=(0,),
    right=(1,),
    rms=0.003,
    points=5000,
    coverage=0.8,
    faces=2,
    stations=(0, 1),
    colour=(200, 200, 200),
    joins=(JoinShape(1, "start", "path", "T"), JoinShape(2, "end", "path", "T")),
    position_sigma=0.001,
)


def test_the_place_of_a_longer_face_is_surer_until_the_scans_own_place_decides() -> None:
    random = np.random.default_rng(3)
    sigmas = [
        face_sigma(x := random.uniform(0, length, 4000), random.normal(0, 0.006, len(x))) for length in (1, 4, 64)
    ]
    assert sigmas[0] == pytest.approx(math.hypot(0.006 / math.sqrt(2), BETWEEN_SCANS), rel=0.1)
    assert sigmas[1] == pytest.approx(math.hypot(0.006 / math.sqrt(8), BETWEEN_SCANS), rel=0.1)
    assert sigmas[2] == pytest.approx(BETWEEN_SCANS, rel=0.2)


def test_a_wall_of_which_one_face_was_seen_has_a_place_but_no_thickness() -> None:
    places, distances = np.linspace(0.1, 3.9, 40), np.full(40, 0.002)
    place, thickness = wall_sigmas(places, distances, 4.0)
    assert place is not None and thickness is None
    both, thickness = wall_sigmas(np.concatenate([places, places + 5.0]), np.tile(distances, 2), 4.0)
    assert both is not None and thickness is not None
    assert thickness == pytest.approx(math.sqrt(2) * place)
    assert both == pytest.approx(place / math.sqrt(2))
    assert wall_sigmas(np.zeros(0), np.zeros(0), 4.0) == (None, None)


def test_a_wall_is_as_long_as_the_walls_at_its_ends_are_sure() -> None:
    across = replace(WALL, start=(0.0, -1.0), end=(0.0, 1.0), position_sigma=0.003, joins=())
    skew = replace(WALL, start=(3.0, -1.0), end=(5.0, 1.0), position_sigma=0.004, joins=())
    assert length_sigma(WALL, (WALL, across, skew)) == pytest.approx(math.hypot(0.003, 0.004 * math.sqrt(2)))
    free = replace(WALL, joins=WALL.joins[:1])
    assert length_sigma(free, (free, across)) == pytest.approx(math.hypot(0.003, FREE_END))
    assumed = replace(across, thickness_sigma=None)
    assert length_sigma(WALL, (WALL, assumed, skew)) is None


def test_less_evidence_makes_a_wall_less_sure_within_bounds() -> None:
    free = replace(WALL, joins=WALL.joins[:1])
    sure = probability(free)
    assert LEAST <= sure < probability(WALL) <= MOST
    assert probability(replace(free, coverage=0.2)) < sure
    assert probability(replace(free, rms=0.02)) < sure
    assert probability(replace(free, end=(0.4, 0.0))) < sure
    assert probability(replace(free, thickness=0.65)) < probability(replace(free, thickness=0.4)) == sure
    worst = replace(WALL, end=(0.3, 0.0), joins=(), coverage=0.0, rms=0.03, stations=(), thickness_sigma=None)
    assert LEAST <= probability(worst) < 0.5
