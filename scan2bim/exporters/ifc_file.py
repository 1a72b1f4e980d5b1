"""An IFC file in the making: its entities, its contexts and what its elements share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from scan2bim import __version__
from scan2bim.exporters.ifc_schema import Dialect, Version, attributes
from scan2bim.ifcfile import ifcopenshell
from scan2bim.model.ids import ifc_guid

Entity = ifcopenshell.entity_instance

LABEL = 255
"""Characters that an IfcLabel or IfcIdentifier may have."""

COORDINATE_DIGITS = 6
"""Coordinates are written to the micrometre: far below any scanner, and free of the noise of the last float digits."""


@cache
def _places(version: Version, ifc_class: str) -> dict[str, int]:
    """Places of a class's attributes by name."""
    return {name: place for place, name in enumerate(attributes(version, ifc_class))}


class IfcFile:
    """Adds entities. Identifiers come from keys, not from a clock or chance: two runs write the same bytes."""

    def __init__(self, version: Version = "IFC4") -> None:
        self.dialect = Dialect(version)
        # The library's types lack the full name of 4.3.
        self.file = ifcopenshell.file(schema=version)  # pyright: ignore[reportArgumentType]
        self._directions: dict[tuple[float, ...], Entity] = {}
        self._guids: set[str] = set()
        self._made: dict[str, Entity] = {}
        self._history: Entity | None = None

    def add(self, ifc_class: str, *values: Any) -> Entity:
        """A new entity with its attributes in the schema's order; those that the version lacks are left out."""
        if self.dialect.old:
            values = values[: len(attributes(self.dialect.version, ifc_class))]
        return self._create(ifc_class, enumerate(values))

    def root(self, ifc_class: str, key: str, name: str | None = None, **values: Any) -> Entity:
        """A new entity with a GlobalId made from the key: an element's id, or words that say what relates what."""
        ifc_class, values = self.dialect.entity(ifc_class, values)
        if self.dialect.old:
            values["OwnerHistory"] = self._owner()
        places = _places(self.dialect.version, ifc_class)
        told = {"GlobalId": self._guid(key), "Name": label(name), **values}
        entity = self._create(ifc_class, ((places[attribute], value) for attribute, value in told.items()))
        self._made.setdefault(key, entity)
        return entity

    def _create(self, ifc_class: str, values: Iterable[tuple[int, Any]]) -> Entity:
        """A new entity with the attributes at some places; without the library's book-keeping for undoing, which takes
        most of its time, where its own calls can be reached.
        """
        known = [(place, value) for place, value in values if value is not None]
        create = getattr(self.file, "create", None)
        entity = create(ifc_class, -1) if create else None
        put = getattr(entity, "set_attribute_value_py", None)
        if entity is None or put is None:
            entity = self.file.create_entity(ifc_class) if entity is None else entity
            put = entity.__setitem__
        for place, value in known:
            put(place, value)
        return entity

    def made(self, key: str) -> Entity | None:
        """The entity that was made with this key, if any."""
        return self._made.get(key)

    def point(self, coordinates: Iterable[float]) -> Entity:
        """A point in two or three dimensions, metres."""
        return self.add("IfcCartesianPoint", tuple(round(float(c), COORDINATE_DIGITS) + 0.0 for c in coordinates))

    def direction(self, ratios: Iterable[float]) -> Entity:
        """A direction in two or three dimensions, one entity for all that are the same."""
        key = tuple(round(float(r), 12) + 0.0 for r in ratios)
        if key not in self._directions:
            self._directions[key] = self.add("IfcDirection", key)
        return self._directions[key]

    def drop_leftovers(self) -> None:
        """Removes geometry that nothing refers to, and points drawn twice: what the library's drawing functions left."""
        for curve in self.file.by_type("IfcIndexedPolyCurve") if not self.dialect.old else ():
            if curve.Segments is None:
                points = curve.Points.CoordList
                curve.Points.CoordList = [p for i, p in enumerate(points) if i == 0 or p != points[i - 1]]
        items = [item for item in self.file.by_type("IfcRepresentationItem") if not item.is_a("IfcStyledItem")]
        while unused := [item for item in items if self.file.get_total_inverses(item) == 0]:
            gone = {item.id() for item in unused}
            items = [item for item in items if item.id() not in gone]
            for item in unused:
                self.file.remove(item)

    def _owner(self) -> Entity:
        """The one owner history, which IFC2X3 wants of everything: without a time, so that reruns are equal."""
        if self._history is None:
            person = self.file.create_entity("IfcPerson", FamilyName="unknown")
            organization = self.file.create_entity("IfcOrganization", Name="scan2bim")
            user = self.file.create_entity("IfcPersonAndOrganization", person, organization)
            program = self.file.create_entity("IfcApplication", organization, __version__, "scan2bim", "scan2bim")
            self._history = self.file.create_entity(
                "IfcOwnerHistory",
                OwningUser=user,
                OwningApplication=program,
                ChangeAction="NOCHANGE",
                CreationDate=0,
            )
        return self._history

    def _guid(self, key: str) -> str:
        guid, count = ifc_guid(key), 0
        while guid in self._guids:
            count += 1
            guid = ifc_guid(f"{key} again {count}")
        self._guids.add(guid)
        return guid


def label(text: str | None) -> str | None:
    """Text as an IfcLabel takes it."""
    return None if text is None else text[:LABEL]


@dataclass(frozen=True, slots=True)
class Contexts:
    """The geometric contexts: solids, wall axes, outlines of spaces, and symbols of doors and windows in plan."""

    model: Entity
    body: Entity
    axis: Entity
    footprint: Entity
    symbol: Entity


@dataclass(slots=True)
class Shared:
    """An entity that several elements refer to, with those elements, to be related once all are known."""

    entity: Entity
    elements: list[Entity] = field(default_factory=list[Entity])
    usage: Entity | None = None


class TypeBook:
    """The types of the file, each made once, by key."""

    def __init__(self, ifc: IfcFile) -> None:
        self._ifc = ifc
        self._types: dict[str, Shared] = {}

    def find(self, key: str) -> Shared | None:
        """The type with this key, if it was made."""
        return self._types.get(key)

    def keep(self, key: str, entity: Entity, usage: Entity | None = None) -> Shared:
        """Keeps a new type; ``usage`` is the material layer set usage of its occurrences."""
        self._types[key] = Shared(entity, usage=usage)
        return self._types[key]

    def relate(self) -> None:
        """Writes the relations between the types and their elements, and between these and their layers."""
        for key, shared in self._types.items():
            if not shared.elements:
                continue
            if not self._ifc.dialect.old:
                for element in shared.elements:  # the type tells the kind; to say it twice is against the rules
                    element.PredefinedType = None
            self._ifc.root(
                "IfcRelDefinesByType", f"type of {key}", RelatedObjects=shared.elements, RelatingType=shared.entity
            )
            if shared.usage is not None:
                self._ifc.root(
                    "IfcRelAssociatesMaterial",
                    f"layers of {key}",
                    RelatedObjects=shared.elements,
                    RelatingMaterial=shared.usage,
                )
