"""What a laser scanner records at a station: ranges with noise, colour, intensity, rows and columns, misses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.appearance import Camera, record_colours
from scan2bim.simulate.effects import Glass, World, lost, mix_pixels, noise_factor
from scan2bim.simulate.mesh import Patches, build_mesh
from scan2bim.simulate.raycast import CasterName, Hits
from scan2bim.simulate.scene import Scene, Station, turn

F64 = NDArray[np.float64]

LOWEST = math.radians(-60.0)
"""The lowest elevation measured: below, usual scanners see their own tripod."""


@dataclass(frozen=True, slots=True)
class ScannerSpec:
    """A scanner.

    step: between neighbouring rays in both directions, radians; noise: standard deviation of a range, metres;
    reach: longest range measured, metres; registration, registration_turn: standard deviations of the error that the
    written pose has in each coordinate (metres) and about z (radians).

    growth: how much the noise grows at a slant, on dark surfaces and with the range, 1 being usual; mixed: share of
    the rays beside a depth edge that give a range between; dropout: share of all rays that do not come back, to which
    dark, glossy and slanting surfaces add, or None for none at all.
    """

    step: float = math.radians(0.8)
    noise: float = 0.002
    reach: float = 40.0
    registration: float = 0.0
    registration_turn: float = 0.0
    growth: float = 0.0
    mixed: float = 0.0
    dropout: float | None = None
    glass: Glass = field(default_factory=Glass)
    camera: Camera = field(default_factory=Camera)


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
    world: World | None = None,
    caster: CasterName = "auto",
) -> Sweep:
    """Scan the scene from a station. The same arguments give the same sweep.

    world: of ``build_mesh(scene)``, to spare building it for every station.
    """
    number = scene.stations.index(station) if station in scene.stations else 0
    rotation = scene.placement.rotation() @ turn(station.heading)
    viewpoint = scene.placement.points(np.array([station.position], dtype=np.float64))[0]
    solid = World(build_mesh(scene), caster) if world is None else world
    return sweep_from(solid, station.name, viewpoint, rotation, spec, np.random.default_rng([seed, number]))


def sweep_from(
    world: World, name: str, viewpoint: F64, rotation: F64, spec: ScannerSpec, rng: np.random.Generator
) -> Sweep:
    """A full sweep from ``viewpoint`` (3,), the scanner turned by ``rotation`` (3, 3), both in scan coordinates."""
    patches = world.patches
    directions, row, column = directions_of(spec.step)
    towards = directions @ rotation.T
    hits = world.seen(viewpoint, towards, spec.glass, rng)
    true = hits.range
    if spec.mixed > 0.0:
        true = mix_pixels(true, (int(column[-1]) + 1, int(row[-1]) + 1), spec.mixed, rng)
    met = true <= spec.reach
    if spec.dropout is not None:
        slant = incidence(patches, hits.patch[met], towards[met])
        met[met] = ~lost(patches, hits.patch[met], slant, spec.dropout, rng)
    patch = hits.patch[met]
    cosine = incidence(patches, patch, towards[met])
    sigma = spec.noise * noise_factor(patches, patch, cosine, true[met], spec.growth) if spec.growth else spec.noise
    ranges = true[met] + rng.normal(0.0, sigma, int(met.sum()))
    places = viewpoint + towards[met] * true[met, None]
    return Sweep(
        name=name,
        xyz=directions[met] * ranges[:, None],
        rgb=record_colours(patches, patch, places, cosine, spec.camera, rng),
        intensity=_intensity(patches, patch, cosine, ranges, rng),
        row=row[met],
        column=column[met],
        patch=patch,
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
    return np.abs(np.einsum("ij,ij->i", patches.normals()[patch], directions))


def _intensity(
    patches: Patches, patch: NDArray[np.int64], cosine: F64, ranges: F64, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Lambert's law with the surface's lightness as reflectance, falling mildly with range."""
    lightness = patches.rgb[patch].mean(axis=1) / 255.0
    values = lightness * (0.3 + 0.7 * cosine) / (1.0 + 0.02 * ranges) + rng.normal(0.0, 0.01, len(patch))
    return np.clip(values, 0.0, 1.0).astype(np.float32)


def cast_all(scene: Scene, spec: ScannerSpec, seed: int = 0, caster: CasterName = "auto") -> Iterable[Sweep]:
    """A sweep from every station of the scene, one at a time."""
    world = World(build_mesh(scene), caster)
    for station in scene.stations:
        yield cast(scene, station, spec, seed, world)


def true_ranges(scene: Scene, station: Station, spec: ScannerSpec, caster: CasterName) -> Hits:
    """What the rays of ``directions_of(spec.step)`` meet from a station, without noise."""
    placement = scene.placement
    viewpoint = placement.points(np.array([station.position], dtype=np.float64))[0]
    rotation = placement.rotation() @ turn(station.heading)
    return World(build_mesh(scene), caster).solid(viewpoint, directions_of(spec.step)[0] @ rotation.T)
