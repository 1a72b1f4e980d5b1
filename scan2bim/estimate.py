"""What a conversion may take: seconds, memory and disk, from the headers alone. Rough, within a factor of two."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from scan2bim.scans import Scan, ScanSet
from scan2bim.stages import READ, Stage

READ_NANOSECONDS = {".laz": 1000.0, ".las": 220.0, ".ply": 220.0, ".pcd": 220.0, ".e57": 80.0}
"""CPU to read a point by format; text formats take about as much as the rest together."""
TEXT_NANOSECONDS = 500.0
BASE_MEMORY = 500e6
"""Bytes: the program with its libraries and one building's surfaces."""
JOB_MEMORY = 250e6
"""Bytes of one reading process: libraries, chunks and a panorama."""
POINT_DISK = 22.0
"""Bytes in the work folder for each point: 12 for the point, 2 for the sample, and up to 8 for those near walls, held
for a while."""
SCAN_DISK = 1e6
"""Bytes in the work folder for each scan's panorama."""
SHORT = 10.0
"""Seconds of reading below which more processes, each with 1 to 2 s of CPU to start, do not pay."""
MOST_JOBS = 4
"""Above so many reading processes the disk is what limits."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Seconds (wall), bytes of memory at the peak, bytes of disk in the work folder."""

    seconds: float
    memory: float
    disk: float


def choose_jobs(asked: int | None, scans: ScanSet) -> int:
    """How many processes read: what was asked, else by cores, scans and work."""
    if asked is not None:
        return max(1, min(asked, len(scans.scans)))
    if read_seconds(scans.scans, 1) < SHORT:
        return 1
    return max(1, min(cores(), len(scans.scans), MOST_JOBS))


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def stage_seconds(stage: Stage, points: int) -> float:
    """Expected seconds of a stage other than reading."""
    return stage.seconds + stage.nanoseconds * 1e-9 * points


def read_seconds(scans: Iterable[Scan], jobs: int) -> float:
    """Expected seconds to read the scans in so many processes."""
    cost = sum(scan.header.points * READ_NANOSECONDS.get(_suffix(scan), TEXT_NANOSECONDS) for scan in scans)
    return READ.seconds + cost * 1e-9 / jobs


def memory_and_disk(scans: ScanSet, jobs: int) -> tuple[float, float]:
    """Bytes of memory at the peak and of disk in the work folder."""
    return BASE_MEMORY + JOB_MEMORY * jobs, POINT_DISK * scans.points + SCAN_DISK * len(scans.scans)


def free_disk(folder: Path) -> float:
    """Bytes free where the folder is or will be."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    return float(shutil.disk_usage(place).free)


def _suffix(scan: Scan) -> str:
    return scan.header.path.suffix.lower()
