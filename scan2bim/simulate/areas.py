"""Where one can stand in a building: its spaces, or where it has none, the floor under a ceiling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.simulate.effects import World
from scan2bim.truth.values import SpaceTruth, StoreyTruth

F64 = NDArray[np.float64]

GRID = 0.25
"""Metres between the places where floor is looked for."""
HEADROOM = (1.9, 8.0)
"""Metres of clear height between floor and ceiling that make a room."""
FLOOR_OFF = 0.35
"""Metres by which a floor may lie off its storey's level."""
OFF_WALL = 0.2
"""Metres from walls that places of the grid keep: more than half of its diagonal, so that none bridges a thin wall."""
SMALLEST = 1.0
"""Square metres."""


@dataclass(frozen=True, slots=True)
class Area:
    """A name, what it covers in plan, the height of its floor and its clear height."""

    name: str
    storey: str
    outline: BaseGeometry
    floor: float
    height: float


def areas_of(spaces: Sequence[SpaceTruth], storeys: Sequence[StoreyTruth], world: World) -> list[Area]:
    """The model's spaces; where it has none, the free floors of its storeys, or of the whole without storeys."""
    found = [Area(s.name, s.storey, shapely.make_valid(Polygon(s.outline, s.holes)), s.base, s.height) for s in spaces]
    return [area for area in found if area.outline.area >= SMALLEST] or free_floors(storeys, world)


def free_floors(storeys: Sequence[StoreyTruth], world: World) -> list[Area]:
    """Floor with a ceiling over it, storey by storey; each connected part is an area."""
    patches = world.patches
    if not len(patches):
        return []
    corners = np.concatenate([patches.origin, patches.origin + patches.u, patches.origin + patches.v])
    low, high = corners.min(axis=0), corners.max(axis=0)
    levels = storeys or (StoreyTruth(name="", elevation=float(low[2])),)
    x, y = (np.arange(low[i] + GRID / 2, high[i], GRID) for i in (0, 1))
    plan = np.column_stack([grid.ravel() for grid in np.meshgrid(x, y)])
    found: list[Area] = []
    for storey in levels:
        floor, clear = _floor_under(world, plan, storey.elevation)
        inside = (np.abs(floor - storey.elevation) < FLOOR_OFF) & (clear > HEADROOM[0]) & (clear < HEADROOM[1])
        inside &= _clearance(world, plan, storey.elevation) > OFF_WALL
        if not inside.any():
            continue
        # Cells touch at corners: grown by a millimetre, connected ones are one.
        cells = shapely.box(*(plan[inside] - GRID / 2 - 1e-3).T, *(plan[inside] + GRID / 2 + 1e-3).T)
        parts = [p.buffer(OFF_WALL / 2) for p in shapely.get_parts(shapely.union_all(cells)) if p.area >= SMALLEST]
        level, height = float(np.median(floor[inside])), float(np.median(clear[inside]))
        found += [Area(f"{storey.name} {i + 1}".strip(), storey.name, p, level, height) for i, p in enumerate(parts)]
    return found


def _floor_under(world: World, plan: F64, level: float) -> tuple[F64, F64]:
    """Height of the floor, and clear height over it, at places in plan (n, 2), from 1.5 m over a level."""
    middle = np.column_stack([plan, np.full(len(plan), level + 1.5)])
    down, up = (np.tile([0.0, 0.0, way], (len(plan), 1)) for way in (-1.0, 1.0))
    below, above = world.rays(middle, down).range, world.rays(middle, up).range
    return level + 1.5 - below, below + above


def _clearance(world: World, plan: F64, level: float) -> F64:
    """Metres to the nearest thing around at 1.5 m over a level, at places in plan (n, 2)."""
    middle = np.column_stack([plan, np.full(len(plan), level + 1.5)])
    nearest = np.full(len(plan), np.inf)
    for turn in np.arange(8) * (np.pi / 4):
        towards = np.tile([np.cos(turn), np.sin(turn), 0.0], (len(plan), 1))
        nearest = np.minimum(nearest, world.rays(middle, towards).range)
    return nearest
