"""A LAS or LAZ file's own structure (ASPRS LAS 1.0 to 1.4), checked before laspy and lazrs are trusted with it.

What a damaged header could make them allocate or loop over is refused here: offsets, record lengths, counts, the
table of compressed
chunks. Files are read as their header says, never past it.
"""

from __future__ import annotations

import importlib
import io
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import DamagedFileError
from scan2bim.readers.crs import crs_name, geotiff_crs, wkt_unit
from scan2bim.readers.points import no_points, truncated

os.environ.setdefault("RUST_BACKTRACE", "0")  # lazrs would print a stack trace besides our error
lazrs: Any = importlib.import_module("lazrs")
"""The LAZ library, which has no types."""

_SIZES = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)
"""Bytes of a point of formats 0 to 10, without extra bytes."""
_MOST_CHUNK = 10_000_000
"""Points of a compressed chunk: lazrs takes memory for a whole one. Real files have 50,000."""
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
"""Layers of each item of the layered compressor: point, colour, colour with infrared, wave packet; a byte has one."""
_VARIABLE = 0xFFFFFFFF
"""Chunk size of LAZ files whose chunks differ (COPC)."""
_MOST_HEADER = 256 << 20
"""Bytes before the points. Real files have some kilobytes."""
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True, eq=False)
class Chunks:
    """The compressed chunks of a LAZ file that hold points: first byte, bytes and points of each; LAZ VLR; layers."""

    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    points: NDArray[np.int64]
    laszip: bytes
    layers: int


@dataclass(frozen=True, slots=True, eq=False)
class LasFile:
    """What a LAS header says. ``chunks`` is None for uncompressed points."""

    version: tuple[int, int]
    point_format: int
    point_size: int
    points: int
    offset: int
    scales: tuple[float, float, float]
    offsets: tuple[float, float, float]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    crs: str | None
    unit: float | None
    is_copc: bool
    chunks: Chunks | None


@dataclass(frozen=True, slots=True)
class _Vlr:
    user: bytes
    record: int
    data: bytes


def read_las_file(path: Path) -> LasFile:
    """The header of a LAS or LAZ file, checked against the file's size. Raises DamagedFileError."""
    size = path.stat().st_size
    with path.open("rb") as file:
        raw = file.read(375)
        if len(raw) < 227:
            raise truncated(path, "LAS", 227, len(raw))
        return _parse(path, file, raw, size)


def _parse(path: Path, file: BinaryIO, raw: bytes, size: int) -> LasFile:
    version = (raw[24], raw[25])
    header_size, offset, vlr_count = struct.unpack_from("<HII", raw, 94)
    form, point_size, points = struct.unpack_from("<BHI", raw, 104)
    if version == (1, 4) or (version[0] == 1 and version[1] > 4):
        if len(raw) < 375:
            raise truncated(path, "LAS", 375, len(raw))
        points = struct.unpack_from("<Q", raw, 247)[0]
    compressed, form = bool(form & 0xC0), form & 0x3F
    if version[0] != 1 or form >= len(_SIZES) or point_size < _SIZES[form]:
        what = f"version {version[0]}.{version[1]}, point format {form}, {point_size} bytes a point"
        raise DamagedFileError(path, f"damaged or unknown LAS header: {what}.", _AGAIN)
    if points == 0:
        raise no_points(path, "LAS")
    if offset > size or header_size > offset:
        raise truncated(path, "LAS", max(offset, header_size), size)
    if offset > _MOST_HEADER or vlr_count * 54 > offset - header_size:
        raise DamagedFileError(path, f"damaged LAS header: {vlr_count:,} records before byte {offset:,}.", _AGAIN)
    numbers = struct.unpack_from("<12d", raw, 131)
    scales, offsets = _check_scales(path, numbers)
    vlrs = _read_vlrs(path, file, header_size, offset, vlr_count)
    chunks = _chunks_of_points(path, file, vlrs, compressed, point_size, points, offset, size)
    crs, unit = _crs(vlrs)
    upper, lower = np.array(numbers[6::2]), np.array(numbers[7::2])
    is_copc = any(vlr.user == b"copc" and vlr.record == 1 for vlr in vlrs)
    return LasFile(version, form, point_size, points, offset, scales, offsets, lower, upper, crs, unit, is_copc, chunks)


def _check_scales(
    path: Path, numbers: tuple[float, ...]
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    scales, offsets = numbers[0:3], numbers[3:6]
    if not all(1e-12 < abs(scale) < 1e6 for scale in scales) or not all(abs(value) < 1e12 for value in offsets):
        raise DamagedFileError(path, f"damaged LAS header: scales {scales}, offsets {offsets}.", _AGAIN)
    return (scales[0], scales[1], scales[2]), (offsets[0], offsets[1], offsets[2])


def _read_vlrs(path: Path, file: BinaryIO, start: int, end: int, count: int) -> tuple[_Vlr, ...]:
    file.seek(start)
    raw = file.read(end - start)
    vlrs: list[_Vlr] = []
    position = 0
    for _ in range(count):
        if position + 54 > len(raw):
            raise DamagedFileError(path, f"damaged LAS header: {count} records announced, {len(vlrs)} fit.", _AGAIN)
        user, record, length = struct.unpack_from("<2x16sHH", raw, position)
        position += 54 + length
        vlrs.append(_Vlr(user.split(b"\0")[0], record, raw[position - length : position]))
    if position > len(raw):
        raise DamagedFileError(path, "damaged LAS header: a record before the points is longer than its room.", _AGAIN)
    return tuple(vlrs)


def _chunks_of_points(
    path: Path,
    file: BinaryIO,
    vlrs: tuple[_Vlr, ...],
    compressed: bool,
    point_size: int,
    points: int,
    offset: int,
    size: int,
) -> Chunks | None:
    if not compressed:
        if size < offset + points * point_size:
            raise truncated(path, "LAS", offset + points * point_size, size)
        return None
    laszip = next((vlr.data for vlr in vlrs if vlr.user == b"laszip encoded" and vlr.record == 22204), b"")
    _check_laszip(path, laszip, point_size)
    return _chunk_table(path, file, laszip, points, offset, size)


def _check_laszip(path: Path, vlr: bytes, point_size: int) -> None:
    items = struct.unpack_from("<H", vlr, 32)[0] if len(vlr) >= 34 else 0
    sizes = (
        [struct.unpack_from("<HHH", vlr, 34 + 6 * item)[1] for item in range(items)]
        if len(vlr) >= 34 + 6 * items
        else []
    )
    if not sizes or sum(sizes) != point_size:
        raise DamagedFileError(
            path, f"damaged LAZ header: items of {sum(sizes)} bytes for points of {point_size}.", _AGAIN
        )
    compressor = struct.unpack_from("<H", vlr, 0)[0]
    if compressor not in (2, 3):
        raise DamagedFileError(
            path, f"LAZ compressor {compressor} is not read (only chunked ones are).", "Write it again with laszip."
        )


def _chunk_table(path: Path, file: BinaryIO, vlr: bytes, points: int, offset: int, size: int) -> Chunks:
    at = _table_offset(path, file, offset, size)
    file.seek(at)
    head = file.read(8)
    version, chunks = struct.unpack("<II", head) if len(head) == 8 else (1, 0)
    chunk_size = struct.unpack_from("<I", vlr, 12)[0]
    variable = chunk_size == _VARIABLE
    expected = -(-points // max(chunk_size, 1))
    room = at - offset - 8
    if (
        version != 0
        or chunks == 0
        or chunk_size == 0
        or chunks > room
        or (not variable and chunks not in (expected, expected + 1))
    ):
        raise DamagedFileError(path, f"damaged LAZ file: a table of {chunks:,} chunks for {points:,} points.", _AGAIN)
    file.seek(at)
    table = np.array(lazrs.read_chunk_table_only(io.BytesIO(file.read()), lazrs.LazVlr(vlr)), np.int64).reshape(-1, 2)
    counts = table[:, 0] if variable else np.full(chunks, chunk_size, np.int64)
    lengths = table[:, 1]
    used = np.cumsum(counts) - counts < points
    sound = (
        len(table) == chunks and lengths.min() >= 0 and counts.min() >= 0 and (lengths[used & (counts > 0)] > 0).all()
    )
    if not sound or lengths.sum() > room or counts.sum() < points:
        raise DamagedFileError(path, f"damaged LAZ file: its chunks do not add up to {points:,} points.", _AGAIN)
    starts = offset + 8 + np.concatenate([[0], np.cumsum(lengths[:-1])])
    used &= counts > 0
    counts = np.minimum(counts, points - (np.cumsum(counts) - counts))
    if counts[used].max() > _MOST_CHUNK or (chunk_size > _MOST_CHUNK and not variable):
        what = f"compressed chunks of {max(chunk_size, counts.max()):,} points"
        raise DamagedFileError(
            path, f"{what}: more than fit in memory.", "Write it again with laszip's own chunk size."
        )
    return Chunks(starts[used], lengths[used], counts[used], vlr, _layers(vlr))


def _layers(vlr: bytes) -> int:
    """Layers of a chunk of the layered compressor, 0 for the pointwise one."""
    if struct.unpack_from("<H", vlr, 0)[0] != 3:
        return 0
    items = [struct.unpack_from("<HHH", vlr, position) for position in range(34, len(vlr) - 5, 6)]
    return sum(_LAYERS.get(kind, size) for kind, size, _ in items)


def check_chunk(path: Path, raw: bytes, point_size: int, chunks: Chunks, index: int) -> None:
    """Refuses a chunk whose beginning (``raw``) announces layers longer than it: lazrs would take memory for them."""
    if not chunks.layers:
        return
    sizes = raw[point_size + 4 : point_size + 4 + 4 * chunks.layers]
    if len(sizes) < 4 * chunks.layers or int(np.frombuffer(sizes, "<u4").sum(dtype=np.int64)) > chunks.lengths[index]:
        raise DamagedFileError(path, f"damaged LAZ file: chunk {index:,} announces more bytes than it has.", _AGAIN)


def head_size(point_size: int, chunks: Chunks) -> int:
    """Bytes at the beginning of a chunk: its first point, its number of points, the sizes of its layers."""
    return point_size + 4 + 4 * chunks.layers


def _table_offset(path: Path, file: BinaryIO, offset: int, size: int) -> int:
    file.seek(offset)
    raw = file.read(8)
    at = struct.unpack("<q", raw)[0] if len(raw) == 8 else 0
    if at == -1:
        file.seek(size - 8)
        at = struct.unpack("<q", file.read(8))[0]
    if not offset + 8 < at <= size - 8:
        raise DamagedFileError(
            path, f"truncated or unfinished LAZ file: its table of chunks should be at byte {at:,} of {size:,}.", _AGAIN
        )
    return at


def _crs(vlrs: tuple[_Vlr, ...]) -> tuple[str | None, float | None]:
    records = {vlr.record: vlr.data for vlr in vlrs if vlr.user == b"LASF_Projection"}
    if 2112 in records:
        wkt = records[2112].split(b"\0")[0].decode("utf-8", errors="replace")
        return crs_name(wkt) or None, wkt_unit(wkt)
    if 34735 not in records:
        return None, None
    words = np.frombuffer(records[34735][: len(records[34735]) // 8 * 8], "<u2").reshape(-1, 4)[1:]
    keys = {int(key): int(value) for key, location, _, value in words if location == 0}
    return geotiff_crs(keys, records.get(34737, b"").split(b"\0")[0].decode("latin-1"))
