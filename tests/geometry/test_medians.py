from __future__ import annotations

import numpy as np
import pytest

from scan2bim.geometry.medians import FEW, median


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 2, FEW - 1, FEW, FEW + 1, 5_000])
def test_the_median_is_numpys_to_the_last_bit(kind: type, count: int) -> None:
    draw = np.random.default_rng(count)
    values = draw.normal(0, 1, count)
    for case in (values, np.round(values, 1), values**9, np.sort(values), np.full(count, 3.0)):
        assert median(case.astype(kind)) == np.median(case.astype(kind))


def test_two_values_far_apart_leave_the_bins_between_them_empty() -> None:
    values = np.repeat([0.0, 1000.0], FEW)
    assert median(values) == 500.0


def test_there_is_no_median_of_nothing() -> None:
    assert np.isnan(median(np.zeros(0)))
