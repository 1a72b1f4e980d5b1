"""What of a face's surface is the element's own, and what stands before it."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.verify.fits import Cells, own_surface, robust_plane
from scan2bim.verify.layers import find_layers

CELL = 0.05
WIDE, TALL = 3.0, 2.5


def side(deviation: np.ndarray, face: int = 0, outwards: float = 1.0) -> Cells:
    """A wall's face of 3 m x 2.5 m in the plane y = 0 with its deviations (60, 50), and 1 mm of noise."""
    a, b = np.meshgrid(np.arange(CELL / 2, WIDE, CELL), np.arange(CELL / 2, TALL, CELL), indexing="ij")
    count = a.size
    place = np.column_stack([a.ravel(), b.ravel()])
    noisy = deviation.ravel() + np.random.default_rng(1).normal(0, 0.001, count)
    return Cells(
        face=np.full(count, face, np.int32),
        middle=np.column_stack([place[:, 0], np.full(count, outwards * 0.1), place[:, 1]]),
        normal=np.tile([0.0, outwards, 0.0], (count, 1)),
        deviation=noisy,
        square=noisy**2,
        area=np.full(count, CELL**2),
        place=place,
    )


def both(first: Cells, second: Cells) -> Cells:
    """The cells of two faces."""
    names = ("face", "middle", "normal", "deviation", "square", "area", "place")
    return Cells(*(np.concatenate([getattr(first, n), getattr(second, n)]) for n in names))


def flat(away: float = 0.0) -> np.ndarray:
    return np.full((60, 50), away)


def test_a_board_near_a_wall_does_not_turn_the_wall() -> None:
    deviation = flat()
    deviation[36:] = 0.017
    cells = side(deviation)
    plane = robust_plane(cells.place, cells.deviation)
    assert plane is not None
    assert plane[1:] == pytest.approx([0.0, 0.0], abs=0.0005)
    own, _ = own_surface(cells)
    assert own.reshape(60, 50)[:36].all()
    assert own.reshape(60, 50)[36:].mean() < 0.1


def test_a_wall_behind_a_board_that_hides_most_of_it_is_seen_over_the_board() -> None:
    deviation = flat(0.045)
    deviation[:, 40:] = 0.0
    own, _ = own_surface(side(deviation))
    shown = own.reshape(60, 50)
    assert shown[:, 40:].all()
    assert not shown[:, :40].any()


@pytest.mark.parametrize("away", [0.045, -0.045], ids=["towards the room", "away from it"])
def test_a_shifted_wall_is_all_its_own(away: float) -> None:
    own, _ = own_surface(side(flat(away)))
    assert own.all()


def test_a_turned_wall_is_all_its_own() -> None:
    deviation = np.linspace(-0.05, 0.05, 60)[:, None] * np.ones(50)
    own, on_plane = own_surface(side(deviation))
    assert own.all()
    assert on_plane.all()


def test_furring_that_is_not_drawn_is_a_layer_before_a_wall_in_place() -> None:
    cells = both(side(flat(), 0, -1.0), side(flat(0.15), 1))
    own, _ = own_surface(cells)
    (layer,) = find_layers(cells, own, 0.01)
    assert layer.depth == pytest.approx(0.15, abs=0.001)
    assert layer.area == pytest.approx(WIDE * TALL, rel=0.01)
    assert layer.places[:, 1] == pytest.approx(0.25, abs=0.01)


def test_a_wall_of_which_nothing_lies_in_place_was_shifted() -> None:
    cells = both(side(flat(-0.09), 0, -1.0), side(flat(0.09), 1))
    own, _ = own_surface(cells)
    assert find_layers(cells, own, 0.01) == []


def test_a_shelf_is_no_layer() -> None:
    deviation = flat()
    deviation[:, :24] = 0.15
    cells = both(side(flat(), 0, -1.0), side(deviation, 1))
    own, _ = own_surface(cells)
    assert find_layers(cells, own, 0.01) == []
