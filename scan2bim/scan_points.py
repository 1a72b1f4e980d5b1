"""All points of the scans in the model's frame, chunk by chunk, for exporters that want them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.scans import ScanSet

if TYPE_CHECKING:
    from scan2bim.model.points import LocalPoints


def local_points(scans: ScanSet, frame: SurveyFrame) -> Iterator[LocalPoints]:
    """Read all scans, one after the other, in bounded memory. Raises InputError or DamagedFileError."""
    import numpy as np

    from scan2bim.cloud.ingest import source_order
    from scan2bim.model.points import LocalPoints
    from scan2bim.readers import read_chunks

    for scan in scans.scans:
        matrix, offset = frame.of_scan(scan.header)
        for chunk in read_chunks(scan.header):
            xyz = chunk.xyz.astype(np.float64) @ matrix.T + offset
            station = (source_order(chunk, scan.header) + scan.station).astype(np.uint16)
            yield LocalPoints(xyz, chunk.rgb, chunk.intensity, station)
