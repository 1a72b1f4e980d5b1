"""Second-level space boundaries: every stretch of a space's surface, what it is of and which space is behind it.

Top-level boundaries cover the surface of a space once; doors, windows and passages lie in that of their wall. A stretch
without an element is virtual. Metres, the building's frame.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from scan2bim.model.boundary_context import Behind, Solid, StoreyPlan, plan_of
from scan2bim.model.ceilings import plane_of
from scan2bim.model.elements import Building, Opening, Point2, Point3, Ring, Space, Storey
from scan2bim.model.plates import element_over, horizontal_patches
from scan2bim.model.queries import point_on_wall, wall_direction
from scan2bim.model.slope_sides import beside_wall, ring_of, stretch_under

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

STEP: Final = 0.005
"""Metres. Cuts of an edge that are nearer to each other are one."""

PARALLEL: Final = 0.9
"""Cosine of the angle up to which an edge runs along a wall's face."""

LEAST: Final = 0.02
"""Metres. No boundary of an opening is narrower or lower."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A plane piece: origin, x axis and outward normal in space; outline and holes in its x and y (normal cross x)."""

    origin: Point3
    x_axis: Point3
    normal: Point3
    outline: Ring
    holes: tuple[Ring, ...] = ()


@dataclass(frozen=True, slots=True)
class Boundary:
    """A piece of a space's surface.

    key: what makes it one of its own within the building. element: id of the wall, slab, door, opening ... that it is
    of, None of a virtual one. parent: key of the boundary that it lies in. beyond: id of the space behind it. twin: key
    of that space's boundary on the other side. external: whether the outside is behind it, None where not known.
    """

    key: str
    space: str
    element: str | None
    patch: Patch
    beyond: str | None = None
    external: bool | None = None
    parent: str | None = None
    twin: str | None = None


@dataclass(slots=True)
class _Found:
    """Boundaries as they are found, and which could be the two sides of one thing."""

    boundaries: dict[str, Boundary] = field(default_factory=dict[str, Boundary])
    sides: dict[tuple[str, ...], list[tuple[str, Point3]]] = field(
        default_factory=lambda: defaultdict[tuple[str, ...], list[tuple[str, Point3]]](list)
    )

    def add(self, boundary: Boundary, middle: Point3) -> Boundary:
        """Keeps it under a key that is its own."""
        key, count = boundary.key, 1
        while key in self.boundaries:
            count += 1
            key = f"{boundary.key} {count}"
        made = replace(boundary, key=key)
        self.boundaries[key] = made
        if made.beyond is not None:
            pair = sorted((made.space, made.beyond))
            self.sides[(made.element or "", *pair)].append((key, middle))
        return made


@dataclass(frozen=True, slots=True)
class _Edge:
    """An edge of a space's outline with the space to its left."""

    start: Point2
    end: Point2

    @property
    def length(self) -> float:
        return math.dist(self.start, self.end)

    @property
    def along(self) -> Point2:
        return ((self.end[0] - self.start[0]) / self.length, (self.end[1] - self.start[1]) / self.length)

    @property
    def outward(self) -> Point2:
        dx, dy = self.along
        return (dy, -dx)

    def at(self, t: float, out: float = 0.0) -> Point2:
        """The point t metres from the start, ``out`` metres outside."""
        (dx, dy), (nx, ny) = self.along, self.outward
        return (self.start[0] + t * dx + out * nx, self.start[1] + t * dy + out * ny)

    def project(self, point: Point2) -> tuple[float, float]:
        """How far along the edge and how far outside it the point lies."""
        (dx, dy), (nx, ny) = self.along, self.outward
        x, y = point[0] - self.start[0], point[1] - self.start[1]
        return (x * dx + y * dy, x * nx + y * ny)


def space_boundaries(building: Building) -> tuple[Boundary, ...]:
    """All boundaries of all spaces, parents before what lies in them."""
    found = _Found()
    for storey in building.storeys:
        plan = plan_of(storey)
        for space in storey.spaces:
            for polygon in plan.areas.get(space.id, ()):
                _sides(found, plan, space, polygon)
            for patch in horizontal_patches(building, storey, space, plan.areas.get(space.id, ())):
                _level(found, space, patch.element, patch.polygon, patch.z, patch.up, patch.beyond, patch.external)
            for piece in space.ceiling:
                _soffit(found, storey, space, piece)
    return _with_twins(found)


def _sides(found: _Found, plan: StoreyPlan, space: Space, polygon: Polygon) -> None:
    for ring in (polygon.exterior, *polygon.interiors):
        points = [(float(x), float(y)) for x, y in ring.coords]
        for start, end in itertools.pairwise(points):
            edge = _Edge(start, end)
            if edge.length > 1e-4:
                for first, last, behind in _stretches(plan, space, edge):
                    _side(found, plan, space, edge, (first, last), behind)


def _stretches(plan: StoreyPlan, space: Space, edge: _Edge) -> Iterator[tuple[float, float, Behind]]:
    """Parts of the edge, in its order, each with one thing behind it."""
    cuts = sorted({0.0, edge.length, *_cuts(plan, space, edge)})
    kept = [cuts[0]]
    for cut in cuts[1:]:
        if cut - kept[-1] > STEP:
            kept.append(cut)
    kept = [*kept[:-1], edge.length] if len(kept) > 1 else [0.0, edge.length]
    first, current = kept[0], None
    for a, b in itertools.pairwise(kept):
        t = (a + b) / 2
        behind = plan.behind(space, edge.at(t), edge.at(t, 1.0))
        if current is not None and behind != current:
            yield first, a, current
            first = a
        current = behind
    if current is not None:
        yield first, kept[-1], current


def _cuts(plan: StoreyPlan, space: Space, edge: _Edge) -> Iterator[float]:
    """Where what is behind the edge may change."""
    for point in plan.corners_near(edge.start, edge.end):
        t, out = edge.project(point)
        if 0.0 < t < edge.length and -0.1 < out < 1.0:
            yield t
    for side in space.open_sides:
        for point in (side.start, side.end):
            t, _ = edge.project(point)
            if 0.0 < t < edge.length:
                yield t


def _side(
    found: _Found, plan: StoreyPlan, space: Space, edge: _Edge, part: tuple[float, float], behind: Behind
) -> None:
    """The upright boundaries of one part of an edge: up to the element's top, above it a virtual one."""
    top = space.base + space.height.value
    solid = None if behind.solid is None else plan.solids[behind.solid]
    if solid is not None and (space.ceiling or (solid.wall is not None and solid.wall.profile)):
        _under_slope(found, plan, space, edge, part, behind)
        return
    low = space.base
    if solid is not None and solid.top > low + LEAST:
        reach = top if solid.top > top - LEAST else solid.top
        wall = found.add(*_upright(space, edge, part, (low, reach), behind, solid.id, plan.is_external(behind)))
        for opening in solid.wall.openings if solid.wall is not None else ():
            _in_wall(found, space, edge, part, (low, reach), wall, solid, opening)
        low = reach
    if top - low > LEAST / 2:
        beyond = behind.beyond or plan.open_to(space, edge.at((part[0] + part[1]) / 2, 0.0), edge.outward)
        open_side = replace(behind, beyond=beyond)
        if space.ceiling:
            _pieces(found, space, edge, part, stretch_under(space, edge.start, edge.end, part), open_side)
        else:
            found.add(*_upright(space, edge, part, (low, top), open_side, None, None))


def _under_slope(
    found: _Found, plan: StoreyPlan, space: Space, edge: _Edge, part: tuple[float, float], behind: Behind
) -> None:
    """The upright boundaries of one part of an edge where its space or the wall beside it ends in slopes."""
    if behind.solid is None:
        return
    solid = plan.solids[behind.solid]
    room = stretch_under(space, edge.start, edge.end, part)
    own, rest = beside_wall(room, solid, space.base, edge.at(part[0]), edge.along)
    if own is not None:
        heights = space.base, space.base + float(own.bounds[3])
        made, middle = _upright(space, edge, part, heights, behind, solid.id, plan.is_external(behind))
        wall = found.add(replace(made, patch=replace(made.patch, outline=ring_of(own))), middle)
        for opening in solid.wall.openings if solid.wall is not None else ():
            _in_wall(found, space, edge, part, heights, wall, solid, opening)
    beyond = behind.beyond or plan.open_to(space, edge.at((part[0] + part[1]) / 2, 0.0), edge.outward)
    _pieces(found, space, edge, part, rest, replace(behind, beyond=beyond))


def _pieces(
    found: _Found, space: Space, edge: _Edge, part: tuple[float, float], area: BaseGeometry, behind: Behind
) -> None:
    """Virtual boundaries over an area of an edge's part."""
    import shapely

    for piece in shapely.get_parts(area):
        if isinstance(piece, shapely.Polygon) and piece.area > LEAST * LEAST:
            made, _ = _upright(space, edge, part, (space.base, space.base + LEAST), behind, None, None)
            inner = piece.representative_point()
            x, y = edge.at(part[0] + inner.x)
            found.add(replace(made, patch=replace(made.patch, outline=ring_of(piece))), (x, y, space.base + inner.y))


def _in_wall(
    found: _Found,
    space: Space,
    edge: _Edge,
    part: tuple[float, float],
    heights: tuple[float, float],
    parent: Boundary,
    solid: Solid,
    opening: Opening,
) -> None:
    """The boundary of what fills an opening, or of the opening itself where nothing does."""
    wall = solid.wall
    if wall is None or opening.depth is not None:
        return
    (dx, dy), (ux, uy) = edge.along, wall_direction(wall, opening.offset.value + opening.width.value / 2)
    if abs(dx * ux + dy * uy) < PARALLEL:
        return  # the wall's end, not one of its faces
    ends = [
        edge.project(point_on_wall(wall, opening.offset.value + x, 0.0, 0.0)[:2])[0] for x in (0.0, opening.width.value)
    ]
    first, last = max(min(ends), part[0]), min(max(ends), part[1])
    low = max(wall.base + opening.sill.value, heights[0])
    high = min(wall.base + opening.sill.value + opening.height.value, heights[1])
    if last - first < LEAST or high - low < LEAST:
        return
    element = opening.id if opening.fill is None else opening.fill.id
    behind = Behind(None, parent.beyond)
    made, middle = _upright(space, edge, (first, last), (low, high), behind, element, parent.external)
    found.add(replace(made, parent=parent.key), middle)


def _upright(
    space: Space,
    edge: _Edge,
    part: tuple[float, float],
    heights: tuple[float, float],
    behind: Behind,
    element: str | None,
    external: bool | None,
) -> tuple[Boundary, Point3]:
    (first, last), (low, high) = part, heights
    (dx, dy), (nx, ny), (x, y) = edge.along, edge.outward, edge.at(first)
    width, height = last - first, high - low
    outline = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    patch = Patch((x, y, low), (dx, dy, 0.0), (nx, ny, 0.0), outline)
    key = f"boundary of {space.id} by {element or 'nothing'} to {behind.beyond or 'nothing'}"
    mx, my = edge.at((first + last) / 2)
    return Boundary(key, space.id, element, patch, behind.beyond, external), (mx, my, (low + high) / 2)


def _level(
    found: _Found,
    space: Space,
    element: str | None,
    polygon: Polygon,
    z: float,
    up: bool,
    beyond: str | None,
    external: bool | None,
) -> None:
    """A boundary of the floor or ceiling."""
    side = 1.0 if up else -1.0

    def ring(coordinates: Sequence[tuple[float, ...]]) -> Ring:
        points = tuple((float(c[0]), side * float(c[1])) for c in coordinates)[:-1]
        return points if up else tuple(reversed(points))

    patch = Patch(
        (0.0, 0.0, z),
        (1.0, 0.0, 0.0),
        (0.0, 0.0, side),
        ring(list(polygon.exterior.coords)),
        tuple(ring(list(hole.coords)) for hole in polygon.interiors),
    )
    which = "ceiling" if up else "floor"
    key = f"{which} of {space.id} by {element or 'nothing'} to {beyond or 'nothing'}"
    middle = polygon.representative_point()
    found.add(Boundary(key, space.id, element, patch, beyond, external), (middle.x, middle.y, z))


def _soffit(found: _Found, storey: Storey, space: Space, piece: tuple[Point3, ...]) -> None:
    """The boundary of a plane piece of a ceiling: of the roof plane or the covering that lies on it."""
    a, b, c = plane_of(piece)
    size = math.sqrt(1.0 + a * a + b * b)
    normal = (-a / size, -b / size, 1.0 / size)
    run = math.hypot(a, b)
    ux, uy = (-b / run, a / run) if run > 1e-9 else (1.0, 0.0)
    vx, vy, vz = -normal[2] * uy, normal[2] * ux, normal[0] * uy - normal[1] * ux
    x0, y0, _ = piece[0]
    origin = (x0, y0, a * x0 + b * y0 + c)
    offsets = [(x - x0, y - y0, a * (x - x0) + b * (y - y0)) for x, y, _ in piece]
    outline = tuple((dx * ux + dy * uy, dx * vx + dy * vy + dz * vz) for dx, dy, dz in offsets)
    element, external = element_over(storey, piece)
    key = f"ceiling of {space.id} by {element or 'nothing'} to nothing"
    patch = Patch(origin, (ux, uy, 0.0), normal, outline)
    found.add(Boundary(key, space.id, element, patch, None, external), origin)


def _with_twins(found: _Found) -> tuple[Boundary, ...]:
    """Pairs the boundaries that are the two sides of one thing, the nearest first; each has one twin at most."""
    twins: dict[str, str] = {}
    for sides in found.sides.values():
        pairs = sorted(
            (math.dist(p, q), a, b)
            for i, (a, p) in enumerate(sides)
            for b, q in sides[i + 1 :]
            if found.boundaries[a].space != found.boundaries[b].space
        )
        for _, a, b in pairs:
            if a not in twins and b not in twins:
                twins[a], twins[b] = b, a
    return tuple(replace(made, twin=twins.get(key)) for key, made in found.boundaries.items())
