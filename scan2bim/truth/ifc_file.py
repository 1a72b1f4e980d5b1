"""Opening an IFC file of anybody's, and the plain parts of its elements: meshes, placements, properties, storeys."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import DamagedFileError
from scan2bim.ifcfile import open_ifc

F64 = NDArray[np.float64]
Entity = Any
"""An ifcopenshell.entity_instance: its attributes are known at run time only."""

UPRIGHT = 0.1
"""Height of a triangle's unit normal below which it stands upright: 6 degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles of one element, metres, in the file's world coordinates.

    vertices (n, 3) float64; faces (m, 3) int64; material (m,) int64 into ``colours``, -1 for none; colours (k, 4)
    float64: red, green, blue and transparency in 0-1.
    """

    vertices: F64
    faces: NDArray[np.int64]
    material: NDArray[np.int64]
    colours: F64

    def normals(self) -> tuple[F64, F64]:
        """Unit normals (m, 3) and areas (m,) of the triangles."""
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        across = np.cross(b - a, c - a)
        length = np.linalg.norm(across, axis=1)
        return across / np.maximum(length, 1e-12)[:, None], length / 2


def stacked(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one, without their colours."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, first.tolist(), strict=True)])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return Mesh(vertices, faces, np.full(len(faces), -1, dtype=np.int64), np.zeros((0, 4)))


class IfcModel:
    """An IFC file that is read only. Raises InputError where it is none."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file: Any = open_ifc(path)
        try:
            self.schema: str = self.file.schema
            self.unit = float(ifcopenshell.util.unit.calculate_unit_scale(self.file))
        except Exception as error:  # the library raises what it meets in a damaged file, of many classes
            raise DamagedFileError(
                path, f"cannot be read as IFC ({type(error).__name__}: {error}).", "Export it again."
            ) from error

    def of(self, *classes: str) -> list[Entity]:
        """All elements of these classes and of those derived from them; classes that the schema lacks give none."""
        found: dict[int, Entity] = {}
        for name in classes:
            try:
                entities = self.file.by_type(name)
            except RuntimeError:
                continue
            found.update((entity.id(), entity) for entity in entities)
        return list(found.values())

    def meshes(self, elements: Iterable[Entity], *, voids: bool) -> Iterator[tuple[Entity, Mesh]]:
        """The mesh of each element that has one; ``voids``: with its openings cut out."""
        wanted = [e for e in elements if getattr(e, "Representation", None) is not None]
        if not wanted:
            return
        settings: Any = ifcopenshell.geom.settings()
        settings.set("use-world-coords", True)
        settings.set("disable-opening-subtractions", not voids)
        iterator: Any = ifcopenshell.geom.iterator(settings, self.file, 1, include=wanted)
        more = bool(iterator.initialize())
        while more:
            shape = iterator.get()
            mesh = _mesh(shape.geometry)
            if len(mesh.faces):
                yield self.file.by_id(shape.id), mesh
            more = bool(iterator.next())

    def placement(self, element: Entity) -> F64:
        """(4, 4) from the element's own axes to world coordinates, metres."""
        matrix = np.array(ifcopenshell.util.placement.get_local_placement(element.ObjectPlacement), dtype=np.float64)
        matrix[:3, 3] *= self.unit
        return matrix

    def properties(self, element: Entity) -> dict[str, Any]:
        """All single properties of all sets as "Set.Property"."""
        sets: dict[str, dict[str, Any]] = ifcopenshell.util.element.get_psets(element)
        return {f"{name}.{key}": value for name, values in sets.items() for key, value in values.items()}

    def storey(self, element: Entity) -> Entity | None:
        """The storey that an element stands in, or that the element stands in that it is part of or hosted by."""
        for _ in range(8):
            if element is None or element.is_a("IfcBuildingStorey"):
                break
            element = _above(element)
        return element if element is not None and element.is_a("IfcBuildingStorey") else None

    def map_conversion(self) -> F64 | None:
        """(4, 4) from world to map coordinates by the file's IfcMapConversion, None without one."""
        found = self.of("IfcMapConversion")
        if not found:
            return self._rigid_operation()
        conversion = found[0]
        x = 1.0 if conversion.XAxisAbscissa is None else conversion.XAxisAbscissa
        y = conversion.XAxisOrdinate or 0.0
        length = float(np.hypot(x, y)) or 1.0
        c, s = x / length, y / length
        # Eastings are in the map's unit: metres, or else what the projected system says. Scale maps units, not metres.
        moved = (conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight)
        matrix = np.eye(4)
        matrix[:3, :3] = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
        matrix[:3, 3] = [float(value or 0.0) * self._map_unit(conversion) for value in moved]
        return matrix

    def _rigid_operation(self) -> F64 | None:
        """What 4.3 may have instead of a map conversion."""
        lengths = [r for r in self.of("IfcRigidOperation") if r.FirstCoordinate.is_a("IfcLengthMeasure")]
        if not lengths:
            return None
        moved = (lengths[0].FirstCoordinate.wrappedValue, lengths[0].SecondCoordinate.wrappedValue, lengths[0].Height)
        matrix = np.eye(4)
        matrix[:3, 3] = [float(value or 0.0) * self.unit for value in moved]
        return matrix

    def _map_unit(self, conversion: Entity) -> float:
        unit = getattr(conversion.TargetCRS, "MapUnit", None)
        if unit is None:
            return self.unit
        return float(ifcopenshell.util.unit.get_prefix_multiplier(unit.Prefix)) if unit.is_a("IfcSIUnit") else 1.0


def _above(element: Entity) -> Entity | None:
    container = ifcopenshell.util.element.get_container(element)
    if container is not None:
        return container
    for name in ("FillsVoids", "VoidsElements"):
        relations = getattr(element, name, ()) or ()
        if relations:
            relation = relations[0]
            return relation.RelatingOpeningElement if name == "FillsVoids" else relation.RelatingBuildingElement
    return ifcopenshell.util.element.get_aggregate(element)


def _mesh(geometry: Any) -> Mesh:
    vertices = np.array(geometry.verts, dtype=np.float64).reshape(-1, 3)
    faces = np.array(geometry.faces, dtype=np.int64).reshape(-1, 3)
    material = np.array(geometry.material_ids, dtype=np.int64)
    colours = [_colour(style) for style in geometry.materials]
    if len(material) != len(faces):
        material = np.full(len(faces), -1, dtype=np.int64)
    return Mesh(vertices, faces, material, np.array(colours, dtype=np.float64).reshape(-1, 4))


def _colour(style: Any) -> tuple[float, float, float, float]:
    diffuse = style.diffuse
    clear = style.transparency
    red, green, blue = (float(getattr(diffuse, channel)()) for channel in ("r", "g", "b"))
    return red, green, blue, 0.0 if math.isnan(clear) else float(clear)
