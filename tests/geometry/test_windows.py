"""Windows along arrays."""

from __future__ import annotations

import numpy as np
import pytest

from scan2bim.geometry.windows import windows


def test_a_window_holds_a_place_and_its_neighbours_mirrored_at_the_ends() -> None:
    assert windows(np.array([1, 2, 3, 4]), 3).tolist() == [[1, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 4]]
    assert windows(np.array([1, 2]), 5).tolist() == [[2, 1, 1, 2, 2], [1, 1, 2, 2, 1]]


@pytest.mark.parametrize("axis", [0, 1])
def test_windows_go_along_an_axis(axis: int) -> None:
    values = np.arange(12.0).reshape(3, 4)
    means = windows(values, 3, axis).mean(axis=-1)
    assert means.shape == values.shape
    assert means[1, 1] == pytest.approx(5.0)
    assert np.moveaxis(means, axis, 0)[0, 0] == pytest.approx((0.0 + 0.0 + values.take(1, axis)[0]) / 3)
