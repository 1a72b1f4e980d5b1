"""The building's own axes: along its walls, with the longest in the middle of voxels, and turned to its heavier side.

They are told by the building alone, whatever the axes in which it was surveyed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import load_stations
from scan2bim.cloud.lattice import Lattice
from scan2bim.cloud.surfels import PLAN, TALL, Surfels, rough_surfels
from scan2bim.structure.columns import Columns, Grid, gather_columns
from scan2bim.structure.faces import FEWEST_BINS, Face, grow_faces, main_direction
from scan2bim.structure.shapes import Point, Ring, SpaceShape, StoreyShape, StructureShape, WallShape
from scan2bim.structure.steps import turn_to
from scan2bim.structure.storeys import find_storeys, layers_of

PASSES = 60_000, 400_000
"""Points of each pass: the second is in voxels that lie along the walls already, as they do however the building was
surveyed, and has to tell to the millimetre how."""
STRAIGHT = 0.001
"""Radians by which long bare walls differ, as fitted: those with curtains or leaves before them count for little."""
ALONG = 0.01
"""Radians up to which a face is along an axis: it stays within a voxel over 5 m."""
F64 = NDArray[np.float64]


def find_lattice(scan_folders: Sequence[Path]) -> Lattice:
    """Along the walls of the largest storey, with its floor and, as far as they can be, its faces in the middle of
    voxels; that of the local frame where there are none.
    """
    stations = load_stations(scan_folders)
    lattice = Lattice()
    for points in PASSES:
        surfels = rough_surfels(scan_folders, lattice, points)
        own = lattice.own(surfels.xyz).astype(np.float32)
        lattice = lattice.then(_lattice_in(replace(surfels, xyz=own), lattice.own(stations)))
    return lattice


def _lattice_in(surfels: Surfels, stations: F64) -> Lattice:
    layers = layers_of(surfels, stations)
    levels = find_storeys(surfels, layers, stations)
    if not levels:
        return Lattice()
    level = max(levels, key=lambda storey: storey.area)
    top = level.ceiling or level.top
    origin, end = np.floor(surfels.xyz[:, :2].min(0) / PLAN) * PLAN, surfels.xyz[:, :2].max(0)
    grid = Grid(origin, np.full(np.ceil((end - origin) / PLAN).astype(int)[::-1] + 1, top), level.floor)
    columns = gather_columns(surfels, layers.between(surfels, level.floor, top), grid, stations)
    faces = grow_faces(columns, grid.roof.shape, columns.bins >= FEWEST_BINS, columns.high >= 2)
    if not faces:
        return Lattice()
    yaw = main_direction(faces, STRAIGHT)
    yaw += np.pi / 2 * np.round((_heavier_side(columns.xy) - yaw) / (np.pi / 2))
    axes = Lattice(float(yaw)).axes
    x, y = (_middle(columns, faces, axis) for axis in axes)
    return Lattice(float(yaw), (x, y), level.floor - TALL / 2)


def _heavier_side(xy: F64) -> float:
    """Direction, radians, in which places (n, 2) reach farthest from their middle, by the third power."""
    away = xy - xy.mean(0)
    x, y = (away * (away**2).sum(1, keepdims=True)).sum(0).tolist()
    return float(np.arctan2(y, x))


def _middle(columns: Columns, faces: Sequence[Face], axis: F64) -> float:
    """Where along an ``axis`` (2,) voxels are to begin, so that the faces across it stand in their middles: their mean
    place within voxels, in which those with more to show for themselves count more.
    """
    main = np.arctan2(axis[1], axis[0])
    across = [f for f in faces if abs(f.normal @ axis) > 0.9 and abs(turn_to(f.normal, main)) < ALONG]
    phase = np.array([2j * np.pi * (f.centre @ axis) / PLAN for f in across])
    weight = np.array([columns.bins[f.columns].sum() for f in across], np.float64)
    middle = np.angle((weight * np.exp(phase)).sum()) / (2 * np.pi) * PLAN
    return float(middle - PLAN / 2)


def in_survey(structure: StructureShape, lattice: Lattice) -> StructureShape:
    """A structure in a lattice's own coordinates, in those of the survey."""
    if lattice == Lattice():
        return structure
    storeys = tuple(_storey(storey, lattice) for storey in structure.storeys)
    return replace(structure, storeys=storeys, yaw=float(np.mod(structure.yaw + lattice.yaw, np.pi / 2)))


def _storey(storey: StoreyShape, lattice: Lattice) -> StoreyShape:
    return replace(
        storey,
        spaces=tuple(_space(space, lattice) for space in storey.spaces),
        walls=tuple(_wall(wall, lattice) for wall in storey.walls),
        stairs=tuple(
            replace(s, outline=_ring(s.outline, lattice), climb=_ring((s.climb,), Lattice(lattice.yaw))[0])
            for s in storey.stairs
        ),
        wells=tuple(_ring(well, lattice) for well in storey.wells),
        columns=tuple(replace(c, outline=_ring(c.outline, lattice)) for c in storey.columns),
        beams=tuple(replace(b, outline=_ring(b.outline, lattice)) for b in storey.beams),
        roofs=tuple(replace(r, outline=_corners(r.outline, lattice)) for r in storey.roofs),
    )


def _space(space: SpaceShape, lattice: Lattice) -> SpaceShape:
    return replace(
        space,
        outline=_ring(space.outline, lattice),
        holes=tuple(_ring(hole, lattice) for hole in space.holes),
        soffits=tuple(_corners(soffit, lattice) for soffit in space.soffits),
    )


def _wall(wall: WallShape, lattice: Lattice) -> WallShape:
    start, end = _ring((wall.start, wall.end), lattice)
    return replace(wall, start=start, end=end)


def _ring(ring: Ring, lattice: Lattice) -> Ring:
    return tuple(_point(x, y) for x, y in lattice.local(np.array(ring)).tolist())


def _point(x: float, y: float) -> Point:
    return round(x, 4), round(y, 4)


def _corners(
    corners: tuple[tuple[float, float, float], ...], lattice: Lattice
) -> tuple[tuple[float, float, float], ...]:
    return tuple((*_point(x, y), z) for x, y, z in lattice.local(np.array(corners)).tolist())
