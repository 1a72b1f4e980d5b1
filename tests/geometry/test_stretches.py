import numpy as np
import pytest

from scan2bim.geometry.stretches import covered_length


def test_what_is_covered_does_not_depend_on_where_steps_begin() -> None:
    places = np.concatenate([np.arange(0.0, 1.0, 0.05), [3.0]])
    for shift in np.arange(0, 0.05, 0.007):
        assert covered_length(places + shift, 0.05) == pytest.approx(1.05)


def test_nothing_covers_nothing() -> None:
    assert covered_length(np.zeros(0), 0.05) == 0.0
