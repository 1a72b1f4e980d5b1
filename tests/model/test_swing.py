"""Leaves turn until they meet something."""

from __future__ import annotations

import math

import pytest
from buildings import door, measured, wall

from scan2bim.model.elements import Door, Storey
from scan2bim.model.shapes import LEAF_GAP, door_leaves
from scan2bim.model.swing import OPEN_LIMIT, Obstacles


@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("hinge", ["start", "end"])
@pytest.mark.parametrize(("recess", "limit"), [(0.0, OPEN_LIMIT), (0.015, math.pi / 2 + math.atan2(LEAF_GAP, 0.015))])
def test_a_leaf_behind_the_wall_s_face_stops_at_the_edge_of_its_opening(swing, hinge, recess, limit):
    hung = door("x", 1.0, state="closed", hinge_side=hinge, swing_side=swing)
    assert isinstance(hung.fill, Door)
    fill = hung.fill.model_copy(update={"recess": measured(recess), "recess_side": swing})
    opening = hung.model_copy(update={"fill": fill})
    host = wall("x", (0, 0), (4, 0), 0.2, 0.0, openings=(opening,))
    obstacles = Obstacles(Storey(id="s", name="S", elevation=measured(0.0), walls=(host,)))
    (leaf,) = door_leaves(host, opening)
    assert obstacles.swing_limit(host, opening, leaf) == pytest.approx(limit, abs=1e-9)
