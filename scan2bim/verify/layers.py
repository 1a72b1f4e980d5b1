"""What stands flat before a wall that was built as drawn: furring, cladding, another wall that is not drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.fits import UPRIGHT, Cells, weighted_quantile
from scan2bim.verify.result import Addition

F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

PROUD = 0.06
"""Metres before a face from which on a surface is no thicker plaster but another thing."""
FLAT = 0.01
"""Metres from a layer's median within which it is flat: shelves and curtains are not."""
LEAST_AREA = 0.5
"""Square metres of a layer, and of the face that shows the wall in place."""
PARALLEL = 0.97
"""Cosine of the angle between a wall's faces that tell of each other."""
TALL, LONG = 1.8, 0.9
"""Metres of the least wall; lower things are furniture."""
TOP = 0.15
"""Metres under the uppermost measured place of a face up to which a layer reaches: furniture ends lower."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Cells (k,) of an element that show a layer before it, metres before its face, and the layer's places (n, 3)."""

    cells: Mask
    depth: float
    area: float
    places: F64


def find_layers(cells: Cells, own: Mask, tolerance: float) -> list[Layer]:
    """Layers before upright faces that lie in place themselves, or whose opposite face does."""
    faces = [(face, np.flatnonzero(cells.face == face)) for face in np.unique(cells.face)]
    faces = [(face, mine) for face, mine in faces if abs(cells.normal[mine[0], 2]) < UPRIGHT]
    in_place = [mine[0] for _, mine in faces if _is_in_place(cells, mine[own[mine]], tolerance)]
    out: list[Layer] = []
    for _, mine in faces:
        if any(abs(float(cells.normal[other] @ cells.normal[mine[0]])) > PARALLEL for other in in_place):
            layer = _layer(cells, mine)
            if layer is not None:
                out.append(layer)
    return out


def _is_in_place(cells: Cells, mine: NDArray[np.int64], tolerance: float) -> bool:
    area = cells.area[mine]
    if area.sum() < LEAST_AREA:
        return False
    return abs(weighted_quantile(cells.deviation[mine], area, 0.5)) <= tolerance


def _layer(cells: Cells, mine: NDArray[np.int64]) -> Layer | None:
    """The flat layer before a face, as tall and long as a wall; None where there is none."""
    proud = mine[cells.deviation[mine] > PROUD]
    if cells.area[proud].sum() < LEAST_AREA:
        return None
    depth = weighted_quantile(cells.deviation[proud], cells.area[proud], 0.5)
    flat = proud[np.abs(cells.deviation[proud] - depth) < FLAT]
    area = float(cells.area[flat].sum())
    if area < LEAST_AREA:
        return None
    low, high = np.quantile(cells.place[flat], [0.02, 0.98], axis=0)
    top = float(cells.middle[mine, 2].max())
    if (high - low)[0] < LONG or (high - low)[1] < TALL or cells.middle[flat, 2].max() < top - TOP:
        return None
    which = np.zeros(len(cells.face), bool)
    which[flat] = True
    return Layer(which, depth, area, cells.middle[flat] + depth * cells.normal[flat])


def layer_addition(layer: Layer, name: str, storey: str, number: int, to_model: F64) -> Addition:
    """The layer as what is not drawn."""
    own = layer.places @ to_model[:3, :3].T + to_model[:3, 3]
    words = f"{layer.area:.1f} m2 of surface {1000 * layer.depth:.0f} mm before {name or 'a wall'}, which is drawn "
    return Addition(
        id=f"layer-{number}",
        guess="wall",
        storey=storey,
        lower=_vector(own.min(axis=0)),
        upper=_vector(own.max(axis=0)),
        points=0,
        area=round(layer.area, 2),
        sentence=f"{words}bare there; it may be a wall or a lining.",
    )


def _vector(values: F64) -> tuple[float, float, float]:
    return (round(float(values[0]), 3), round(float(values[1]), 3), round(float(values[2]), 3))
