"""Of two openings in one place, leaves of one door, and openings that reach a wall's end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.openings.build import without_overlaps
from scan2bim.openings.closed.find import closed_doors, head_of, judged
from scan2bim.openings.closed.rectangles import Rectangle, contrasted
from scan2bim.openings.orthoimage import Orthoimage
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import StoreyShape, WallShape

WALL = WallShape((0, 0), (4, 0), 0.2, 0.002, 0, 2.5, True, (0,), (1,), 0.002, 900, 0.9, 2, (0,), (200, 200, 200))
STOREY = StoreyShape(0.0, None, 2.5, 2.5, (), (WALL,))
DOORWAY = OpeningShape(
    0, 0, "door", "open", 1.0, 0.0, 1.8, 2.1, 0.004, 0.004, 0.5, 2, True, 300, (0,), 0.9, sides=3, angle=1.2
)  # fmt: skip
LEAF = replace(DOORWAY, state="closed", offset=1.02, width=0.88, angle=None, looked_through=0.0, confidence=0.99)


def test_a_closed_leaf_beside_an_open_one_is_a_part_of_their_door() -> None:
    assert without_overlaps([DOORWAY, LEAF], [STOREY]) == [DOORWAY]


@pytest.mark.parametrize("doorway", [replace(DOORWAY, angle=None), replace(DOORWAY, width=1.1)])
def test_a_closed_leaf_that_is_no_half_of_a_doorway_is_surer_than_what_was_looked_through(
    doorway: OpeningShape,
) -> None:
    assert without_overlaps([doorway, LEAF], [STOREY])[0] == LEAF


def test_a_closed_leaf_that_was_looked_through_does_not_hang_where_one_stands_open() -> None:
    door = replace(DOORWAY, width=0.9, confidence=0.93)
    wide = replace(LEAF, offset=0.4, width=1.7, looked_through=0.3)
    assert without_overlaps([door, wide], [STOREY]) == [door]
    assert without_overlaps([replace(door, angle=None), wide], [STOREY]) == [wide]
    paned = replace(wide, handle_height=1.05)
    assert without_overlaps([door, paned], [STOREY]) == [paned]


def test_an_opening_whose_lining_goes_on_behind_the_next_wall_ends_with_its_own() -> None:
    (found,) = without_overlaps([replace(DOORWAY, offset=2.96, width=1.08)], [STOREY])
    assert found.offset + found.width == pytest.approx(4.0)


def test_an_opening_that_lies_half_beyond_its_wall_is_dropped() -> None:
    assert not without_overlaps([replace(DOORWAY, offset=3.2)], [STOREY])


def face(*leaves: tuple[int, int], pane: bool = False, through: bool = False) -> Orthoimage:
    """A face of 4 x 2.6 m with leaves between columns, 2.05 m high, each of its own depth and all of one colour."""
    rng = np.random.default_rng(3)
    shape = (260, 400)
    rgb = (0.8 + rng.normal(0, 0.01, (*shape, 3))).astype(np.float32)
    depth = rng.normal(0, 0.002, shape).astype(np.float32)
    coarse = np.zeros((52, 80), np.uint8)
    looked = coarse.copy()
    for k, (low, high) in enumerate(leaves):
        depth[:205, low:high] -= 0.02 + 0.02 * k
        rgb[:205, low:high] -= 0.3
        if pane:
            rgb[90:185, low + 15 : high - 15] = 0.1
            looked[18:37, (low + 15) // 5 : (high - 15) // 5] = through
    count = (rng.random(shape) < 0.6).astype(np.uint16)
    return Orthoimage("left", count, rgb, depth, np.ones(shape, bool), coarse + 1, looked, coarse)


def test_two_leaves_that_stand_edge_to_edge_are_one_door() -> None:
    (found,) = closed_doors(contrasted([face((100, 185), (185, 270))]))
    assert (found.box.left, found.box.right) == pytest.approx((1.0, 2.7), abs=0.03)


def test_two_doors_with_a_post_between_them_are_two() -> None:
    assert len(closed_doors(contrasted([face((60, 145), (160, 245))]))) == 2


def test_a_pane_does_not_make_a_leaf_uneven() -> None:
    solid, glazed = (closed_doors(contrasted([face((100, 190), pane=True, through=t)])) for t in (False, True))
    assert glazed[0].whole > 0.95
    assert not solid or solid[0].whole < glazed[0].whole


def test_a_rectangle_up_to_a_low_ceiling_holds_a_door_if_its_head_was_seen() -> None:
    faces = contrasted([face((100, 190))])
    tall = replace(judged(faces, Rectangle(1.0, 1.9, 2.6, True)), probability=0.99)
    headed = replace(judged(faces, Rectangle(1.0, 1.9, 2.04)), probability=0.7)
    beside = replace(judged(faces, Rectangle(2.5, 3.4, 2.04)), probability=0.7)
    assert head_of(tall, [beside, headed]) is headed
    assert head_of(tall, [beside]) is None
    assert head_of(tall, [replace(headed, probability=0.2)]) is None


@pytest.mark.parametrize(("offset", "kept"), [(1.85, ["door", "window"]), (1.2, ["window"])])
def test_a_surer_window_replaces_a_closed_door_in_its_place_and_not_one_beside_it(
    offset: float, kept: list[str]
) -> None:
    window = replace(DOORWAY, kind="window", state="unknown", offset=offset, width=1.0, sill=0.1, angle=None)
    door = replace(LEAF, offset=1.0, width=0.9, confidence=0.7)
    assert [o.kind for o in without_overlaps([window, door], [STOREY])] == kept


@pytest.mark.parametrize(("sill", "kept"), [(0.9, "window"), (0.5, "door")])
def test_a_window_in_a_row_of_alike_ones_is_no_door_with_its_parapet(sill: float, kept: str) -> None:
    """A radiator's panel below a window looks like the lower part of a leaf."""
    window = replace(DOORWAY, kind="window", state="unknown", sill=0.9, width=1.0, height=1.5, angle=None, sides=3)
    row = [replace(window, offset=offset, sill=sill) for offset in (4.0, 6.0)]
    door = replace(LEAF, offset=1.0, width=1.0, height=2.4, confidence=0.97)
    found = without_overlaps([replace(window, offset=1.0), door, *row], [STOREY])
    assert [o.kind for o in found if o.offset < 2.0] == [kept]
