"""What the read and surfel stages left of a set of scans, as later stages use it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import load_panoramas, load_stations
from scan2bim.cloud.lattice import Lattice
from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.surfels import Surfels


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Trusted surfels, and ``doubtful`` ones that their own station's surroundings do not bear out; ``panoramas`` by
    station number; ``stations`` (s, 3) positions by station number, nan where unknown; ``lattice`` of the surfels.
    """

    surfels: Surfels
    doubtful: Surfels
    panoramas: dict[int, Panorama]
    stations: NDArray[np.float64]
    lattice: Lattice = field(default_factory=Lattice)

    def in_lattice(self) -> Scene:
        """The same in the lattice's own coordinates."""
        lattice = self.lattice
        if lattice == Lattice():
            return self

        def turned(surfels: Surfels) -> Surfels:
            return replace(surfels, xyz=lattice.own(surfels.xyz).astype(np.float32))

        panoramas = {number: panorama.turned(lattice) for number, panorama in self.panoramas.items()}
        return replace(
            self,
            surfels=turned(self.surfels),
            doubtful=turned(self.doubtful),
            panoramas=panoramas,
            stations=lattice.own(self.stations),
        )


def load_scene(surfel_folder: Path, scan_folders: Sequence[Path]) -> Scene:
    """Read surfels and panoramas; the stages one after the other get the same."""
    changed = (surfel_folder / "surfels.bin").stat().st_mtime_ns
    return _load(surfel_folder, tuple(scan_folders), changed)


@lru_cache(maxsize=1)
def _load(surfel_folder: Path, scan_folders: tuple[Path, ...], changed: int) -> Scene:
    del changed
    return Scene(
        Surfels.load(surfel_folder, trusted=True),
        Surfels.load(surfel_folder, trusted=False),
        load_panoramas(scan_folders),
        load_stations(scan_folders),
        Lattice.load(surfel_folder),
    )
