"""The cells of the compared elements as coloured squares, for the USD with deviations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.pictures import UNSEEN, deviation_colours

if TYPE_CHECKING:
    from scan2bim.verify.build import Found
    from scan2bim.verify.result import ElementResult

F64 = NDArray[np.float64]
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """An element's result, the corners (v, 3) of its cells in the model's axes, metres, the cells as quads (q, 4) and
    their sRGB colours (q, 3): grey where nothing was measured.
    """

    result: ElementResult
    corners: F64
    quads: NDArray[np.int32]
    colours: NDArray[np.uint8]


def paint(found: Found) -> Iterator[Painted]:
    """The elements that have cells, in the report's order."""
    surface, elements = found.surface, found.model.elements
    order, ends = surface.table.by_element(len(elements))
    places = {e.guid: i for i, e in enumerate(elements) if e.role == "compared"}
    patches = {e.guid: i for i, e in enumerate(elements) if e.role == "patch"}
    places |= {e.guid: patches[e.host] for e in elements if e.role == "fill" and e.host in patches}
    to_model = found.placement.to_model(found.anchor)
    for result in found.report.elements:
        number = places.get(result.guid)
        cells = order[ends[number] : ends[number + 1]] if number is not None else order[:0]
        if not len(cells):
            continue
        colours = np.tile(np.array(UNSEEN, np.uint8), (len(cells), 1))
        measured = surface.is_measured[cells]
        colours[measured] = deviation_colours(surface.measured.mean[cells[measured]], result.tolerance)
        yield Painted(result, *_squares(found, cells, to_model), colours)


def _squares(found: Found, cells: NDArray[np.int64], to_model: F64) -> tuple[F64, NDArray[np.int32]]:
    """Corners (v, 3), shared within a face, and quads (q, 4) of cells; u, v and the normal are right-handed."""
    table = found.surface.table
    face = table.cell_face[cells].astype(np.int64)
    at = table.cell_at[cells][:, None, :].astype(np.int64) + CORNERS
    key = np.concatenate([np.broadcast_to(face[:, None, None], (len(cells), 4, 1)), at], axis=2).reshape(-1, 3)
    unique, place = np.unique(key, axis=0, return_inverse=True)
    f = unique[:, 0]
    along = unique[:, 1:] * table.size[f][:, None]
    local = table.origin[f] + along[:, :1] * table.u[f] + along[:, 1:] * table.v[f]
    return local @ to_model[:3, :3].T + to_model[:3, 3], place.reshape(-1, 4).astype(np.int32)
