"""Words in a plan stand where nothing else does."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import YAW, door, measured, wall

from scan2bim.model.elements import Building, Frame, Storey, Wall
from scan2bim.report.plan import storey_sheet
from scan2bim.report.plan_labels import opening_labels
from scan2bim.report.plan_symbols import opening_label
from scan2bim.report.sheet import Shape, Text, View


def test_sizes_stand_off_each_other_names_and_scanners():
    openings = tuple(door(str(k), 1.0 + 0.05 * k, 1.0, hinge_side="start", swing_side="right") for k in range(3))
    host = wall("w", (0.0, 0.0), (6.0, 0.0), 0.2, 0.0, openings=openings)
    host = host.model_copy(update={"start": (0.0, 0.0), "end": (6.0, 0.0)})
    view = View(100.0, 0.0, 500.0)
    free = [label.y for label in opening_labels(view, [(host, o) for o in openings], [], [])]
    assert min(np.diff(sorted(free))) >= 10.0
    first = next(iter(opening_labels(view, [(host, openings[0])], [], [])))
    name = Text(first.x, first.y, "Hall", 18.0, (0, 0, 0), "middle")
    moved = next(iter(opening_labels(view, [(host, openings[0])], [name], [])))
    assert abs(moved.y - name.y) > 10.0
    scanner = (first.x / 100.0, (500.0 - first.y) / 100.0, 1.5)
    assert abs(next(iter(opening_labels(view, [(host, openings[0])], [], [scanner]))).y - first.y) > 8.0


def test_all_of_a_plan_is_on_its_sheet_though_lengths_of_the_whole_reach_past_its_corners():
    corners = [(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (14.0, 6.0), (14.0, 9.0), (0.0, 9.0)]
    outer = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    walls = tuple(
        wall(str(k), start, end, 0.3, 0.0).model_copy(update={"left_spaces": ("a",), "external": True})
        for k, (start, end) in enumerate(outer)
    )
    storey = Storey(id="s", name="S", elevation=measured(0.0), walls=walls)
    sheet = storey_sheet(storey, Building(id="b", name="B", storeys=(storey,), frame=Frame(yaw=YAW)))
    drawn = np.concatenate([ring for mark in sheet.marks if isinstance(mark, Shape) for ring in mark.rings])
    assert drawn.min() >= 0.0
    assert drawn[:, 0].max() <= sheet.width and drawn[:, 1].max() <= sheet.height


def labelled(swing: str, external: bool) -> float:
    """Metres to the wall's left at which a door's label stands."""
    opening = door("d", 2.0, 1.0, hinge_side="start", swing_side=swing)
    made = wall("w", (0.0, 0.0), (6.0, 0.0), 0.2, 0.0, openings=(opening,))
    spaces: dict[str, object] = {"left_spaces": ("a",), "right_spaces": () if external else ("b",)}
    host: Wall = made.model_copy(update={"start": (0.0, 0.0), "end": (6.0, 0.0), "external": external, **spaces})
    view = View(100.0, 0.0, 0.0)
    label = opening_label(view, host, opening)
    return -(label.y - view.page(np.zeros((1, 2)))[0][1]) / view.scale


@pytest.mark.parametrize(
    ("swing", "external", "low", "high"),
    [
        ("left", True, 1.1, 1.4),  # inside, beyond the quarter circle
        ("right", True, 0.1, 0.4),  # inside, beside the wall
        ("left", False, -0.4, -0.1),
        ("right", False, 0.1, 0.4),
    ],
)
def test_a_doors_size_is_off_lengths_and_leaf(swing: str, external: bool, low: float, high: float):
    assert low < labelled(swing, external) < high
