"""Reading IFC files back, with ifcopenshell's own geometry and nothing of the exporter's."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.shape
import numpy as np
from buildings import building, measured

from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Building, Storey, Wall
from scan2bim.model.ids import ifc_guid

_OPEN: list[ifcopenshell.file] = []
"""Files that were read: an entity of one that is gone crashes the interpreter."""


def one_storey(*walls: Wall, **more) -> Building:
    storey = Storey(id="storey", name="Storey", elevation=measured(0.0), walls=walls, **more)
    return Building(id="building", name="Building", storeys=(storey,))


def written(house: Building, folder: Path) -> ifcopenshell.file:
    export(house, folder / "house.ifc")
    _OPEN.append(ifcopenshell.open(str(folder / "house.ifc")))
    return _OPEN[-1]


def whole(folder: Path) -> ifcopenshell.file:
    return written(building(), folder)


def entity(file: ifcopenshell.file, identifier: str) -> ifcopenshell.entity_instance:
    return file.by_guid(ifc_guid(identifier))


def points(element: ifcopenshell.entity_instance, openings: bool = True) -> np.ndarray:
    """World coordinates (n, 3) of the corners of the element's body, metres."""
    return np.array(_shape(element, openings).geometry.verts).reshape(-1, 3)


def volume(element: ifcopenshell.entity_instance, openings: bool = True) -> float:
    return ifcopenshell.util.shape.get_volume(_shape(element, openings).geometry)


def _shape(element, openings):
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("disable-opening-subtractions", not openings)
    return ifcopenshell.geom.create_shape(settings, element)
