"""Openings of one wall, its points made up: no scan, no stage before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.openings.mullions import without_mullions
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.open import find_open
from scan2bim.openings.shapes import OpeningShape
from scan2bim.openings.wall_image import PIXEL, WallImage, wall_image
from scan2bim.structure.shapes import WallShape

F64 = NDArray[np.float64]
LENGTH, HEIGHT, THICKNESS = 5.0, 2.6, 0.3
STEP = 0.012
"""Distance of the points on a surface, metres."""
Hole = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def sheet(hole: Hole, depth: float, step: float = STEP) -> F64:
    """Points (n, 3) along, across and up on an upright rectangle ``depth`` behind the left face."""
    left, right, bottom, top = hole
    along, up = np.meshgrid(np.arange(left, right, step), np.arange(bottom, top, step))
    return np.column_stack([along.ravel(), np.full(along.size, THICKNESS / 2 - depth), up.ravel()])


def reveals(hole: Hole, deep: float = 0.12) -> F64:
    """Points on the four sides of a hole, ``deep`` metres into the wall."""
    left, right, bottom, top = hole
    depth = np.arange(0.02, deep, STEP)
    parts: list[F64] = []
    for along, up in (
        (np.array([left]), np.arange(bottom, top, STEP)),
        (np.array([right]), np.arange(bottom, top, STEP)),
        (np.arange(left, right, STEP), np.array([bottom])),
        (np.arange(left, right, STEP), np.array([top])),
    ):
        grid = np.meshgrid(along, THICKNESS / 2 - depth, up, indexing="ij")
        parts.append(np.stack(grid, -1).reshape(-1, 3))
    return np.concatenate(parts)


def pane(hole: Hole, frame: float = 0.07) -> F64:
    """Frame, and a pane that returns one pulse in sixteen."""
    left, right, bottom, top = hole
    solid = sheet(hole, 0.1)
    x, z = solid[:, 0], solid[:, 2]
    clear = (x > left + frame) & (x < right - frame) & (z > bottom + frame) & (z < top - frame)
    glass = (left + frame, right - frame, bottom + frame, top - frame)
    return np.concatenate([solid[~clear], sheet(glass, 0.11, 4 * STEP)])


def image(holes: list[Hole], *inside: F64, through: list[Hole] | None = None) -> tuple[WallShape, WallImage]:
    """An outer wall with its room on the left and ``holes`` in it, seen from nowhere that is known; ``through`` was
    looked through.
    """
    grey = (200, 200, 200)
    wall = WallShape(
        (0.0, 0.0), (LENGTH, 0.0), THICKNESS, None, 0.0, HEIGHT, True, (0,), (), 0.002, 9999, 1.0, 1, (0,), grey
    )  # fmt: skip
    face = sheet((0.0, LENGTH, 0.0, HEIGHT), 0.0)
    for left, right, bottom, top in holes:
        x, z = face[:, 0], face[:, 2]
        face = face[(x < left) | (x > right) | (z < bottom) | (z > top)]
    points = np.concatenate([face, *inside])
    along, across, up = points.astype(np.float32).T
    count = len(points)
    made = WallPoints(along, across, up, np.zeros((count, 3), np.uint8), np.zeros(count, np.uint16))
    found = wall_image(wall, made, {}, np.full((1, 3), np.nan))
    for left, right, bottom, top in through or []:
        rows = slice(round(bottom / PIXEL), round(top / PIXEL))
        found.through[rows, round(left / PIXEL) : round(right / PIXEL)] = 1
    return wall, replace(found)


def found_in(holes: list[Hole], *inside: F64, through: list[Hole] | None = None) -> list[OpeningShape]:
    return find_open(0, 0, *image(holes, *inside, through=through))


def sides(opening: OpeningShape) -> Hole:
    return (opening.offset, opening.offset + opening.width, opening.sill, opening.sill + opening.height)


WINDOW = (1.0, 2.2, 0.9, 2.1)
DOORWAY = (1.0, 1.9, 0.0, 2.05)


def clear(hole: Hole, frame: float = 0.1) -> Hole:
    return hole[0] + frame, hole[1] - frame, hole[2] + frame, hole[3] - frame


def test_a_window_that_was_looked_through_has_its_sides_to_a_centimetre() -> None:
    (found,) = found_in([WINDOW], reveals(WINDOW), pane(WINDOW), through=[clear(WINDOW)])
    assert found.kind == "window"
    assert sides(found) == pytest.approx(WINDOW, abs=0.01)
    assert (found.jambs, found.sides) == (2, 4)


def test_panes_beside_a_mullion_are_one_window_also_if_the_frame_hides_the_head_of_one() -> None:
    holes = [(1.0, 1.96, 0.9, 2.1), (2.04, 3.0, 0.9, 2.1)]
    post, whole = sheet((1.96, 2.04, 0.9, 2.1), 0.03), (1.0, 3.0, 0.9, 2.1)
    wall, found = image([whole], *(reveals(h) for h in holes), post, through=[clear(h) for h in holes])
    (first,) = find_open(0, 0, wall, found)
    left = replace(first, width=0.96)
    right = replace(first, offset=2.04, width=0.96, height=first.height - 0.05)
    lower = replace(right, hidden=(0.0, 0.0, 0.0, 0.05))
    (window,) = without_mullions([left, lower], found)
    assert (window.sill, window.height) == (first.sill, first.height) and window.width == pytest.approx(2.0)
    assert len(without_mullions([left, right], found)) == 2


@pytest.mark.parametrize(("depth", "number"), [(0.0, 2), (0.012, 2), (0.03, 1)])
def test_where_things_hide_the_wall_beside_windows_a_mullion_stands_back_more(depth: float, number: int) -> None:
    holes = [(1.0, 1.96, 0.9, 2.1), (2.04, 3.0, 0.9, 2.1)]
    post, whole = sheet((1.96, 2.04, 0.9, 2.1), depth), (1.0, 3.0, 0.9, 2.1)
    _, found = image([whole], *(reveals(h) for h in holes), post, through=[clear(h) for h in holes])
    wall, single = image([holes[0]], reveals(holes[0]), through=[clear(holes[0])])
    (first,) = find_open(0, 0, wall, single)
    windows = [first, replace(first, offset=2.04)]
    hidden = replace(found, on_face=found.on_face & (found.along > 1.0) & (found.along < 3.0))
    assert len(without_mullions(windows, hidden)) == number
    assert len(without_mullions(windows, found)) == (1 if depth else 2)


def test_a_window_that_nobody_looked_through_is_told_by_its_pane() -> None:
    (found,) = found_in([WINDOW], reveals(WINDOW), pane(WINDOW))
    assert found.kind == "window"
    assert sides(found) == pytest.approx(WINDOW, abs=0.01)
    assert found.looked_through == 0.0


def test_a_solid_niche_is_no_window() -> None:
    assert not found_in([WINDOW], reveals(WINDOW), sheet(WINDOW, 0.1))


def test_seven_centimetres_of_wall_part_two_windows() -> None:
    above = (1.0, 1.8, 1.47, 2.2)
    below = (1.0, 1.8, 0.7, 1.4)
    found = found_in(
        [above, below], reveals(above), reveals(below), pane(above), pane(below), through=[clear(above), clear(below)]
    )
    first, second = sorted(found, key=lambda o: -o.sill)
    assert sides(first) == pytest.approx(above, abs=0.012)
    assert sides(second) == pytest.approx(below, abs=0.012)


def test_the_panes_of_one_window_with_a_mullion_behind_the_face_are_one_window() -> None:
    halves = [(1.1, 1.5, 1.0, 2.0), (1.7, 2.1, 1.0, 2.0)]
    mullion = sheet((1.5, 1.7, 0.97, 2.03), 0.1)
    (found,) = found_in([WINDOW], reveals(WINDOW), pane(WINDOW), mullion, through=halves)
    assert sides(found) == pytest.approx(WINDOW, abs=0.01)


def test_a_window_ends_where_a_closed_leaf_stands_beside_it() -> None:
    both = (1.0, 3.0, 0.1, 2.1)
    window, leaf = (1.0, 2.0, 0.1, 2.1), (2.0, 3.0, 0.1, 2.1)
    (found,) = found_in([both], reveals(both), pane(window), sheet(leaf, 0.1), through=[clear(window)])
    assert found.offset == pytest.approx(1.0, abs=0.01)
    assert found.offset + found.width == pytest.approx(2.0, abs=0.1)


def test_a_wall_without_a_face_but_rims_is_a_glass_front_and_no_opening() -> None:
    front = (0.1, LENGTH - 0.1, 0.05, HEIGHT - 0.1)
    assert not found_in([front], pane(front), through=[clear(front)])


def test_a_pane_from_the_floor_to_a_door_s_height_is_a_glazed_door() -> None:
    (found,) = found_in([DOORWAY], reveals(DOORWAY), pane(DOORWAY), through=[clear(DOORWAY)])
    assert (found.kind, found.state, found.glazed, found.leaves) == ("door", "closed", True, 1)


def test_a_doorway_with_nothing_in_it_is_an_open_door() -> None:
    (found,) = found_in([DOORWAY], reveals(DOORWAY, 0.28), through=[DOORWAY])
    assert (found.kind, found.state, found.glazed) == ("door", "open", None)
    assert sides(found) == pytest.approx(DOORWAY, abs=0.01)


@pytest.mark.parametrize(("seen", "doors"), [(0.1, 1), (1.0, 0)], ids=["a leaf's edge", "a wall that goes on"])
def test_what_little_was_seen_of_an_inner_walls_other_face_does_not_close_a_doorway(seen: float, doors: int) -> None:
    wall, here = image([DOORWAY], reveals(DOORWAY, 0.28), through=[DOORWAY])
    other = np.zeros(here.faces.shape[1:], np.int32)
    left, right, bottom, top = (round(x / PIXEL) for x in DOORWAY)
    rows, every = slice(bottom, top), round(1 / seen)
    other[rows, left - 8 : right + 8][:, ::every] = 1
    behind = here.behind.copy()
    behind[1][rows, left:right] = 2 * (doors > 0)
    inner = replace(here, faces=np.stack([here.faces[0], other]), behind=behind)
    found = find_open(0, 0, replace(wall, right=(1,), thickness_sigma=0.002, faces=2), inner)
    assert len(found) == doors


def board(hole: Hole, thickness: float, proud: float = 0.04) -> F64:
    """Points on the front of a window board below a hole, and on its upper side."""
    left, right, bottom, _ = hole
    return np.concatenate([sheet((left - 0.05, right + 0.05, bottom - thickness, bottom), -proud, STEP / 2)])


def test_an_opening_ends_below_the_window_board_that_lies_on_it() -> None:
    (found,) = found_in([WINDOW], reveals(WINDOW), pane(WINDOW), board(WINDOW, 0.03), through=[clear(WINDOW)])
    assert found.sill == pytest.approx(WINDOW[2] - 0.03, abs=0.006)


def test_a_radiator_below_a_window_is_no_board() -> None:
    low = (WINDOW[0], WINDOW[1], WINDOW[2] - 0.1, WINDOW[3])
    (found,) = found_in([WINDOW], reveals(WINDOW), pane(WINDOW), board(low, 0.6), through=[clear(WINDOW)])
    assert found.sill == pytest.approx(WINDOW[2], abs=0.006)


def blank(hole: Hole, *inside: F64) -> list[OpeningShape]:
    """Found in a cloud without positions of the scanner, in which nothing was scanned in a hole and behind it."""
    wall, found = image([hole], *inside)
    rows = slice(round(hole[2] / PIXEL), round(hole[3] / PIXEL))
    found.blank[rows, round(hole[0] / PIXEL) : round(hole[1] / PIXEL)] = True
    return find_open(0, 0, wall, replace(found))


def test_a_window_whose_panes_returned_nothing_is_told_by_its_reveals() -> None:
    (found,) = blank(WINDOW, reveals(WINDOW))
    assert found.kind == "window"
    assert sides(found) == pytest.approx(WINDOW, abs=0.01)
    assert found.looked_through == 0.0


def test_a_place_that_something_hid_is_no_window() -> None:
    assert not blank(WINDOW)
    assert not blank((1.0, 2.8, 0.0, 0.8))


def test_the_bar_of_a_window_whose_side_a_curtain_hides_is_found() -> None:
    left, right, bottom, top = wide = (1.0, 2.6, 0.9, 2.1)
    halves = [(left, 1.8, bottom, top), (1.8, right, bottom, top)]
    panes = [(a + 0.1, b - 0.1, bottom + 0.1, top - 0.1) for a, b, *_ in halves]
    parts = np.concatenate([reveals(wide), *(pane(half, 0.1) for half in halves)])
    curtain = (right - 0.2, right + 0.3, 0.0, HEIGHT)
    panes[1] = (1.9, right - 0.2, *panes[1][2:])
    wall, picture = image([wide, curtain], parts[parts[:, 0] < right - 0.2], through=panes)
    (found,) = find_open(0, 0, wall, picture)
    assert found.hidden[1] > 0.3
    assert found.bars == pytest.approx((1.8,), abs=0.02)


def test_two_windows_whose_pier_a_curtain_hides_are_two() -> None:
    first, second = (0.8, 2.0, 0.9, 2.1), (2.1, 3.3, 0.9, 2.1)
    parts = np.concatenate([reveals(first), pane(first), reveals(second), pane(second)])
    seen = parts[(parts[:, 0] < 1.97) | (parts[:, 0] > 2.13)]
    wall, picture = image([first, second, (1.97, 2.13, 0.0, HEIGHT)], seen, through=[clear(first), clear(second)])
    assert len(find_open(0, 0, wall, picture)) == 2


def test_the_upper_part_of_a_window_below_another_one_is_a_window() -> None:
    above, below = (1.0, 1.6, 1.2, 2.2), (1.0, 1.6, 0.3, 1.1)
    parts = np.concatenate([reveals(above), pane(above), reveals(below), pane(below)])
    shown = (1.1, 1.5, 0.95, 1.05)
    hidden_part = (0.9, 1.7, 0.0, 0.93)
    seen = parts[parts[:, 2] > 0.93]
    wall, picture = image([above, below, hidden_part], seen, through=[clear(above), shown])
    assert [o.offset for o in find_open(0, 0, wall, picture)] == pytest.approx([1.0, 1.0], abs=0.01)
    alone, lonely = image([below, hidden_part], seen[seen[:, 2] < 1.15], through=[shown])
    assert not find_open(0, 0, alone, lonely)


def test_a_window_whose_panes_returned_nothing_is_told_by_its_frame() -> None:
    left, right, bottom, top = WINDOW
    ring = sheet(WINDOW, 0.1)
    x, z = ring[:, 0], ring[:, 2]
    inner = (x > left + 0.07) & (x < right - 0.07) & (z > bottom + 0.07) & (z < top - 0.07)
    (found,) = blank(WINDOW, ring[~inner])
    assert sides(found) == pytest.approx(WINDOW, abs=0.015)


def test_pulses_that_a_dark_curtain_swallowed_do_not_widen_a_window_whose_side_was_seen() -> None:
    hidden = (WINDOW[1], WINDOW[1] + 0.5, WINDOW[2], WINDOW[3])
    curtained = (hidden[0] + 0.01, *hidden[1:])
    wall, found = image([WINDOW, curtained], reveals(WINDOW), pane(WINDOW), through=[clear(WINDOW), hidden])
    rows = slice(round(hidden[2] / PIXEL), round(hidden[3] / PIXEL))
    found.lost[rows, round(hidden[0] / PIXEL) : round(hidden[1] / PIXEL)] = True
    (window,) = find_open(0, 0, wall, found)
    assert sides(window) == pytest.approx(WINDOW, abs=0.02)
    found.lost[:] = False
    assert find_open(0, 0, wall, found)[0].width > WINDOW[1] - WINDOW[0] + 0.2


def test_a_part_of_a_glass_front_is_no_window() -> None:
    beside = [(WINDOW[1], WINDOW[1] + 0.4, 0.0, HEIGHT)]
    assert found_in([WINDOW], reveals(WINDOW), through=[clear(WINDOW)])
    assert not found_in([WINDOW], reveals(WINDOW), through=[clear(WINDOW), *beside])


@pytest.mark.parametrize(("depth", "number"), [(0.0, 2), (0.015, 1), (0.06, 1)])
def test_windows_that_a_mullion_parts_are_one_and_such_that_a_pier_parts_are_two(depth: float, number: int) -> None:
    holes = [(1.0, 1.96, 0.9, 2.1), (2.04, 3.0, 0.9, 2.1)]
    post = sheet((1.96, 2.04, 0.9, 2.1), depth)
    found = found_in([(1.0, 3.0, 0.9, 2.1)], *(reveals(h) for h in holes), post, through=[clear(h) for h in holes])
    assert [o.kind for o in found] == ["window"] * number
    assert max(o.offset + o.width for o in found) == pytest.approx(3.0, abs=0.02)
    if number == 1:
        assert found[0].width == pytest.approx(2.0, abs=0.03) and found[0].bars == pytest.approx((2.0,), abs=0.02)
