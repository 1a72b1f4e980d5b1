"""The points of the scans with the elements of the verified model, and those that no element explains, as LAZ."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from scan2bim.model.classified import CLASSES, UNCLASSIFIED, ClassifiedWriter, Owner
from scan2bim.model.points import LocalPoints
from scan2bim.verify.compare import Owned, compare_points
from scan2bim.verify.ifc_model import ModelElement

if TYPE_CHECKING:
    from scan2bim.verify.build import Found

STEMS: Final = {
    "IfcWall": "Wall",
    "IfcCurtainWall": "Wall",
    "IfcSlab": "Slab",
    "IfcCovering": "Covering",
    "IfcColumn": "Column",
    "IfcBeam": "Beam",
    "IfcMember": "Beam",
    "IfcStair": "Stair",
    "IfcRamp": "Stair",
    "IfcRoof": "RoofPlane",
    "IfcDoor": "Door",
    "IfcWindow": "Window",
}
"""Class of points by the beginning of the IFC class: IfcWallStandardCase and IfcStairFlight too. Others
are unclassified and have their element's number."""


def write_classified(found: Found, path: Path) -> None:
    """All points, with class and element. Raises OSError."""
    _write(found, path, only_unexplained=False)


def write_remainder(found: Found, path: Path) -> None:
    """The points that no element explains. Raises OSError."""
    _write(found, path, only_unexplained=True)


def owners_of(elements: Sequence[ModelElement]) -> tuple[list[Owner], NDArray[np.uint32]]:
    """The elements that points can be given, and the number (e + 1,) from 1 on of each of the model's elements, 0 for
    none, as the last entry is. What is measured across an opening belongs to the door or window in it.
    """
    owners: list[Owner] = []
    numbers = np.zeros(len(elements) + 1, np.uint32)
    fill_of: dict[str, int] = {}
    for place, element in enumerate(elements):
        if element.role in ("compared", "context", "fill"):
            owners.append(Owner(element.guid, class_of(element.ifc_class), element.name))
            numbers[place] = len(owners)
            if element.role == "fill" and element.host:
                fill_of[element.host] = len(owners)
    for place, element in enumerate(elements):
        if element.role == "patch":
            numbers[place] = fill_of.get(element.guid, 0)
    return owners, numbers


def class_of(ifc_class: str) -> int:
    """LAS class of an IFC class."""
    return next((CLASSES[name] for stem, name in STEMS.items() if ifc_class.startswith(stem)), UNCLASSIFIED)


def _write(found: Found, path: Path, only_unexplained: bool) -> None:
    owners, numbers = owners_of(found.model.elements)
    source = found.source
    with ClassifiedWriter(path, source.shift, owners) as out:

        def sink(owned: Owned) -> None:
            kept = owned.owner == -2 if only_unexplained else np.ones(len(owned.owner), bool)
            picked = owned.records[kept]
            points = LocalPoints(
                owned.xyz(kept),
                np.column_stack([picked["r"], picked["g"], picked["b"]]),
                picked["i"].astype(np.float32) / np.float32(255),
                picked["station"],
            )
            out.add(points, numbers[np.maximum(owned.owner[kept], -1)])

        table, ignored = found.surface.table, found.placement.ignored
        compare_points(table, source.scan_folders, source.stations, ignored, [sink], lambda _: None)
