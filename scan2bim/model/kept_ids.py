"""Identifiers of an earlier model of the same building: what still stands where it stood keeps its own.

Ids made from places alone (``ids``) change where a length falls on the other side of a line of the grid, or a wall is
found longer than before. Told which model came before, two surveys of one building can be compared id by id.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

import shapely

from scan2bim.model.elements import Area, Building, Opening, Point3, RoofPlane, Storey, Wall
from scan2bim.model.ids import stable_id
from scan2bim.model.queries import everything
from scan2bim.model.shapes import opening_outline, wall_footprints

SAME: Final = 0.3
"""Least overlap (shared over joint volume) of what counts as the same thing: half of it, moved or changed a little."""
REACH: Final = 0.1
"""Metres by which walls and what is in them count as thicker, so that a thin wall that was moved is still the same."""
LEVEL: Final = 0.5
"""Metres up and down over which a plate counts, since thicknesses are often assumed; and storeys may lie apart."""
_REFERENCES: Final = frozenset(("id", "wall", "to", "left_spaces", "right_spaces"))
"""Keys of the model's form whose values are ids of elements."""


@dataclass(frozen=True, slots=True)
class _Thing:
    """Something with a place: its footprint, from z ``low`` up to ``high``, metres."""

    id: str
    kind: str
    shape: shapely.Geometry
    low: float
    high: float

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return float(shapely.area(self.shape)) * (self.high - self.low)

    def overlap(self, other: _Thing) -> float:
        """Shared over joint volume."""
        rise = min(self.high, other.high) - max(self.low, other.low)
        shared = float(shapely.area(shapely.intersection(self.shape, other.shape))) * max(rise, 0.0)
        both = self.volume + other.volume
        return shared / max(both - shared, 1e-9)


def with_ids_of(building: Building, earlier: Building) -> Building:
    """The building; whatever the earlier model has in the same place and of the same kind carries the id from there."""
    now, before = _by_kind(building, (0.0, 0.0, 0.0)), _by_kind(earlier, _offset(earlier, building))
    kept = {building.id: earlier.id}
    for kind, things in now.items():
        kept |= _matched(things, before.get(kind, []))
    kept |= _fills(building, earlier, kept)
    taken = set(kept.values())
    for thing in everything(building):
        if thing.id not in kept and thing.id in taken:
            kept[thing.id] = stable_id("new", thing.id)
    return Building.model_validate(_renamed(building.model_dump(), kept))


def _offset(earlier: Building, building: Building) -> Point3:
    """What brings the earlier model's coordinates into the building's."""
    x, y, z = (old - new for old, new in zip(earlier.frame.shift, building.frame.shift, strict=True))
    return x, y, z


def _matched(things: list[_Thing], before: list[_Thing]) -> dict[str, str]:
    """The earlier id of each thing that has one: those that overlap most first, each earlier id once."""
    if not before:
        return {}
    tree = shapely.STRtree([thing.shape for thing in before])
    pairs = [
        (-things[i].overlap(before[j]), things[i].id, before[j].id)
        for i, j in zip(*tree.query([thing.shape for thing in things], predicate="intersects").tolist(), strict=True)
    ]
    found: dict[str, str] = {}
    given: set[str] = set()
    for overlap, new, old in sorted(pairs):
        if -overlap >= SAME and new not in found and old not in given:
            found[new] = old
            given.add(old)
    return found


def _fills(building: Building, earlier: Building, kept: Mapping[str, str]) -> dict[str, str]:
    """Doors and windows whose opening is kept and was filled by one of their kind."""
    before = {opening.id: opening.fill for opening in _openings(earlier)}
    return {
        opening.fill.id: old.id
        for opening in _openings(building)
        if opening.fill is not None
        and (old := before.get(kept.get(opening.id, ""))) is not None
        and old.kind == opening.fill.kind
    }


def _openings(building: Building) -> Iterator[Opening]:
    return chain.from_iterable(wall.openings for storey in building.storeys for wall in storey.walls)


def _by_kind(building: Building, offset: Point3) -> dict[str, list[_Thing]]:
    """All elements with a place, moved by the offset."""
    found: dict[str, list[_Thing]] = defaultdict(list)
    for thing in chain.from_iterable(_things(storey) for storey in building.storeys):
        shape = shapely.transform(shapely.make_valid(thing.shape), lambda xy: xy + offset[:2])
        if not shape.is_empty:
            found[thing.kind].append(_Thing(thing.id, thing.kind, shape, thing.low + offset[2], thing.high + offset[2]))
    return found


def _things(storey: Storey) -> Iterator[_Thing]:
    level = storey.elevation.value
    yield _Thing(storey.id, "Storey", shapely.box(-1e6, -1e6, 1e6, 1e6), level - LEVEL, level + LEVEL)
    footprints = wall_footprints(storey)
    for wall in storey.walls:
        body = shapely.Polygon(footprints[wall.id]).buffer(REACH, join_style="mitre")
        yield _Thing(wall.id, "Wall", body, wall.base, wall.base + wall.height.value)
        yield from (_opening(wall, opening) for opening in wall.openings)
    for upright in (*storey.spaces, *storey.columns, *storey.beams, *storey.stairs):
        shape, top = shapely.Polygon(upright.outline), upright.base + upright.height.value
        yield _Thing(upright.id, type(upright).__name__, shape, upright.base, top)
    for plate in (*storey.slabs, *storey.coverings, *storey.roofs):
        yield _plate(plate)


def _opening(wall: Wall, opening: Opening) -> _Thing:
    shape = shapely.Polygon(opening_outline(wall, opening)).buffer(REACH, join_style="mitre")
    low = wall.base + opening.sill.value
    return _Thing(opening.id, "Opening", shape, low, low + opening.height.value)


def _plate(plate: Area | RoofPlane) -> _Thing:
    if isinstance(plate, RoofPlane):
        heights = [z for _, _, z in plate.outline]
        outline = [(x, y) for x, y, _ in plate.outline]
        return _Thing(plate.id, "RoofPlane", shapely.Polygon(outline), min(heights), max(heights) + LEVEL)
    top, kind = plate.top.value, type(plate).__name__
    return _Thing(plate.id, kind, shapely.Polygon(plate.outline), top - LEVEL, top + LEVEL)


def _renamed(value: Any, kept: Mapping[str, str], key: str = "") -> Any:
    """The model's plain form with other ids, wherever an id stands."""
    if isinstance(value, dict):
        return {name: _renamed(part, kept, name) for name, part in value.items()}
    if isinstance(value, (tuple, list)):
        return tuple(_renamed(part, kept, key) for part in value)
    return kept.get(value, value) if key in _REFERENCES and isinstance(value, str) else value
