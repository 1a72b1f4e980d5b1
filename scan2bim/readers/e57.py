"""E57 (ASTM E2807): points in bounded chunks, with the checksum of every page verified.

Structured and unstructured, Cartesian and spherical, several scans a file, any number of points, integer, scaled and
float fields.
Fields of extensions are ignored. invalidState 1 (a direction without a range) becomes ``Chunk.misses``, 2 is dropped.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import F32, U8, Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.e57_header import read_headers, scans_of, to_cartesian
from scan2bim.readers.e57_layout import Buffers, Layout, Limits, make_buffers
from scan2bim.readers.e57_library import LibraryReader, open_points
from scan2bim.readers.e57_points import PointReader, keep_points
from scan2bim.readers.points import START_SPREAD, join_chunks, stamp, stretch, unit_range

__all__ = ["read_chunks", "read_headers", "sample_points"]


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of one scan. Raises DamagedFileError where they end early or a page's checksum is wrong."""
    if header.points == 0:
        return
    yield from _read(header, chunk_points)


def _read(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    records = scans_of(*stamp(header.path))[header.index].records
    buffers = make_buffers(records.layout, min(chunk_points, header.points))
    with open_points(header.path, header.index, records, buffers) as reader:
        yield from _chunks(header, reader, records.layout, buffers)


def _chunks(
    header: ScanHeader, reader: PointReader | LibraryReader, layout: Layout, buffers: Buffers
) -> Iterator[Chunk]:
    done = 0
    while done < header.points and (count := reader.read()):
        done += count
        yield _chunk(header, layout, buffers, count)
    if done != header.points:
        raise DamagedFileError(
            header.path,
            f"scan {header.index} ends after {done:,} of {header.points:,} points.",
            "Copy or export it again.",
        )


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """``count`` points thinned from the start of the scan."""
    wanted = min(header.points, START_SPREAD * count)
    chunks: list[Chunk] = []
    for chunk in _read(header, max(wanted, 1)) if wanted else ():
        chunks.append(chunk)
        if sum(len(part.xyz) + part.dropped for part in chunks) >= wanted:
            break
    return join_chunks(chunks, count)


def _chunk(header: ScanHeader, layout: Layout, buffers: Buffers, count: int) -> Chunk:
    raw = buffers.xyz[:count]
    with np.errstate(invalid="ignore", over="ignore"):
        points = to_cartesian(raw) if layout.spherical else raw
    state = np.zeros(0, np.uint8) if buffers.state is None else buffers.state[:count]
    # A point exactly in the scanner's centre is none: writers that know no invalid state mark no-return so.
    centre = header.pose is not None and not header.origin.any()
    xyz, rows, missed = keep_points(points, header.origin, state, centre)
    misses = _directions(raw[state == 1], layout) if missed else np.zeros((0, 3), np.float32)
    rgb = _colours(layout.colour, buffers.rgb[:count]) if layout.colour and buffers.rgb is not None else None
    intensity = (
        unit_range(_intensities(layout.intensity, buffers.intensity[:count]))
        if layout.intensity and buffers.intensity is not None
        else None
    )
    if len(rows) < count:
        rgb = None if rgb is None else np.take(rgb, rows, axis=0)
        intensity = None if intensity is None else intensity[rows]
    dropped = count - len(rows) - len(misses)
    return Chunk(xyz, rgb, intensity, None, misses if len(misses) else None, dropped)


def _colours(limits: tuple[Limits, Limits, Limits], raw: NDArray[Any]) -> U8:
    if raw.dtype == np.uint8 and all(channel == Limits(0, 255) for channel in limits):
        return raw.copy()
    low = np.array([channel.low for channel in limits])
    high = np.array([channel.high for channel in limits])
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = (raw - low) * (255.0 / (high - low)) + 0.5
    return np.fmax(np.fmin(scaled, 255.0), 0.0).astype(np.uint8)


def _intensities(limits: Limits, raw: F32) -> F32:
    if limits == Limits(0, 1):
        return raw.copy()
    if max(abs(limits.low), abs(limits.high)) < 1e6:
        return (raw - np.float32(limits.low)) * np.float32(1.0 / (limits.high - limits.low))
    return stretch(raw, limits.low, limits.high)


def _directions(raw: NDArray[Any], layout: Layout) -> F32:
    """Unit directions (m, 3) of records without a range; those without a direction are left out."""
    values = raw.astype(np.float64)
    if layout.spherical:
        values[:, 0] = 1.0
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        directions = to_cartesian(values) if layout.spherical else values
        unit = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    return unit[np.isfinite(unit).all(axis=1)]
