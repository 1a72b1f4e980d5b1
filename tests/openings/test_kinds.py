"""What openings are: hatches, glass partitions, windows that reach low, windows with a blind half down."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from modelled import Modelled, modelled, rectangle_of, rectangle_overlap
from synthetic import Scanned, scanned, two_rooms

from scan2bim.openings.shapes import OpeningShape
from scan2bim.simulate.effects import Glass
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Box, Scene, WindowSpec

SPEC = ScannerSpec(step=math.radians(0.5), dropout=0.02, glass=Glass(0.3, 0.05))
MIDDLE = (
    WindowSpec("hatch", 0.3, sill=1.0, width=0.8, height=0.6, frame=0.001),
    WindowSpec("partition", 2.6, sill=0.05, width=1.4, height=2.2, frame=0.05, pane=True),
)
SOUTH = (WindowSpec("low window", 5.2, sill=0.1, width=1.4, height=2.2, pane=True),)
NORTH = (
    WindowSpec("window with a blind", 5.2, width=1.4, pane=True),
    WindowSpec("niche", 1.5, sill=0.8, width=0.8, height=1.0, frame=0.001),
)
BLIND = Box("blind", (8.4 - 5.9, 4.3 + 0.02), (1.3, 0.02, 0.7), base=1.45, colour=(220, 220, 210))
BACK = Box("back of the niche", (8.4 - 1.9, 4.3 + 0.1), (0.8, 0.1, 1.0), base=0.8, colour=(235, 233, 228))
STREET = (
    Box("street", (4.0, 2.0), (40.0, 40.0, 0.1), base=-0.4),
    Box("house to the south", (4.0, -7.0), (30.0, 0.5, 7.0), base=-0.3),
    Box("house to the north", (4.0, 13.0), (30.0, 0.5, 7.0), base=-0.3),
)


def scene() -> Scene:
    whole = two_rooms(0.4)
    (storey,) = whole.storeys
    windows = {"middle wall": MIDDLE}
    for wall in storey.walls:
        for window in wall.windows:
            windows[wall.name] = SOUTH if window.name == "east window" else NORTH
    walls = tuple(dataclasses.replace(w, windows=windows.get(w.name, w.windows)) for w in storey.walls)
    storey = dataclasses.replace(storey, walls=walls, boxes=(*storey.boxes, BLIND, BACK, *STREET))
    return dataclasses.replace(whole, storeys=(storey,))


@cache
def scan() -> tuple[Scanned, Modelled]:
    return scanned(scene(), SPEC), modelled(scene(), SPEC)


def found(name: str) -> tuple[float, OpeningShape]:
    """The found opening that overlaps most with a true one, and how much."""
    truth, model = scan()
    (corners,) = [np.array(w.corners) for w in truth.truth.windows if w.name == name]
    scored = [(rectangle_overlap(corners, rectangle_of(o, model)), o) for o in model.openings]
    return max(scored, key=lambda pair: pair[0])


@pytest.mark.parametrize("name", ["hatch", "partition", "low window", "window with a blind"])
def test_each_has_the_size_of_the_opening_in_the_wall(name: str) -> None:
    assert found(name)[0] > 0.9


def test_a_hole_in_an_inner_wall_without_frame_and_pane_is_an_opening_without_fill() -> None:
    _, hatch = found("hatch")
    assert hatch.kind == "passage"
    assert hatch.sill == pytest.approx(1.0, abs=0.02)


def test_a_wide_pane_down_to_the_floor_in_an_inner_wall_is_a_window_and_no_passage() -> None:
    assert found("partition")[1].kind == "window"


def test_a_window_over_a_strip_of_wall_is_no_door_though_it_is_as_high() -> None:
    _, window = found("low window")
    assert window.kind == "window"
    assert window.sill == pytest.approx(0.1, abs=0.02)


def test_a_blind_that_is_half_down_does_not_end_the_window() -> None:
    assert found("window with a blind")[1].kind == "window"


def test_neither_a_niche_nor_anything_else_is_found() -> None:
    truth, model = scan()
    there = [t for t in (*truth.truth.doors, *truth.truth.windows) if t.name != "niche"]
    corners = [np.array(t.corners) for t in there]
    for opening in model.openings:
        assert max(rectangle_overlap(c, rectangle_of(opening, model)) for c in corners) > 0.5, opening
