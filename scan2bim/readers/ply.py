"""PLY: ASCII and both binaries, vertex properties in any order and of any type; other elements are passed over."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.lines import Columns, Span, read_rows, sample_rows, skip_lines
from scan2bim.readers.lines import look as look_at_rows
from scan2bim.readers.lines import to_chunk as rows_to_chunk
from scan2bim.readers.points import choose_origin, no_points, read_exactly, stamp, tail_notes
from scan2bim.readers.records import Fields, Records, check_room, look, read_records, sample_records, to_chunk

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    **dict.fromkeys(("int64", "long"), "i8"),
    **dict.fromkeys(("uint64", "ulong"), "u8"),
}
_MOST_HEADER = 1 << 16
_LOOK = 4096
_SHORTEST_LINE = 6
"""Bytes of the shortest ASCII line of a vertex: "0 0 0" and its end."""
_COLOURS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_INTENSITIES = ("intensity", "scalar_intensity", "scalar_scalar_intensity", "reflectance", "scalar_reflectance")
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: tuple[tuple[str, str], ...]
    has_lists: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Ply:
    """Where the vertices lie: as ``records`` in a binary file, else as ``span`` and ``columns``."""

    fields: Fields
    count: int
    records: Records | None
    span: Span
    columns: Columns
    notes: tuple[str, ...] = ()


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """The header of the file's one cloud. Raises DamagedFileError."""
    ply = _layout(*stamp(path))
    rgb, intensity = ply.fields.rgb is not None, ply.fields.intensity is not None
    if ply.records:
        origin = look(sample_records(path, ply.records, _LOOK), ply.fields).origin
    else:
        origin = choose_origin(sample_rows(path, ply.span, ply.columns, _LOOK)[:, :3])
    return (
        ScanHeader(path, 0, path.stem, ply.count, origin, has_colour=rgb, has_intensity=intensity, notes=ply.notes),
    )


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The vertices of the file."""
    ply = _layout(*stamp(header.path))
    if ply.records:
        scaling = look(sample_records(header.path, ply.records, _LOOK), ply.fields, header.origin)
        for records in read_records(header.path, ply.records, chunk_points):
            yield to_chunk(records, ply.fields, scaling)
        return
    scaling_of_rows = look_at_rows(sample_rows(header.path, ply.span, ply.columns, _LOOK), ply.columns, header.origin)
    for rows in read_rows(header.path, ply.span, ply.columns, chunk_points):
        yield rows_to_chunk(rows, ply.columns, scaling_of_rows)


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Vertices from stretches spread over the file."""
    ply = _layout(*stamp(header.path))
    if ply.records:
        scaling = look(sample_records(header.path, ply.records, _LOOK), ply.fields, header.origin)
        return to_chunk(sample_records(header.path, ply.records, count), ply.fields, scaling)
    rows = sample_rows(header.path, ply.span, ply.columns, count)
    return rows_to_chunk(rows, ply.columns, look_at_rows(rows, ply.columns, header.origin))


@lru_cache(maxsize=256)
def _layout(path: Path, size: int, changed: int) -> _Ply:
    del changed
    lines, end = _header_lines(path)
    encoding = _encoding(path, lines)
    elements = _elements(path, lines)
    place = next(
        (index for index, element in enumerate(elements) if element.name in ("vertex", "point", "points")), None
    )
    if place is None:
        raise DamagedFileError(path, "this PLY file has no vertices.", "Export the point cloud, not only its faces.")
    vertices, before = elements[place], elements[:place]
    if vertices.count == 0:
        raise no_points(path, "PLY")
    if encoding == "ascii":
        return _ascii(path, vertices, before, end, size)
    if vertices.has_lists or any(element.has_lists for element in before):
        raise DamagedFileError(
            path, "lists among or before the vertices are not read.", "Write it with the vertices first, without lists."
        )
    order = "<" if encoding == "binary_little_endian" else ">"
    start = end + sum(element.count * _dtype(path, element, order).itemsize for element in before)
    records = Records(start, _dtype(path, vertices, order), vertices.count)
    check_room(path, "PLY", records)
    notes = () if elements[place + 1 :] else tail_notes(path, records.end)
    return _Ply(_fields(path, vertices), vertices.count, records, Span(0, 0, None), Columns(0), notes)


def _header_lines(path: Path) -> tuple[list[list[str]], int]:
    head = read_exactly(path, _MOST_HEADER)
    found = re.search(rb"\bend_header[ \t]*(\r\n|\n|\r)", head)
    if found is None:
        raise DamagedFileError(path, "truncated PLY file: its header has no end_header.", _AGAIN)
    text = head[: found.start()].decode("ascii", errors="replace")
    return [words for line in re.split(r"\r\n|\n|\r", text) if (words := line.split())], found.end()


def _encoding(path: Path, lines: list[list[str]]) -> str:
    encoding = next((words[1] for words in lines if words[0] == "format" and len(words) > 1), "none")
    if encoding not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise DamagedFileError(path, f"PLY format {encoding!r} is unknown.", _AGAIN)
    return encoding


def _elements(path: Path, lines: list[list[str]]) -> list[_Element]:
    elements: list[_Element] = []
    for words in lines:
        if words[0] == "element":
            elements.append(_Element(words[1], _count(path, words), (), False))
        elif words[0] == "property":
            elements[-1] = _with_property(path, elements[-1:], words)
    return elements


def _count(path: Path, words: list[str]) -> int:
    if len(words) != 3 or not words[2].isdecimal() or len(words[2]) > 18:
        raise DamagedFileError(path, f"damaged PLY header: {' '.join(words)[:60]!r}.", _AGAIN)
    return int(words[2])


def _with_property(path: Path, elements: list[_Element], words: list[str]) -> _Element:
    is_list = len(words) == 5 and words[1] == "list"
    if not elements or (not is_list and (len(words) != 3 or words[1] not in _TYPES)):
        raise DamagedFileError(path, f"damaged PLY header: {' '.join(words)[:60]!r}.", _AGAIN)
    element = elements[0]
    properties = (*element.properties, (words[-1].lower(), "" if is_list else _TYPES[words[1]]))
    return _Element(element.name, element.count, properties, element.has_lists or is_list)


def _dtype(path: Path, element: _Element, order: str) -> np.dtype[np.void]:
    names = [name for name, _ in element.properties]
    if len(set(names)) < len(names):
        raise DamagedFileError(path, f"damaged PLY header: a property of {element.name} is there twice.", _AGAIN)
    return np.dtype([(name, order + kind) for name, kind in element.properties])


def _fields(path: Path, vertices: _Element) -> Fields:
    names = [name for name, _ in vertices.properties]
    if not {"x", "y", "z"} <= set(names):
        raise DamagedFileError(path, f"vertices have no x, y, z, only {', '.join(names)[:80]}.", _AGAIN)
    rgb = next((colours for colours in _COLOURS if set(colours) <= set(names)), None)
    return Fields(("x", "y", "z"), rgb, next((name for name in _INTENSITIES if name in names), None))


def _ascii(path: Path, vertices: _Element, before: list[_Element], start: int, size: int) -> _Ply:
    if vertices.has_lists:
        raise DamagedFileError(path, "lists among the vertices are not read.", "Write it without lists.")
    fields = _fields(path, vertices)
    names = [name for name, _ in vertices.properties]
    if len(set(names)) < len(names):
        raise DamagedFileError(path, "damaged PLY header: a property of the vertices is there twice.", _AGAIN)
    skipped = sum(element.count for element in before)
    least = (vertices.count * _SHORTEST_LINE) - 1
    with path.open("rb") as file:
        begin = skip_lines(file, start, skipped) if skipped <= size else None
        end = skip_lines(file, begin, vertices.count) if begin is not None and begin + least <= size else None
    if begin is None or end is None:
        raise DamagedFileError(path, f"truncated PLY file: fewer lines than its {vertices.count:,} vertices.", _AGAIN)
    rgb = (names.index(fields.rgb[0]), names.index(fields.rgb[1]), names.index(fields.rgb[2])) if fields.rgb else None
    intensity = names.index(fields.intensity) if fields.intensity else None
    columns = Columns(len(names), (names.index("x"), names.index("y"), names.index("z")), rgb, intensity)
    return _Ply(fields, vertices.count, None, Span(begin, end, vertices.count), columns)
