"""What a ray meets first. Two casters with one result: open3d's, and one in numpy where open3d cannot be loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d
from scan2bim.simulate.mesh import Patches

F64 = NDArray[np.float64]

CHUNK_TESTS = 4_000_000
"""Ray-patch pairs tested at once: three float64 arrays of 32 MB each."""
EDGE_ON = 1e-9
"""Patches whose spat product with the viewpoint is below this (m^3) are seen edge-on and cannot be hit."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """For each ray its range (n,) float64, infinite where it meets nothing, and the patch (n,) int64, -1 there."""

    range: F64
    patch: NDArray[np.int64]


def first_hits(
    patches: Patches, viewpoint: F64, directions: F64, caster: Literal["auto", "open3d", "numpy"] = "auto"
) -> Hits:
    """What rays from ``viewpoint`` (3,) along the unit vectors ``directions`` (n, 3) meet first.

    "auto" takes open3d where it can be loaded, else numpy; "open3d" raises MissingLibraryError where it cannot.
    """
    if caster == "numpy":
        return first_hits_numpy(patches, viewpoint, directions)
    try:
        return first_hits_open3d(patches, viewpoint, directions)
    except MissingLibraryError:
        if caster == "open3d":
            raise
        return first_hits_numpy(patches, viewpoint, directions)


def first_hits_numpy(patches: Patches, viewpoint: F64, directions: F64) -> Hits:
    """As ``first_hits``, by central projection.

    Seen from the viewpoint, a point w + a u + b v of a patch (w its origin) lies along d where d = c0 w + c1 u + c2 v
    with c0 > 0; then the range is 1 / c0, a = c1 / c0 and b = c2 / c0. One matrix per patch gives c for all rays, and
    the nearest patch is the one with the largest c0.
    """
    matrices = np.stack([patches.origin - viewpoint, patches.u, patches.v], axis=2)
    seen = np.flatnonzero(np.abs(np.linalg.det(matrices)) > EDGE_ON)
    inverse: F64 = np.linalg.inv(matrices[seen]).astype(np.float64)
    half = patches.half[seen]
    rows = max(1, CHUNK_TESTS // max(1, len(seen)))
    parts = [_project(inverse, half, directions[i : i + rows]) for i in range(0, len(directions), rows)]
    nearness = np.concatenate([p[0] for p in parts])
    index = np.concatenate([p[1] for p in parts])
    hit = nearness > 0.0
    ranges = np.full(len(directions), np.inf)
    ranges[hit] = 1.0 / nearness[hit]
    return Hits(ranges, np.where(hit, seen[index], -1))


def _project(inverse: F64, half: NDArray[np.bool_], directions: F64) -> tuple[F64, NDArray[np.intp]]:
    c0, c1, c2 = (directions @ inverse[:, k, :].T for k in range(3))
    inside = (c1 >= 0.0) & (c2 >= 0.0) & np.where(half, c1 + c2 <= c0, (c1 <= c0) & (c2 <= c0))
    nearness = np.where(inside & (c0 > 0.0), c0, 0.0)
    index = nearness.argmax(axis=1)
    return nearness[np.arange(len(directions)), index], index


def first_hits_open3d(patches: Patches, viewpoint: F64, directions: F64) -> Hits:
    """As ``first_hits``, by open3d's RaycastingScene in float32; MissingLibraryError where it cannot be loaded."""
    o3d = load_open3d()
    vertices, triangles, owner = patches.triangles()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor((vertices - viewpoint).astype(np.float32)), o3d.core.Tensor(triangles))
    rays = np.concatenate([np.zeros_like(directions), directions], axis=1).astype(np.float32)
    found = scene.cast_rays(o3d.core.Tensor(rays))
    ranges = found["t_hit"].numpy().astype(np.float64)
    triangle = found["primitive_ids"].numpy()
    hit = np.isfinite(ranges)
    patch = np.full(len(directions), -1, dtype=np.int64)
    patch[hit] = owner[triangle[hit]]
    return Hits(ranges, patch)
