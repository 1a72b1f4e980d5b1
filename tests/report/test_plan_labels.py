"""Words in a plan stand where nothing else does."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import door, wall

from scan2bim.model.elements import Wall
from scan2bim.report.plan_symbols import opening_label
from scan2bim.report.sheet import View


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
