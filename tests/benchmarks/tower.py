"""A large building for measuring cost: copies of a simulated flat side by side and one above the other.

A flat is scanned once; each copy is written as files of its own with the poses moved. So a building of 100 million
points costs the casting of seven sweeps, and its points, stations, rooms and storeys grow together, as they do in a
real survey.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scan2bim.simulate.e57 import write_e57
from scan2bim.simulate.scanner import ScannerSpec, Sweep, cast_all
from scan2bim.simulate.scene import Scene
from scan2bim.simulate.scenes import rotated_flat

STEP = math.radians(0.275)
"""Between rays: 0.7 M records a station, 5 M a flat of seven stations."""
ALONG = 10.9
"""Metres from a flat to the next: their outer walls stand back to back."""
ABOVE = 2.8
"""Metres from a storey to the next: 2.52 m clear, 0.28 m of slab."""
WIDTH = 5
"""Flats side by side on each storey, except where there are fewer in all."""
LAZ_SCALE = 0.0005
"""Metres: as fine as the E57 files."""


@dataclass(frozen=True, slots=True)
class Place:
    """A flat's place in the building: how many flats along and above the first."""

    along: int
    above: int


def places(flats: int) -> list[Place]:
    """The places of so many flats, filled storey by storey; two storeys at least."""
    width = min(WIDTH, max(1, flats // 2))
    return [Place(i % width, i // width) for i in range(flats)]


def flat_sweeps() -> list[Sweep]:
    """The sweeps of one flat. It has no window in its end walls, so that none looks into its neighbour."""
    scene = _without_end_windows(rotated_flat())
    spec = ScannerSpec(step=STEP, registration=0.001, registration_turn=math.radians(0.003))
    return list(cast_all(scene, spec, seed=5))


def _without_end_windows(scene: Scene) -> Scene:
    storeys = tuple(
        replace(
            storey,
            walls=tuple(
                replace(wall, windows=()) if wall.external and wall.start[0] == wall.end[0] else wall
                for wall in storey.walls
            ),
        )
        for storey in scene.storeys
    )
    return replace(scene, storeys=storeys)


def copy_of(sweeps: list[Sweep], place: Place) -> Iterator[Sweep]:
    """The sweeps of the flat at a place: the same records, other names and poses."""
    rotation = rotated_flat().placement.rotation()
    move = rotation @ np.array([ALONG * place.along, 0.0, ABOVE * place.above])
    for sweep in sweeps:
        yield replace(
            sweep, name=f"flat_{place.above}_{place.along}_{sweep.name}", translation=sweep.translation + move
        )


def write_flat(sweeps: list[Sweep], place: Place, folder: Path) -> int:
    """One E57 file a station into the folder; gives the number of records."""
    folder.mkdir(parents=True)
    for sweep in copy_of(sweeps, place):
        write_e57(folder / f"{sweep.name}.e57", [sweep])
    return sum(len(sweep.xyz) + len(sweep.miss_directions) for sweep in sweeps)


def write_laz(sweeps: list[Sweep], flats: list[Place], path: Path) -> int:
    """All hits of the flats merged in one LAZ file, with colour, intensity and station; gives the number of points."""
    import laspy

    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = np.full(3, LAZ_SCALE), np.zeros(3)
    count = 0
    with laspy.open(str(path), mode="w", header=header) as writer:
        for station, sweep in enumerate(s for place in flats for s in copy_of(sweeps, place)):
            points: Any = laspy.ScaleAwarePointRecord.zeros(len(sweep.xyz), header=header)
            points.x, points.y, points.z = sweep.world().T
            points.red, points.green, points.blue = sweep.rgb.T.astype(np.uint16) * 257
            points.intensity = np.round(sweep.intensity * 65535).astype(np.uint16)
            points.point_source_id = np.full(len(sweep.xyz), station + 1, np.uint16)
            writer.write_points(points)
            count += len(sweep.xyz)
    return count
