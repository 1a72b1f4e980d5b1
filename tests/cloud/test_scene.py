from __future__ import annotations

import numpy as np
from modelled import merged_scan, model_of, modelled, scan_of
from synthetic import COARSE, scanned, two_rooms


def test_nearly_all_points_of_a_scan_of_bare_surfaces_are_trusted() -> None:
    result = scanned(two_rooms(0.4), COARSE)
    cloud = modelled(two_rooms(0.4), COARSE).cloud
    assert cloud.surfels.count.sum() > 0.97 * len(result.points())


def test_the_panoramas_stand_where_the_scanner_stood() -> None:
    result, model = scanned(two_rooms(0.4), COARSE), modelled(two_rooms(0.4), COARSE)
    np.testing.assert_allclose(model.cloud.stations, result.positions(), atol=1e-5)
    assert sorted(model.cloud.panoramas) == [0, 1]
    for number, panorama in model.cloud.panoramas.items():
        np.testing.assert_allclose(panorama.position, result.positions()[number], atol=1e-5)


def test_a_scan_without_position_lies_beside_those_with_one() -> None:
    result = scanned(two_rooms(0.4), COARSE)
    cloud = model_of([merged_scan(result.sweeps[0].world()), scan_of(result.sweeps[1])]).cloud
    assert np.isnan(cloud.stations[0]).all()
    assert sorted(cloud.panoramas) == [1]
    assert set(np.unique(cloud.surfels.station).tolist()) == {0, 1}
