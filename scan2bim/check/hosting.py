"""Openings in their walls, doors and windows in their openings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from scan2bim.check.bodies import Body, Floats
from scan2bim.check.model import Model, Part, finding
from scan2bim.check.values import Finding

OUT: Final = 0.1
"""Metres that a casing or a sill may reach out of an opening to each side."""
SIZE: Final = 0.05
"""Metres by which stated and drawn sizes may differ: frames are set with joints of a few centimetres."""
SKIN: Final = 0.01
"""Metres. An opening must reach this near to both faces of its wall; a layer of plaster over it is a fault."""
MISS: Final = 0.08
"""Share of an opening that may lie outside its wall: doors reach into the floor, openings to a corner."""


class Frame:
    """Axes of an opening: across the wall, along it, up; ranges of a body along them."""

    def __init__(self, opening: Body, host: Body) -> None:
        import shapely

        plan = opening.plan.minimum_rotated_rectangle
        corners = np.array(plan.exterior.coords) if isinstance(plan, shapely.Polygon) else np.zeros((5, 2))
        sides = [corners[1] - corners[0], corners[2] - corners[1]]
        units = [side / max(float(np.linalg.norm(side)), 1e-9) for side in sides]
        centre = (opening.low + opening.high) / 2
        self.centre = centre
        self.across = min(units, key=lambda unit: _chord(host, centre, unit))
        self.along = np.array([-self.across[1], self.across[0]])

    def ranges(self, body: Body) -> Floats:
        """(3, 2): lowest and highest across, along and up, from the opening's middle."""
        points = body.vertices - self.centre
        sideways: Floats = points[:, :2] @ np.stack([self.across, self.along], axis=1)
        columns: Floats = np.vstack([sideways.T, points[:, 2]])
        ranges: Floats = np.stack([columns.min(axis=1), columns.max(axis=1)], axis=1)
        return ranges

    def points(self, across: Floats, along: Floats, up: Floats) -> Floats:
        """World coordinates of all combinations (k, 3)."""
        a, b, c = (grid.ravel() for grid in np.meshgrid(across, along, up, indexing="ij"))
        plan: Floats = a[:, None] * self.across + b[:, None] * self.along
        return self.centre + np.column_stack([plan, c])


def _chord(host: Body, centre: Floats, unit: Floats) -> float:
    """How far the host reaches from a point in a direction in plan, to both sides."""
    import shapely

    line = shapely.LineString([centre[:2] - 50 * unit, centre[:2] + 50 * unit])
    shared = host.plan.intersection(line)
    near = [part for part in shapely.get_parts(shared) if part.distance(shapely.Point(centre[:2])) < 1e-3]
    return sum(part.length for part in near) or 100.0


def check_hosting(model: Model) -> Iterator[Finding]:
    """All findings of openings and what fills them."""
    for opening in model.of("IfcOpeningElement"):
        relations = opening.entity.VoidsElements
        host = model.part(relations[0].RelatingBuildingElement) if relations else None
        if not relations:
            yield opening.finding("opening without a host", "voids no element")
        fills = [relation.RelatedBuildingElement for relation in opening.entity.HasFillings]
        if len(fills) > 1:
            yield opening.finding("two fillings", "is filled more than once", len(fills))
        if host is None or host.body is None or opening.body is None:
            continue
        frame = Frame(opening.body, host.body)
        if host.is_a("IfcWall"):
            yield from _in_host(opening, host, frame)
        for entity in fills:
            fill = model.part(entity)
            if fill is not None and fill.body is not None:
                yield from _in_opening(model, fill, opening, frame)
    yield from _without_opening(model)


def _in_host(opening: Part, host: Part, frame: Frame) -> Iterator[Finding]:
    assert opening.body is not None
    assert host.body is not None
    name = host.entity.Name or host.entity.GlobalId
    (a0, a1), (b0, b1), (c0, c1) = frame.ranges(opening.body)
    own = np.linspace(0.04, 0.96, 12)
    inner = np.linspace(a0, a1, 9)[1:-1]
    inside = host.body.contains(frame.points(inner, b0 + own * (b1 - b0), c0 + own * (c1 - c0)))
    share = inside.reshape(len(inner), -1).max(axis=0).mean()
    if share == 0 and _already_cut(host.body, frame.centre):
        return
    if share == 0:
        yield opening.finding("opening misses its wall", f"lies wholly outside {name}", 1.0, "share outside")
        return
    if share < 1 - MISS:
        yield opening.finding("opening leaves its wall", f"reaches out of {name}", 1 - share, "share outside")
    if opening.entity.is_a() == "IfcOpeningElement" and _kind(opening) == "RECESS":
        return
    middle = np.linspace(0.2, 0.8, 4)
    skins = []
    for edge, side in ((a0, -1.0), (a1, 1.0)):
        beyond = frame.points(np.array([edge + side * SKIN]), b0 + middle * (b1 - b0), c0 + middle * (c1 - c0))
        skins.append(host.body.contains(beyond).mean())
    if max(skins) > 0.5:
        yield opening.finding("opening does not pierce its wall", f"ends inside {name}", a1 - a0, "m deep")


def _already_cut(host: Body, centre: Floats) -> bool:
    """Whether the host's body spans the place: some programs draw walls with their holes and the openings as well."""
    import shapely

    within = host.low[2] < centre[2] < host.high[2]
    return bool(within and host.plan.convex_hull.contains(shapely.Point(centre[:2])))


def _kind(opening: Part) -> str:
    kind = getattr(opening.entity, "PredefinedType", None) or opening.entity.ObjectType or ""
    return kind.upper()


def _in_opening(model: Model, fill: Part, opening: Part, frame: Frame) -> Iterator[Finding]:
    assert fill.body is not None
    assert opening.body is not None
    hole, body = frame.ranges(opening.body), frame.ranges(fill.body)
    apart = max(body[0, 0] - hole[0, 1], hole[0, 0] - body[0, 1])
    if apart > 0.0:
        yield fill.finding("filling not in its opening", "stands before or behind its opening", apart, "m")
    outside = np.maximum(hole[1:, 0] - body[1:, 0], body[1:, 1] - hole[1:, 1])
    centre = np.abs(body.mean(axis=1) - hole.mean(axis=1))[1:]
    if outside.max() > OUT or (centre > np.maximum(OUT, 0.2 * (hole[1:, 1] - hole[1:, 0]))).any():
        amount = max(outside.max(), centre.max())
        yield fill.finding("filling not in its opening", "is moved or larger than its opening", amount, "m")
    elif (body[1:, 1] - body[1:, 0] < 0.7 * (hole[1:, 1] - hole[1:, 0])).any():
        missing = (hole[1:, 1] - hole[1:, 0] - body[1:, 1] + body[1:, 0]).max()
        yield fill.finding("filling smaller than its opening", "leaves a part of its opening free", missing, "m")
    yield from _stated(model, fill, hole)
    up = model.matrix(fill.entity)[:3, 2]
    if abs(up[2]) < 0.99 and host_upright(model, opening):
        tilt = float(np.degrees(np.arccos(min(1.0, abs(up[2])))))
        yield fill.finding("filling not upright", "is tilted in an upright wall", tilt, "degrees")


def host_upright(model: Model, opening: Part) -> bool:
    """Whether the opening's own frame is upright or its sides are."""
    return abs(model.matrix(opening.entity)[:3, 2][2]) > 0.99


def _stated(model: Model, fill: Part, hole: Floats) -> Iterator[Finding]:
    """OverallWidth and OverallHeight against the opening."""
    if not fill.is_a("IfcDoor", "IfcWindow"):
        return
    width, height = fill.entity.OverallWidth, fill.entity.OverallHeight
    if width is None or height is None:
        return
    w, h = width * model.unit, height * model.unit
    real_w, real_h = (hole[1:, 1] - hole[1:, 0]).tolist()
    allowed = SIZE + OUT
    if max(abs(w - real_w), abs(h - real_h)) <= allowed:
        return
    if max(abs(w - real_h), abs(h - real_w)) <= allowed:
        yield fill.finding("width and height swapped", f"states {w:.2f} x {h:.2f} m", abs(w - real_w), "m")
    else:
        text = f"states {w:.2f} x {h:.2f} m in an opening of {real_w:.2f} x {real_h:.2f} m"
        yield fill.finding("stated size unlike the opening", text, max(abs(w - real_w), abs(h - real_h)), "m")


def _without_opening(model: Model) -> Iterator[Finding]:
    """Doors and windows that fill nothing though they stand in a wall."""
    walls = list(model.of("IfcWall"))
    for fill in model.of("IfcDoor", "IfcWindow"):
        if fill.entity.FillsVoids or fill.entity.Decomposes or fill.body is None:
            continue
        centre = ((fill.body.low + fill.body.high) / 2)[None]
        for wall in walls:
            if wall.body is None or (wall.body.low > centre[0]).any() or (wall.body.high < centre[0]).any():
                continue
            if wall.body.contains(centre)[0]:
                name = wall.entity.Name or wall.entity.GlobalId
                yield finding(fill.entity, "filling without an opening", f"stands in {name} and fills no opening")
                break
