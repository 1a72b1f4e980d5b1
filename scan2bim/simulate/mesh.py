"""A scene as plane patches with element names and colours: what rays are cast against."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from scan2bim.simulate import parts
from scan2bim.simulate.parts import FINISHES, Patch
from scan2bim.simulate.scene import (
    CONCRETE,
    WHITE,
    Box,
    Placement,
    Rgb,
    Scene,
    StoreySpec,
    footprint,
    room_outlines,
    turn,
)

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Parallelograms, or where ``half`` triangles.

    Of the points ``origin + a * u + b * v``: those with a and b in 0-1, in a triangle also a + b <= 1.

    origin, u, v (n, 3) float64 in scan coordinates; half (n,) bool; element (n,) int32 into ``names``; rgb (n, 3)
    uint8; finish (n,) int8 into ``appearance.FINISHES``; glass (n,) bool.
    """

    origin: F64
    u: F64
    v: F64
    half: NDArray[np.bool_]
    element: NDArray[np.int32]
    rgb: NDArray[np.uint8]
    names: tuple[str, ...]
    finish: NDArray[np.int8]
    glass: NDArray[np.bool_]

    def __len__(self) -> int:
        """How many."""
        return len(self.origin)

    def only(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Patches:
        """Some of them."""
        return dataclasses.replace(
            self,
            origin=self.origin[which],
            u=self.u[which],
            v=self.v[which],
            half=self.half[which],
            element=self.element[which],
            rgb=self.rgb[which],
            finish=self.finish[which],
            glass=self.glass[which],
        )

    def normals(self) -> F64:
        """Unit normals (n, 3)."""
        across = np.cross(self.u, self.v)
        return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)

    def triangles(self) -> tuple[F64, NDArray[np.uint32], NDArray[np.int64]]:
        """Vertices (m, 3) float64, triangles (t, 3) uint32, and the patch of each triangle (t,) int64."""
        a, b, d = self.origin, self.origin + self.u, self.origin + self.v
        full = np.flatnonzero(~self.half)
        vertices = np.concatenate([np.stack([a, b, d], axis=1).reshape(-1, 3), (b + self.v)[full]])
        first = 3 * np.arange(len(a))
        lower = np.stack([first, first + 1, first + 2], axis=1)
        upper = np.stack([first[full] + 1, 3 * len(a) + np.arange(len(full)), first[full] + 2], axis=1)
        return vertices, np.concatenate([lower, upper]).astype(np.uint32), np.concatenate([np.arange(len(a)), full])


def build_mesh(scene: Scene) -> Patches:
    """All surfaces of the scene that a ray can meet, in scan coordinates."""
    return gather((patch for storey in scene.storeys for patch in _storey_patches(scene, storey)), scene.placement)


def gather(patches: Iterable[Patch], placement: Placement) -> Patches:
    """Single patches in the scene's frame as one value in scan coordinates."""
    found = list(patches)
    names = tuple(dict.fromkeys(patch.element for patch in found))
    number = {name: i for i, name in enumerate(names)}
    rotation = placement.rotation()
    return Patches(
        origin=placement.points(np.array([p.origin for p in found]).reshape(-1, 3)),
        u=np.array([p.u for p in found]).reshape(-1, 3) @ rotation.T,
        v=np.array([p.v for p in found]).reshape(-1, 3) @ rotation.T,
        half=np.array([p.half for p in found], dtype=np.bool_),
        element=np.array([number[p.element] for p in found], dtype=np.int32),
        rgb=np.array([p.rgb for p in found], dtype=np.uint8).reshape(-1, 3),
        names=names,
        finish=np.array([FINISHES.index(p.finish) for p in found], dtype=np.int8),
        glass=np.array([p.glass for p in found], dtype=np.bool_),
    )


def _storey_patches(scene: Scene, storey: StoreySpec) -> Iterable[Patch]:
    yield from _floor(storey)
    yield from _ceiling(scene, storey)
    for wall in storey.walls:
        yield from parts.wall_patches(wall, storey)
    for box in storey.boxes:
        yield from box_patches_of(box, storey)


def _floor(storey: StoreySpec) -> Iterable[Patch]:
    """Each room's floor in its colour, the thresholds under the walls, and the sides of the shafts through the slab."""
    holes = _holes(storey)
    outlines = room_outlines(storey)
    rooms = shapely.union_all(list(outlines.values()))
    for room in storey.rooms:
        name = f"floor {storey.name} {room.name}"
        yield from _plate(name, outlines[room.name].difference(holes), storey.elevation, room.floor_colour)
    rest = footprint(storey).difference(rooms).difference(holes)
    yield from _plate(f"floor {storey.name}", rest, storey.elevation, CONCRETE)
    for shaft in storey.shafts:
        yield from _shaft_sides(shaft.polygon, storey)


def _ceiling(scene: Scene, storey: StoreySpec) -> Iterable[Patch]:
    above = next((s for s in scene.storeys if s.elevation > storey.elevation + 1e-6), None)
    holes = shapely.GeometryCollection() if above is None else _holes(above)
    plate = footprint(storey).difference(holes)
    yield from _plate(f"ceiling {storey.name}", plate, storey.elevation + storey.height, WHITE)


def _holes(storey: StoreySpec) -> BaseGeometry:
    return shapely.union_all([shaft.polygon for shaft in storey.shafts])


def _plate(element: str, area: BaseGeometry, z: float, rgb: Rgb) -> Iterable[Patch]:
    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(area)):
        corners = np.column_stack([shapely.get_coordinates(triangle)[:3], np.full(3, z)])
        yield Patch(element, corners[0], corners[1] - corners[0], corners[2] - corners[0], rgb, half=True)


def _shaft_sides(outline: shapely.Polygon, storey: StoreySpec) -> Iterable[Patch]:
    ring = shapely.get_coordinates(outline)
    down = np.array([0.0, 0.0, -storey.slab])
    for a, b in itertools.pairwise(ring):
        start = np.array([*a, storey.elevation])
        yield Patch(f"slab {storey.name}", start, np.array([*(b - a), 0.0]), down, CONCRETE)


def box_patches_of(box: Box, storey: StoreySpec) -> Iterable[Patch]:
    """The sides of a box, in the scene's frame."""
    axes = turn(box.yaw)
    corner = (
        np.array([*box.centre, storey.elevation + box.base])
        - axes[:, 0] * box.size[0] / 2
        - axes[:, 1] * box.size[1] / 2
    )
    yield from parts.box_patches(box.name, corner, axes * np.array(box.size), box.colour, box.finish)
