"""PCD (Point Cloud Library): ASCII, binary and binary_compressed, packed colours, viewpoint."""

from __future__ import annotations

import re
import struct
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import Chunk, Pose, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.lines import Columns, Span, read_rows, sample_rows, skip_lines
from scan2bim.readers.lines import look as look_at_rows
from scan2bim.readers.lines import to_chunk as rows_to_chunk
from scan2bim.readers.lzf import decompressed
from scan2bim.readers.points import (
    choose_origin,
    no_points,
    read_exactly,
    rotation_matrix,
    stamp,
    tail_notes,
    truncated,
)
from scan2bim.readers.records import Fields, Records, check_room, look, read_records, sample_records, to_chunk

_TYPES = {("F", 4): "f4", ("F", 8): "f8"} | {
    (kind, size): f"{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)
}
_MOST_HEADER = 1 << 16
_LOOK = 4096
_SHORTEST_LINE = 6
_BEST_RATIO = 90
"""LZF adds at most 264 bytes for 3: no honest file unpacks to more than this many times its size."""
_MOST_VALUES = 4096
"""Values of one field of a point, such as a descriptor's."""
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True, eq=False)
class _Pcd:
    """A PCD header: ``data`` is ascii, binary or binary_compressed, ``offset`` the byte behind the header."""

    data: str
    offset: int
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    counts: tuple[int, ...]
    points: int
    width: int
    height: int
    pose: Pose | None
    fields: Fields

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of a point as binary files store it."""
        shapes = zip(self.names, self.kinds, self.counts, strict=True)
        return np.dtype(
            [(name, "<" + kind, (count,)) if count > 1 else (name, "<" + kind) for name, kind, count in shapes]
        )

    @property
    def columns(self) -> Columns:
        """Of an ASCII file's lines."""
        starts = np.concatenate([[0], np.cumsum(self.counts)])
        place = {name: int(start) for name, start in zip(self.names, starts[:-1], strict=True)}
        fields = self.fields
        x, y, z = (place[name] for name in fields.xyz)
        rgb = (place[fields.rgb[0]], place[fields.rgb[1]], place[fields.rgb[2]]) if fields.rgb else None
        intensity = place[fields.intensity] if fields.intensity else None
        return Columns(
            int(starts[-1]), (x, y, z), rgb, intensity, packed=place[fields.packed] if fields.packed else None
        )


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """The header of the file's one cloud. Raises DamagedFileError."""
    pcd = _parse(*stamp(path))
    columns, rows = (pcd.width, pcd.height) if pcd.height > 1 and pcd.width > 1 else (None, None)
    return (
        ScanHeader(
            path,
            0,
            path.stem,
            pcd.points,
            _origin(path, pcd),
            pcd.pose,
            has_colour=pcd.fields.rgb is not None or pcd.fields.packed is not None,
            has_intensity=pcd.fields.intensity is not None,
            columns=columns,
            rows=rows,
            notes=tail_notes(path, _records(pcd).end) if pcd.data == "binary" else (),
        ),
    )


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of the file."""
    path, pcd = header.path, _parse(*stamp(header.path))
    if pcd.data == "ascii":
        span = _span(path, pcd)
        scaling = look_at_rows(sample_rows(path, span, pcd.columns, _LOOK), pcd.columns, header.origin)
        for rows in read_rows(path, span, pcd.columns, chunk_points):
            yield rows_to_chunk(rows, pcd.columns, scaling)
        return
    if pcd.data == "binary":
        scaling_of_records = look(sample_records(path, _records(pcd), _LOOK), pcd.fields, header.origin)
        for records in read_records(path, _records(pcd), chunk_points):
            yield to_chunk(records, pcd.fields, scaling_of_records)
        return
    with _unpacked(path, pcd) as file:
        scaling_of_records = look(_sample_planes(file, pcd, _LOOK), pcd.fields, header.origin)
        for start in range(0, pcd.points, chunk_points):
            records = _planes(file, pcd, start, min(chunk_points, pcd.points - start))
            yield to_chunk(records, pcd.fields, scaling_of_records)


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Points from stretches spread over the file."""
    path, pcd = header.path, _parse(*stamp(header.path))
    if pcd.data == "ascii":
        rows = sample_rows(path, _span(path, pcd), pcd.columns, count)
        return rows_to_chunk(rows, pcd.columns, look_at_rows(rows, pcd.columns, header.origin))
    records = _sample(path, pcd, count)
    return to_chunk(records, pcd.fields, look(records, pcd.fields, header.origin))


def _origin(path: Path, pcd: _Pcd) -> NDArray[np.float64]:
    """Zeros for single floats: what they cannot hold is lost already."""
    kinds = dict(zip(pcd.names, pcd.kinds, strict=True))
    if pcd.data == "ascii":
        return choose_origin(sample_rows(path, _span(path, pcd), pcd.columns, _LOOK)[:, :3])
    if pcd.data == "binary_compressed" and all(kinds[name] == "f4" for name in pcd.fields.xyz):
        _compressed_sizes(path, pcd)
        return np.zeros(3)
    return look(_sample(path, pcd, _LOOK), pcd.fields).origin


def _sample(path: Path, pcd: _Pcd, count: int) -> NDArray[Any]:
    if pcd.data == "binary":
        return sample_records(path, _records(pcd), count)
    with _unpacked(path, pcd) as file:
        return _sample_planes(file, pcd, count)


def _records(pcd: _Pcd) -> Records:
    return Records(pcd.offset, pcd.dtype, pcd.points)


@lru_cache(maxsize=256)
def _parse(path: Path, size: int, changed: int) -> _Pcd:
    del size, changed
    head = read_exactly(path, _MOST_HEADER)
    found = re.search(rb"^DATA[ \t]+(\w+)[ \t]*(\r\n|\n|\r)", head, re.MULTILINE)
    if found is None:
        raise DamagedFileError(path, "truncated PCD file: its header has no DATA line.", _AGAIN)
    lines = [line.split() for line in head[: found.start()].decode("ascii", errors="replace").splitlines()]
    entries = {words[0]: words[1:] for words in lines if words and not words[0].startswith("#")}
    data = found[1].decode("ascii").lower()
    if data not in ("ascii", "binary", "binary_compressed"):
        raise DamagedFileError(path, f"PCD data {data!r} are unknown.", _AGAIN)
    names, kinds, counts = _fields(path, entries)
    width, height = _whole(path, entries, "WIDTH", 0), _whole(path, entries, "HEIGHT", 1)
    points = _whole(path, entries, "POINTS", width * height)
    if points != width * height and width * height:
        raise DamagedFileError(path, f"damaged PCD header: {width:,} x {height:,} are not {points:,} points.", _AGAIN)
    if points == 0:
        raise no_points(path, "PCD")
    pcd = _Pcd(
        data,
        found.end(),
        names,
        kinds,
        counts,
        points,
        width,
        height,
        _pose(path, entries),
        _meaning(path, names, kinds),
    )
    if data == "binary":
        check_room(path, "PCD", _records(pcd))
    return pcd


def _whole(path: Path, entries: dict[str, list[str]], name: str, default: int) -> int:
    words = entries.get(name, [str(default)])
    if len(words) != 1 or not words[0].isdecimal() or len(words[0]) > 18:
        raise DamagedFileError(path, f"damaged PCD header: {name} {' '.join(words)[:40]!r}.", _AGAIN)
    return int(words[0])


def _fields(path: Path, entries: dict[str, list[str]]) -> tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...]]:
    names = entries.get("FIELDS", entries.get("COLUMNS", []))
    sizes, types = entries.get("SIZE", ["4"] * len(names)), entries.get("TYPE", ["F"] * len(names))
    counts = entries.get("COUNT", ["1"] * len(names))
    whole = all(word.isdecimal() and 0 < int(word[:9]) <= _MOST_VALUES for word in (*sizes, *counts))
    if not names or len({len(names), len(sizes), len(types), len(counts)}) != 1 or not whole:
        raise DamagedFileError(path, "damaged PCD header: FIELDS, SIZE, TYPE and COUNT do not fit each other.", _AGAIN)
    unknown = [kind for kind in zip(types, map(int, sizes), strict=True) if kind not in _TYPES]
    if unknown:
        raise DamagedFileError(
            path, f"damaged PCD header: a field of type {unknown[0][0]} with {unknown[0][1]} bytes.", _AGAIN
        )
    unique = tuple(f"_{index}" if name == "_" else name.lower() for index, name in enumerate(names))
    if len(set(unique)) < len(unique):
        raise DamagedFileError(path, "damaged PCD header: a field is there twice.", _AGAIN)
    kinds = [_TYPES[kind] for kind in zip(types, map(int, sizes), strict=True)]
    packed = [name in ("rgb", "rgba") and kind in ("f4", "u4", "i4") for name, kind in zip(unique, kinds, strict=True)]
    return (
        unique,
        tuple("u4" if is_packed else kind for is_packed, kind in zip(packed, kinds, strict=True)),
        tuple(int(count) for count in counts),
    )


def _meaning(path: Path, names: tuple[str, ...], kinds: tuple[str, ...]) -> Fields:
    if not {"x", "y", "z"} <= set(names):
        raise DamagedFileError(path, f"points have no x, y, z, only {', '.join(names)[:80]}.", _AGAIN)
    packed = next(
        (name for name, kind in zip(names, kinds, strict=True) if name in ("rgb", "rgba") and kind == "u4"), None
    )
    rgb = ("r", "g", "b") if packed is None and {"r", "g", "b"} <= set(names) else None
    intensity = next((name for name in ("intensity", "i", "reflectivity") if name in names), None)
    return Fields(("x", "y", "z"), rgb, intensity, packed)


def _pose(path: Path, entries: dict[str, list[str]]) -> Pose | None:
    """The viewpoint as a pose; the default (no shift, no turn), which every writer puts there, says nothing."""
    words = entries.get("VIEWPOINT", [])
    if not words:
        return None
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError:
        numbers = np.zeros(0)
    length = float(np.linalg.norm(numbers[3:])) if len(numbers) == 7 and np.isfinite(numbers).all() else 0.0
    if not 0.9 < length < 1.1:
        raise DamagedFileError(
            path, f"damaged PCD header: VIEWPOINT {' '.join(words)[:60]!r} is no position and turn.", _AGAIN
        )
    if np.array_equal(numbers, [0, 0, 0, 1, 0, 0, 0]):
        return None
    return Pose(rotation_matrix(numbers[3:] / length), numbers[:3])


def _span(path: Path, pcd: _Pcd) -> Span:
    size = path.stat().st_size
    possible = pcd.offset + pcd.points * _SHORTEST_LINE - 1 <= size
    with path.open("rb") as file:
        end = skip_lines(file, pcd.offset, pcd.points) if possible else None
    if end is None:
        raise DamagedFileError(path, f"truncated PCD file: fewer lines than its {pcd.points:,} points.", _AGAIN)
    return Span(pcd.offset, end, pcd.points)


def _compressed_sizes(path: Path, pcd: _Pcd) -> tuple[int, int]:
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(pcd.offset)
        raw = file.read(8)
    packed, unpacked = struct.unpack("<II", raw) if len(raw) == 8 else (0, 0)
    if pcd.offset + 8 + packed > size:
        raise truncated(path, "PCD", pcd.offset + 8 + packed, size)
    if unpacked != pcd.points * pcd.dtype.itemsize or unpacked > packed * _BEST_RATIO:
        raise DamagedFileError(path, f"damaged PCD file: {packed:,} packed bytes for {pcd.points:,} points.", _AGAIN)
    return packed, unpacked


@contextmanager
def _unpacked(path: Path, pcd: _Pcd) -> Generator[IO[bytes]]:
    file = decompressed(path, pcd.offset + 8, *_compressed_sizes(path, pcd))
    try:
        yield file
    finally:
        file.close()


def _planes(file: IO[bytes], pcd: _Pcd, start: int, count: int) -> NDArray[Any]:
    """``count`` points from ``start`` on: the unpacked data hold one field after the other."""
    records = np.zeros(count, pcd.dtype)
    offset = 0
    for name, kind, values in zip(pcd.names, pcd.kinds, pcd.counts, strict=True):
        width = np.dtype(kind).itemsize * values
        if name in pcd.fields.all():
            file.seek(offset + start * width)
            records[name] = np.frombuffer(file.read(count * width), "<" + kind)
        offset += width * pcd.points
    return records


def _sample_planes(file: IO[bytes], pcd: _Pcd, count: int) -> NDArray[Any]:
    stretches = max(min(count, pcd.points) // 512, 1)
    length = min(-(-count // stretches), pcd.points)
    starts = np.unique(np.linspace(0, pcd.points - length, stretches).astype(np.int64))
    return np.concatenate([_planes(file, pcd, int(start), length) for start in starts])
