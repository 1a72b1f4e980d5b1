"""The labelled voxels of all storeys as a numpy archive (``.voxels.npz``).

``numpy.load(path)`` gives, for each storey with spaces: ``storey_N/labels`` (layers, rows, columns) uint8, layers
upwards; ``storey_N/origin`` (3,) float64, the grid's lower left corner in scan coordinates (metres, z up); ``storey_N/
yaw``, radians from x to the direction of the columns, rows run to the left of it; ``storey_N/size``, a voxel's edge,
metres; ``storey_N/name`` and ``storey_N/id``, those of the model. ``label_names`` (8,) has the labels' names by value,
``version`` that of this form.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from scan2bim.errors import UsageError
from scan2bim.model.elements import Building
from scan2bim.model.voxels import Label, VoxelSource

ONLY_BY_NAME: Final = True
"""Rays are cast for it: a folder of all formats does not get this one."""
VERSION: Final = 1
_TIME: Final = (1980, 1, 1, 0, 0, 0)  # the oldest that the format knows: equal models give equal files
UNTOLD: Final = "Without scanner positions empty voxels cannot be told from occluded ones; none is called empty."


def export(building: Building, path: Path, voxels: VoxelSource | None) -> tuple[str, ...]:
    """Write the archive, storey by storey. Raises UsageError without scans, OSError."""
    if voxels is None:
        raise UsageError(f"{path.name}: labelled voxels need the scans. Convert from them, not from a model.")
    notes: list[str] = []
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        _write(archive, "version", np.int64(VERSION))
        _write(archive, "label_names", np.array([label.words for label in Label]))
        numbers = {storey.id: number for number, storey in enumerate(building.storeys)}
        for grid in voxels(building):
            prefix = f"storey_{numbers[grid.storey]}"
            _write(archive, f"{prefix}/labels", grid.labels)
            _write(archive, f"{prefix}/origin", grid.origin + np.array(building.frame.shift))
            _write(archive, f"{prefix}/yaw", np.float64(grid.yaw))
            _write(archive, f"{prefix}/size", np.float64(grid.size))
            _write(archive, f"{prefix}/name", np.array(grid.name))
            _write(archive, f"{prefix}/id", np.array(grid.storey))
            notes += [] if grid.told else [UNTOLD]
    return tuple(dict.fromkeys(notes))


def _write(archive: zipfile.ZipFile, name: str, value: ArrayLike) -> None:
    info = zipfile.ZipInfo(f"{name}.npy", _TIME)
    info.compress_type = zipfile.ZIP_DEFLATED
    with archive.open(info, "w", force_zip64=True) as file:
        np.lib.format.write_array(file, np.asarray(value), allow_pickle=False)
