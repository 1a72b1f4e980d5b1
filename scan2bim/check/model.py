"""An IFC file as the checks see it: its elements with bodies, storeys and relations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import numpy as np

from scan2bim.check.bodies import Body, Floats
from scan2bim.check.values import Finding
from scan2bim.ifcfile import open_ifc

Entity = ifcopenshell.entity_instance

HEAVY: Final = 20_000
"""Triangles from which on a body is furniture or a mesh of a scan: looked at by its bounds alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A product with its body, if it has one that could be made."""

    entity: Entity
    body: Body | None

    def is_a(self, *names: str) -> bool:
        """Whether it is of one of these classes."""
        return any(self.entity.is_a(name) for name in names)

    def finding(self, check: str, text: str, amount: float | None = None, unit: str = "") -> Finding:
        """A finding of this product."""
        return finding(self.entity, check, text, amount, unit)


def finding(entity: Entity, check: str, text: str, amount: float | None = None, unit: str = "") -> Finding:
    """A finding of any entity with a GlobalId."""
    rounded = None if amount is None else round(float(amount), 4)
    return Finding(check, entity.GlobalId, getattr(entity, "Name", None) or "", entity.is_a(), text, rounded, unit)


@dataclass(frozen=True, slots=True)
class Level:
    """A storey and the z of its placement, metres."""

    entity: Entity
    z: float


@dataclass(eq=False)
class Model:
    """The file, metres a unit, and its products by step id."""

    path: Path
    file: ifcopenshell.file
    unit: float
    parts: dict[int, Part]
    notes: list[str] = field(default_factory=list[str])

    def of(self, *names: str) -> Iterator[Part]:
        """Products of these classes that have a body."""
        for part in self.parts.values():
            if part.body is not None and part.is_a(*names):
                yield part

    def part(self, entity: Entity | None) -> Part | None:
        """The product of an entity."""
        return None if entity is None else self.parts.get(entity.id())

    @cached_property
    def levels(self) -> list[Level]:
        """Storeys from the lowest up."""
        found = [Level(s, self.matrix(s)[2, 3]) for s in self.file.by_type("IfcBuildingStorey") if s.ObjectPlacement]
        return sorted(found, key=lambda level: level.z)

    def matrix(self, entity: Entity) -> Floats:
        """Placement (4, 4) of a product, metres."""
        made: Any = ifcopenshell.util.placement.get_local_placement(entity.ObjectPlacement)
        matrix = np.array(made, np.float64)
        matrix[:3, 3] *= self.unit
        return matrix

    def storey_of(self, entity: Entity) -> Entity | None:
        """The storey that contains the element, also by way of what it fills or is a part of."""
        found = ifcopenshell.util.element.get_container(entity, ifc_class="IfcBuildingStorey")
        if found is None and entity.is_a("IfcSpatialElement" if self.file.schema != "IFC2X3" else "IfcSpace"):
            whole = ifcopenshell.util.element.get_aggregate(entity)
            return whole if whole is not None and whole.is_a("IfcBuildingStorey") else None
        return found


def read_model(path: Path) -> Model:
    """The file with all bodies, openings not subtracted. Raises InputError for what is no IFC file."""
    return model_of(path, open_ifc(path))


def model_of(path: Path, file: ifcopenshell.file) -> Model:
    """The products of an open file with their bodies."""
    products = [p for p in file.by_type("IfcProduct") if p.is_a("IfcElement") or p.is_a("IfcSpace")]
    bodies = _bodies(file, [p for p in products if p.Representation])
    parts = {product.id(): Part(product, bodies.get(product.id())) for product in products}
    return Model(path, file, float(ifcopenshell.util.unit.calculate_unit_scale(file)), parts)


def _bodies(file: ifcopenshell.file, products: list[Entity]) -> dict[int, Body]:
    if not products:
        return {}
    settings: Any = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("disable-opening-subtractions", True)
    settings.set("weld-vertices", True)
    iterator: Any = ifcopenshell.geom.iterator(settings, file, 1, include=products)
    out: dict[int, Body] = {}
    going = iterator.initialize()
    while going:
        shape = iterator.get()
        vertices = np.array(shape.geometry.verts, np.float64).reshape(-1, 3)
        triangles = np.array(shape.geometry.faces, np.int64).reshape(-1, 3)
        if len(triangles):
            out[shape.id] = Body(vertices, triangles)
        going = iterator.next()
    return out
