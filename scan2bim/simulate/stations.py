"""Where the scanner stands: places that see the most of each room, or those of a list."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.errors import InputError, PrecheckError, reason
from scan2bim.simulate.areas import Area
from scan2bim.simulate.effects import World
from scan2bim.simulate.scene import Point3, Station
from scan2bim.simulate.variation import EYE
from scan2bim.simulate.visibility import seen_by

F64 = NDArray[np.float64]
Rng = np.random.Generator

CLEAR = 0.4
"""Metres round the scanner in which nothing may stand."""
CANDIDATES = 24
"""Places tried in each room."""
ENOUGH = 0.97
"""Share of what the candidates together see from which on a room needs no more stations."""
WORTH = 0.04
"""Share that one more station must add."""
MOST = 6
"""Stations in a room."""
TARGET_STEP = 0.3
"""Metres between the places on the walls that are to be seen."""
COLUMNS = ("x", "y", "z")


def place_stations(areas: Sequence[Area], world: World, rng: Rng) -> list[Station]:
    """Stations in every area in which a scanner can stand. Raises PrecheckError where there is none."""
    found: list[Station] = []
    for area in areas:
        for position in _best_places(area, world, rng):
            heading = float(rng.uniform(0.0, 2 * math.pi))
            found.append(Station(f"scan_{len(found) + 1:03d}", position, heading))
    if not found:
        raise PrecheckError(
            "the model has no space and no floor under a ceiling in which a scanner could stand. "
            "Give the positions: --stations FILE.csv with the columns x, y, z."
        )
    return found


def read_stations(path: Path, rng: Rng) -> list[Station]:
    """Stations from a CSV file with the columns x, y, z in metres and, if wanted, name. Raises InputError."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
            fields = {name.strip().lower() for name in (rows[0] if rows else {}) if name}
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"cannot be read as CSV ({reason(error)}).") from error
    if not rows or not set(COLUMNS) <= fields:
        raise InputError(
            path, "expected a first line with the names x, y, z (and name, if wanted), then a station a line."
        )
    found: list[Station] = []
    for number, row in enumerate(rows, 2):
        cells = {str(key).strip().lower(): value for key, value in row.items()}
        try:
            x, y, z = (float(cells[axis] or "") for axis in COLUMNS)
        except ValueError:
            raise InputError(path, f"line {number}: expected numbers for x, y, z, got {list(row.values())}.") from None
        if not all(map(math.isfinite, (x, y, z))):
            raise InputError(path, f"line {number}: expected finite numbers for x, y, z, got {list(row.values())}.")
        name = (cells.get("name") or "").strip() or f"scan_{number - 1:03d}"
        found.append(Station(name, (x, y, z), float(rng.uniform(0.0, 2 * math.pi))))
    names = [station.name for station in found]
    if len(set(names)) < len(names) or any("/" in name or "\\" in name for name in names):
        raise InputError(path, "expected names that are all different and can be names of files.")
    return found


def area_at(position: Point3, areas: Sequence[Area]) -> Area | None:
    """The area that a position is in, the one whose floor is next below it."""
    point = shapely.Point(position[:2])
    under = [a for a in areas if a.floor <= position[2] + 0.1 <= a.floor + a.height and a.outline.contains(point)]
    return max(under, key=lambda area: area.floor, default=None)


def _best_places(area: Area, world: World, rng: Rng) -> list[Point3]:
    """Greedily the places that see most of the walls that is not seen yet."""
    places = _standing_places(area, world, rng)
    if not len(places):
        return []
    seen = seen_by(world, places, _targets(area))
    reachable = int(seen.any(axis=0).sum())
    done = np.zeros(seen.shape[1], dtype=np.bool_)
    chosen: list[int] = []
    while len(chosen) < MOST:
        gains = (seen & ~done).sum(axis=1)
        best = int(gains.argmax())
        if chosen and (gains[best] < WORTH * reachable or done.sum() >= ENOUGH * reachable):
            break
        chosen.append(best)
        done |= seen[best]
    return [(float(x), float(y), float(z)) for x, y, z in places[chosen]]


def _standing_places(area: Area, world: World, rng: Rng) -> F64:
    """Up to ``CANDIDATES`` places (n, 3) at eye height over free floor, clear of everything round them."""
    inner = area.outline.buffer(-CLEAR)
    if inner.is_empty:
        inner = area.outline.buffer(-CLEAR / 2)
    if inner.is_empty:
        return np.zeros((0, 3))
    x0, y0, x1, y1 = inner.bounds
    tried = np.column_stack([rng.uniform(x0, x1, 40 * CANDIDATES), rng.uniform(y0, y1, 40 * CANDIDATES)])
    tried = tried[shapely.contains_xy(inner, *tried.T)][: 4 * CANDIDATES]
    middle = shapely.get_coordinates(inner.representative_point())
    tried = np.concatenate([middle, tried])
    places = np.column_stack([tried, np.full(len(tried), area.floor + min(EYE, 0.75 * area.height))])
    free = np.array([_is_clear(place, area, world) for place in places], dtype=np.bool_)
    return places[free][:CANDIDATES]


def _is_clear(place: F64, area: Area, world: World) -> bool:
    """Whether the floor lies under a place, and nothing stands near the scanner or its tripod."""
    turns = np.arange(12) * (2 * math.pi / 12)
    level = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(12)])
    low = place - [0.0, 0.0, place[2] - area.floor - 0.4]
    origins = np.concatenate([[place], np.tile(place, (12, 1)), np.tile(low, (12, 1))])
    ranges = world.rays(origins, np.concatenate([[[0.0, 0.0, -1.0]], level, level])).range
    return bool(abs(ranges[0] - (place[2] - area.floor)) < 0.35 and (ranges[1:] > CLEAR).all())


def _targets(area: Area) -> F64:
    """Places (n, 3) just inside the area's outline, near the floor, at breast height and under the ceiling."""
    ring = area.outline.buffer(-0.05).boundary
    lines = [part for part in shapely.get_parts(ring) if part.length > 0]
    plan = [
        shapely.get_coordinates(shapely.line_interpolate_point(line, np.arange(0.0, line.length, TARGET_STEP)))
        for line in lines
    ]
    if not plan:
        return np.zeros((0, 3))
    points = np.concatenate(plan)
    heights = area.floor + area.height * np.array([0.1, 0.45, 0.85])
    return np.column_stack([np.tile(points, (3, 1)), np.repeat(heights, len(points))])
