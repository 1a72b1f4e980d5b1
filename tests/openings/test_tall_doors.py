"""Doors as high as the room: no lintel tells them, and their leaves reach the ceiling as walls do."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from modelled import Modelled, modelled, rectangle_of, rectangle_overlap
from synthetic import Scanned, rotated_flat, scanned

from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Scene

SPEC = ScannerSpec(step=math.radians(0.7))


def tall_doors(top: float = 2.519) -> Scene:
    """The flat with all doors as high as its rooms: open, ajar, and closed, flush on one side, or 12 cm deep."""
    flat = rotated_flat()
    (storey,) = flat.storeys
    walls = tuple(
        dataclasses.replace(w, doors=tuple(dataclasses.replace(d, height=top, casing=0.0) for d in w.doors))
        for w in storey.walls
    )
    return dataclasses.replace(flat, storeys=(dataclasses.replace(storey, walls=walls),))


@pytest.fixture(scope="module")
def truth() -> Scanned:
    return scanned(tall_doors(), SPEC)


@pytest.fixture(scope="module")
def model() -> Modelled:
    return modelled(tall_doors(), SPEC)


def test_every_door_as_high_as_the_room_is_found_in_its_state_and_no_other(model: Modelled, truth: Scanned) -> None:
    for door in (d for d in truth.truth.doors if d.state != "passage"):
        corners = np.array(door.corners)
        found = max(model.openings, key=lambda o: rectangle_overlap(corners, rectangle_of(o, model)))
        assert rectangle_overlap(corners, rectangle_of(found, model)) > 0.9, door.name
        assert (found.kind, found.state) == ("door", door.state), door.name
    assert sum(o.kind == "door" for o in model.openings) == sum(d.state != "passage" for d in truth.truth.doors)


def test_leaves_as_high_as_the_room_are_no_walls_and_part_no_space(model: Modelled, truth: Scanned) -> None:
    assert len(model.walls) == len(truth.truth.walls)
    areas = sorted(p.area for p in model.spaces)
    assert areas == pytest.approx(sorted(s.area for s in truth.truth.spaces), rel=0.01)
