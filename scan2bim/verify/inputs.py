"""What a verification works on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.model.elements import Building


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What a verification works on. transform, placing and fitted as in ``verification.VerifyRequest``."""

    model: Path
    scan_folders: tuple[Path, ...]
    surfel_folder: Path
    frame: SurveyFrame
    building: Building | None
    transform: tuple[tuple[float, ...], ...] | None
    placing: str
    fitted: bool
