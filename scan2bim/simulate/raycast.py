"""What a ray meets first. Two casters with one result: open3d's, and one in numpy where open3d cannot be loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d
from scan2bim.simulate.mesh import Patches

F64 = NDArray[np.float64]
CasterName = Literal["auto", "open3d", "numpy"]

BLOCK = 2000
"""Rays tested with all patches at a time."""
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


class Caster:
    """Casts rays at the same patches again and again.

    "auto" takes open3d where it can be loaded, else numpy; "open3d" raises MissingLibraryError where it cannot.
    """

    def __init__(self, patches: Patches, caster: CasterName = "auto") -> None:
        self._patches = patches
        self._open3d: Any = None
        if caster == "numpy":
            return
        try:
            self._open3d = load_open3d()
        except MissingLibraryError:
            if caster == "open3d":
                raise
            return
        vertices, triangles, self._owner = patches.triangles()
        # Float32 is good to 4 micrometres up to 60 m from the middle.
        self._centre: F64 = vertices.mean(axis=0) if len(vertices) else np.zeros(3)
        tensor = self._open3d.core.Tensor
        self._scene = self._open3d.t.geometry.RaycastingScene()
        if len(triangles):
            self._scene.add_triangles(tensor((vertices - self._centre).astype(np.float32)), tensor(triangles))

    def from_point(self, viewpoint: F64, directions: F64) -> Hits:
        """What rays from ``viewpoint`` (3,) along the unit vectors ``directions`` (n, 3) meet first."""
        if self._open3d is None:
            return first_hits_numpy(self._patches, viewpoint, directions)
        return self.rays(np.broadcast_to(viewpoint, directions.shape), directions)

    def rays(self, origins: F64, directions: F64) -> Hits:
        """What rays from ``origins`` (n, 3) along the unit vectors ``directions`` (n, 3) meet first."""
        if self._open3d is None:
            return _each_ray(self._patches, origins, directions)
        n = len(directions)
        if n == 0 or len(self._patches) == 0:
            return Hits(np.full(n, np.inf), np.full(n, -1, dtype=np.int64))
        rays = np.empty((n, 6), dtype=np.float32)
        rays[:, :3] = origins - self._centre
        rays[:, 3:] = directions
        found = self._scene.cast_rays(self._open3d.core.Tensor(rays))
        ranges = found["t_hit"].numpy().astype(np.float64)
        triangle = found["primitive_ids"].numpy()
        hit = np.isfinite(ranges)
        patch = np.full(n, -1, dtype=np.int64)
        patch[hit] = self._owner[triangle[hit]]
        return Hits(ranges, patch)


def first_hits(patches: Patches, viewpoint: F64, directions: F64, caster: CasterName = "auto") -> Hits:
    """What rays from ``viewpoint`` (3,) along the unit vectors ``directions`` (n, 3) meet first."""
    return Caster(patches, caster).from_point(viewpoint, directions)


def _each_ray(patches: Patches, origins: F64, directions: F64) -> Hits:
    """Each ray against each patch: for few rays, as those that panes mirror."""
    ranges, patch = np.full(len(directions), np.inf), np.full(len(directions), -1, dtype=np.int64)
    normal = np.cross(patches.u, patches.v)
    square = np.einsum("ij,ij->i", normal, normal)
    across_u, across_v = np.cross(patches.v, normal) / square[:, None], np.cross(normal, patches.u) / square[:, None]
    for start in range(0, len(directions) if len(patches) else 0, BLOCK):
        o, d = origins[start : start + BLOCK], directions[start : start + BLOCK]
        slope = d @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (np.einsum("ij,ij->i", patches.origin, normal) - o @ normal.T) / slope
            a = o @ across_u.T - np.einsum("ij,ij->i", patches.origin, across_u) + t * (d @ across_u.T)
            b = o @ across_v.T - np.einsum("ij,ij->i", patches.origin, across_v) + t * (d @ across_v.T)
        inside = (a >= 0) & (b >= 0) & np.where(patches.half, a + b <= 1, (a <= 1) & (b <= 1)) & (t > 0)
        far = np.where(inside, t, np.inf)
        nearest = far.argmin(axis=1)
        rows = np.arange(len(d))
        ranges[start : start + BLOCK] = far[rows, nearest]
        patch[start : start + BLOCK] = np.where(np.isfinite(far[rows, nearest]), nearest, -1)
    return Hits(ranges, patch)


def first_hits_numpy(patches: Patches, viewpoint: F64, directions: F64) -> Hits:
    """As ``first_hits``, by central projection; one viewpoint for all rays.

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
