"""Draw a made-up building as IFC: walls with openings, doors, windows with panes, slabs, spaces, stairs, columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np
from made_up_plans import GOING
from made_up_shapes import Building, Hole, Level, Piece, Stair
from shapely.geometry import Polygon, box

FRAME, LEAF, SASH, PANE = 0.05, 0.04, 0.07, 0.012
"""Width of frames; thickness of leaves, windows' frames and panes, metres."""
TREAD = 0.3
"""Height of a stair's steps, metres: they overlap."""
CEILING = 0.02


def write_ifc(building: Building, path: Path, rng: np.random.Generator) -> None:
    """Write it as IFC4. ``rng`` chooses how deep in their walls doors and windows hang."""
    drawing = _Drawing()
    storeys: list[Any] = []
    for number, level in enumerate(building.levels):
        top = number == len(building.levels) - 1
        storeys.append(_draw_level(drawing, building, level, f"Storey {number}", top, rng))
    drawing.finish(storeys)
    drawing.file.write(str(path))


def _draw_level(
    drawing: _Drawing, building: Building, level: Level, name: str, top: bool, rng: np.random.Generator
) -> Any:
    style = building.style
    storey = drawing.storey(name, level.elevation)
    elements = [drawing.element("IfcSlab", storey, [(level.floor, -style.slab, style.slab)], PredefinedType="FLOOR")]
    if top:
        elements.append(
            drawing.element("IfcSlab", storey, [(building.outline, style.height, style.slab)], PredefinedType="ROOF")
        )
    for piece in level.walls:
        elements += _draw_wall(drawing, storey, piece, style.height, rng)
    if level.stair is not None:
        steps = _steps(level.stair, (style.height + style.slab) / level.stair.risers)
        elements.append(drawing.element("IfcStair", storey, steps, PredefinedType="STRAIGHT_RUN_STAIR"))
    elements += [drawing.element("IfcColumn", storey, [(column, 0.0, style.height)]) for column in level.columns]
    for room, height in level.rooms:
        if height < style.height:
            elements.append(drawing.element("IfcCovering", storey, [(room, height, CEILING)], PredefinedType="CEILING"))
    spaces = [drawing.element("IfcSpace", storey, [(room, 0.0, height)]) for room, height in level.rooms]
    drawing.relate("IfcRelContainedInSpatialStructure", RelatedElements=elements, RelatingStructure=storey)
    drawing.relate("IfcRelAggregates", RelatingObject=storey, RelatedObjects=spaces)
    return storey


def _draw_wall(drawing: _Drawing, storey: Any, piece: Piece, height: float, rng: np.random.Generator) -> list[Any]:
    """The wall and what fills its openings."""
    wall = drawing.element("IfcWall", storey, [(piece.outline, 0.0, height)])
    found = [wall]
    for hole in piece.holes:
        void = (_strip(piece, hole.along, hole.along + hole.width, piece.thickness + 0.1), hole.sill, hole.height)
        opening = drawing.element("IfcOpeningElement", storey, [void])
        drawing.relate("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=opening)
        if hole.kind == "passage":
            continue
        filling = (_draw_door if hole.kind == "door" else _draw_window)(drawing, storey, piece, hole, rng)
        drawing.relate("IfcRelFillsElement", RelatingOpeningElement=opening, RelatedBuildingElement=filling)
        found.append(filling)
    return found


def _draw_door(drawing: _Drawing, storey: Any, piece: Piece, hole: Hole, rng: np.random.Generator) -> Any:
    half = piece.thickness / 2
    off = float(rng.choice([0.0, half - 0.04, half - 0.02]))
    low, high = hole.along, hole.along + hole.width
    solids = [
        (_strip(piece, low + FRAME, high - FRAME, LEAF, off), 0.005, hole.height - FRAME),
        (_strip(piece, low, low + FRAME, piece.thickness), 0.0, hole.height),
        (_strip(piece, high - FRAME, high, piece.thickness), 0.0, hole.height),
        (_strip(piece, low + FRAME, high - FRAME, piece.thickness), hole.height - FRAME, FRAME),
    ]
    return drawing.element("IfcDoor", storey, solids, OverallHeight=hole.height, OverallWidth=hole.width)


def _draw_window(drawing: _Drawing, storey: Any, piece: Piece, hole: Hole, rng: np.random.Generator) -> Any:
    off = float(rng.uniform(-0.05, max(piece.thickness / 2 - 0.12, 0.0)))
    low, high, sill, height = hole.along, hole.along + hole.width, hole.sill, hole.height
    inner = (low + FRAME, high - FRAME)
    bars = [
        (_strip(piece, low, low + FRAME, SASH, off), sill, height),
        (_strip(piece, high - FRAME, high, SASH, off), sill, height),
        (_strip(piece, *inner, SASH, off), sill, FRAME),
        (_strip(piece, *inner, SASH, off), sill + height - FRAME, FRAME),
    ]
    if hole.width > 1.3:
        middle = (low + high) / 2
        bars.append((_strip(piece, middle - 0.04, middle + 0.04, SASH, off), sill + FRAME, height - 2 * FRAME))
    pane = (_strip(piece, *inner, PANE, off), sill + FRAME, height - 2 * FRAME)
    return drawing.element("IfcWindow", storey, bars, glass=[pane], OverallHeight=height, OverallWidth=hole.width)


def _strip(piece: Piece, low: float, high: float, thickness: float, off: float = 0.0) -> Polygon:
    """A rectangle along a wall's axis; ``off``: how far its middle lies left of it."""
    start, end = np.array(piece.axis.coords[0]), np.array(piece.axis.coords[-1])
    along = (end - start) / piece.axis.length
    left = np.array([-along[1], along[0]])
    near, far = left * (off - thickness / 2), left * (off + thickness / 2)
    a, b = start + along * low, start + along * high
    return Polygon([a + near, b + near, b + far, a + far])


Solid = tuple[Polygon, float, float]
"""An outline in plan, the height of its underside above the floor, and its own height."""


def _steps(stair: Stair, riser: float) -> list[Solid]:
    x0, y0, x1, y1 = stair.outline.bounds
    found: list[Solid] = []
    for i in range(stair.risers - 1):
        near, far = i * GOING, (i + 1) * GOING
        tread = box(x0 + near, y0, x0 + far, y1) if stair.along_x else box(x0, y0 + near, x1, y0 + far)
        top = (i + 1) * riser
        found.append((tread, max(0.0, top - TREAD), min(top, TREAD)))
    return found


class _Drawing:
    """An IFC4 file that grows."""

    def __init__(self) -> None:
        """With project, site and building."""
        self.file = ifcopenshell.file(schema="IFC4")
        create = self.file.create_entity
        self.context = create(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=self._axes(0.0),
        )
        kinds = {
            "LENGTHUNIT": "METRE",
            "AREAUNIT": "SQUARE_METRE",
            "VOLUMEUNIT": "CUBIC_METRE",
            "PLANEANGLEUNIT": "RADIAN",
        }
        units = [create("IfcSIUnit", UnitType=kind, Name=name) for kind, name in kinds.items()]
        project = self._rooted(
            "IfcProject",
            Name="made up",
            RepresentationContexts=[self.context],
            UnitsInContext=create("IfcUnitAssignment", Units=units),
        )
        site = self._rooted("IfcSite", ObjectPlacement=self._placed(None, 0.0))
        self.building = self._rooted("IfcBuilding", ObjectPlacement=self._placed(site.ObjectPlacement, 0.0))
        self.relate("IfcRelAggregates", RelatingObject=project, RelatedObjects=[site])
        self.relate("IfcRelAggregates", RelatingObject=site, RelatedObjects=[self.building])
        shine = create(
            "IfcSurfaceStyleRendering",
            SurfaceColour=create("IfcColourRgb", Red=0.6, Green=0.75, Blue=0.8),
            Transparency=0.8,
            ReflectanceMethod="GLASS",
        )
        self.glass = create("IfcSurfaceStyle", Name="Glass", Side="BOTH", Styles=[shine])

    def storey(self, name: str, elevation: float) -> Any:
        """A storey with its floor at a height."""
        placement = self._placed(self.building.ObjectPlacement, elevation)
        return self._rooted("IfcBuildingStorey", Name=name, ObjectPlacement=placement, Elevation=elevation)

    def element(
        self, kind: str, storey: Any, solids: Iterable[Solid], glass: Iterable[Solid] = (), **given: Any
    ) -> Any:
        """An element of upright solids, those of ``glass`` clear."""
        panes = [self._solid(*one) for one in glass]
        for pane in panes:
            self.file.create_entity("IfcStyledItem", Item=pane, Styles=[self.glass])
        items = [*(self._solid(*one) for one in solids), *panes]
        body = self.file.create_entity(
            "IfcShapeRepresentation",
            ContextOfItems=self.context,
            RepresentationIdentifier="Body",
            RepresentationType="SweptSolid",
            Items=items,
        )
        shape = self.file.create_entity("IfcProductDefinitionShape", Representations=[body])
        placement = self._placed(storey.ObjectPlacement, 0.0)
        named = {"Name": f"{kind[3:]} {self.file.get_max_id()}", "ObjectPlacement": placement, "Representation": shape}
        return self._rooted(kind, **named, **given)

    def relate(self, kind: str, **given: Any) -> None:
        """A relation."""
        self._rooted(kind, **given)

    def finish(self, storeys: Sequence[Any]) -> None:
        """Put the storeys into the building."""
        self.relate("IfcRelAggregates", RelatingObject=self.building, RelatedObjects=list(storeys))

    def _rooted(self, kind: str, **given: Any) -> Any:
        return self.file.create_entity(kind, GlobalId=ifcopenshell.guid.new(), **given)

    def _point(self, *at: float) -> Any:
        return self.file.create_entity("IfcCartesianPoint", Coordinates=[float(x) for x in at])

    def _axes(self, height: float) -> Any:
        return self.file.create_entity("IfcAxis2Placement3D", Location=self._point(0.0, 0.0, height))

    def _placed(self, above: Any, height: float) -> Any:
        return self.file.create_entity("IfcLocalPlacement", PlacementRelTo=above, RelativePlacement=self._axes(height))

    def _solid(self, outline: Polygon, base: float, height: float) -> Any:
        rings = [
            self.file.create_entity("IfcPolyline", Points=[self._point(x, y) for x, y in ring.coords])
            for ring in (outline.exterior, *outline.interiors)
        ]
        kind = "IfcArbitraryProfileDefWithVoids" if len(rings) > 1 else "IfcArbitraryClosedProfileDef"
        voids = {"InnerCurves": rings[1:]} if len(rings) > 1 else {}
        profile = self.file.create_entity(kind, ProfileType="AREA", OuterCurve=rings[0], **voids)
        up = self.file.create_entity("IfcDirection", DirectionRatios=[0.0, 0.0, 1.0])
        return self.file.create_entity(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self._axes(base),
            ExtrudedDirection=up,
            Depth=float(height),
        )
