"""The labelled voxels of a conversion's scans, storey by storey, for exporters that want them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scan2bim.model.elements import Building
    from scan2bim.model.voxels import VoxelGrid
    from scan2bim.stages import Folders


def labelled_voxels(folders: Folders, building: Building) -> Iterator[VoxelGrid]:
    """Those of all storeys that have spaces; one storey is in memory at a time."""
    from scan2bim.cloud.scene import load_scene
    from scan2bim.coverage.voxels import label_storeys

    return label_storeys(building, load_scene(folders.surfels, folders.scans))
