"""The colour of surfaces as a camera on the scanner sees it: finishes, uneven light, exposure.

paint is mottled a little, wood has upright grain, print is made of patches of colours of its own, cloth has upright
folds, metal is smooth and sends slanting rays away (``GLOSS``); plain is one colour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.mesh import Patches
from scan2bim.simulate.parts import FINISHES

F64 = NDArray[np.float64]

GLOSS = {"metal": 1.0, "print": 0.25}
"""Share of the slanting rays that a finish sends away, where the scanner loses any; 0 where none is given."""
PRINT_CELLS = 6
"""A print's patches of colour along each of its sides."""
WAVES = 6
"""Waves that the light's variation is made of."""
WAVELENGTHS = (2.5, 9.0)
"""Metres: from the cone of a lamp to the length of a room."""


@dataclass(frozen=True, slots=True)
class Camera:
    """How colours are recorded.

    exposure: standard deviation of a station's brightness; tint: of each of its channels against that; lighting:
    standard deviation of the light's variation through the building; drift: of what of that differs from station
    to station; noise: of each value, of 255.
    """

    exposure: float = 0.03
    tint: float = 0.0
    lighting: float = 0.0
    drift: float = 0.0
    noise: float = 3.0


def record_colours(
    patches: Patches, patch: NDArray[np.int64], points: F64, cosine: F64, camera: Camera, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Colours (n, 3) uint8 at points (n, 3) in scan coordinates on patches, each met at an incidence of ``cosine``."""
    shade = rng.normal(1.0, camera.exposure) * (0.85 + 0.15 * cosine)
    values = patches.rgb[patch].astype(np.float64)
    if (patches.finish > 0).any():
        values = np.clip(_finished(patches, patch, points, values), 0.0, 255.0)
    if camera.lighting > 0.0:
        # The building's own light is the same for all stations: its seed is fixed.
        shade = shade * (1.0 + camera.lighting * _waves(points, np.random.default_rng(1)))
    if camera.drift > 0.0:
        shade = shade * (1.0 + camera.drift * _waves(points, rng))
    values *= shade[:, None]
    if camera.tint > 0.0:
        values *= rng.normal(1.0, camera.tint, 3)
    values += rng.normal(0.0, camera.noise, (len(patch), 3))
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def _waves(points: F64, rng: np.random.Generator) -> F64:
    """A smooth field of mean 0 and deviation 1 at points, (n,)."""
    directions = rng.normal(0.0, 1.0, (WAVES, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = directions * (2 * math.pi / rng.uniform(*WAVELENGTHS, (WAVES, 1)))
    phases = rng.uniform(0.0, 2 * math.pi, WAVES)
    return np.cos(points @ waves.T + phases).sum(axis=1) * math.sqrt(2.0 / WAVES)


def _finished(patches: Patches, patch: NDArray[np.int64], points: F64, values: F64) -> F64:
    """Base colours varied by the finish of the surface."""
    finish = patches.finish[patch]
    out = values.copy()
    normals = patches.normals()
    tangent = np.column_stack([-normals[:, 1], normals[:, 0]])
    for kind, vary in (("paint", _paint), ("wood", _wood), ("cloth", _cloth)):
        which = np.flatnonzero(finish == FINISHES.index(kind))
        if len(which):
            p = points[which]
            along = np.einsum("ij,ij->i", p[:, :2], tangent[patch[which]])
            out[which] *= vary(along, p[:, 2], patches.element[patch[which]])[:, None]
    which = np.flatnonzero(finish == FINISHES.index("print"))
    if len(which):
        out[which] = _print(patches, patch[which], points[which], values[which])
    return out


def _paint(along: F64, z: F64, element: NDArray[np.int32]) -> F64:
    return 1.0 + 0.02 * (_noise(along / 0.5, z / 0.5, element) + 0.5 * _noise(along / 0.06, z / 0.06, element))


def _wood(along: F64, z: F64, element: NDArray[np.int32]) -> F64:
    wide, fine = _noise(along / 0.09, z / 1.1, element), _noise(along / 0.012, z / 0.35, element + 7)
    return 1.0 + 0.07 * wide + 0.05 * fine


def _cloth(along: F64, z: F64, element: NDArray[np.int32]) -> F64:
    return 1.0 + 0.1 * np.cos(along * (2 * math.pi / 0.11) + element) + 0.03 * _noise(along / 0.3, z / 0.3, element)


def _print(patches: Patches, patch: NDArray[np.int64], points: F64, values: F64) -> F64:
    """Patches of random colours, mixed with the base colour, in a grid over the surface."""
    local = points - patches.origin[patch]
    u, v = patches.u[patch], patches.v[patch]
    a, b = (np.einsum("ij,ij->i", local, w) / np.einsum("ij,ij->i", w, w) for w in (u, v))
    i, j = (np.clip(np.floor(x * PRINT_CELLS), 0, PRINT_CELLS - 1).astype(np.int64) for x in (a, b))
    own = np.stack([_hashed(i, j, patch * 4 + k) for k in range(3)], axis=1) * 127.5 + 127.5
    return 0.35 * values + 0.65 * own


def _noise(x: F64, y: F64, seed: NDArray[np.int32]) -> F64:
    """Smooth noise in -1 to 1 on a grid of unit cells, (n,)."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    a, b = x - i, y - j
    a, b = a * a * (3 - 2 * a), b * b * (3 - 2 * b)
    low = _hashed(i, j, seed) * (1 - a) + _hashed(i + 1, j, seed) * a
    high = _hashed(i, j + 1, seed) * (1 - a) + _hashed(i + 1, j + 1, seed) * a
    return low * (1 - b) + high * b


def _hashed(i: NDArray[np.int64], j: NDArray[np.int64], seed: NDArray[np.int32] | NDArray[np.int64]) -> F64:
    """Evenly spread numbers in -1 to 1 that depend on whole numbers alone."""
    mixed = (i * 0x1F1F1F1F) ^ (j * 0x5DEECE66D) ^ (seed.astype(np.int64) * 0x2545F491)
    mixed = (mixed ^ (mixed >> 15)) * 0x2C1B3C6D
    mixed = (mixed ^ (mixed >> 12)) * 0x297A2D39
    mixed ^= mixed >> 15
    return (mixed & 0xFFFF) / 32767.5 - 1.0
