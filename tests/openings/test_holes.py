"""Windows before the sky, in scans that do not record the pulses that never came back."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
from modelled import Modelled, model_of, rectangle_of, rectangle_overlap, scan_of
from numpy.typing import NDArray
from synthetic import scanned, two_rooms

from scan2bim.cloud.panorama import Panorama, add_hits
from scan2bim.openings.holes import holes
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.simulate.scene import Scene

F64 = NDArray[np.float64]
STEP, ROWS, COLUMNS = 0.05, 50, 80
EYE = np.array([2.0, 2.0, 1.5])


def seen(*gone: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Holes that a station finds in a wall of 4 x 2.5 m along x, of which it saw all but ``gone``: left, right, bottom
    and top.
    """
    x, z = np.meshgrid(np.arange(-1.0, 5.0, 0.01), np.arange(-1.0, 3.5, 0.01))
    x, z = x.ravel(), z.ravel()
    for left, right, bottom, top in gone:
        there = (x > left) & (x < right) & (z > bottom) & (z < top)
        x, z = x[~there], z[~there]
    ranges = np.zeros((6, 192, 192), np.float32)
    add_hits(np.column_stack([x, np.zeros_like(x), z]).astype(np.float32), EYE.astype(np.float32), ranges)
    start, along = np.zeros(2), np.array([1.0, 0.0])
    return holes(Panorama(EYE, ranges), start, along, 0.0, slice(0, COLUMNS), ROWS, STEP)


def test_a_window_of_which_no_pulse_came_back_is_a_hole() -> None:
    found = seen((1.0, 2.0, 1.0, 2.0))
    assert found[21:39, 21:39].all()
    found[19:41, 19:41] = False
    assert not found.any()


def test_what_goes_on_to_the_end_of_what_was_scanned_is_none() -> None:
    assert not seen((1.0, 2.0, -9.0, 1.0)).any()


def test_single_pulses_that_were_lost_are_none() -> None:
    assert not seen(*((x, x + 0.08, 1.0, 1.08) for x in np.arange(0.5, 3.5, 0.3))).any()


def before_the_sky(high: bool) -> Scene:
    """Two rooms with windows without frames, and ``high`` ones that reach the ceiling."""
    scene = two_rooms(0.4)
    (storey,) = scene.storeys
    walls = tuple(
        dataclasses.replace(
            wall,
            windows=tuple(
                dataclasses.replace(w, frame=0.001, height=storey.height - w.sill if high else w.height)
                for w in wall.windows
            ),
        )
        for wall in storey.walls
    )
    return dataclasses.replace(scene, storeys=(dataclasses.replace(storey, walls=walls),))


@cache
def without_misses(high: bool) -> tuple[list[F64], Modelled]:
    """The true windows' corners and what is found."""
    result = scanned(before_the_sky(high), ScannerSpec(step=math.radians(0.5)))
    scans = [scan_of(sweep) for sweep in result.sweeps]
    scans = [dataclasses.replace(s, chunk=dataclasses.replace(s.chunk, misses=None)) for s in scans]
    return [np.array(w.corners) for w in result.truth.windows], model_of(scans)


def check(high: bool) -> None:
    truth, model = without_misses(high)
    windows = [rectangle_of(o, model) for o in model.openings if o.kind == "window"]
    assert len(windows) == len(truth)
    for corners in truth:
        assert max(rectangle_overlap(corners, found) for found in windows) > 0.9


def test_windows_before_the_sky_are_found() -> None:
    check(high=False)


def test_windows_up_to_the_ceiling_are_found() -> None:
    check(high=True)
