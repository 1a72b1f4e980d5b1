"""What a real scanner makes of what its rays meet: glass, mixed pixels, lost returns, noise that grows at a slant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.appearance import GLOSS
from scan2bim.simulate.mesh import Patches
from scan2bim.simulate.parts import FINISHES
from scan2bim.simulate.raycast import Caster, CasterName, Hits

F64 = NDArray[np.float64]

DEPTH_EDGE = 0.04
"""Metres between neighbouring ranges from which a beam that falls on both gives a false range between them."""
FARTHEST_MIX = 1.5
"""Metres from which on a scanner tells the two echoes apart."""
DARK = 30.0
"""Of 255: what is darker sends back so little that rays are lost."""
OFF_PANE = 1e-4
"""Metres before the pane at which a mirrored ray starts, so as not to meet the pane's own frame behind it."""
GRAZING = 0.12
"""Cosine below which surfaces send little back: 83 degrees."""


@dataclass(frozen=True, slots=True)
class Glass:
    """Of the rays that meet a pane straight on: the share that it sends back, and that it mirrors. The rest pass."""

    returned: float = 0.0
    mirrored: float = 0.0


class World:
    """The solid patches and the panes of a scene, ready for casting."""

    def __init__(self, patches: Patches, caster: CasterName = "auto") -> None:
        self.patches = patches
        self._solid_number = np.flatnonzero(~patches.glass)
        self._pane_number = np.flatnonzero(patches.glass)
        self._solid = Caster(patches.only(self._solid_number), caster)
        self._panes = Caster(patches.only(self._pane_number), caster) if len(self._pane_number) else None

    def solid(self, viewpoint: F64, directions: F64) -> Hits:
        """What rays meet first where all glass lets them pass."""
        return _numbered(self._solid.from_point(viewpoint, directions), self._solid_number)

    def rays(self, origins: F64, directions: F64) -> Hits:
        """What rays from ``origins`` (n, 3) meet first where all glass lets them pass."""
        return _numbered(self._solid.rays(origins, directions), self._solid_number)

    def seen(self, viewpoint: F64, directions: F64, glass: Glass, rng: np.random.Generator) -> Hits:
        """What rays give, glass included: a mirrored ray has the length of its whole way."""
        hits = self.solid(viewpoint, directions)
        if self._panes is None or glass == Glass():
            return hits
        panes = _numbered(self._panes.from_point(viewpoint, directions), self._pane_number)
        meets = np.flatnonzero(panes.range < hits.range)
        normals = self.patches.normals()[panes.patch[meets]]
        cosine = np.einsum("ij,ij->i", normals, directions[meets])
        drawn = rng.random(len(meets))
        back = glass.returned * (0.15 + 0.85 * np.abs(cosine) ** 8)
        stays, bounces = drawn < back, (drawn >= back) & (drawn < back + glass.mirrored)
        ranges, patch = hits.range.copy(), hits.patch.copy()
        ranges[meets[stays]], patch[meets[stays]] = panes.range[meets[stays]], panes.patch[meets[stays]]
        mirrored = meets[bounces]
        towards = directions[mirrored] - 2 * cosine[bounces, None] * normals[bounces]
        start = viewpoint + directions[mirrored] * panes.range[mirrored, None]
        ghost = _numbered(self._solid.rays(start + OFF_PANE * towards, towards), self._solid_number)
        ranges[mirrored], patch[mirrored] = panes.range[mirrored] + OFF_PANE + ghost.range, ghost.patch
        return Hits(ranges, patch)


def _numbered(hits: Hits, number: NDArray[np.intp]) -> Hits:
    """Hits on some of the patches, with the patches' numbers among all."""
    if len(number) == 0:
        return hits
    return Hits(hits.range, np.where(hits.patch >= 0, number[hits.patch], -1))


def mix_pixels(ranges: F64, shape: tuple[int, int], share: float, rng: np.random.Generator) -> F64:
    """Ranges (n,) of a grid (columns, rows) with false ones at depth edges: ``share`` of the rays beside an edge."""
    grid = ranges.reshape(shape)
    out = grid.copy()
    for axis in (0, 1):
        other = np.roll(grid, -1, axis=axis)
        with np.errstate(invalid="ignore"):
            step = np.abs(other - grid)
        if axis == 1:
            # Columns go round, rows do not: the lowest has nothing below.
            step[:, -1] = np.inf
        edge = np.isfinite(step) & (step > DEPTH_EDGE) & (step < FARTHEST_MIX) & (rng.random(shape) < share)
        weight = rng.random(int(edge.sum()))
        out[edge] = weight * grid[edge] + (1 - weight) * other[edge]
    return out.ravel()


def lost(
    patches: Patches, patch: NDArray[np.int64], cosine: F64, share: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Which returns are too weak: ``share`` of all, and most from dark, glossy and slanting surfaces."""
    gloss = np.array([GLOSS.get(name, 0.0) for name in FINISHES])[patches.finish[patch]]
    dark = np.clip(1.0 - patches.rgb[patch].mean(axis=1) / DARK, 0.0, 1.0)
    slant = np.clip(1.0 - cosine / GRAZING, 0.0, 1.0)
    chance = 1.0 - (1.0 - share) * (1.0 - 0.6 * dark) * (1.0 - 0.8 * slant) * (1.0 - gloss * (1.0 - cosine) ** 2)
    return rng.random(len(patch)) < chance


def noise_factor(patches: Patches, patch: NDArray[np.int64], cosine: F64, ranges: F64, growth: float) -> F64:
    """How many times the noise of a white wall met straight on at 5 m: more at a slant, far away and on the dark."""
    lightness = np.maximum(patches.rgb[patch].mean(axis=1) / 255.0, 0.05)
    worse = 0.3 * (1.0 / np.maximum(cosine, 0.1) - 1.0) + 0.1 * (1.0 / lightness - 1.0) + 0.05 * (ranges - 5.0)
    return np.maximum(1.0 + growth * worse, 0.5)
