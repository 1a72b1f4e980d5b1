"""The model's own JSON file."""

from __future__ import annotations

from pathlib import Path

from scan2bim.model.elements import Building
from scan2bim.model.io import dump_building


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Writes the whole model, lossless; there is never anything to leave out."""
    path.write_bytes(dump_building(building).encode())
    return ()
