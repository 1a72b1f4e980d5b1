"""Walls: layers against bodies, overlaps, joints, axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import ifcopenshell.util.element
import ifcopenshell.util.representation
import numpy as np

from scan2bim.check.bodies import Bar, Body, bar_of, sheet_thickness
from scan2bim.check.model import Entity, Model, Part
from scan2bim.check.values import Finding

SAME: Final = 0.006
"""Metres by which layers and body may differ: more than rounding, less than a layer of plaster."""
GAP: Final = 0.01
"""Metres. Walls that are joined touch to this."""
NEAR: Final = 0.12
"""Metres. The end of a wall this near before another one was meant to reach it."""
SHARED: Final = 0.02
"""Square metres that two walls may share in plan beyond the crossing of their thicknesses."""
STRAY: Final = 0.02
"""Metres that an axis may lie outside the body, sideways."""


@dataclass(frozen=True, slots=True, eq=False)
class _Wall:
    part: Part
    body: Body
    bar: Bar | None

    @property
    def name(self) -> str:
        return self.part.entity.Name or self.part.entity.GlobalId


def check_walls(model: Model) -> Iterator[Finding]:
    """All findings of walls."""
    import shapely

    walls = [
        _Wall(part, part.body, bar_of(part.body.plan))
        for part in model.of("IfcWall")
        if part.body is not None and part.body.plan.area > 1e-6
    ]
    for wall in walls:
        yield from _layers(model, wall)
        yield from _axis(model, wall)
    tree = shapely.STRtree([wall.body.plan for wall in walls])
    joined = _joins(model)
    for i, wall in enumerate(walls):
        near = tree.query(wall.body.plan, predicate="dwithin", distance=NEAR)
        others = [walls[j] for j in sorted(near.tolist()) if j != i and _level(wall.body, walls[j].body) > 0.1]
        yield from _overlaps(wall, [o for o in others if o.part.entity.id() > wall.part.entity.id()])
        yield from _gaps(wall, others, joined)
    yield from _far_joins(model)


def _level(a: Body, b: Body) -> float:
    """Height that two bodies share."""
    return float(min(a.high[2], b.high[2]) - max(a.low[2], b.low[2]))


def _layers(model: Model, wall: _Wall) -> Iterator[Finding]:
    material: Any = ifcopenshell.util.element.get_material(wall.part.entity, should_skip_usage=True)
    if material is None or not material.is_a("IfcMaterialLayerSet"):
        return
    stated = sum(layer.LayerThickness for layer in material.MaterialLayers) * model.unit
    found = wall.bar.thickness if wall.bar is not None else sheet_thickness(wall.body.plan)
    if found is None or (wall.bar is None and not _arched(wall.part.entity)):
        return
    if wall.bar is not None and wall.bar.length < 2 * wall.bar.thickness and abs(wall.bar.length - stated) < SAME:
        return  # a stub: its longer side is across the wall
    lean = wall.part.body is not None and _sheared(model, wall)
    if abs(stated - found) > max(SAME, 0.02 * stated) and not lean:
        text = f"layers make {stated:.3f} m, the body is {found:.3f} m thick"
        yield wall.part.finding("layers unlike the body", text, stated - found, "m")


def _sheared(model: Model, wall: _Wall) -> bool:
    """Whether the body leans, so that its outline in plan says nothing of its thickness."""
    z = wall.body.vertices[:, 2]
    low, high = (wall.body.vertices[np.abs(z - edge) < 1e-3, :2] for edge in (z.min(), z.max()))
    return (
        len(low) > 0
        and len(high) > 0
        and bool(np.linalg.norm(low.mean(axis=0) - high.mean(axis=0)) > 0.05)
        and (wall.bar is not None and abs((low.mean(axis=0) - high.mean(axis=0)) @ wall.bar.along) < 0.05)
    )


def _arched(entity: Entity) -> bool:
    axis = ifcopenshell.util.representation.get_representation(entity, "Plan", "Axis")
    axis = axis or ifcopenshell.util.representation.get_representation(entity, "Model", "Axis")
    return axis is not None and any(item.is_a("IfcTrimmedCurve") for item in axis.Items)


def _axis(model: Model, wall: _Wall) -> Iterator[Finding]:
    """A straight axis lies within the body and is about as long as it."""
    entity = wall.part.entity
    reps = [r for r in entity.Representation.Representations if r.RepresentationIdentifier == "Axis"]
    if not reps or wall.bar is None or len(reps[0].Items) != 1 or not reps[0].Items[0].is_a("IfcPolyline"):
        return
    made = [(*tuple(p.Coordinates), 0.0, 0.0) for p in reps[0].Items[0].Points]
    local = np.array([(*p[:2], 0.0, 1.0) for p in made]) * np.array([model.unit, model.unit, 1.0, 1.0])
    points = (local @ model.matrix(entity).T)[:, :2]
    across = np.array([-wall.bar.along[1], wall.bar.along[0]])
    aside = np.abs((points - wall.bar.start) @ across).max() - wall.bar.thickness / 2
    if wall.bar.length < 1.5 * wall.bar.thickness:
        return  # as long as thick: which side is the length cannot be told
    if aside > STRAY and not _sheared(model, wall):
        yield wall.part.finding("axis outside the body", "leaves the body sideways", aside, "m")
        return
    length = float(np.linalg.norm(points[-1] - points[0]))
    off = abs(length - wall.bar.length)
    if off > max(1.2, 2 * wall.bar.thickness):
        yield wall.part.finding(
            "axis unlike the body", f"is {length:.2f} m, the body {wall.bar.length:.2f} m", off, "m"
        )


def _overlaps(wall: _Wall, others: list[_Wall]) -> Iterator[Finding]:
    for other in others:
        shared = wall.body.plan.intersection(other.body.plan)
        if shared.area < SHARED or min(wall.bar is None, other.bar is None):
            continue
        allowed = SHARED + _crossing(wall.bar, other.bar)
        high = _level(wall.body, other.body)
        if shared.area > allowed and shared.area * high > 0.05:
            yield wall.part.finding("walls overlap", f"shares its place with {other.name}", shared.area * high, "m3")


def _crossing(a: Bar | None, b: Bar | None) -> float:
    """Area that two walls share where they cross or corner without being cut."""
    if a is None or b is None:
        return 0.3
    sine = abs(a.along[0] * b.along[1] - a.along[1] * b.along[0])
    return 1.2 * a.thickness * b.thickness / sine if sine > 0.17 else 0.0


def _joins(model: Model) -> set[frozenset[int]]:
    return {
        frozenset((r.RelatingElement.id(), r.RelatedElement.id()))
        for r in model.file.by_type("IfcRelConnectsPathElements")
    }


def _gaps(wall: _Wall, others: list[_Wall], joined: set[frozenset[int]]) -> Iterator[Finding]:
    """Ends that stop short of a wall before them, and ends that touch one without a relation."""
    import shapely

    if wall.bar is None or wall.bar.length < wall.bar.thickness:
        return
    for end, out in ((wall.bar.start, -wall.bar.along), (wall.bar.end, wall.bar.along)):
        touching = [o for o in others if o.body.plan.distance(shapely.Point(end)) <= GAP]
        if touching:
            yield from _unrelated(wall, touching, joined)
            continue
        ray = shapely.LineString([end, end + NEAR * out])
        ahead = [(o.body.plan.intersection(ray), o) for o in others if o.body.plan.intersects(ray)]
        gaps = [(shapely.Point(end).distance(shared), o) for shared, o in ahead]
        if gaps:
            gap, other = min(gaps, key=lambda pair: pair[0])
            if gap > GAP and wall.body.plan.distance(other.body.plan) > GAP:
                yield wall.part.finding("gap at a joint", f"stops short of {other.name}", gap, "m")


def _unrelated(wall: _Wall, touching: list[_Wall], joined: set[frozenset[int]]) -> Iterator[Finding]:
    """Only where the file tells its other joints: a wall that has a relation, but none with what it ends at."""
    own = wall.part.entity.id()
    if not any(own in pair for pair in joined):
        return
    if not any(frozenset((own, o.part.entity.id())) in joined for o in touching):
        yield wall.part.finding("joint without a relation", f"ends at {touching[0].name}, to which nothing relates it")


def _far_joins(model: Model) -> Iterator[Finding]:
    for relation in model.file.by_type("IfcRelConnectsPathElements"):
        one, two = model.part(relation.RelatingElement), model.part(relation.RelatedElement)
        if one is None or two is None or one.body is None or two.body is None:
            continue
        gap = one.body.plan.distance(two.body.plan)
        apart = math.hypot(gap, max(0.0, -_level(one.body, two.body)))
        if apart > GAP:
            name = two.entity.Name or two.entity.GlobalId
            yield one.finding("related walls do not meet", f"is related to {name} but apart from it", apart, "m")
