"""Stairs: their flights with steps, and the landings between these."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scan2bim.exporters.ifc_draft import Draft, Level, aggregate
from scan2bim.exporters.ifc_file import Entity
from scan2bim.exporters.ifc_products import upright_product, with_area
from scan2bim.exporters.ifc_properties import Value, measure
from scan2bim.exporters.ifc_shapes import (
    extrusion,
    placement,
    polygons,
    polyline,
    prisms,
    profile,
    representation,
    shape,
)
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import Flight, Point2, Stair, Storey

if TYPE_CHECKING:
    from shapely import Polygon

WAIST = 0.15
"""Metres. Thickness of a flight below its steps, and of a landing: usual in concrete; a scan seldom sees it."""

RISER = 0.175
"""Metres. A usual riser, where they were not counted."""

LANDING_GAP = 0.3
"""Metres. A landing reaches at least this near to the flights that it joins."""

_SHAPES = {"straight": "STRAIGHT_RUN_STAIR", "spiral": "SPIRAL_STAIR"}


def add_stairs(draft: Draft, level: Level, storey: Storey) -> list[Entity]:
    """The storey's stairs."""
    made = [_stair(draft, level, stair) for stair in storey.stairs]
    return [entity for entity in made if entity is not None]


def _stair(draft: Draft, level: Level, stair: Stair) -> Entity | None:
    areas = with_area(draft, stair, polygons(stair.outline) if stair.height.value > 0.0 else [])
    if not areas:
        return None
    flights = [flight for flight in stair.flights if flight.height > 0.0 and flight.width.value > 0.0]
    kind = _SHAPES.get(stair.shape, "NOTDEFINED") if len(flights) < 2 else _kind_of(flights)
    if flights:
        entity = _assembly(draft, level, stair, flights, kind, areas)
    else:
        solids = prisms(draft.ifc, areas, stair.height.value, 0.0)
        entity = upright_product(draft, level, stair, "IfcStair", stair.base - level.elevation, solids, kind)
        entity.Description = "Envelope: its steps were not found"
    risers = stair.risers or (sum(_risers(f) for f in flights) if all(f.risers for f in flights) and flights else None)
    values: dict[str, Value | None] = {
        "NumberOfRiser": measure("IfcCountMeasure", risers),
        "RiserHeight": measure("IfcPositiveLengthMeasure", stair.height.value / risers if risers else None),
    }
    draft.properties.common(entity, "Pset_StairCommon", values)
    draft.properties.evidence(entity, stair)
    draft.classes.classify(entity)
    return entity


def _kind_of(flights: list[Flight]) -> str:
    """By the turn from the first flight to the last."""
    first, last = _direction(flights[0]), _direction(flights[-1])
    turn = math.acos(max(-1.0, min(1.0, first[0] * last[0] + first[1] * last[1])))
    if len(flights) != 2 or turn < math.radians(20):
        return "NOTDEFINED" if turn >= math.radians(20) or len(flights) != 2 else "TWO_STRAIGHT_RUN_STAIR"
    return "HALF_TURN_STAIR" if turn > math.radians(135) else "QUARTER_TURN_STAIR"


def _assembly(
    draft: Draft, level: Level, stair: Stair, flights: list[Flight], kind: str, areas: list[Polygon]
) -> Entity:
    ifc = draft.ifc
    place = placement(ifc, level.placement, (0.0, 0.0, stair.base - level.elevation))
    entity = ifc.root("IfcStair", stair.id, stair.name, ObjectPlacement=place, PredefinedType=kind)
    parts = [_flight(draft, entity, stair, flight, number) for number, flight in enumerate(flights, 1)]
    aggregate(ifc, entity, [*parts, *_landings(draft, entity, stair, flights, areas)])
    return entity


def _direction(flight: Flight) -> Point2:
    run = math.dist(flight.start, flight.end)
    if run < 1e-6:
        return (1.0, 0.0)
    return ((flight.end[0] - flight.start[0]) / run, (flight.end[1] - flight.start[1]) / run)


def _risers(flight: Flight) -> int:
    return flight.risers or max(1, round(flight.height / RISER))


def _flight(draft: Draft, whole: Entity, stair: Stair, flight: Flight, number: int) -> Entity:
    ifc, risers, width = draft.ifc, _risers(flight), flight.width.value
    run = math.dist(flight.start, flight.end)
    outline = _steps(risers, run, flight.height)
    across = ifc.add(
        "IfcAxis2Placement3D",
        ifc.point((0.0, width / 2, 0.0)),
        ifc.direction((0.0, -1.0, 0.0)),
        ifc.direction((1.0, 0.0, 0.0)),
    )
    solid = extrusion(ifc, profile(ifc, tuple(outline)), width, across)
    draft.styles.paint([solid], colour_of(stair))
    line = polyline(ifc, ((0.0, 0.0), (max(run, 0.01), 0.0)))
    sizes = {"NumberOfRisers": risers, "NumberOfTreads": max(risers - 1, 0), "RiserHeight": flight.height / risers}
    entity = ifc.root(
        "IfcStairFlight",
        f"flight {number} of {stair.id}",
        f"{stair.name} flight {number}",
        ObjectPlacement=placement(
            ifc, whole.ObjectPlacement, (*flight.start, flight.base - stair.base), _direction(flight)
        ),
        Representation=shape(
            ifc,
            representation(ifc, draft.contexts.axis, "Curve2D", [line]),
            representation(ifc, draft.contexts.body, "SweptSolid", [solid]),
        ),
        PredefinedType="STRAIGHT",
        **(sizes if ifc.dialect.old else {}),  # later versions keep them in the property set alone
    )
    tread = run / (risers - 1) if risers > 1 and run > 0.0 else None
    values: dict[str, Value | None] = {
        "NumberOfRiser": ("IfcCountMeasure", risers),
        "NumberOfTreads": ("IfcCountMeasure", max(risers - 1, 0)),
        "RiserHeight": ("IfcPositiveLengthMeasure", flight.height / risers),
        "TreadLength": measure("IfcPositiveLengthMeasure", tread),
    }
    draft.properties.common(entity, "Pset_StairFlightCommon", values)
    counted = "counted" if flight.risers else "assumed from the height"
    draft.properties.custom(entity, "S2B_Evidence", {"Risers": ("IfcLabel", counted)})
    volume = _area(outline) * width
    sums = {"Length": math.hypot(run, flight.height), "GrossVolume": volume, "NetVolume": volume}
    draft.properties.quantities(entity, "Qto_StairFlightBaseQuantities", sums)
    return entity


def _steps(risers: int, run: float, height: float) -> list[Point2]:
    """The flight from the side: x along it from the first riser, z up from its base; counter-clockwise.

    It ends with the last tread: the floor above, at the head of the last riser, is not the flight's.
    """
    rise, tread = height / risers, run / (risers - 1) if risers > 1 else 0.0
    if risers < 2 or tread < 0.05:
        depth = max(run, 0.25)
        return [(0.0, 0.0), (depth, 0.0), (depth, height), (0.0, height)]
    drop = WAIST / math.cos(math.atan2(rise, tread))
    under = [(run, height - rise - drop)] if height - rise > drop else [(run, 0.0)]
    foot = drop * tread / rise
    first = [(0.0, 0.0), (foot, 0.0)] if height - rise > drop else [(0.0, 0.0)]
    corners: list[Point2] = []
    for step in range(risers - 1, 0, -1):
        corners += [(step * tread, step * rise), ((step - 1) * tread, step * rise)]
    return [*first, *under, *corners]


def _area(outline: list[Point2]) -> float:
    return 0.5 * sum(
        x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True)
    )


def _landings(
    draft: Draft, whole: Entity, stair: Stair, flights: list[Flight], areas: list[Polygon]
) -> list[Entity]:
    """What is left of the outline between the end of one flight and the start of the next, at their height."""
    import shapely

    runs = [shapely.LineString((f.start, f.end)).buffer(f.width.value / 2, cap_style="flat") for f in flights]
    rest = shapely.difference(shapely.union_all(areas), shapely.union_all(runs))
    parts = [part for part in shapely.get_parts(rest) if isinstance(part, shapely.Polygon) and part.area > 0.1]
    made: list[Entity] = []
    for number, (lower, upper) in enumerate(zip(flights, flights[1:], strict=False), 1):
        ends = (shapely.Point(lower.end), shapely.Point(upper.start))
        near = [part for part in parts if max(part.distance(end) for end in ends) < LANDING_GAP]
        if not near:
            continue
        parts = [part for part in parts if part is not near[0]]
        name = f"landing {number} of {stair.id}", f"{stair.name} landing {number}"
        made.append(_landing(draft, whole, stair, name, near[0], upper.base - stair.base - WAIST))
    return made


def _landing(
    draft: Draft, whole: Entity, stair: Stair, name: tuple[str, str], area: Polygon, bottom: float
) -> Entity:
    """A landing over an area, its underside this much over the stair's foot; name: its key and its name."""
    solids = prisms(draft.ifc, [area], WAIST, 0.0)
    draft.styles.paint(solids, colour_of(stair))
    key, label = name
    entity = draft.ifc.root(
        "IfcSlab",
        key,
        label,
        ObjectPlacement=placement(draft.ifc, whole.ObjectPlacement, (0.0, 0.0, bottom)),
        Representation=shape(draft.ifc, representation(draft.ifc, draft.contexts.body, "SweptSolid", solids)),
        PredefinedType="LANDING",
    )
    draft.properties.common(entity, "Pset_SlabCommon", {"IsExternal": ("IfcBoolean", False)})
    sums = {"Width": WAIST, "Perimeter": area.exterior.length, "GrossArea": area.area, "NetArea": area.area}
    volume = area.area * WAIST
    draft.properties.quantities(entity, "Qto_SlabBaseQuantities", {**sums, "GrossVolume": volume, "NetVolume": volume})
    return entity
