"""What the read and surfel stages left of a set of scans, as later stages use it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import ScanSummary, load_panoramas
from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.surfels import Surfels


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Trusted surfels, and ``doubtful`` ones that their own station's surroundings do not bear out; ``panoramas`` by
    station number; ``stations`` (s, 3) positions by station number, nan where unknown.
    """

    surfels: Surfels
    doubtful: Surfels
    panoramas: dict[int, Panorama]
    stations: NDArray[np.float64]


def load_scene(surfel_folder: Path, scan_folders: Sequence[Path]) -> Scene:
    """Read surfels and panoramas; the stages one after the other get the same."""
    changed = (surfel_folder / "surfels.bin").stat().st_mtime_ns
    return _load(surfel_folder, tuple(scan_folders), changed)


@lru_cache(maxsize=1)
def _load(surfel_folder: Path, scan_folders: tuple[Path, ...], changed: int) -> Scene:
    del changed
    summaries = [ScanSummary.load(f) for f in scan_folders]
    last = max((s.station + len(s.sources) for s in summaries), default=0)
    stations = np.full((last + 1, 3), np.nan)
    for summary in summaries:
        if summary.position is not None:
            stations[summary.station] = summary.position
    return Scene(
        Surfels.load(surfel_folder, trusted=True),
        Surfels.load(surfel_folder, trusted=False),
        load_panoramas(scan_folders),
        stations,
    )
