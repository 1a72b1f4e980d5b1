"""Storeys, and elements in the right one; placements; what stands far away or twice."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Final

import numpy as np

from scan2bim.check.model import Level, Model, Part, finding
from scan2bim.check.values import Finding

BELOW: Final = 0.6
"""Metres that an element may reach below its storey: door sills, split levels."""
ABOVE: Final = 0.3
"""Metres below the next storey from which on an element belongs to that."""
LIFTED: Final = 0.25
"""Metres. A wall or column this far above all floors, with nothing under it, floats."""
FAR: Final = 3.0
"""An element further from the middle of all than this many times the building's size is lost."""
TWICE: Final = 0.002
"""Metres. Two elements of a class whose bounds agree to this are one, made twice."""
PLACED: Final = ("IfcDoor", "IfcWindow", "IfcWall", "IfcColumn")


def check_levels(model: Model) -> Iterator[Finding]:
    """All findings of storeys, containers and places."""
    yield from _elevations(model)
    for part in model.of(*PLACED):
        yield from _container(model, part)
    for part in model.of("IfcSpace"):
        yield from _container(model, part)
    yield from _containment(model)
    yield from _floating(model)
    yield from _lost(model)
    yield from _doubled(model)


def _elevations(model: Model) -> Iterator[Finding]:
    for level in model.levels:
        stated = level.entity.Elevation
        # Some files measure elevations from the building's or the site's own zero.
        base = _zero(model, level)
        if stated is not None and all(abs(stated * model.unit - (level.z - zero)) > 0.02 for zero in (0.0, base)):
            text = f"states {stated * model.unit:.3f} m, is placed at {level.z:.3f} m"
            yield finding(level.entity, "elevation unlike the placement", text, stated * model.unit - level.z, "m")
    for lower, upper in zip(model.levels, model.levels[1:], strict=False):
        if upper.z - lower.z < 0.02 and lower.entity.ContainsElements and upper.entity.ContainsElements:
            yield finding(upper.entity, "storeys at one height", f"lies at the height of {lower.entity.Name}")


def _zero(model: Model, level: Level) -> float:
    """Z of the building that the storey is a part of."""
    for relation in level.entity.Decomposes:
        whole = relation.RelatingObject
        if getattr(whole, "ObjectPlacement", None):
            return float(model.matrix(whole)[2, 3])
    return 0.0


def _container(model: Model, part: Part) -> Iterator[Finding]:
    assert part.body is not None
    storey = model.storey_of(part.entity)
    if storey is None or len(model.levels) == 0:
        return
    own = next((level for level in model.levels if level.entity == storey), None)
    if own is None:
        return
    bottom, top = float(part.body.low[2]), float(part.body.high[2])
    higher = [level.z for level in model.levels if level.z > own.z + 0.5]
    if bottom < own.z - BELOW and not (top > own.z + 0.5 and part.is_a("IfcWall", "IfcColumn", "IfcSpace")):
        yield part.finding("outside its storey", f"lies below {storey.Name}", own.z - bottom, "m")
    elif bottom < own.z - 1.5:
        yield part.finding("outside its storey", f"reaches far below {storey.Name}", own.z - bottom, "m")
    elif higher and bottom > higher[0] - ABOVE and (bottom + top) / 2 > higher[0]:  # not what hangs below it
        yield part.finding("outside its storey", f"lies above {storey.Name}", bottom - own.z, "m")


def _containment(model: Model) -> Iterator[Finding]:
    for part in model.parts.values():
        entity = part.entity
        if entity.is_a("IfcFeatureElement") or entity.is_a("IfcVirtualElement"):
            if entity.is_a("IfcOpeningElement") and entity.ContainedInStructure:
                yield part.finding("opening in a storey", "is contained in a storey, where its wall belongs")
            continue
        if entity.is_a("IfcSpace"):
            if not entity.Decomposes:
                yield part.finding("in no storey", "is a part of no storey")
            continue
        homes = len(entity.ContainedInStructure)
        if homes > 1:
            yield part.finding("in two storeys", "is contained more than once", homes)
        if homes == 0 and not entity.Decomposes and not getattr(entity, "FillsVoids", ()):
            yield part.finding("in no storey", "is contained in no storey and is no part of anything")
        if homes == 0 and getattr(entity, "FillsVoids", ()):
            yield part.finding("in no storey", "fills an opening but is contained in no storey")
        if entity.Representation and part.body is None and not _only_lines(part):
            yield part.finding("no body", "has a representation of which no body comes out")
        if not entity.ObjectPlacement:
            yield part.finding("no placement", "has no placement")
        if (
            not entity.Representation
            and entity.is_a("IfcBuildingElement" if _old(model) else "IfcBuiltElement")
            and not entity.IsDecomposedBy
        ):
            yield part.finding("no body", "has no representation and no parts")


def _old(model: Model) -> bool:
    return model.file.schema in ("IFC2X3", "IFC4")


def _only_lines(part: Part) -> bool:
    """Whether nothing but curves and points was to be drawn."""
    kinds = {r.RepresentationType for r in part.entity.Representation.Representations}
    return kinds <= {"Curve2D", "GeometricCurveSet", "Curve3D", "Annotation2D", "BoundingBox", "PointCloud"}


def _floating(model: Model) -> Iterator[Finding]:
    """Walls and columns that stand on nothing, though their storey has a floor below them."""
    import shapely

    under = list(model.of("IfcSlab", "IfcWall", "IfcBeam", "IfcColumn", "IfcFooting", "IfcRoof", "IfcCovering"))
    tree = shapely.STRtree([p.body.plan for p in under if p.body is not None])
    for part in model.of("IfcWall", "IfcColumn"):
        assert part.body is not None
        storey = model.storey_of(part.entity)
        own = next((level for level in model.levels if level.entity == storey), None)
        bottom = float(part.body.low[2])
        if own is None or bottom - own.z < LIFTED:
            continue
        hits = [under[i] for i in tree.query(part.body.plan, predicate="intersects").tolist() if under[i] is not part]
        if not any(
            h.body is not None and h.body.low[2] < bottom - 0.01 and h.body.high[2] > bottom - 0.1 for h in hits
        ):
            yield part.finding("stands on nothing", "hangs above its floor", bottom - own.z, "m")


def _lost(model: Model) -> Iterator[Finding]:
    parts = [p for p in model.parts.values() if p.body is not None]
    if len(parts) < 4:
        return
    low = np.stack([p.body.low for p in parts if p.body is not None])
    high = np.stack([p.body.high for p in parts if p.body is not None])
    centres = (low + high) / 2
    middle = np.median(centres, axis=0)
    size = np.maximum(np.quantile(high, 0.9, axis=0) - np.quantile(low, 0.1, axis=0), 5.0)
    away = np.abs(centres - middle) / size
    for part, share, centre in zip(parts, away.max(axis=1), centres, strict=True):
        if share > FAR and not part.is_a("IfcSite", "IfcGeographicElement"):
            distance = float(np.linalg.norm(centre - middle))
            yield part.finding("far from the building", "lies away from all other elements", distance, "m")


def _doubled(model: Model) -> Iterator[Finding]:
    seen: dict[tuple[str, tuple[int, ...]], list[Part]] = defaultdict(list)
    for part in model.parts.values():
        if part.body is not None:
            ends = np.concatenate([part.body.low, part.body.high])
            seen[part.entity.is_a(), tuple(np.round(ends / TWICE).astype(int).tolist())].append(part)
    for same in seen.values():
        for part in same[1:]:
            name = same[0].entity.Name or same[0].entity.GlobalId
            yield part.finding("made twice", f"has the bounds of {name}, to the millimetre")
