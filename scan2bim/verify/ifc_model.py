"""Reading any IFC (2x3, 4, 4x3): its elements as triangles in metres, its openings, storeys and map conversion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element as element_util
import ifcopenshell.util.placement as placement_util
import ifcopenshell.util.unit as unit_util
import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import InputError
from scan2bim.ifcfile import open_ifc
from scan2bim.verify.hanging import Hanging, drawn_hanging

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
Role = Literal["compared", "context", "fill", "opening", "patch"]

SKIPPED = ("IfcVirtualElement", "IfcFeatureElementAddition", "IfcFeatureElementSubtraction", "IfcReinforcingElement")
"""Classes with geometry that no scan can see."""
MOVABLE = ("IfcFurnishingElement", "IfcFurniture", "IfcSystemFurnitureElement", "IfcTransportElement")
"""Things that are moved after building: they explain points, but where they stand is no fault."""
GLASS = 0.25
"""Transparency from which a surface is taken as glass, which scanners see through: drawn panes have 0.3 to 0.9."""
LIBRARIES = ("hybrid-cgal-simple-opencascade", "opencascade")
"""Geometry kernels of ifcopenshell, the first that is there: the hybrid gives the same surfaces in a third of the
time."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelElement:
    """An element with a body.

    vertices (v, 3) float64 metres in the model's world axes; triangles (t, 3) int32; glass (t,) bool. role: "compared",
    "context" (explains points, is not judged), "fill" (door or window), "opening" or "patch" (the wall's surface across
    its opening). host: for a fill its opening, for an opening its wall, as GlobalId. storey: name of the one that holds
    it. hanging: of a door, as its operation tells.
    """

    guid: str
    ifc_class: str
    name: str
    storey: str
    role: Role
    vertices: F64
    triangles: I32
    glass: NDArray[np.bool_]
    host: str | None = None
    hanging: Hanging | None = None


@dataclass(frozen=True, slots=True)
class MapConversion:
    """IfcMapConversion, or 4.3's rigid operation, in metres: eastings, northings, height, turn (radians), crs name."""

    eastings: float
    northings: float
    height: float
    turn: float
    crs: str | None

    def matrix(self) -> F64:
        """From the model's world axes to map coordinates, (4, 4), metres."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        out = np.eye(4)
        out[:2, :2] = [[c, -s], [s, c]]
        out[:3, 3] = (self.eastings, self.northings, self.height)
        return out


@dataclass(frozen=True, slots=True)
class ModelStorey:
    """A storey's name and elevation, metres in the model's world axes."""

    name: str
    elevation: float


@dataclass(frozen=True, slots=True, eq=False)
class IfcModel:
    """What verification needs of an IFC file. ``without_body`` are elements without geometry: (guid, class, name)."""

    path: Path
    schema: str
    name: str
    elements: tuple[ModelElement, ...]
    storeys: tuple[ModelStorey, ...]
    conversion: MapConversion | None
    without_body: tuple[tuple[str, str, str], ...]


def read_model(path: Path) -> IfcModel:
    """Elements with their bodies in metres. Raises InputError where the file cannot be read or has no bodies."""
    file = open_ifc(path)
    wanted = [e for e in file.by_type("IfcElement") if not _is_any(e, SKIPPED)]
    drawn = [e for e in wanted if getattr(e, "Representation", None)]
    drawn += [e for e in file.by_type("IfcOpeningElement") if e.Representation and e not in drawn]
    site = [e for e in file.by_type("IfcSite") if e.Representation]
    elements = tuple(_elements(file, [*drawn, *site]))
    if not any(e.role == "compared" for e in elements):
        raise InputError(path, "has no building element with a body.", "Export the model with geometry.")
    found = {e.guid for e in elements}
    bare = tuple(
        (e.GlobalId, e.is_a(), e.Name or "") for e in wanted if e.GlobalId not in found and not e.IsDecomposedBy
    )
    project = file.by_type("IfcProject")
    name = (project[0].LongName or project[0].Name or path.stem) if project else path.stem
    return IfcModel(path, file.schema, name, elements, _storeys(file), conversion_of(file), bare)


def _elements(file: ifcopenshell.file, products: Sequence[Any]) -> Iterator[ModelElement]:
    openings = {r.RelatedOpeningElement.GlobalId: r.RelatingBuildingElement for r in file.by_type("IfcRelVoidsElement")}
    fills = {r.RelatedBuildingElement.GlobalId: r.RelatingOpeningElement for r in file.by_type("IfcRelFillsElement")}
    scale = unit_util.calculate_unit_scale(file)
    # Threads finish them in any order.
    bodies = {guid: (vertices, triangles, glass) for guid, vertices, triangles, glass in _bodies(file, products)}
    for product in products:
        guid = product.GlobalId
        if guid not in bodies:
            continue
        vertices, triangles, glass = bodies[guid]
        host = openings.get(guid) or fills.get(guid)
        yield ModelElement(
            guid=guid,
            ifc_class=product.is_a(),
            name=product.Name or "",
            storey=_storey_of(host if product.is_a("IfcOpeningElement") and host else product),
            role=_role(product),
            vertices=vertices,
            triangles=triangles,
            glass=glass,
            host=None if host is None else host.GlobalId,
            hanging=drawn_hanging(product, _operation(product), vertices / scale),
        )


def _bodies(file: ifcopenshell.file, products: Sequence[Any]) -> Iterator[tuple[str, F64, I32, NDArray[np.bool_]]]:
    """GlobalId, vertices, triangles and glass of each body; elements that no kernel can mesh are left out."""
    if not products:
        return
    settings: Any = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("weld-vertices", True)
    shapes = _iterator(settings, file, products)
    while shapes is not None:
        shape = shapes.get()
        geometry = shape.geometry
        vertices = np.array(geometry.verts, np.float64).reshape(-1, 3)
        triangles = np.array(geometry.faces, np.int32).reshape(-1, 3)
        if len(triangles) and np.isfinite(vertices).all():
            see_through = np.array([_transparency(m) >= GLASS for m in geometry.materials] + [False])
            ids = np.array(geometry.material_ids, np.int64)
            glass = see_through[ids] if len(ids) == len(triangles) else np.zeros(len(triangles), bool)
            yield shape.guid, vertices, triangles, glass
        if not shapes.next():
            return


def _iterator(settings: Any, file: ifcopenshell.file, products: Sequence[Any]) -> Any:
    """A started iterator over the products' bodies, None where there is none."""
    for library in LIBRARIES:
        try:
            shapes: Any = ifcopenshell.geom.iterator(
                settings, file, 2, include=list(products), geometry_library=library
            )
            if shapes.initialize():
                return shapes
        except (RuntimeError, TypeError, ValueError):
            continue
    return None


def _transparency(material: Any) -> float:
    value = float(material.transparency)
    return 0.0 if math.isnan(value) else value


def _role(product: Any) -> Role:
    if product.is_a("IfcOpeningElement"):
        return "opening"
    if product.is_a("IfcDoor") or product.is_a("IfcWindow"):
        return "fill"
    return "context" if product.is_a("IfcSite") or _is_any(product, MOVABLE) else "compared"


def _is_any(product: Any, classes: Sequence[str]) -> bool:
    for name in classes:
        try:
            if product.is_a(name):
                return True
        except RuntimeError:  # a class that this schema does not know
            continue
    return False


def _storey_of(product: Any) -> str:
    container = element_util.get_container(product)
    while container is not None and not container.is_a("IfcBuildingStorey"):
        container = element_util.get_aggregate(container)
    return "" if container is None else (container.Name or container.GlobalId)


def _storeys(file: ifcopenshell.file) -> tuple[ModelStorey, ...]:
    scale = unit_util.calculate_unit_scale(file)
    found = [
        ModelStorey(s.Name or s.GlobalId, float(placement_util.get_storey_elevation(s)) * scale)
        if s.ObjectPlacement is None
        else ModelStorey(
            s.Name or s.GlobalId, float(placement_util.get_local_placement(s.ObjectPlacement)[2, 3]) * scale
        )
        for s in file.by_type("IfcBuildingStorey")
    ]
    return tuple(sorted(found, key=lambda s: s.elevation))


def _operation(product: Any) -> str | None:
    """The way in which a door moves, from itself (IFC4) or its type or style."""
    if not product.is_a("IfcDoor"):
        return None
    kind = element_util.get_type(product)
    for holder in (product, kind):
        value = getattr(holder, "OperationType", None) if holder is not None else None
        if value and value != "NOTDEFINED":
            return str(value)
    return None


def _metres(unit: Any, file: ifcopenshell.file) -> float:
    """Of a unit of maps, the file's own where none is stated."""
    if unit is None:
        return float(unit_util.calculate_unit_scale(file))
    factor = 1.0
    while unit.is_a("IfcConversionBasedUnit"):
        measure = unit.ConversionFactor
        factor *= measure.ValueComponent.wrappedValue
        unit = measure.UnitComponent
    prefix = getattr(unit, "Prefix", None)
    return factor * (unit_util.get_prefix_multiplier(prefix) if prefix else 1.0)


def conversion_of(file: ifcopenshell.file) -> MapConversion | None:
    """How the model's coordinates became those of the map, None where the file does not say."""
    if file.schema == "IFC2X3":
        return None
    for entry in file.by_type("IfcMapConversion"):
        target = entry.TargetCRS
        metres = _metres(getattr(target, "MapUnit", None), file)
        across = 1.0 if entry.XAxisAbscissa is None else entry.XAxisAbscissa
        return MapConversion(
            entry.Eastings * metres,
            entry.Northings * metres,
            (entry.OrthogonalHeight or 0.0) * metres,
            math.atan2(entry.XAxisOrdinate or 0.0, across),
            getattr(target, "Name", None),
        )
    for entry in file.by_type("IfcRigidOperation") if file.schema_identifier == "IFC4X3_ADD2" else ():
        metres = _metres(getattr(entry.TargetCRS, "MapUnit", None), file)
        if entry.FirstCoordinate.is_a("IfcLengthMeasure"):
            east, north = (value.wrappedValue * metres for value in (entry.FirstCoordinate, entry.SecondCoordinate))
            return MapConversion(east, north, (entry.Height or 0.0) * metres, 0.0, entry.TargetCRS.Description)
    return None
