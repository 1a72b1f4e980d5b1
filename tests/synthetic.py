"""Scenes with exact truth for the tests of all folders: ``from synthetic import scanned, two_rooms``.

The scenes are those of ``scan2bim.simulate``; casting works with and without open3d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.e57 import write_e57
from scan2bim.simulate.scanner import ScannerSpec, Sweep, cast_all
from scan2bim.simulate.scene import Scene
from scan2bim.simulate.scenes import l_shaped, rotated_flat, two_rooms, two_storeys
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.io import write_truth
from scan2bim.truth.values import Truth

__all__ = ["Scanned", "l_shaped", "rotated_flat", "scanned", "two_rooms", "two_storeys", "write_scene"]

FINE = ScannerSpec(step=math.radians(0.5))
"""2.6 cm between points at 3 m, 216,000 rays a station: as dense as tests need."""
COARSE = ScannerSpec(step=math.radians(1.0))
"""54,000 rays a station: for what only has to run."""


@dataclass(frozen=True, slots=True, eq=False)
class Scanned:
    """A scene with its truth and a sweep from each station."""

    scene: Scene
    truth: Truth
    sweeps: tuple[Sweep, ...]

    def points(self) -> NDArray[np.float64]:
        """All points in scan coordinates, (n, 3)."""
        return np.concatenate([sweep.world() for sweep in self.sweeps])

    def colours(self) -> NDArray[np.uint8]:
        """(n, 3) as ``points``."""
        return np.concatenate([sweep.rgb for sweep in self.sweeps])

    def positions(self) -> NDArray[np.float64]:
        """The scanner's positions in scan coordinates, (stations, 3)."""
        return np.array([sweep.translation for sweep in self.sweeps])


@cache
def scanned(scene: Scene, spec: ScannerSpec = FINE, seed: int = 0) -> Scanned:
    """The scene scanned from all its stations; kept, since several tests look at the same."""
    return Scanned(scene, truth_of(scene), tuple(cast_all(scene, spec, seed)))


def write_scene(folder: Path, scene: Scene, spec: ScannerSpec = COARSE, seed: int = 0) -> Scanned:
    """Write one E57 a station and ``truth.json`` to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    result = scanned(scene, spec, seed)
    for sweep in result.sweeps:
        write_e57(folder / f"{sweep.name}.e57", [sweep])
    write_truth(folder / "truth.json", result.truth)
    return result
