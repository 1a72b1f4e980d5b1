"""PTX (Leica): structured scans, each with its scanner's position and matrix; 0 0 0 is no return."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

import numpy as np

from scan2bim.cloud.scan import F64, Chunk, Pose, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.lines import Columns, Span, look, read_rows, sample_rows, skip_lines, to_chunk
from scan2bim.readers.points import choose_origin, no_points, stamp

_LOOK = 4096
_SHORTEST_LINE = 8
"""Bytes of the shortest line of a point: "0 0 0 0" and its end."""
_COLUMNS = {3: Columns(3), 4: Columns(4, intensity=3), 7: Columns(7, intensity=3, rgb=(4, 5, 6))}
_RIGID = 1e-3
"""How far the matrix's columns may be from orthonormal, for the digits that the file keeps."""
_APART = 1e-3
"""File units: the scanner's position and the matrix's shift are the same when closer."""
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True, eq=False)
class _Scan:
    """One scan: its lines, its grid, its pose, and the shift (3,) from its points' frame to the scanner."""

    span: Span
    columns: Columns
    grid: tuple[int, int]
    pose: Pose
    shift: F64


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """One header per scan. Raises DamagedFileError."""
    scans = _scans(*stamp(path))
    return tuple(_header(path, index, scan, len(scans)) for index, scan in enumerate(scans))


def _header(path: Path, index: int, scan: _Scan, scans: int) -> ScanHeader:
    rows = sample_rows(path, scan.span, scan.columns, _LOOK)
    columns, lines = scan.grid
    return ScanHeader(
        path,
        index,
        path.stem if scans == 1 else f"{path.stem}#{index}",
        scan.span.rows or 0,
        choose_origin((rows[rows[:, :3].any(axis=1)])[:, :3] - scan.shift),
        scan.pose,
        has_colour=scan.columns.rgb is not None,
        has_intensity=scan.columns.intensity is not None,
        columns=columns,
        rows=lines,
    )


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of one scan; lines of 0 0 0 are dropped."""
    scan = _scans(*stamp(header.path))[header.index]
    rows = sample_rows(header.path, scan.span, scan.columns, _LOOK)
    scaling = look(rows, scan.columns, header.origin + scan.shift)
    for part in read_rows(header.path, scan.span, scan.columns, chunk_points):
        yield to_chunk(part, scan.columns, scaling, drop_zeros=True)


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Points from stretches spread over one scan."""
    scan = _scans(*stamp(header.path))[header.index]
    rows = sample_rows(header.path, scan.span, scan.columns, count)
    return to_chunk(rows, scan.columns, look(rows, scan.columns, header.origin + scan.shift), drop_zeros=True)


@lru_cache(maxsize=64)
def _scans(path: Path, size: int, changed: int) -> tuple[_Scan, ...]:
    del changed
    scans: list[_Scan] = []
    position = 0
    with path.open("rb") as file:
        while (start := _next_line(file, position, size)) is not None:
            scan = _scan(path, file, start, size)
            scans.append(scan)
            position = scan.span.end
    if not any(scan.span.rows for scan in scans):
        raise no_points(path, "PTX")
    return tuple(scans)


def _next_line(file: BinaryIO, position: int, size: int) -> int | None:
    """The byte of the next line that is not blank, None at the end."""
    file.seek(position)
    while position < size:
        line = file.readline(1 << 16)
        if not line or line.strip():
            return position if line else None
        position += len(line)
    return None


def _scan(path: Path, file: BinaryIO, start: int, size: int) -> _Scan:
    file.seek(start)
    numbers = [_numbers(path, file.readline(1 << 16), count) for count in (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)]
    columns, rows = int(numbers[0][0]), int(numbers[1][0])
    count, begin = columns * rows, file.tell()
    if not (0 <= columns < 2**31 and 0 <= rows < 2**31):
        raise DamagedFileError(path, f"a grid of {columns:,} x {rows:,} points.", _AGAIN)
    end = skip_lines(file, begin, count) if begin + count * _SHORTEST_LINE - 2 <= size else None
    if end is None:
        raise DamagedFileError(
            path, f"truncated PTX file: {columns:,} x {rows:,} points announced, fewer lines follow.", _AGAIN
        )
    file.seek(begin)
    words = len(file.readline(1 << 16).split()) if count else 4
    if words not in _COLUMNS:
        raise DamagedFileError(path, f"lines of {words} numbers: PTX has 4, or 7 with colour.", _AGAIN)
    pose, shift = _pose(path, numbers[2], np.array(numbers[6:10]))
    return _Scan(Span(begin, end, count), _COLUMNS[words], (columns, rows), pose, shift)


def _numbers(path: Path, line: bytes, count: int) -> list[float]:
    try:
        numbers = [float(word) for word in line.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        found = line[:60].decode("ascii", "replace").strip()
        raise DamagedFileError(
            path, f"damaged PTX header: expected a line of {count} numbers, found {found!r}.", _AGAIN
        )
    return numbers


def _pose(path: Path, position: list[float], matrix: F64) -> tuple[Pose, F64]:
    """Pose and shift of the (4, 4) matrix, which multiplies row vectors from the right.

    Some programs write points in the common frame with the identity, and the scanner's position apart: then the
    points are taken
    back by that position, so that they have the scanner in their centre.
    """
    rotation, translation = matrix[:3, :3].T, matrix[3, :3]
    if (
        np.abs(rotation @ rotation.T - np.eye(3)).max() > _RIGID
        or np.linalg.det(rotation) < 0
        or abs(matrix[3, 3] - 1) > _RIGID
    ):
        raise DamagedFileError(
            path, "the matrix of a scan is no rotation with a shift.", "Export it again, registered and unscaled."
        )
    station = np.array(position)
    if np.allclose(matrix, np.eye(4)) and np.abs(station).max() > _APART:
        return Pose(np.eye(3), station), station
    return Pose(rotation, translation), np.zeros(3)
