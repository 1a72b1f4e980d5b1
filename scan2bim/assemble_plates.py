"""Plates and stairs of the model stage: floor slabs, ceiling coverings, stairs with their flights."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon

from scan2bim.model.elements import Covering, Dimension, Evidence, Flight, RoofPlane, Slab, Stair
from scan2bim.model.ids import distinct, stable_id
from scan2bim.structure.shapes import Ring, SpaceShape, StairShape, StoreyShape, StructureShape, WallShape, ring_of

SLAB = 0.25
"""Assumed thickness, metres, of a slab of which one side was seen."""
CEILING = 0.02
"""Assumed thickness, metres, of a ceiling covering: only its underside is ever seen."""
LEVEL = 0.001
"""Metres of height along a piece of a ceiling up to which it is level."""
ROOF = 0.25
"""Assumed thickness, metres, of a roof: rafters and insulation."""
TREADS_SEEN = 0.9
"""Confidence in a stair of which five or more treads were seen one above the other."""


def coverings_of(space_id: str, shape: SpaceShape, number: int, index: int) -> tuple[Covering, ...]:
    """The level ceilings of a space whose undersides were seen: one, unless it lies under a roof."""
    if shape.ceiling is None:
        return ()
    name = f"Ceiling {number}.{index + 1:02d}"
    level = [s for s in shape.soffits if max(z for _, _, z in s) - min(z for _, _, z in s) < LEVEL]
    if not shape.soffits:
        return (_covering(space_id, name, shape, shape.outline, shape.holes, shape.ceiling),)
    return tuple(
        _covering(f"{space_id} {k}", f"{name}.{k}", shape, tuple((x, y) for x, y, _ in soffit), (), soffit[0][2])
        for k, soffit in enumerate(level, 1)
    )


def _covering(key: str, name: str, shape: SpaceShape, outline: Ring, holes: tuple[Ring, ...], under: float) -> Covering:
    return Covering(
        id=stable_id("covering", key),
        name=name,
        confidence=round(min(0.98, 0.5 + 0.48 * shape.ceiling_share), 3),
        evidence=Evidence(
            coverage=shape.ceiling_share, sentence=f"underside seen on {shape.ceiling_share:.0%} of the area"
        ),
        outline=outline,
        holes=holes,
        top=Dimension(value=round(under + CEILING, 4), source="measured", sigma=0.003),
        thickness=Dimension(value=CEILING, source="assumed"),
    )


def roofs_of(number: int, structure: StructureShape) -> tuple[RoofPlane, ...]:
    """The roof planes over a storey, as far as they were seen from inside."""
    shapes = structure.storeys[number].roofs
    ids = distinct(stable_id("roof", number, *np.mean(s.outline, axis=0)) for s in shapes)
    return tuple(
        RoofPlane(
            id=i,
            name=f"Roof plane {number}.{k + 1}",
            confidence=round(min(0.95, 0.5 + 0.45 * s.coverage), 3),
            evidence=Evidence(
                rms=s.rms,
                coverage=s.coverage,
                sentence=f"underside seen on {s.coverage:.0%}, RMS {s.rms * 1000:.0f} mm; thickness assumed",
            ),
            outline=s.outline,
            thickness=Dimension(value=ROOF, source="assumed"),
        )
        for k, (i, s) in enumerate(zip(ids, shapes, strict=True))
    )


def elevation_of(shape: StoreyShape) -> Dimension:
    """Height of a storey's floor, metres."""
    sigma = None if shape.sigma is None else round(shape.sigma, 4)
    return Dimension(value=round(shape.floor, 4), source="assumed" if sigma is None else "measured", sigma=sigma)


def slabs_of(number: int, structure: StructureShape) -> tuple[Slab, ...]:
    """Floor slab of a storey under its spaces and walls; its thickness is measured where the ceiling below was seen."""
    shape = structure.storeys[number]
    parts = [s.polygon.buffer(0.02, join_style="mitre") for s in shape.spaces] + [_footprint(w) for w in shape.walls]
    if not parts:
        return ()
    plate = shapely.union_all(parts).buffer(0.05, join_style="mitre").buffer(-0.05, join_style="mitre")
    inside = shapely.union_all([s.polygon for s in shape.spaces])
    plate = plate.difference(shapely.union_all([Polygon(well).intersection(inside) for well in shape.wells]))
    below = structure.storeys[number - 1].ceiling if number > 0 else None
    gap = None if below is None or shape.sigma is None else shape.floor - below
    thickness = (
        Dimension(value=round(gap, 4), source="measured", sigma=0.005)
        if gap is not None and 0.08 <= gap <= 0.8
        else Dimension(value=SLAB, source="assumed")
    )
    seen = (
        float(np.average([s.floor_share for s in shape.spaces], weights=[s.polygon.area for s in shape.spaces]))
        if shape.spaces
        else 0.0
    )
    pieces = [p for p in shapely.get_parts(plate) if isinstance(p, Polygon) and p.area > 0.5]
    ids = distinct(stable_id("slab", number, *p.representative_point().coords[0]) for p in pieces)
    return tuple(
        Slab(
            id=i,
            name=f"Floor slab {number}.{k + 1}",
            confidence=round(min(0.97, 0.5 + 0.45 * seen), 3),
            evidence=Evidence(coverage=round(seen, 3), sentence=f"upper side seen on {seen:.0%} of the spaces' area"),
            outline=ring_of(shapely.get_coordinates(shapely.orient_polygons(p).exterior)),
            holes=tuple(
                ring_of(shapely.get_coordinates(r))
                for r in shapely.orient_polygons(p).interiors
                if Polygon(r).area > 0.3
            ),
            top=elevation_of(shape),
            thickness=thickness,
            use="BASESLAB" if number == 0 else "FLOOR",
        )
        for k, (i, p) in enumerate(zip(ids, pieces, strict=True))
    )


def _footprint(wall: WallShape) -> Polygon:
    return shapely.buffer(wall.line, wall.thickness / 2, cap_style="flat" if wall.bulge else "square")


def stairs_of(number: int, structure: StructureShape) -> tuple[Stair, ...]:
    """The stairs that start in a storey; a straight one has its flight."""
    shapes = structure.storeys[number].stairs
    ids = distinct(stable_id("stair", number, *s.outline[0], *s.outline[-1]) for s in shapes)
    return tuple(_stair(i, s, f"Stair {number}.{k + 1}") for k, (i, s) in enumerate(zip(ids, shapes, strict=True)))


def _stair(identifier: str, shape: StairShape, name: str) -> Stair:
    height = max(shape.top - shape.base, 0.3)
    width = Dimension(value=shape.width, source="measured", sigma=0.03)
    return Stair(
        id=identifier,
        name=name,
        confidence=TREADS_SEEN,
        evidence=Evidence(sentence=f"{shape.kind} stair, {shape.risers} risers of {height / shape.risers:.3f} m"),
        outline=shape.outline,
        base=shape.base,
        height=Dimension(value=round(height, 4), source="measured", sigma=0.01),
        shape=shape.kind,
        risers=shape.risers,
        width=width,
        flights=(_flight(shape, width),) if shape.kind == "straight" else (),
    )


def _flight(shape: StairShape, width: Dimension) -> Flight:
    """The one flight of a straight stair, along the middle of its outline."""
    outline, climb = np.array(shape.outline), np.array(shape.climb)
    middle = np.array(Polygon(shape.outline).centroid.coords[0])
    along = (outline - middle) @ climb
    start, end = middle + along.min() * climb, middle + along.max() * climb
    return Flight(
        start=(round(float(start[0]), 4), round(float(start[1]), 4)),
        end=(round(float(end[0]), 4), round(float(end[1]), 4)),
        base=shape.base,
        height=round(max(shape.top - shape.base, 0.3), 4),
        width=width,
        risers=shape.risers,
    )
