"""The labelled voxels of a storey, after the founding paper's section IV, as whoever has the scans gives them to an
exporter that wants them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from scan2bim.model.elements import Building


class Label(IntEnum):
    """Of a voxel. From 1 to 3 it is occupied: points lie in it; NONE is outside of all spaces, or inside of a wall."""

    NONE = 0
    CLUTTER = 1
    STRUCTURE = 2
    OUTLIER = 3
    OCCLUDED_CLUTTER = 4
    OCCLUDED_STRUCTURE = 5
    EMPTY = 6
    OPENING = 7

    @property
    def words(self) -> str:
        """The paper's name."""
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True, slots=True, eq=False)
class VoxelGrid:
    """The labels of a storey.

    labels (layers, rows, columns) uint8, layers upwards. origin (3,) local metres of the lower left corner; columns
    run along the direction ``yaw`` (radians from local x), rows to the left of it; size: a voxel's edge, metres. told:
    False where no scanner positions are known, so that what is not occupied counts as occluded.
    """

    storey: str
    name: str
    origin: NDArray[np.float64]
    yaw: float
    size: float
    labels: NDArray[np.uint8]
    told: bool

    def layer_at(self, height: float) -> int:
        """The layer at a height (local z), or the nearest."""
        layer = int(np.floor((height - self.origin[2]) / self.size))
        return min(max(layer, 0), self.labels.shape[0] - 1)


VoxelSource: TypeAlias = Callable[[Building], Iterator[VoxelGrid]]
"""The labelled voxels of the building's storeys, one after the other, lowest first; those without spaces left out."""
