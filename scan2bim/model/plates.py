"""Floors and ceilings of spaces: which slab, covering or roof they are of, and which space is behind."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from scan2bim.model.ceilings import plane_of
from scan2bim.model.elements import Area, Building, Point3, Ring, Slab, Space, Storey

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

LEAST_AREA: Final = 1e-4
"""Square metres. What is smaller is a leftover of a crossing outline."""

SLIVER: Final = 0.01
"""Metres. Narrower pieces of a floor or ceiling are none."""

NEAR: Final = 0.15
"""Metres. A plate whose face is this near to a space's floor or ceiling bounds it."""

DEEP: Final = 1.0
"""Metres. Deepest build-up between a space and the one above it."""

SNAP: Final = 1e-6
"""Metres. Overlays snap to this grid: without one, GEOS may give back the whole where edges nearly fall together."""


@dataclass(frozen=True, slots=True)
class LevelPatch:
    """A piece of a space's floor or ceiling (``up``) at height z, and what it is of."""

    polygon: Polygon
    z: float
    up: bool
    element: str | None
    beyond: str | None
    external: bool | None


def valid_areas(outline: Ring, holes: Sequence[Ring] = ()) -> list[Polygon]:
    """An outline with holes as valid polygons, outlines counter-clockwise and holes clockwise; none without area."""
    import shapely

    if len(set(outline)) < 3:
        return []
    area = shapely.Polygon(outline, [hole for hole in holes if len(set(hole)) >= 3])
    valid = area if area.is_valid else shapely.make_valid(area)
    parts = [part for part in shapely.get_parts(shapely.get_parts(valid)) if isinstance(part, shapely.Polygon)]
    return [shapely.orient_polygons(part) for part in parts if part.area > LEAST_AREA]


def horizontal_patches(
    building: Building, storey: Storey, space: Space, areas: Sequence[Polygon]
) -> Iterator[LevelPatch]:
    """The space's floor, and its ceiling where that is level, in pieces that cover each once."""
    top = _top(space)
    floors = sorted(_slabs(building, space.base, True), key=lambda slab: (abs(slab.top.value - space.base), slab.id))
    ceilings: list[Area] = sorted(
        (c for c in storey.coverings if abs(c.top.value - c.thickness.value - top) < NEAR),
        key=lambda c: (abs(c.top.value - c.thickness.value - top), c.id),
    )
    ceilings += _slabs(building, top, False)
    below = [s for other in building.storeys for s in other.spaces if -DEEP < _top(s) - space.base < NEAR]
    above = [s for other in building.storeys for s in other.spaces if -NEAR < s.base - top < DEEP]
    yield from _covered(areas, space.base, False, [(f.id, f) for f in floors], below, space.id)
    if not space.ceiling:
        yield from _covered(areas, top, True, [(c.id, c) for c in ceilings], above, space.id)


def element_over(storey: Storey, piece: Sequence[Point3]) -> tuple[str | None, bool | None]:
    """The roof plane or covering on which a plane piece of a ceiling lies, and whether the outside is behind it."""
    import shapely

    inner = shapely.Polygon([corner[:2] for corner in piece]).representative_point()
    z = _height_of(piece, inner.x, inner.y)
    over = [
        (abs(_height_of(roof.outline, inner.x, inner.y) - z), roof.id)
        for roof in storey.roofs
        if shapely.Polygon([corner[:2] for corner in roof.outline]).distance(inner) < NEAR
    ]
    if over and min(over)[0] < NEAR:
        return min(over)[1], True
    for covering in storey.coverings:
        near = abs(covering.top.value - covering.thickness.value - z) < NEAR
        if near and shapely.Polygon(covering.outline, covering.holes).distance(inner) < SLIVER:
            return covering.id, None
    return None, None


def _height_of(piece: Sequence[Point3], x: float, y: float) -> float:
    a, b, c = plane_of(tuple(piece))
    return a * x + b * y + c


def _slabs(building: Building, z: float, floor: bool) -> list[Slab]:
    """Slabs whose upper side, or lower side, is at this height."""
    slabs = [slab for storey in building.storeys for slab in storey.slabs]
    if floor:
        return [slab for slab in slabs if abs(slab.top.value - z) < NEAR]
    return [slab for slab in slabs if -NEAR < slab.top.value - slab.thickness.value - z < DEEP / 2]


def _top(space: Space) -> float:
    return space.base + space.height.value


def _covered(
    areas: Sequence[Polygon], z: float, up: bool, plates: list[tuple[str, Area]], spaces: list[Space], own: str
) -> Iterator[LevelPatch]:
    import shapely

    from scan2bim.geometry.polygons import area_outside

    rest: BaseGeometry = shapely.union_all(list(areas))
    for name, plate in plates:
        outline = _whole(plate.outline, plate.holes)
        if _apart(rest, outline):
            continue
        external = isinstance(plate, Slab) and plate.use != "FLOOR"
        for part in _parts(shapely.intersection(rest, outline, grid_size=SNAP)):
            yield from _divided(part, z, up, name, spaces, own, external)
        rest = area_outside(rest, outline, SNAP)
    for part in _parts(rest):
        yield from _divided(part, z, up, None, spaces, own, None)


def _divided(
    part: Polygon, z: float, up: bool, element: str | None, spaces: list[Space], own: str, external: bool | None
) -> Iterator[LevelPatch]:
    """The part in pieces by the space behind."""
    import shapely

    from scan2bim.geometry.polygons import area_outside

    rest: BaseGeometry = part
    for space in spaces:
        behind = _whole(space.outline, space.holes)
        if space.id == own or _apart(rest, behind):
            continue
        shared = list(_parts(shapely.intersection(rest, behind, grid_size=SNAP)))
        for piece in shared:
            yield LevelPatch(piece, z, up, element, space.id, False)
        if shared:
            rest = area_outside(rest, shapely.union_all(shared), SNAP)
    for piece in _parts(rest):
        yield LevelPatch(piece, z, up, element, None, external if external else None)


@lru_cache(maxsize=1024)
def _whole(outline: Ring, holes: tuple[Ring, ...]) -> BaseGeometry:
    """The area of an outline with holes: each is laid against all others."""
    import shapely

    return shapely.union_all(valid_areas(outline, holes))


def _apart(one: BaseGeometry, other: BaseGeometry) -> bool:
    """Whether the boxes round two shapes have nothing in common: there are far more such than others."""
    left, bottom, right, top = one.bounds
    low, lowest, high, highest = other.bounds
    return bool(high < left or low > right or highest < bottom or lowest > top)


def _parts(shape: BaseGeometry) -> Iterator[Polygon]:
    """Polygons of some width."""
    import shapely

    for part in shapely.get_parts(shape):
        if isinstance(part, shapely.Polygon) and not part.buffer(-SLIVER / 2).is_empty:
            yield shapely.orient_polygons(part)
