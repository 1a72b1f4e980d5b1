"""Floors and ceilings of spaces are covered once, however the rooms above and below lie."""

from __future__ import annotations

import pytest
import shapely
from buildings import building

from scan2bim.model.plates import horizontal_patches


def test_a_ceiling_below_a_room_whose_edge_nearly_falls_together_with_its_own_is_covered_once():
    # the upper room's edge leaves the lower one's by micrometres: overlays in floating point give back the whole
    lower = ((-0.5616, -4.1003), (1.775, -4.6391), (2.6895, -0.6737), (0.3529, -0.1348))
    upper = (
        (0.3529, -0.1348),
        (-0.0231776982867888, -1.7655666621719637),
        (2.1656, -2.2706),
        (2.5419427453497976, -0.6396682425186194),
    )
    house = building()
    below, above = house.storeys
    room = below.spaces[0].model_copy(update={"id": "below", "outline": lower, "holes": ()})
    over = above.spaces[0].model_copy(update={"id": "above", "outline": upper, "holes": ()})
    storeys = (below.model_copy(update={"spaces": (room,)}), above.model_copy(update={"spaces": (over,)}))
    area = shapely.Polygon(lower)
    patches = list(horizontal_patches(house.model_copy(update={"storeys": storeys}), storeys[0], room, [area]))
    ceiling = [patch for patch in patches if patch.up]
    assert sum(patch.polygon.area for patch in ceiling) == pytest.approx(area.area, abs=1e-4)
    assert {patch.beyond for patch in ceiling} == {"above", None}
