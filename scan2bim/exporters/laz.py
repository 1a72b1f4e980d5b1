"""Classified points: ``.laz`` or ``.las`` 1.4 with every valid point of the scans, the class and the element it lies on.

Coordinates are metres, z up, with the survey's shift put back. The extra dimension ``element`` numbers the elements
from 1, 0 for none; the table of numbers, GlobalIds, classes and names is an extended record of the user ``scan2bim``
(JSON). Classes from 64 on are named in the standard's lookup record. Points are read and written chunk by chunk.
"""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Final

import laspy
import numpy as np
from laspy.vlrs import VLR
from laspy.vlrs.vlrlist import VLRList

from scan2bim import __version__
from scan2bim.errors import UsageError
from scan2bim.exporters.point_labels import CLASSES, PointLabels, point_labels
from scan2bim.model.elements import Building
from scan2bim.model.ids import ifc_guid
from scan2bim.model.points import LocalPoints, PointSource

ONLY_BY_NAME: Final = True
"""Whole scans are copied: a folder of all formats does not get this one."""
SCALE: Final = 0.0001
"""Metres that coordinates are kept to: far below a scanner's noise."""
_USER: Final = "scan2bim"
_TABLE: Final = 1  # number of the record with the table of elements
_NAME: Final = 15  # characters of a class's name in the lookup record


def export(building: Building, path: Path, points: PointSource | None) -> tuple[str, ...]:
    """Write all points as ``path``. Raises UsageError without scans, InputError where one cannot be read, OSError."""
    if points is None:
        raise UsageError(f"{path.name}: classified points need the scans. Convert from them, not from a model.")
    labels = point_labels(building)
    classified = written = 0
    with laspy.open(str(path), mode="w", header=_header(building), do_compress=path.suffix.lower() == ".laz") as out:
        for chunk in points():
            numbers = labels.of(chunk.xyz)
            out.write_points(_records(out.header, chunk, numbers, labels))
            written, classified = written + len(numbers), classified + int(np.count_nonzero(numbers))
        out.write_evlrs(VLRList([VLR(_USER, _TABLE, "elements by number", _table(labels))]))
    share = classified / max(written, 1)
    return (f"{written:,} points, {share:.0%} on an element; the rest (furniture, outdoors) has class 1.",)


def _header(building: Building) -> laspy.LasHeader:
    header = laspy.LasHeader(version="1.4", point_format=7)
    header.scales = np.full(3, SCALE)
    header.offsets = np.array(building.frame.shift)
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


def _table(labels: PointLabels) -> bytes:
    rows = [
        {"element": number, "GlobalId": ifc_guid(element.id), "class": int(labels.classes[number]), "name": element.name}
        for number, element in enumerate(labels.elements, 1)
    ]
    return json.dumps(rows, ensure_ascii=False).encode()


def _records(
    header: laspy.LasHeader, chunk: LocalPoints, numbers: np.ndarray, labels: PointLabels
) -> laspy.ScaleAwarePointRecord:
    records = laspy.ScaleAwarePointRecord.zeros(len(numbers), header=header)
    for axis, name in enumerate("xyz"):
        records[name] = chunk.xyz[:, axis] + header.offsets[axis]
    if chunk.rgb is not None:
        for channel, name in enumerate(("red", "green", "blue")):
            records[name] = chunk.rgb[:, channel].astype(np.uint16) * 257
    if chunk.intensity is not None:
        records["intensity"] = np.round(np.clip(chunk.intensity, 0.0, 1.0) * 65_535).astype(np.uint16)
    records["return_number"] = np.ones(len(numbers), np.uint8)
    records["number_of_returns"] = np.ones(len(numbers), np.uint8)
    records["point_source_id"] = chunk.station
    records["classification"] = labels.classes[numbers]
    records["element"] = numbers
    return records
