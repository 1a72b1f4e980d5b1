"""PTS (Leica): a count of points, then one point a line; several such blocks make several scans."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.lines import Columns, Span, look, read_rows, sample_rows, skip_lines, to_chunk
from scan2bim.readers.points import choose_origin, no_points, stamp

_LOOK = 4096
_SHORTEST_LINE = 6
"""Bytes of the shortest line of a point: "0 0 0" and its end."""
_COLUMNS = {
    3: Columns(3),
    4: Columns(4, intensity=3),
    6: Columns(6, rgb=(3, 4, 5)),
    7: Columns(7, intensity=3, rgb=(4, 5, 6)),
    9: Columns(9, rgb=(3, 4, 5)),
    10: Columns(10, intensity=3, rgb=(4, 5, 6)),
}
"""Meaning by number of columns: x y z, intensity, red green blue; what follows is a normal."""
_AGAIN = "Copy or export it again."


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """One header per block of points. Raises DamagedFileError."""
    blocks = _blocks(*stamp(path))
    return tuple(_header(path, index, span, columns, len(blocks)) for index, (span, columns) in enumerate(blocks))


def _header(path: Path, index: int, span: Span, columns: Columns, scans: int) -> ScanHeader:
    rows = sample_rows(path, span, columns, _LOOK)
    return ScanHeader(
        path,
        index,
        path.stem if scans == 1 else f"{path.stem}#{index}",
        span.rows or 0,
        choose_origin(rows[:, :3]),
        has_colour=columns.rgb is not None,
        has_intensity=columns.intensity is not None,
    )


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of one block."""
    span, columns = _blocks(*stamp(header.path))[header.index]
    scaling = look(sample_rows(header.path, span, columns, _LOOK), columns, header.origin)
    for rows in read_rows(header.path, span, columns, chunk_points):
        yield to_chunk(rows, columns, scaling)


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Points from stretches spread over one block."""
    span, columns = _blocks(*stamp(header.path))[header.index]
    rows = sample_rows(header.path, span, columns, count)
    return to_chunk(rows, columns, look(rows, columns, header.origin))


@lru_cache(maxsize=64)
def _blocks(path: Path, size: int, changed: int) -> tuple[tuple[Span, Columns], ...]:
    """Place and columns of each block that has points."""
    del changed
    blocks: list[tuple[Span, Columns]] = []
    position = 0
    with path.open("rb") as file:
        while position < size:
            file.seek(position)
            line = file.readline(1 << 16)
            if not line.strip():
                position += len(line)
                continue
            count = _count(path, line)
            start = position + len(line)
            end = skip_lines(file, start, count) if start + count * _SHORTEST_LINE - 1 <= size else None
            if end is None:
                raise DamagedFileError(
                    path, f"truncated PTS file: {count:,} points announced, fewer lines follow.", _AGAIN
                )
            if count:
                file.seek(start)
                blocks.append((Span(start, end, count), _columns(path, file.readline(1 << 16))))
            position = end
    if not blocks:
        raise no_points(path, "PTS")
    return tuple(blocks)


def _count(path: Path, line: bytes) -> int:
    word = line.strip().removeprefix(b"\xef\xbb\xbf")
    if not word.isdigit() or len(word) > 15:
        raise DamagedFileError(
            path, f"expected a count of points, found {line[:40].decode('ascii', 'replace').strip()!r}.", _AGAIN
        )
    return int(word)


def _columns(path: Path, line: bytes) -> Columns:
    count = len(line.replace(b",", b" ").replace(b";", b" ").split())
    if count not in _COLUMNS:
        raise DamagedFileError(path, f"lines of {count} numbers: PTS has {', '.join(map(str, _COLUMNS))}.", _AGAIN)
    return _COLUMNS[count]
