"""What a laser scanner records at a station: ranges with noise, colour, intensity, rows and columns, misses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.mesh import Patches, build_mesh
from scan2bim.simulate.raycast import Hits, first_hits
from scan2bim.simulate.scene import Placement, Scene, Station, turn

F64 = NDArray[np.float64]

LOWEST = math.radians(-60.0)
"""The lowest elevation measured: below, usual scanners see their own tripod."""


@dataclass(frozen=True, slots=True)
class ScannerSpec:
    """A scanner.

    step: between neighbouring rays in both directions, radians; noise: standard deviation of a range, metres;
    reach: longest range measured, metres; registration, registration_turn: standard deviations of the error that the
    written pose has in each coordinate (metres) and about z (radians).
    """

    step: float = math.radians(0.8)
    noise: float = 0.002
    reach: float = 40.0
    registration: float = 0.0
    registration_turn: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """One station's records, in the scanner's own frame, column by column.

    xyz (n, 3) float64 metres; rgb (n, 3) uint8; intensity (n,) float32 in 0-1; row, column (n,) int32; patch (n,)
    int64: the patch that was hit. miss_directions (m, 3) float64 unit vectors of rays that met nothing, miss_row,
    miss_column (m,) int32. rotation (3, 3) and translation (3,) float64: the pose as registration would give it,
    scanner to scan coordinates.
    """

    name: str
    xyz: F64
    rgb: NDArray[np.uint8]
    intensity: NDArray[np.float32]
    row: NDArray[np.int32]
    column: NDArray[np.int32]
    patch: NDArray[np.int64]
    miss_directions: F64
    miss_row: NDArray[np.int32]
    miss_column: NDArray[np.int32]
    rotation: F64
    translation: F64

    def world(self) -> F64:
        """The points in scan coordinates by the written pose, (n, 3) float64."""
        return self.xyz @ self.rotation.T + self.translation


def cast(
    scene: Scene,
    station: Station,
    spec: ScannerSpec,
    seed: int = 0,
    patches: Patches | None = None,
    caster: Literal["auto", "open3d", "numpy"] = "auto",
) -> Sweep:
    """Scan the scene from a station. The same arguments give the same sweep.

    patches: of ``build_mesh(scene)``, to spare building them for every station.
    """
    solid = build_mesh(scene) if patches is None else patches
    rng = np.random.default_rng([seed, scene.stations.index(station) if station in scene.stations else 0])
    directions, row, column = directions_of(spec.step)
    rotation = scene.placement.rotation() @ turn(station.heading)
    viewpoint = scene.placement.points(np.array([station.position], dtype=np.float64))[0]
    hits = first_hits(solid, viewpoint, directions @ rotation.T, caster)
    met = hits.range <= spec.reach
    ranges = hits.range[met] + rng.normal(0.0, spec.noise, int(met.sum()))
    cosine = incidence(solid, hits.patch[met], directions[met] @ rotation.T)
    return Sweep(
        name=station.name,
        xyz=directions[met] * ranges[:, None],
        rgb=_colours(solid, hits.patch[met], cosine, rng),
        intensity=_intensity(solid, hits.patch[met], cosine, ranges, rng),
        row=row[met],
        column=column[met],
        patch=hits.patch[met],
        miss_directions=directions[~met],
        miss_row=row[~met],
        miss_column=column[~met],
        rotation=turn(rng.normal(0.0, spec.registration_turn)) @ rotation,
        translation=viewpoint + rng.normal(0.0, spec.registration, 3),
    )


def directions_of(step: float) -> tuple[F64, NDArray[np.int32], NDArray[np.int32]]:
    """Unit vectors (n, 3) float64 of a full sweep in the scanner's frame, with row and column (n,) int32 of each.

    Column 0 looks along +x and columns turn counter-clockwise; row 0 is the highest.
    """
    columns = round(2 * math.pi / step)
    rows = int((math.pi / 2 - LOWEST) / step)
    azimuth = 2 * math.pi * np.arange(columns) / columns
    elevation = math.pi / 2 - step * (np.arange(rows) + 0.5)
    a, e = (grid.ravel() for grid in np.meshgrid(azimuth, elevation, indexing="ij"))
    column, row = (
        grid.ravel().astype(np.int32) for grid in np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    )
    return np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]), row, column


def incidence(patches: Patches, patch: NDArray[np.int64], directions: F64) -> F64:
    """Cosine between ray and normal of what it met, (n,) in 0-1. directions (n, 3) unit vectors in scan coordinates."""
    normals = np.cross(patches.u, patches.v)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.abs(np.einsum("ij,ij->i", normals[patch], directions))


def _colours(patches: Patches, patch: NDArray[np.int64], cosine: F64, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The surface's colour, shaded a little by incidence, with the camera's exposure at this station and its noise."""
    exposure = rng.normal(1.0, 0.03)
    shade = exposure * (0.85 + 0.15 * cosine)
    values = patches.rgb[patch] * shade[:, None] + rng.normal(0.0, 3.0, (len(patch), 3))
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def _intensity(
    patches: Patches, patch: NDArray[np.int64], cosine: F64, ranges: F64, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Lambert's law with the surface's lightness as reflectance, falling mildly with range."""
    lightness = patches.rgb[patch].mean(axis=1) / 255.0
    values = lightness * (0.3 + 0.7 * cosine) / (1.0 + 0.02 * ranges) + rng.normal(0.0, 0.01, len(patch))
    return np.clip(values, 0.0, 1.0).astype(np.float32)


def cast_all(
    scene: Scene, spec: ScannerSpec, seed: int = 0, caster: Literal["auto", "open3d", "numpy"] = "auto"
) -> list[Sweep]:
    """A sweep from every station of the scene."""
    patches = build_mesh(scene)
    return [cast(scene, station, spec, seed, patches, caster) for station in scene.stations]


def true_ranges(scene: Scene, station: Station, spec: ScannerSpec, caster: Literal["auto", "open3d", "numpy"]) -> Hits:
    """What the rays of ``directions_of(spec.step)`` meet from a station, without noise."""
    placement: Placement = scene.placement
    viewpoint = placement.points(np.array([station.position], dtype=np.float64))[0]
    rotation = placement.rotation() @ turn(station.heading)
    return first_hits(build_mesh(scene), viewpoint, directions_of(spec.step)[0] @ rotation.T, caster)
