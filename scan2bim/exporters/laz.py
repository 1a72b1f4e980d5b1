"""Classified points of the scans: every valid point, with the class and the element of the model that it lies on.

The form is that of ``model/classified.py``, with the survey's shift put back; it is written chunk by chunk.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from scan2bim.errors import UsageError
from scan2bim.exporters.point_labels import point_labels
from scan2bim.model.classified import ClassifiedWriter, Owner
from scan2bim.model.elements import Building
from scan2bim.model.ids import ifc_guid
from scan2bim.model.points import PointSource

ONLY_BY_NAME: Final = True
"""Whole scans are copied: a folder of all formats does not get this one."""


def export(building: Building, path: Path, points: PointSource | None) -> tuple[str, ...]:
    """Write all points as ``path``. Raises UsageError without scans, InputError where one cannot be read, OSError."""
    if points is None:
        raise UsageError(f"{path.name}: classified points need the scans. Convert from them, not from a model.")
    labels = point_labels(building)
    owners = [
        Owner(ifc_guid(element.id), int(labels.classes[number]), element.name)
        for number, element in enumerate(labels.elements, 1)
    ]
    classified = written = 0
    with ClassifiedWriter(path, building.frame.shift, owners) as out:
        for chunk in points():
            numbers = labels.of(chunk.xyz)
            out.add(chunk, numbers)
            written, classified = written + len(numbers), classified + int(np.count_nonzero(numbers))
    share = classified / max(written, 1)
    return (f"{written:,} points, {share:.0%} on an element; the rest (furniture, outdoors) has class 1.",)
