"""What a ray meets first. Two casters with one result: open3d's, and one in numpy where open3d cannot be loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d
from scan2bim.simulate.mesh import Patches

F64 = NDArray[np.float64]

BUNDLES = 10
"""Steps per unit of each coordinate that directions are bundled by: cones of some 5 degrees' half-angle."""
SLACK = 1e-6
"""Radians added to cones, far above the rounding of their angles."""
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
    the nearest patch is the one with the largest c0. Each bundle of near rays is tested only with patches in its
    cone.
    """
    matrices = np.stack([patches.origin - viewpoint, patches.u, patches.v], axis=2)
    seen = np.flatnonzero(np.abs(np.linalg.det(matrices)) > EDGE_ON)
    inverse: F64 = np.linalg.inv(matrices[seen]).astype(np.float64)
    towards, spread = _cones(matrices[seen])
    ranges = np.full(len(directions), np.inf)
    patch = np.full(len(directions), -1, dtype=np.int64)
    for bundle in _bundles(directions):
        rays = directions[bundle]
        axis = rays.mean(axis=0)
        axis /= np.linalg.norm(axis)
        width = _angles(rays @ axis).max()
        near = np.flatnonzero(_angles(towards @ axis) <= spread + width + SLACK)
        if len(near):
            nearness, index = _project(inverse[near], patches.half[seen[near]], rays)
            hit = nearness > 0.0
            ranges[bundle[hit]] = 1.0 / nearness[hit]
            patch[bundle[hit]] = seen[near[index[hit]]]
    return Hits(ranges, patch)


def _bundles(directions: F64) -> list[NDArray[np.intp]]:
    """Indices of rays grouped by direction, each group within some 10 degrees."""
    cells = np.floor(directions * BUNDLES).astype(np.int64) + BUNDLES
    key = (cells[:, 0] * 4 * BUNDLES + cells[:, 1]) * 4 * BUNDLES + cells[:, 2]
    order = np.argsort(key, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(key[order])) + 1)


def _cones(matrices: F64) -> tuple[F64, F64]:
    """Unit vectors (n, 3) towards the patches, and the half-angles (n,) of cones round them that hold the patches."""
    w, u, v = (matrices[:, :, k] for k in range(3))
    centre = w + (u + v) / 2
    radius = np.maximum(np.linalg.norm(u + v, axis=1), np.linalg.norm(u - v, axis=1)) / 2
    distance = np.linalg.norm(centre, axis=1)
    outside = distance > radius
    share = np.divide(radius, distance, out=np.ones_like(radius), where=outside)
    return centre / np.maximum(distance, EDGE_ON)[:, None], np.where(outside, np.arcsin(share), np.pi)


def _angles(cosine: F64) -> F64:
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _project(inverse: F64, half: NDArray[np.bool_], directions: F64) -> tuple[F64, NDArray[np.intp]]:
    """For each ray the largest c0 of the patches that it meets, 0 where it meets none, and which patch that is."""
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
