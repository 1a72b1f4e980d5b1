"""Doors that hang otherwise than drawn, and scans that the others vouch for."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.model.elements import Door, ScanResidual
from scan2bim.verify.hanging import Hanging, built_hanging, difference
from scan2bim.verify.place import is_vouched_for

ALONG, LEFT = np.array([1.0, 0.0]), np.array([0.0, 1.0])
DRAWN = Hanging(-ALONG, LEFT)


def door(angle: float, hinge: str, swing: str) -> Door:
    return Door.model_validate(
        {"id": "d", "name": "", "confidence": 0.9, "angle": angle, "hinge_side": hinge, "swing_side": swing}
    )


@pytest.mark.parametrize(
    ("hinge", "swing", "words"),
    [
        ("start", "left", ""),
        ("end", "left", "hangs at the other end"),
        ("start", "right", "swings to the other side"),
        ("end", "right", "hangs at the other end and swings to the other side"),
    ],
)
def test_an_open_leaf_tells_how_it_hangs(hinge: str, swing: str, words: str) -> None:
    assert difference(DRAWN, built_hanging(door(1.2, hinge, swing), ALONG)) == words


def test_a_leaf_that_is_nearly_closed_tells_nothing() -> None:
    assert built_hanging(door(0.1, "end", "right"), ALONG) is None


@pytest.mark.parametrize(
    ("offset", "vouched"),
    [((0.001, 0.0, 0.0), True), ((0.08, 0.0, 0.0), False), ((None, 0.0, 0.0), False)],
)
def test_a_scan_off_the_model_is_vouched_for_by_scans_that_it_fits(
    offset: tuple[float | None, float, float], vouched: bool
) -> None:
    residual = ScanResidual(offset=offset, sigma=(0.001, 0.001, 0.001), rms=0.001, patches=40)
    assert is_vouched_for(np.array([0.09, 0.0, 0.0]), residual) == vouched
    assert not is_vouched_for(np.array([0.09, 0.0, 0.0]), None)
