"""Changes to IFC models: what was drawn is made to differ from what was built."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.placement as placement_util
import ifcopenshell.util.unit as unit_util
import numpy as np
import shapely
from edit_truth import F64, Seen

from scan2bim.verify.patches import main_direction

LEAST_PLAN = 1.5
"""Square metres, in plan, of a slab that the scans must show."""


@dataclass(frozen=True, slots=True, eq=False)
class Edit:
    """A change: kind, GlobalId of the element, host (of a door), size (m or radians), extent of what deviates (m), box
    (2, 3) of what is no longer drawn, rectangles (corner, two edges: (3, 3)) of what is drawn and was not built, and
    strips of a wall, each on both faces, between an opening's sides as drawn and as built.
    """

    guid: str
    size: float
    extent: float
    kind: str = ""
    host: str = ""
    box: F64 | None = None
    rectangles: tuple[F64, ...] = ()
    strips: tuple[tuple[F64, F64], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """What is changed: the file, the product, its vertices (v, 3) and those of any element by GlobalId, what is seen,
    and chance.
    """

    file: Any
    product: Any
    bodies: dict[str, F64]
    seen: Seen
    rng: np.random.Generator

    @property
    def points(self) -> F64:
        """Vertices of the product."""
        return self.bodies[self.product.GlobalId]

    def either(self) -> float:
        """1 or -1."""
        return float(self.rng.choice([-1, 1]))


def _move(file: Any, product: Any, motion: F64) -> None:
    """By a motion (4, 4) of the world, metres, without changing other products' placements of the same entity."""
    scale = unit_util.calculate_unit_scale(file)
    place = product.ObjectPlacement
    parent = place.PlacementRelTo
    outer = placement_util.get_local_placement(parent) if parent is not None else np.eye(4)
    own = placement_util.get_local_placement(place)
    in_units = motion.copy()
    in_units[:3, 3] /= scale
    local = np.linalg.inv(outer) @ in_units @ own
    place.RelativePlacement = _axes(file, local)


def _axes(file: Any, matrix: F64) -> Any:
    """A placement entity of a motion (4, 4) in the file's units."""
    make = file.create_entity
    return make(
        "IfcAxis2Placement3D",
        make("IfcCartesianPoint", tuple(float(x) for x in matrix[:3, 3])),
        make("IfcDirection", tuple(float(x) for x in matrix[:3, 2])),
        make("IfcDirection", tuple(float(x) for x in matrix[:3, 0])),
    )


def _shifted(by: F64) -> F64:
    out = np.eye(4)
    out[:3, 3] = by
    return out


def _along(points: F64) -> F64:
    return main_direction(points[:, :2] - points[:, :2].mean(axis=0))


def shift_wall(subject: Subject) -> Edit:
    """Across itself by 10 to 100 mm."""
    size = float(subject.rng.uniform(0.010, 0.100))
    along = _along(subject.points)
    across = np.array([-along[1], along[0], 0.0])
    _move(subject.file, subject.product, _shifted(across * size * subject.either()))
    return Edit(subject.product.GlobalId, size, size)


def turn_wall(subject: Subject) -> Edit:
    """About the vertical through its middle by 0.5 to 2 degrees."""
    points = subject.points
    angle = math.radians(float(subject.rng.uniform(0.5, 2.0))) * subject.either()
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    c, s = math.cos(angle), math.sin(angle)
    motion = np.eye(4)
    motion[:2, :2] = [[c, -s], [s, c]]
    motion[:3, 3] = middle - motion[:3, :3] @ middle
    _move(subject.file, subject.product, motion)
    return Edit(subject.product.GlobalId, angle, abs(angle) * float(np.ptp(points[:, :2] @ _along(points))) / 2)


def thicken_wall(subject: Subject) -> Edit | None:
    """By 30 to 80 mm, half on each side, where it is an extruded rectangle or outline."""
    size = float(subject.rng.uniform(0.030, 0.080))
    by = size / unit_util.calculate_unit_scale(subject.file)
    wall = subject.product
    solids = [i for r in wall.Representation.Representations for i in r.Items if i.is_a("IfcExtrudedAreaSolid")]
    profile = _thicker(subject.file, solids[0].SweptArea, by) if len(solids) == 1 else None
    if profile is None:
        return None
    solids[0].SweptArea = profile
    return Edit(wall.GlobalId, size / 2, size / 2)


def _thicker(file: Any, profile: Any, by: float) -> Any:
    """The profile wider across, in the file's units; None where it is of another kind or no straight wall's."""
    make = file.create_entity
    if profile.is_a("IfcRectangleProfileDef"):
        return make("IfcRectangleProfileDef", "AREA", None, profile.Position, profile.XDim, profile.YDim + by)
    if not profile.is_a("IfcArbitraryClosedProfileDef") or not profile.OuterCurve.is_a("IfcPolyline"):
        return None
    own = np.array([p.Coordinates[:2] for p in profile.OuterCurve.Points])
    if np.ptp(own[:, 1]) * unit_util.calculate_unit_scale(file) > 0.6:
        return None
    own[:, 1] += np.sign(own[:, 1] - (own[:, 1].min() + own[:, 1].max()) / 2) * by / 2
    first = [make("IfcCartesianPoint", (float(x), float(y))) for x, y in own[:-1]]
    return make("IfcArbitraryClosedProfileDef", "AREA", None, make("IfcPolyline", [*first, first[0]]))


def delete_wall(subject: Subject) -> Edit:
    """Out of the drawing: the scans show a wall that it lacks. What it hosts goes too."""
    wall = subject.product
    for relation in wall.HasOpenings:
        for filling in relation.RelatedOpeningElement.HasFillings:
            filling.RelatedBuildingElement.Representation = None
    wall.Representation = None
    return Edit(wall.GlobalId, 0.0, 1.0, box=_box(subject.points))


def _box(points: F64) -> F64:
    return np.array([points.min(axis=0), points.max(axis=0)])


def add_wall(subject: Subject) -> Edit:
    """A copy of it, 0.6 to 0.9 m beside it: drawn, not built."""
    along = _along(subject.points)
    across = np.array([-along[1], along[0], 0.0])
    size = float(subject.rng.uniform(0.6, 0.9)) * subject.either()
    copy = _copied(subject.file, subject.product)
    _move(subject.file, copy, _shifted(across * size))
    return Edit(copy.GlobalId, abs(size), abs(size), rectangles=_sides(subject.points + across * size, along))


def _sides(points: F64, along: F64) -> tuple[F64, F64]:
    """The two upright sides of the box of a body (v, 3) along a direction (2,): corner and edges."""
    across = np.array([-along[1], along[0]])
    a, b = points[:, :2] @ along, points[:, :2] @ across
    low, high = points[:, 2].min(), points[:, 2].max()
    u, v = np.array([*(along * np.ptp(a)), 0.0]), np.array([0.0, 0.0, high - low])
    first, second = (np.array([[*(along * a.min() + across * side), low], u, v]) for side in (b.min(), b.max()))
    return first, second


def _copied(file: Any, product: Any) -> Any:
    copy = file.create_entity(product.is_a(), GlobalId=ifcopenshell.guid.new(), Name=f"copy of {product.Name}")
    copy.Representation = product.Representation
    place = product.ObjectPlacement
    copy.ObjectPlacement = file.create_entity("IfcLocalPlacement", place.PlacementRelTo, place.RelativePlacement)
    if not product.is_a("IfcOpeningElement"):
        for relation in product.ContainedInStructure:
            relation.RelatedElements = [*relation.RelatedElements, copy]
    return copy


def lower_slab(subject: Subject) -> Edit | None:
    """By 20 to 100 mm, where the scans show more than its edges, and no other slab or ceiling lies under it or in its
    place: a finish drawn into its screed cannot be told, and what is drawn twice is still there.
    """
    if subject.seen.plan_area(subject.product.GlobalId) < LEAST_PLAN:
        return None
    size = float(subject.rng.uniform(0.020, 0.100))
    low, high = _box(subject.points)
    level = [*subject.file.by_type("IfcSlab"), *subject.file.by_type("IfcCovering")]
    others = [subject.bodies[s.GlobalId] for s in level if s.GlobalId in subject.bodies]
    for other in (_box(o) for o in others if o is not subject.points):
        under = low[2] - 0.15 < other[1, 2] < high[2]
        twice = abs(other[0, 2] - low[2]) < 0.05
        if (under or twice) and (np.minimum(high, other[1])[:2] > np.maximum(low, other[0])[:2] + 0.1).all():
            return None
    _move(subject.file, subject.product, _shifted(np.array([0.0, 0.0, -size])))
    return Edit(subject.product.GlobalId, size, size)


def add_column(subject: Subject) -> Edit | None:
    """Of 0.3 m, standing free in a scanned room under its ceiling: drawn, not built. The product is any slab."""
    rooms = [s for s in subject.seen.truth["spaces"] if s["scanned"] and s["area"] > 6]
    room = rooms[int(subject.rng.integers(len(rooms)))]
    outline = shapely.MultiPolygon([shapely.Polygon(p[0], p[1:]) for p in room["polygons"]]).buffer(-0.6)
    if outline.is_empty:
        return None
    low, high = np.array(outline.bounds[:2]), np.array(outline.bounds[2:])
    place = next(p for p in subject.rng.uniform(low, high, (1000, 2)) if outline.contains(shapely.Point(p)))
    half = np.array([0.15, 0.15])
    base, height = float(room["z0"]), float(room["height"])
    ends = np.array([[*(place - half), base], [*(place + half), base + height]])
    column = subject.file.create_entity("IfcColumn", GlobalId=ifcopenshell.guid.new(), Name="column not built")
    column.ObjectPlacement = subject.file.create_entity("IfcLocalPlacement", None, _axes(subject.file, np.eye(4)))
    context = subject.product.Representation.Representations[0].ContextOfItems
    motion = _shifted(np.array([*place, base]))
    column.Representation = _extruded(subject.file, context, motion, (0.3, 0.3, height))
    for relation in subject.product.ContainedInStructure:
        relation.RelatedElements = [*relation.RelatedElements, column]
    corners = np.array([[x, y, z] for x in ends[:, 0] for y in ends[:, 1] for z in ends[:, 2]])
    return Edit(column.GlobalId, 0.0, 1.0, rectangles=_sides(corners, np.array([1.0, 0.0])))


def _extruded(file: Any, context: Any, motion: F64, size: tuple[float, float, float]) -> Any:
    """A box of length, width and height (m) standing about the origin of ``motion`` (4, 4), metres."""
    make = file.create_entity
    scale = unit_util.calculate_unit_scale(file)
    in_units = motion.copy()
    in_units[:3, 3] /= scale
    length, width, height = (float(x) / scale for x in size)
    middle = make("IfcAxis2Placement2D", make("IfcCartesianPoint", (0.0, 0.0)), make("IfcDirection", (1.0, 0.0)))
    profile = make("IfcRectangleProfileDef", "AREA", None, middle, length, width)
    up = make("IfcDirection", (0.0, 0.0, 1.0))
    solid = make("IfcExtrudedAreaSolid", profile, _axes(file, in_units), up, height)
    shape = make("IfcShapeRepresentation", context, "Body", "SweptSolid", [solid])
    return make("IfcProductDefinitionShape", None, None, [shape])


def move_door(subject: Subject) -> Edit | None:
    """With its opening along the wall by 100 to 400 mm."""
    door, opening, wall = _hosted(subject.product)
    size = float(subject.rng.uniform(0.1, 0.4)) * subject.either()
    motion = _shifted(np.array([*(_along(subject.points) * size), 0.0]))
    if not _has_room(subject, subject.bodies[opening.GlobalId] + motion[:3, 3], wall, opening):
        return None
    hangs = door.ObjectPlacement.PlacementRelTo == opening.ObjectPlacement
    _move(subject.file, opening, motion)
    if not hangs:
        _move(subject.file, door, motion)
    strips = tuple(_strip(subject, opening, wall, side, size) for side in (-1.0, 1.0))
    return Edit(door.GlobalId, abs(size), abs(size), strips=strips)


def _hosted(door: Any) -> tuple[Any, Any, Any]:
    """A door or window, its opening and its wall."""
    opening = door.FillsVoids[0].RelatingOpeningElement
    return door, opening, opening.VoidsElements[0].RelatingBuildingElement


def _has_room(subject: Subject, hole: F64, wall: Any, opening: Any) -> bool:
    """Whether a hole (v, 3) lies in its wall, which has a body, and meets none of its other openings."""
    if wall.GlobalId not in subject.bodies:
        return False
    along = _along(subject.bodies[wall.GlobalId])
    body, own = subject.bodies[wall.GlobalId][:, :2] @ along, hole[:, :2] @ along
    others = [r.RelatedOpeningElement.GlobalId for r in wall.HasOpenings]
    taken = [subject.bodies[g] for g in others if g != opening.GlobalId and g in subject.bodies]
    free = all(
        (t[:, :2] @ along).min() > own.max() + 0.05
        or (t[:, :2] @ along).max() < own.min() - 0.05
        or t[:, 2].min() > hole[:, 2].max()
        or t[:, 2].max() < hole[:, 2].min()
        for t in taken
    )
    return bool(free and own.min() > body.min() + 0.05 and own.max() < body.max() - 0.05)


def resize_door(subject: Subject) -> Edit | None:
    """Its opening wider or narrower by 100 to 350 mm on one side. The other side stays."""
    door, opening, wall = _hosted(subject.product)
    if wall.GlobalId not in subject.bodies:
        return None
    along = _along(subject.bodies[wall.GlobalId])
    hole = subject.bodies[opening.GlobalId]
    a, b = hole[:, :2] @ along, hole[:, :2] @ [-along[1], along[0]]
    size = float(subject.rng.uniform(0.1, 0.35)) * subject.either()
    side = subject.either()
    width = float(np.ptp(a)) + size
    middle = (a.min() + a.max()) / 2 + side * size / 2
    if width < 0.5 or len(door.FillsVoids) != 1:
        return None
    place = along * middle + np.array([-along[1], along[0]]) * (b.min() + b.max()) / 2
    motion = np.eye(4)
    motion[:2, 0], motion[:2, 1] = along, (-along[1], along[0])
    motion[:3, 3] = (*place, hole[:, 2].min())
    corners = np.array([[*(place + along * k * width / 2), z] for k in (-1, 1) for z in hole[:, 2]])
    if size > 0 and not _has_room(subject, corners, wall, opening):
        return None
    scale = unit_util.calculate_unit_scale(subject.file)
    outer = placement_util.get_local_placement(opening.ObjectPlacement).copy()
    outer[:3, 3] *= scale
    local = np.linalg.inv(outer) @ motion
    context = next(r.ContextOfItems for r in opening.Representation.Representations if r.RepresentationType != "Box")
    box = (width, float(np.ptp(b)), float(np.ptp(hole[:, 2])))
    opening.Representation = _extruded(subject.file, context, local, box)
    door.OverallWidth = width / scale
    return Edit(door.GlobalId, abs(size), abs(size), strips=(_strip(subject, opening, wall, side, side * size),))


def add_door(subject: Subject) -> Edit | None:
    """A copy of it beside it in its wall: drawn, walled up in the building."""
    door, opening, wall = _hosted(subject.product)
    along = _along(subject.points)
    hole = subject.bodies[opening.GlobalId]
    size = (float(np.ptp(hole[:, :2] @ along)) + 0.3) * subject.either()
    motion = _shifted(np.array([*(along * size), 0.0]))
    if not _has_room(subject, hole + motion[:3, 3], wall, opening):
        return None
    gap, copy = _copied(subject.file, opening), _copied(subject.file, door)
    if door.ObjectPlacement.PlacementRelTo == opening.ObjectPlacement:
        copy.ObjectPlacement.PlacementRelTo = gap.ObjectPlacement
        _move(subject.file, gap, motion)
    else:
        _move(subject.file, gap, motion)
        _move(subject.file, copy, motion)
    make, new = subject.file.create_entity, ifcopenshell.guid.new
    make("IfcRelVoidsElement", new(), RelatingBuildingElement=wall, RelatedOpeningElement=gap)
    make("IfcRelFillsElement", new(), RelatingOpeningElement=gap, RelatedBuildingElement=copy)
    return Edit(copy.GlobalId, abs(size), abs(size), rectangles=_faces_of(subject, hole + motion[:3, 3], wall))


def _faces_of(subject: Subject, hole: F64, wall: Any) -> tuple[F64, F64]:
    """The rectangles of a hole (v, 3) on both faces of its wall."""
    body = subject.bodies[wall.GlobalId]
    along = _along(body)
    across = np.array([-along[1], along[0]])
    a, b = hole[:, :2] @ along, body[:, :2] @ across
    ends = [[*(along * x + across * y), z] for x in a for y in (b.min(), b.max()) for z in hole[:, 2]]
    return _sides(np.array(ends), along)


def _strip(subject: Subject, opening: Any, wall: Any, side: float, by: float) -> tuple[F64, F64]:
    """What lies, on both faces of the wall, between the ``side`` (-1 or 1) of an opening and where it is drawn, ``by``
    metres along the wall beside it.
    """
    along = _along(subject.bodies[wall.GlobalId])
    hole = subject.bodies[opening.GlobalId]
    edge = side * float((side * (hole[:, :2] @ along)).max())
    across = np.array([-along[1], along[0]])
    middle = across * float((hole[:, :2] @ across).mean())
    corners = [[*(along * x + middle), z] for x in (edge, edge + by) for z in (hole[:, 2].min(), hole[:, 2].max())]
    return _faces_of(subject, np.array(corners), wall)


def delete_door(subject: Subject) -> Edit:
    """With its opening out of the drawing: the scans show one that it lacks."""
    door, opening, _ = _hosted(subject.product)
    opening.Representation = None
    door.Representation = None
    return Edit(door.GlobalId, 0.0, 1.0, box=_box(subject.points))


MAKERS: dict[str, Callable[[Subject], Edit | None]] = {
    "wall shifted": shift_wall,
    "wall turned": turn_wall,
    "wall thickened": thicken_wall,
    "wall not drawn": delete_wall,
    "wall not built": add_wall,
    "slab lowered": lower_slab,
    "column not built": add_column,
    "door moved": move_door,
    "door resized": resize_door,
    "door walled up": add_door,
    "door not drawn": delete_door,
}
