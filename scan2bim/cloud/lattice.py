"""Where the voxels of the surfels lie: along the building's walls, and not along the axes in which it was surveyed.

So the same building, turned or moved, falls into the same voxels, and what is told from rasters stays the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

F64 = NDArray[np.float64]
FILE = "lattice.json"
"""Its name in the folder of the surfels."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Voxels turned by ``yaw`` (radians) against the local frame. Own coordinates are along its axes from ``corner``
    (2,), in metres, heights those of the local frame; ``level`` is the height of a lower side of voxels.
    """

    yaw: float = 0.0
    corner: tuple[float, float] = (0.0, 0.0)
    level: float = 0.0

    @property
    def axes(self) -> F64:
        """Unit vectors (2, 2) of its x and y in the local frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, s], [-s, c]])

    def own(self, points: NDArray[np.floating]) -> F64:
        """Own coordinates of local ones (n, 2) or (n, 3)."""
        (a, b), (c, d) = self.axes.tolist()
        x, y = points[:, 0].astype(np.float64), points[:, 1].astype(np.float64)
        out = np.empty(points.shape)  # by columns: many times as fast as a product of so narrow matrices
        out[:, 0] = x * a + y * b - self.corner[0]
        out[:, 1] = x * c + y * d - self.corner[1]
        out[:, 2:] = points[:, 2:]
        return out

    def local(self, points: F64) -> F64:
        """Local coordinates of own ones (n, 2) or (n, 3)."""
        return np.concatenate([(points[:, :2] + self.corner) @ self.axes, points[:, 2:]], axis=1)

    def then(self, other: Lattice) -> Lattice:
        """The lattice that was found as ``other`` in own coordinates."""
        x, y = (other.axes @ self.corner + other.corner).tolist()
        return Lattice(self.yaw + other.yaw, (x, y), other.level)

    def save(self, folder: Path) -> None:
        """Write as JSON."""
        (folder / FILE).write_bytes(TypeAdapter(Lattice).dump_json(self))

    @staticmethod
    def load(folder: Path) -> Lattice:
        """What ``save`` wrote."""
        return TypeAdapter(Lattice).validate_json((folder / FILE).read_bytes())
