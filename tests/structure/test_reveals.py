from __future__ import annotations

from scan2bim.structure.reveals import outer_thickness
from scan2bim.structure.thicknesses import OUTER
from scan2bim.structure.walls import THICKEST


def test_without_deep_reveals_outer_walls_have_the_usual_thickness() -> None:
    assert outer_thickness([]) == OUTER
    assert outer_thickness([0.1, 0.15, 0.2, OUTER - 0.01]) == OUTER


def test_niches_beyond_the_thickest_wall_do_not_make_outer_walls_thicker() -> None:
    reveals = [0.36, 0.37, 0.38, 0.385, 0.39]
    assert outer_thickness([*reveals, 0.6, 0.7, 0.79]) == outer_thickness(reveals)
    assert outer_thickness([0.1, 0.6, 0.7, 0.79]) == OUTER


def test_one_deep_reveal_is_not_believed() -> None:
    assert outer_thickness([0.1, 0.1, 0.6]) == OUTER


def test_outer_walls_are_at_least_as_thick_as_their_reveals_are_deep() -> None:
    thickness = outer_thickness([0.40, 0.41, 0.42, 0.42, 0.1])
    assert 0.42 <= thickness <= 0.47
    assert thickness < THICKEST


def test_reveals_seen_a_centimetre_deeper_give_the_same_assumed_thickness() -> None:
    assert outer_thickness([0.37, 0.38, 0.38, 0.39]) == outer_thickness([0.38, 0.39, 0.39, 0.40]) == 0.40
