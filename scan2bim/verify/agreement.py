"""Whether stations look through what a model draws before them: they do where it is another building's, or lies
elsewhere than its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama
from scan2bim.verify.faces import FaceTable, Plane
from scan2bim.verify.visibility import LOOKED_THROUGH, SAW, look, opaque_bodies

F64 = NDArray[np.float64]

STATIONS = 6
"""Stations that are asked: each shows a room."""
LEAST_CELLS = 50
"""Cells that the stations must see or look through for their share to tell anything."""


@dataclass(frozen=True, slots=True, eq=False)
class Sights:
    """What tells whether a placing is right: the faces of the elements that count, where the model stands, its planes,
    which elements (e,) count, and some stations' panoramas.
    """

    table: FaceTable
    planes: Sequence[Plane]
    counts: NDArray[np.bool_]
    panoramas: Sequence[Panorama]

    def agreement(self, matrix: F64) -> float:
        """Of the surface that the stations should see by a placing (4, 4), the share that they saw and did not look
        through; 1 where too little tells.
        """
        if not self.panoramas:
            return 1.0
        table = self.table.moved(matrix)
        bodies = opaque_bodies(self.planes, self.counts, matrix)
        bits = look(table, bodies, self.panoramas, np.ones(len(table.cell_face), bool), lambda _: None)
        saw = (bits & SAW) > 0
        through = ~saw & ((bits & LOOKED_THROUGH) > 0)
        told = int(saw.sum() + through.sum())
        return float(saw.sum()) / told if told >= LEAST_CELLS else 1.0


def some_panoramas(panoramas: Sequence[Panorama]) -> list[Panorama]:
    """An even choice of them."""
    places = np.unique(np.linspace(0, len(panoramas) - 1, STATIONS).astype(int)) if panoramas else []
    return [panoramas[int(i)] for i in places]
