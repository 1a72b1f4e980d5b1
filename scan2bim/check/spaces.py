"""Spaces: overlaps with walls and each other, gaps before walls, boundaries that cover them and lie on them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from scan2bim.check.bodies import Body, Floats, polygons_of
from scan2bim.check.model import Entity, Model, Part, finding
from scan2bim.check.values import Finding

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

DEEP: Final = 0.04
"""Metres that a space may reach into a wall: finishes and skirtings."""
GAP: Final = (0.08, 0.6)
"""Metres from a space to the wall before it that are a gap: less are finishes, more is no wall of this space."""
LONG: Final = 0.6
"""Metres of a space's outline that must have the gap."""
ROOM: Final = 1.5
"""Square metres between walls from which on a space is missing there."""
CLOSED: Final = 0.02
"""Share of a space's surface that its boundaries may leave free or cover twice."""
ON: Final = 0.05
"""Metres that a boundary may lie off its space's surface."""
REACH: Final = 0.35
"""Metres that a boundary may lie off the element that it is of."""


def check_spaces(model: Model) -> Iterator[Finding]:
    """All findings of spaces and their boundaries."""
    spaces = [part for part in model.of("IfcSpace") if part.body is not None and part.body.plan.area > 0.01]
    walls = [part for part in model.of("IfcWall", "IfcColumn") if part.body is not None]
    yield from _in_walls(spaces, walls)
    yield from _in_spaces(spaces)
    yield from _gaps(model, spaces, walls)
    yield from _missing(spaces, walls)
    yield from _boundaries(model, spaces)


def _shared_height(a: Body, b: Body) -> float:
    return float(min(a.high[2], b.high[2]) - max(a.low[2], b.low[2]))


def _deep(shape: BaseGeometry, depth: float) -> bool:
    """Whether some part of a shape is wider than twice this."""
    return any(not part.buffer(-depth).is_empty for part in polygons_of(shape))


def _in_walls(spaces: list[Part], walls: list[Part]) -> Iterator[Finding]:
    import shapely

    tree = shapely.STRtree([w.body.plan for w in walls if w.body is not None])
    for space in spaces:
        assert space.body is not None
        for i in sorted(tree.query(space.body.plan, predicate="intersects").tolist()):
            wall = walls[i]
            assert wall.body is not None
            high = _shared_height(space.body, wall.body)
            shared = space.body.plan.intersection(wall.body.plan)
            if high < 0.3 or shared.area < 0.02 or not _deep(shared, DEEP / 2):
                continue
            if wall.is_a("IfcColumn") or _slanted(wall.body):
                continue  # columns stand in spaces; the plan of what leans is wider than its section
            if wall.body.plan.area - shared.area < 0.1 * wall.body.plan.area:
                continue  # a low or free-standing wall inside a space
            name = wall.entity.Name or wall.entity.GlobalId
            yield space.finding("space in a wall", f"reaches into {name}", shared.area * high, "m3")


def _slanted(body: Body) -> bool:
    """Whether upper and lower outlines differ in place."""
    z = body.vertices[:, 2]
    low, high = (body.vertices[np.abs(z - edge) < 1e-3, :2].mean(axis=0) for edge in (z.min(), z.max()))
    return float(np.linalg.norm(low - high)) > 0.05 and len(np.unique(np.round(z, 3))) == 2


def _in_spaces(spaces: list[Part]) -> Iterator[Finding]:
    import shapely

    tree = shapely.STRtree([s.body.plan for s in spaces if s.body is not None])
    for i, space in enumerate(spaces):
        assert space.body is not None
        for j in sorted(tree.query(space.body.plan, predicate="intersects").tolist()):
            other = spaces[j]
            if j <= i or other.body is None:
                continue
            high = _shared_height(space.body, other.body)
            shared = space.body.plan.intersection(other.body.plan)
            if high > 0.1 and _deep(shared, DEEP / 2):
                name = other.entity.Name or other.entity.GlobalId
                yield space.finding("spaces overlap", f"shares its place with {name}", shared.area * high, "m3")


def _gaps(model: Model, spaces: list[Part], walls: list[Part]) -> Iterator[Finding]:
    """Stretches of a space's outline with a wall before them that they do not reach."""
    import shapely

    solids = [*walls, *(p for p in model.of("IfcCurtainWall", "IfcPlate", "IfcDoor", "IfcWindow", "IfcRailing"))]
    for space in spaces:
        assert space.body is not None
        near = [
            p.body.plan
            for p in (*solids, *(s for s in spaces if s is not space))
            if p.body is not None
            and _shared_height(space.body, p.body) > 0.3
            and p.body.plan.distance(space.body.plan) < GAP[1]
        ]
        if not near:
            continue
        tree = shapely.STRtree(near)
        missing = 0.0
        worst = 0.0
        for polygon in polygons_of(space.body.plan):
            outline: Any = polygon.exterior.simplify(0.005)
            steps = np.arange(0.05, outline.length, 0.1)
            points = shapely.line_interpolate_point(outline, steps)
            _, distance = tree.query_nearest(points, all_matches=False, return_distance=True)
            gap = (distance > GAP[0]) & (distance < GAP[1])
            before = np.array([_faces(outline, s, near, GAP[1]) for s in steps[gap]]) if gap.any() else np.zeros(0)
            missing += 0.1 * float(before.sum())
            worst = max(worst, float(distance[gap][before > 0].max(initial=0.0)))
        if missing > LONG:
            yield space.finding("space leaves a gap", f"{missing:.1f} m of its outline stay off the wall", worst, "m")


def _faces(outline: Any, along: float, solids: list[BaseGeometry], reach: float) -> float:
    """1 where a solid lies straight before the outline within reach, else 0."""
    import shapely

    a, b = (np.array(outline.interpolate(along + d).coords[0]) for d in (-0.01, 0.01))
    run = b - a
    size = float(np.linalg.norm(run))
    if size < 0.019:
        return 0.0
    normal = np.array([run[1], -run[0]]) / size * (1 if outline.is_ccw else -1)
    middle = (a + b) / 2
    ray = shapely.LineString([middle + 0.02 * normal, middle + reach * normal])
    return float(any(solid.intersects(ray) for solid in solids))


def _missing(spaces: list[Part], walls: list[Part]) -> Iterator[Finding]:
    """Places that walls enclose on all sides, on a storey that has spaces, without one."""
    import shapely

    heights = sorted({round(float(s.body.low[2]) * 2) / 2 for s in spaces if s.body is not None})
    for height in heights:
        cut = height + 1.0
        around = [w for w in walls if w.body is not None and w.body.low[2] < cut < w.body.high[2]]
        here = [s.body.plan for s in spaces if s.body is not None and s.body.low[2] < cut < s.body.high[2]]
        if not around or not here:
            continue
        solid = shapely.union_all([w.body.plan.buffer(0.01) for w in around if w.body is not None])
        covered = shapely.union_all(here)
        for polygon in polygons_of(solid):
            for ring in polygon.interiors:
                hole = shapely.Polygon(ring).buffer(-0.05)
                inside = hole.difference(solid)
                if inside.area > ROOM and inside.intersection(covered).area < 0.1 * inside.area:
                    wall = min(around, key=lambda w: w.body.plan.distance(hole) if w.body is not None else 9.0)
                    x, y = inside.representative_point().coords[0]
                    text = f"encloses a place without a space at ({x:.2f}, {y:.2f}, {height:.1f})"
                    yield wall.finding("space missing", text, inside.area, "m2")


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    corners: Floats
    area: float
    normal: Floats


def _boundaries(model: Model, spaces: list[Part]) -> Iterator[Finding]:
    """Second-level boundaries whose surfaces are bounded planes."""
    known = [
        r
        for r in model.file.by_type("IfcRelSpaceBoundary")
        if r.Name == "2ndLevel" or r.is_a("IfcRelSpaceBoundary2ndLevel")
    ]
    by_space: dict[int, list[Entity]] = defaultdict(list)
    for relation in known:
        by_space[relation.RelatingSpace.id()].append(relation)
    for space in spaces:
        relations = by_space.get(space.entity.id(), [])
        if known and not relations:
            yield space.finding("space without boundaries", "has none, though other spaces have")
        patches = {r.id(): _patch(model, space, r) for r in relations}
        if not relations or any(patch is None for patch in patches.values()):
            continue
        yield from _cover(space, relations, patches)
        for relation in relations:
            patch = patches[relation.id()]
            if patch is not None:
                yield from _place(model, space, relation, patch)
        yield from _parents(relations)
    yield from _twins(known)


def _patch(model: Model, space: Part, relation: Entity) -> _Patch | None:
    import shapely

    geometry = relation.ConnectionGeometry
    surface = geometry.SurfaceOnRelatingElement if geometry and geometry.is_a("IfcConnectionSurfaceGeometry") else None
    if surface is None or not surface.is_a("IfcCurveBoundedPlane") or not surface.OuterBoundary.is_a("IfcPolyline"):
        return None
    import ifcopenshell.util.placement

    rings = [
        np.array([p.Coordinates[:2] for p in curve.Points]) * model.unit
        for curve in (surface.OuterBoundary, *surface.InnerBoundaries)
        if curve.is_a("IfcPolyline")
    ]
    if len(rings[0]) < 3:
        return None
    area = shapely.Polygon(rings[0], rings[1:]).area
    made: Any = ifcopenshell.util.placement.get_axis2placement(surface.BasisSurface.Position)
    matrix = np.array(made, np.float64)
    matrix[:3, 3] *= model.unit
    matrix = model.matrix(space.entity) @ matrix
    flat = np.column_stack([rings[0], np.zeros(len(rings[0])), np.ones(len(rings[0]))])
    return _Patch((flat @ matrix.T)[:, :3], float(area), matrix[:3, 2])


def _cover(space: Part, relations: list[Entity], patches: dict[int, _Patch | None]) -> Iterator[Finding]:
    assert space.body is not None
    top = [p for r in relations if (p := patches[r.id()]) is not None and not getattr(r, "ParentBoundary", None)]
    if not any(hasattr(r, "ParentBoundary") for r in relations):
        top = [p for r in relations if (p := patches[r.id()]) is not None and not _in_opening(r)]
    share = sum(p.area for p in top) / space.body.surface
    if abs(share - 1) > CLOSED:
        text = "boundaries cover its surface more than once" if share > 1 else "boundaries leave a part of it free"
        yield space.finding("boundaries do not close", text, share, "of the surface")


def _in_opening(relation: Entity) -> bool:
    element = relation.RelatedBuildingElement
    return element is not None and (element.is_a("IfcOpeningElement") or bool(getattr(element, "FillsVoids", ())))


def _place(model: Model, space: Part, relation: Entity, patch: _Patch) -> Iterator[Finding]:
    assert space.body is not None
    off = float(space.body.distance(patch.corners).max())
    if off > ON:
        yield finding(relation, "boundary off its space", f"leaves the surface of {space.entity.Name}", off, "m")
        return
    centre = patch.corners[:-1].mean(axis=0)
    sides = space.body.contains(np.stack([centre + 0.03 * patch.normal, centre - 0.03 * patch.normal]))
    if sides[0] and not sides[1]:
        yield finding(relation, "boundary inside out", f"its normal points into {space.entity.Name}")
    element = model.part(relation.RelatedBuildingElement)
    if element is None or element.body is None:
        return
    reach = float(element.body.distance(patch.corners).max())
    if reach > REACH + (0.3 if element.is_a("IfcDoor", "IfcWindow", "IfcSlab") else 0.0) and not element.is_a(
        "IfcRoof"
    ):
        name = element.entity.Name or element.entity.GlobalId
        yield finding(relation, "boundary off its element", f"is of {name}, which is not there", reach, "m")


def _parents(relations: list[Entity]) -> Iterator[Finding]:
    for relation in relations:
        element = relation.RelatedBuildingElement
        if not hasattr(relation, "ParentBoundary") or element is None or not _in_opening(relation):
            continue
        parent = relation.ParentBoundary
        if parent is None:
            yield finding(relation, "boundary without its parent", f"of {element.Name} lies in no boundary of a wall")
        elif parent.RelatingSpace != relation.RelatingSpace:
            yield finding(relation, "boundary without its parent", "its parent is of another space")


def _twins(relations: list[Entity]) -> Iterator[Finding]:
    """A pair may be stated on one side or on both; each boundary is of one pair."""
    for relation in relations:
        twin = getattr(relation, "CorrespondingBoundary", None)
        if twin is None:
            continue
        if twin.CorrespondingBoundary not in (None, relation) or len(twin.Corresponds) > 1:
            yield finding(relation, "other side does not answer", "its corresponding boundary names another")
        elif (
            twin.RelatedBuildingElement != relation.RelatedBuildingElement
            or twin.RelatingSpace == relation.RelatingSpace
        ):
            yield finding(relation, "other side of another thing", "its corresponding boundary is of another element")
