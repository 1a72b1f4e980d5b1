"""Classified points as ``.laz`` or ``.las`` 1.4: each point with its class and the number of its element.

Coordinates are metres, z up. The extra dimension ``element`` numbers the elements from 1, 0 for none; the table of
numbers, GlobalIds, classes and names is an extended record of the user ``scan2bim`` (JSON). Classes from 64 on are
named in the standard's lookup record.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from types import TracebackType
from typing import Final

import laspy
import numpy as np
from laspy.vlrs import VLR
from laspy.vlrs.vlrlist import VLRList
from numpy.typing import NDArray

from scan2bim import __version__
from scan2bim.model.points import LocalPoints

SCALE: Final = 0.0001
"""Metres that coordinates are kept to: far below a scanner's noise."""
UNCLASSIFIED: Final = 1
CLASSES: Final = {
    "Wall": 64,
    "Slab": 65,
    "Covering": 66,
    "Column": 67,
    "Beam": 68,
    "Stair": 69,
    "RoofPlane": 70,
    "Door": 71,
    "Window": 72,
}
"""Numbers that the LAS standard leaves to users (64 on): it has none for the parts of a building."""
_USER: Final = "scan2bim"
_TABLE: Final = 1  # number of the record with the table of elements
_NAME: Final = 15  # characters of a class's name in the lookup record


@dataclass(frozen=True, slots=True)
class Owner:
    """An element that points can lie on: GlobalId, class (LAS number) and name."""

    guid: str
    classification: int
    name: str


class ClassifiedWriter:
    """Writes points chunk by chunk; a context manager. owners: the elements in the order of their numbers, from 1 on.

    shift (3,) metres is put back onto all coordinates. ``.laz`` is compressed.
    """

    def __init__(self, path: Path, shift: tuple[float, float, float], owners: Sequence[Owner]) -> None:
        self._owners = owners
        self._classes = np.array([UNCLASSIFIED, *(owner.classification for owner in owners)], np.uint8)
        self._out = laspy.open(str(path), "w", header=_header(shift), do_compress=path.suffix.lower() == ".laz")

    def __enter__(self) -> ClassifiedWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._out.write_evlrs(VLRList([VLR(_USER, _TABLE, "elements by number", _table(self._owners))]))
        self._out.close()

    def add(self, points: LocalPoints, numbers: NDArray[np.uint32]) -> None:
        """Write points with the numbers (n,) of their elements, 0 for none."""
        self._out.write_points(_records(self._out.header, points, numbers, self._classes))


def _header(shift: tuple[float, float, float]) -> laspy.LasHeader:
    header = laspy.LasHeader(version="1.4", point_format=7)
    header.scales = np.full(3, SCALE)
    header.offsets = np.array(shift)
    header.generating_software = f"scan2bim {__version__}"
    header.system_identifier = "terrestrial laser scans"
    header.creation_date = date(1980, 1, 1)  # the same input gives the same bytes
    header.add_extra_dims([laspy.ExtraBytesParams("element", "uint32", "number of the element, 0 none")])
    header.vlrs.append(VLR("LASF_Spec", 0, "class names", _lookup()))
    return header


def _lookup() -> bytes:
    """The standard's record of class names: a number and 15 characters each."""
    names = {number: name.lower() for name, number in CLASSES.items()} | {70: "roof"}
    return b"".join(bytes([number]) + name.encode("ascii").ljust(_NAME, b"\0") for number, name in names.items())


def _table(owners: Sequence[Owner]) -> bytes:
    rows = [
        {"element": number, "GlobalId": owner.guid, "class": owner.classification, "name": owner.name}
        for number, owner in enumerate(owners, 1)
    ]
    return json.dumps(rows, ensure_ascii=False).encode()


def _records(
    header: laspy.LasHeader, points: LocalPoints, numbers: NDArray[np.uint32], classes: NDArray[np.uint8]
) -> laspy.ScaleAwarePointRecord:
    records = laspy.ScaleAwarePointRecord.zeros(len(numbers), header=header)
    for axis, name in enumerate("xyz"):
        records[name] = points.xyz[:, axis] + header.offsets[axis]
    if points.rgb is not None:
        for channel, name in enumerate(("red", "green", "blue")):
            records[name] = points.rgb[:, channel].astype(np.uint16) * 257
    if points.intensity is not None:
        records["intensity"] = np.round(np.clip(points.intensity, 0.0, 1.0) * 65_535).astype(np.uint16)
    records["return_number"] = np.ones(len(numbers), np.uint8)
    records["number_of_returns"] = np.ones(len(numbers), np.uint8)
    records["point_source_id"] = points.station
    records["classification"] = classes[numbers]
    records["element"] = numbers
    return records
