"""What a file states against what it draws: quantities, identifiers, units, georeference, closed bodies."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import ifcopenshell.util.element
import numpy as np

from scan2bim.check.bodies import bar_of, polygons_of
from scan2bim.check.model import HEAVY, Model, Part, finding
from scan2bim.check.values import Finding

APART: Final = 0.03
"""Share by which a stated and a drawn quantity may differ: gross and net are told apart in many ways."""
OURS: Final = ("IfcWall", "IfcSlab", "IfcColumn", "IfcBeam", "IfcSpace", "IfcCovering", "IfcOpeningElement")
_DIGITS: Final = frozenset("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$")


def check_records(model: Model) -> Iterator[Finding]:
    """All findings of what is stated."""
    yield from _identifiers(model)
    yield from _georeference(model)
    yield from _sizes(model)
    for part in model.of(*OURS):
        yield from _body(part)
        yield from _quantities(model, part)
    for part in model.of("IfcWall", "IfcColumn", "IfcSpace", "IfcSlab"):
        yield from _upright(model, part)
    yield from _external(model)


def _identifiers(model: Model) -> Iterator[Finding]:
    roots = model.file.by_type("IfcRoot")
    counts = Counter(root.GlobalId for root in roots)
    for root in roots:
        guid = root.GlobalId
        if counts[guid] > 1:
            yield finding(root, "GlobalId used twice", "shares its GlobalId with another", counts[guid])
        if len(guid) != 22 or guid[0] not in "0123" or not set(guid) <= _DIGITS:
            yield finding(root, "GlobalId malformed", f"{guid!r} is no compressed identifier")


def _georeference(model: Model) -> Iterator[Finding]:
    if model.file.schema == "IFC2X3":
        return
    project = model.file.by_type("IfcProject")[0]
    made = list(model.file.by_type("IfcMapConversion"))
    numbers: set[tuple[object, ...]] = {
        (r.Eastings, r.Northings, r.OrthogonalHeight, r.XAxisAbscissa, r.XAxisOrdinate) for r in made
    }
    rigid = model.file.by_type("IfcRigidOperation") if model.file.schema_identifier == "IFC4X3_ADD2" else ()
    numbers |= {(r.FirstCoordinate.wrappedValue, r.SecondCoordinate.wrappedValue, r.Height) for r in rigid}
    if len(numbers) > 1:
        yield finding(project, "two places on the map", "its map conversions differ", len(numbers))
    for relation in made:
        x, y = relation.XAxisAbscissa, relation.XAxisOrdinate
        if x is not None and y is not None and abs(math.hypot(x, y) - 1) > 1e-3:
            yield finding(project, "map direction no unit vector", "its x axis on the map", math.hypot(x, y))
        if relation.Scale is not None and relation.Scale <= 0:
            yield finding(project, "map scale not positive", "no map has such a scale", relation.Scale)


def _sizes(model: Model) -> Iterator[Finding]:
    """A unit that is wrong shows in the height of doors."""
    heights = [float(p.body.high[2] - p.body.low[2]) for p in model.of("IfcDoor") if p.body is not None]
    heights = heights or [float(p.body.high[2] - p.body.low[2]) for p in model.of("IfcSpace") if p.body is not None]
    if heights and not 0.8 < float(np.median(heights)) < 12:
        project = model.file.by_type("IfcProject")[0]
        yield finding(project, "unit implausible", "its doors or rooms are so high", float(np.median(heights)), "m")


def _body(part: Part) -> Iterator[Finding]:
    assert part.body is not None
    if len(part.body.triangles) > HEAVY:
        return
    volume = part.body.volume
    if abs(volume) < 1e-6:
        yield part.finding("body without volume", "its faces enclose nothing", volume, "m3")
    elif volume < 0:
        yield part.finding("body inside out", "its faces look inwards", volume, "m3")
    elif _leaks(part):
        yield part.finding("body not closed", "its faces leave openings", part.body.open_edges(), "edges")


def _leaks(part: Part) -> bool:
    """Open edges, and a hull that does not close: the vectors of its faces do not cancel out."""
    assert part.body is not None
    if part.body.open_edges() == 0:
        return False
    a, b, c = np.moveaxis(part.body.corners, 1, 0)
    sum_of_faces = float(np.linalg.norm(np.cross(b - a, c - a).sum(axis=0) / 2))
    return sum_of_faces > 1e-3 * part.body.surface


def _quantities(model: Model, part: Part) -> Iterator[Finding]:
    assert part.body is not None
    sets: dict[str, dict[str, Any]] = ifcopenshell.util.element.get_psets(part.entity, qtos_only=True)
    stated = {k: float(v) for s in sets.values() for k, v in s.items() if isinstance(v, int | float) and k != "id"}
    if len(part.body.triangles) > HEAVY:
        return
    filled = _filled(part) / max(part.body.plan.area, 1e-9)
    for name, drawn, scale in _drawn(model, part):
        value = stated.get(name)
        if value is None or drawn <= 0:
            continue
        value *= scale
        allowed = max(APART * drawn, 0.012 if scale == model.unit else 0.01)
        # What is gross may count holes in, whether these are drawn as holes or as openings.
        most = drawn * filled if name.startswith("Gross") else drawn
        if not drawn - allowed <= value <= most + allowed:
            yield part.finding("quantity unlike the body", f"states {name} {value:.3f}, is {drawn:.3f}", value - drawn)


def _filled(part: Part) -> float:
    """Area in plan with holes closed."""
    import shapely

    assert part.body is not None
    return sum(shapely.Polygon(polygon.exterior).area for polygon in polygons_of(part.body.plan))


def _drawn(model: Model, part: Part) -> Iterator[tuple[str, float, float]]:
    """Names of quantities, what the body makes of them, metres (square, cubic) in the file's unit."""
    assert part.body is not None
    unit = model.unit
    area_unit, volume_unit = _unit(model, "AREAUNIT", unit**2), _unit(model, "VOLUMEUNIT", unit**3)
    height = float(part.body.high[2] - part.body.low[2])
    if part.is_a("IfcOpeningElement"):
        return
    yield "GrossVolume", abs(part.body.volume), volume_unit
    if part.is_a("IfcWall"):
        yield "Height", height, unit
        bar = bar_of(part.body.plan)
        if bar is not None and bar.length > 3 * bar.thickness and _vertical(part):
            yield "Width", bar.thickness, unit
    elif part.is_a("IfcSpace"):
        yield "Height", height, unit
        yield "NetFloorArea", part.body.plan.area, area_unit
        yield "GrossFloorArea", part.body.plan.area, area_unit
    elif part.is_a("IfcSlab", "IfcCovering") and _is_plate(part):
        yield "GrossArea", part.body.plan.area, area_unit
        yield "Width", height, unit


def _is_plate(part: Part) -> bool:
    """Whether the body is its outline in plan times its height: level, of one thickness."""
    assert part.body is not None
    prism = part.body.plan.area * float(part.body.high[2] - part.body.low[2])
    return abs(abs(part.body.volume) - prism) < 0.02 * prism


def _vertical(part: Part) -> bool:
    assert part.body is not None
    z = part.body.vertices[:, 2]
    low = part.body.vertices[np.abs(z - z.min()) < 1e-3, :2]
    return bool((np.abs(np.ptp(low, axis=0) - np.ptp(part.body.vertices[:, :2], axis=0)) < 1e-3).all())


def _unit(model: Model, kind: str, derived: float) -> float:
    import ifcopenshell.util.unit

    unit = ifcopenshell.util.unit.get_project_unit(model.file, kind)
    if unit is None:
        return derived
    return float(ifcopenshell.util.unit.calculate_unit_scale(model.file, kind))


def _upright(model: Model, part: Part) -> Iterator[Finding]:
    if not part.entity.ObjectPlacement or not part.is_a("IfcWall", "IfcSpace"):
        return
    up = model.matrix(part.entity)[:3, 2]
    if abs(up[2]) < 0.999:
        tilt = math.degrees(math.acos(min(1.0, abs(float(up[2])))))
        yield part.finding("placed askew", "its placement is tilted", tilt, "degrees")


def _external(model: Model) -> Iterator[Finding]:
    """Fills and walls that disagree on being outside."""
    for part in model.of("IfcDoor", "IfcWindow"):
        own = _is_external(part)
        opening = part.entity.FillsVoids[0].RelatingOpeningElement if part.entity.FillsVoids else None
        voids = opening.VoidsElements if opening is not None else ()
        host = model.part(voids[0].RelatingBuildingElement) if voids else None
        other = _is_external(host) if host is not None else None
        if own is not None and other is not None and own != other:
            text = f"is {'' if own else 'not '}external, its wall is {'' if other else 'not '}so"
            yield part.finding("external unlike its wall", text)


def _is_external(part: Part) -> bool | None:
    for name in ("Wall", "Door", "Window"):
        found: Any = ifcopenshell.util.element.get_pset(part.entity, f"Pset_{name}Common", "IsExternal")
        if isinstance(found, bool):
            return found
    return None
