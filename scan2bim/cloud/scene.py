"""What the read and surfel stages left of a set of scans, as later stages use it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.panorama import Panorama, agreement
from scan2bim.cloud.surfels import Surfels

TRUST = 0.5
"""Share of its neighbourhood that must agree with a surfel: half, as for the edge of a surface."""


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
    """Read surfels and panoramas, and part the surfels by whether their own station's surroundings bear them out."""
    summaries = [ScanSummary.load(f) for f in scan_folders]
    last = max((s.station + len(s.sources) for s in summaries), default=0)
    stations = np.full((last + 1, 3), np.nan)
    panoramas: dict[int, Panorama] = {}
    for summary, folder in zip(summaries, scan_folders, strict=True):
        if summary.position is not None:
            stations[summary.station] = summary.position
            panoramas[summary.station] = Panorama.load(folder / "panorama.npz")
    trusted: list[Surfels] = []
    doubtful: list[Surfels] = []
    for block in Surfels.blocks(surfel_folder):
        agrees = agreement(block.xyz, block.station, panoramas) >= TRUST
        trusted.append(block.pick(agrees))
        doubtful.append(block.pick(~agrees))
    return Scene(Surfels.joined(trusted), Surfels.joined(doubtful), panoramas, stations)
