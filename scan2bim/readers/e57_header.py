"""Headers of the scans of an E57 file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from scan2bim.cloud.scan import F64, Pose, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.crs import crs_name
from scan2bim.readers.e57_file import Section, check_count, check_file
from scan2bim.readers.e57_layout import (
    Layout,
    Node,
    Records,
    declared_range,
    make_buffers,
    number,
    prototype,
    scan_layout,
    text,
)
from scan2bim.readers.e57_library import open_image, open_points
from scan2bim.readers.points import choose_origin, no_points, rotation_matrix, stamp

_FIRST = 256
"""Records read with the header, to tell which frame the stated bounds are in and whether coordinates are large."""
_LARGEST = 1e9
"""File units. Bounds beyond are the defaults of a field's type, not bounds."""


@dataclass(frozen=True, slots=True, eq=False)
class E57Scan:
    """A scan's header, and where its records lie and how to read them."""

    header: ScanHeader
    records: Records


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """One header per scan. Raises DamagedFileError."""
    return tuple(scan.header for scan in scans_of(*stamp(path)))


@lru_cache(maxsize=1024)
def scans_of(path: Path, size: int, changed: int) -> tuple[E57Scan, ...]:
    """The scans of a file in this state: it is opened once for header, sample and points. Raises DamagedFileError."""
    del size, changed
    sections = check_file(path)
    with open_image(path) as image:
        root = image.root()
        scans = root["data3D"] if root.isDefined("data3D") else []
        if len(scans) != len(sections):
            raise DamagedFileError(path, f"{len(scans)} scans with {len(sections)} sets of points.", "Export it again.")
        crs = crs_name(text(root, "coordinateMetadata")) or None
        found = tuple(_scan(path, index, scans[index], section, crs) for index, section in enumerate(sections))
    if sum(scan.header.points for scan in found) == 0:
        raise no_points(path, "E57")
    return found


def _scan(path: Path, index: int, scan: Node, section: Section, crs: str | None) -> E57Scan:
    layout = scan_layout(path, index, scan)
    check_count(path, index, section, layout.bits)
    name = text(scan, "name") or f"{path.stem}#{index}"
    pose = scan_pose(path, index, scan)
    records = Records(section, layout)
    if section.records == 0:
        notes = ("this scan holds no points",)
        return E57Scan(ScanHeader(path, index, name, 0, np.zeros(3), pose, crs=crs, notes=notes), records)
    first = _first_points(path, index, records)
    box = _local_box(scan, layout, first, pose)
    lower, upper = _common_box(box, pose)
    columns, rows = _grid(scan, section.records)
    header = ScanHeader(
        path,
        index,
        name,
        section.records,
        choose_origin(first),
        pose,
        lower,
        upper,
        layout.colour is not None,
        layout.intensity is not None,
        columns,
        rows,
        crs=crs,
    )
    return E57Scan(header, records)


def scan_pose(path: Path, index: int, scan: Node) -> Pose | None:
    """The pose that the file states, None where it states none. Raises DamagedFileError where it is no rigid motion."""
    if not scan.isDefined("pose"):
        return None
    pose = scan["pose"]
    quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    if pose.isDefined("rotation"):
        quaternion = np.array([_component(path, index, pose, "rotation", axis) for axis in "wxyz"])
    length = float(np.linalg.norm(quaternion))
    if not 0.9 < length < 1.1:
        raise DamagedFileError(
            path, f"the pose of scan {index} is no rotation (quaternion of length {length:g}).", "Export it again."
        )
    translation = np.zeros(3)
    if pose.isDefined("translation"):
        translation = np.array([_component(path, index, pose, "translation", axis) for axis in "xyz"])
    return Pose(rotation_matrix(quaternion / length), translation)


def _component(path: Path, index: int, pose: Node, part: str, axis: str) -> float:
    value = number(pose, part, axis)
    if value is None:
        raise DamagedFileError(
            path, f"the pose of scan {index} lacks {part} {axis} or it is no number.", "Export it again."
        )
    return value


def to_cartesian(spherical: F64) -> F64:
    """(n, 3) x, y, z of (n, 3) range, azimuth, elevation (radians)."""
    ranges, azimuth, elevation = spherical.T
    flat = ranges * np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), ranges * np.sin(elevation)], axis=1)


def _first_points(path: Path, index: int, records: Records) -> F64:
    """Up to 256 valid points (n, 3) from the start of a scan, in its own frame."""
    layout = records.layout
    buffers = make_buffers(layout, _FIRST)
    with open_points(path, index, records, buffers) as reader:
        count = reader.read()
    xyz = buffers.xyz[:count].astype(np.float64)
    with np.errstate(invalid="ignore"):
        xyz = to_cartesian(xyz) if layout.spherical else xyz
    keep = (np.abs(xyz) < 1e15).all(axis=1) & xyz.any(axis=1)
    return xyz[keep] if buffers.state is None else xyz[keep & (buffers.state[:count] == 0)]


def _local_box(scan: Node, layout: Layout, first: F64, pose: Pose | None) -> F64 | None:
    """Lower and upper corner (2, 3) of the scan in its own frame, from the statement that its first points agree with.

    The standard's bounds are in the scan's frame. pye57 writes the local corners turned by the pose; others the box
    in the common frame,
    which says nothing certain of the local one.
    """
    names = [f"{axis}{end}" for end in ("Minimum", "Maximum") for axis in "xyz"]
    numbers = [value for name in names if (value := number(scan, "cartesianBounds", name)) is not None]
    candidates: list[F64] = []
    if len(numbers) == 6:
        stated = np.array(numbers).reshape(2, 3)
        candidates.append(stated)
        if pose is not None:
            candidates.append((stated - pose.translation) @ pose.rotation)
    if not layout.spherical:
        ranges = [declared_range(prototype(scan)[axis]) for axis in layout.axes]
        if all(limits is not None for limits in ranges):
            candidates.append(np.array([[limits.low, limits.high] for limits in ranges if limits]).T)
    return next((box for box in candidates if _holds(box, first)), None)


def _holds(box: F64, points: F64) -> bool:
    if len(points) == 0 or np.abs(box).max() > _LARGEST or (box[0] > box[1]).any():
        return False
    margin = 1e-3 * (box[1] - box[0]) + 1e-3
    return bool(((points >= box[0] - margin) & (points <= box[1] + margin)).all())


def _common_box(box: F64 | None, pose: Pose | None) -> tuple[F64 | None, F64 | None]:
    if box is None:
        return None, None
    if pose is None:
        return box[0], box[1]
    corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3) @ pose.rotation.T + pose.translation
    return corners.min(axis=0), corners.max(axis=0)


def _grid(scan: Node, records: int) -> tuple[int | None, int | None]:
    """Columns and rows of a structured scan, (None, None) for others: every record must have a place in the grid."""
    sides: list[int] = []
    for name in ("column", "row"):
        limits = [number(scan, "indexBounds", f"{name}{end}") for end in ("Minimum", "Maximum")]
        if None in limits and prototype(scan).isDefined(f"{name}Index"):
            declared = declared_range(prototype(scan)[f"{name}Index"])
            limits = [declared.low, declared.high] if declared else limits
        low, high = limits
        sides.append(0 if low is None or high is None else int(high - low) + 1)
    columns, rows = sides
    structured = columns > 1 and rows > 1 and records <= columns * rows < 2**40
    return (columns, rows) if structured else (None, None)
