"""A plain IFC of a simulated scene's walls, openings and floors, with changes: what a verification is tried on."""

from __future__ import annotations

import math
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np

from scan2bim.simulate.truth import DoorTruth, Truth, WindowTruth


@dataclass(frozen=True)
class Change:
    """Of a wall: moved to its left (m), turned about its middle (radians), thicker (m) or left out."""

    left: float = 0.0
    turn: float = 0.0
    thicker: float = 0.0
    out: bool = False


def guid_of(name: str) -> str:
    return ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_URL, name).hex)


class Drawing:
    """An IFC4 file in metres, one storey."""

    def __init__(self) -> None:
        self.file: Any = ifcopenshell.file(schema="IFC4")
        make = self.file.create_entity
        unit = make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
        self.origin = self._placement(np.eye(4))
        self.context = make("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, self.origin)
        project = make("IfcProject", guid_of("project"), Name="drawn", RepresentationContexts=[self.context])
        project.UnitsInContext = make("IfcUnitAssignment", [unit])
        building = make("IfcBuilding", guid_of("building"), Name="house")
        self.storey = make("IfcBuildingStorey", guid_of("storey"), Name="ground floor")
        self.storey.ObjectPlacement = make("IfcLocalPlacement", None, self.origin)
        make("IfcRelAggregates", guid_of("p"), RelatingObject=project, RelatedObjects=[building])
        make("IfcRelAggregates", guid_of("b"), RelatingObject=building, RelatedObjects=[self.storey])
        self.held: list[Any] = []

    def _placement(self, matrix: np.ndarray) -> Any:
        make = self.file.create_entity
        point = make("IfcCartesianPoint", tuple(float(x) for x in matrix[:3, 3]))
        axis = make("IfcDirection", tuple(float(x) for x in matrix[:3, 2]))
        ref = make("IfcDirection", tuple(float(x) for x in matrix[:3, 0]))
        return make("IfcAxis2Placement3D", point, axis, ref)

    def box(self, ifc_class: str, name: str, matrix: np.ndarray, size: Sequence[float], **more: Any) -> Any:
        """A box of length, width and height; the middle of its underside at the matrix's origin."""
        make = self.file.create_entity
        profile = make("IfcRectangleProfileDef", "AREA", None, None, float(size[0]), float(size[1]))
        solid = make(
            "IfcExtrudedAreaSolid", profile, self.origin, make("IfcDirection", (0.0, 0.0, 1.0)), float(size[2])
        )
        shape = make("IfcShapeRepresentation", self.context, "Body", "SweptSolid", [solid])
        product = make(ifc_class, guid_of(name), Name=name, **more)
        product.ObjectPlacement = make("IfcLocalPlacement", None, self._placement(matrix))
        product.Representation = make("IfcProductDefinitionShape", None, None, [shape])
        if ifc_class != "IfcOpeningElement":
            self.held.append(product)
        return product

    def write(self, path: Path) -> Path:
        self.file.create_entity(
            "IfcRelContainedInSpatialStructure",
            guid_of("c"),
            RelatedElements=self.held,
            RelatingStructure=self.storey,
        )
        self.file.write(str(path))
        return path


def frame(x: float, y: float, z: float, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]])


def draw(truth: Truth, path: Path, changes: Mapping[str, Change] | None = None) -> Path:
    """Write the scene's model with the changed walls."""
    drawing = Drawing()
    for wall in truth.walls:
        change = (changes or {}).get(wall.name, Change())
        if change.out:
            continue
        start, end = np.array(wall.start), np.array(wall.end)
        angle = math.atan2(*(end - start)[::-1])
        middle = (start + end) / 2 + change.left * np.array([-math.sin(angle), math.cos(angle)])
        matrix = frame(middle[0], middle[1], wall.base, angle + change.turn)
        length = float(np.linalg.norm(end - start))
        body = drawing.box("IfcWall", wall.name, matrix, (length, wall.thickness + change.thicker, wall.height))
        for fill in (*truth.doors, *truth.windows):
            if fill.wall == wall.name:
                _opening(drawing, body, fill, wall.thickness)
    low, high = np.min([w.start for w in truth.walls], axis=0), np.max([w.end for w in truth.walls], axis=0)
    middle = (low + high) / 2
    floor = frame(middle[0], middle[1], truth.walls[0].base - 0.2, 0.0)
    drawing.box("IfcSlab", "floor", floor, (*(high - low + 2.0), 0.2))
    return drawing.write(path)


def _opening(drawing: Drawing, wall: Any, fill: DoorTruth | WindowTruth, thickness: float) -> None:
    a, b = np.array(fill.corners[0]), np.array(fill.corners[1])
    middle, angle = (a + b) / 2, math.atan2(*(b - a)[:2][::-1])
    matrix = frame(middle[0], middle[1], a[2], angle)
    hole = drawing.box("IfcOpeningElement", f"{fill.name} opening", matrix, (fill.width, thickness + 0.2, fill.height))
    kind = "IfcDoor" if isinstance(fill, DoorTruth) else "IfcWindow"
    door = drawing.box(
        kind, fill.name, matrix, (fill.width, 0.04, fill.height), OverallWidth=fill.width, OverallHeight=fill.height
    )
    make = drawing.file.create_entity
    make("IfcRelVoidsElement", guid_of(f"v{fill.name}"), RelatingBuildingElement=wall, RelatedOpeningElement=hole)
    make("IfcRelFillsElement", guid_of(f"f{fill.name}"), RelatingOpeningElement=hole, RelatedBuildingElement=door)
