"""LAS, LAZ and COPC: plain records straight from the file, compressed ones by laspy and lazrs.

A file that merges several stations often keeps them apart by point source id: a quick look (the first point of every
compressed
chunk and some whole stretches) lists the ids.
"""

from __future__ import annotations

import importlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import F32, F64, U8, Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.las_file import Chunks, LasFile, check_chunk, head_size, lazrs, read_las_file
from scan2bim.readers.points import choose_origin, guess_range, join_chunks, make_chunk, rows_of, stamp, tail_notes
from scan2bim.readers.records import Records, read_records, sample_records

laspy: Any = importlib.import_module("laspy")
"""The LAS library, whose types strict checking does not take."""

logging.getLogger("laspy").addHandler(logging.NullHandler())  # its messages would be shown besides our errors

_LOOK_CHUNKS = 4096
"""Compressed chunks whose first point is looked at: the first point of each is stored as it is."""
_LOOK_WHOLE = 3
"""Compressed chunks, usually of 50,000 points, that are looked at as a whole."""
_LOOK_RECORDS = 40_000
_SAMPLE_WHOLE = 8
_HUGE = 1_000_000
"""Points of a chunk that is not decompressed for a look: memory and time would not be bounded."""


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """What a quick look at a file's points showed: their ranges and their sources."""

    file: LasFile
    lower: F64
    upper: F64
    rgb_bits: int
    intensity: tuple[float, float] | None
    sources: tuple[int, ...]


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """The header of the file's one cloud. Raises DamagedFileError."""
    look = _look(*stamp(path))
    file = look.file
    stated = _stated_bounds(look)
    notes = ["bounds in the file's header are wrong: not used"] if stated is None else []
    if "red" in _dtype(file).names and not look.rgb_bits:
        notes.append("colour fields are all zero: no colour")
    if file.chunks is None and file.version < (1, 4):
        notes.extend(tail_notes(path, _records(file).end))
    lower, upper = stated or (None, None)
    header = ScanHeader(
        path,
        0,
        path.stem,
        file.points,
        choose_origin(lower, upper) if stated else choose_origin(look.lower, look.upper),
        None,
        lower,
        upper,
        look.rgb_bits > 0,
        look.intensity is not None,
        unit=file.unit,
        crs=file.crs,
        sources=look.sources,
        notes=tuple(notes),
    )
    return (header,)


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of the file. Raises DamagedFileError where they end early."""
    look = _look(*stamp(header.path))
    done = 0
    for records in _stream(header.path, look, chunk_points):
        done += len(records)
        yield _chunk(header, look, records)
    if done != header.points:
        raise DamagedFileError(
            header.path, f"ends after {done:,} of {header.points:,} points.", "Copy or export it again."
        )


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Points from several places of the file."""
    look = _look(*stamp(header.path))
    if look.file.chunks is None:
        records = sample_records(header.path, _records(look.file), count)
        return join_chunks([_chunk(header, look, records)], count)
    parts = _whole_chunks(header.path, look.file, look.file.chunks, _SAMPLE_WHOLE)
    parts = [rows_of(part, -(-count // len(parts))) for part in parts]
    return join_chunks([_chunk(header, look, part) for part in parts], count)


def _stated_bounds(look: _Look) -> tuple[F64, F64] | None:
    lower, upper = look.file.lower, look.file.upper
    margin = 1e-3 + np.abs(np.array(look.file.scales))
    sound = np.isfinite(lower).all() and np.isfinite(upper).all() and (lower <= upper).all()
    return (
        (lower, upper)
        if sound and (look.lower >= lower - margin).all() and (look.upper <= upper + margin).all()
        else None
    )


def _dtype(file: LasFile) -> Any:
    """The structured dtype of a record, extra bytes as one field."""
    dtype = laspy.PointFormat(file.point_format).dtype()
    extra = file.point_size - dtype.itemsize
    return np.dtype([*((name, dtype[name]) for name in dtype.names or ()), ("extra", "V", extra)]) if extra else dtype


def _records(file: LasFile) -> Records:
    return Records(file.offset, _dtype(file), file.points)


def _stream(path: Path, look: _Look, chunk_points: int) -> Iterator[NDArray[Any]]:
    if look.file.chunks is None:
        yield from read_records(path, _records(look.file), chunk_points)
        return
    chunks, file = look.file.chunks, look.file
    begins = np.cumsum(chunks.points) - chunks.points
    checked = 0
    with (
        laspy.open(path, read_evlrs=False, decompression_selection=_selection(look)) as reader,
        path.open("rb") as stream,
    ):
        for start in range(0, file.points, chunk_points):
            while checked < len(begins) and begins[checked] < start + chunk_points:
                _check_head(path, stream, file, chunks, checked)
                checked += 1
            yield _as_records(reader.read_points(min(chunk_points, file.points - start)))


def _check_head(path: Path, stream: BinaryIO, file: LasFile, chunks: Chunks, index: int) -> bytes:
    """The first point of a compressed chunk, as bytes, once the chunk's beginning was found sound."""
    stream.seek(int(chunks.starts[index]))
    head = stream.read(head_size(file.point_size, chunks))
    if len(head) < file.point_size:
        raise DamagedFileError(path, "truncated LAZ file: a chunk lies beyond its end.", "Copy or export it again.")
    check_chunk(path, head, file.point_size, chunks, index)
    return head[: file.point_size]


def _as_records(points: Any) -> NDArray[Any]:
    return cast(NDArray[Any], points.array)


def _selection(look: _Look) -> Any:
    """The fields to decompress, where the point format allows a choice."""
    selection = laspy.DecompressionSelection.base().decompress_z()
    if look.intensity:
        selection = selection.decompress_intensity()
    if look.rgb_bits:
        selection = selection.decompress_rgb()
    return selection.decompress_point_source_id() if look.sources else selection


def _chunk(header: ScanHeader, look: _Look, records: NDArray[Any]) -> Chunk:
    xyz = _coordinates(look.file, records, header.origin)
    intensity = _intensity(records, look.intensity) if look.intensity else None
    source = records["point_source_id"].astype(np.uint16) if header.sources else None
    return make_chunk(xyz, _colours(records, look.rgb_bits) if look.rgb_bits else None, intensity, source)


def _coordinates(file: LasFile, records: NDArray[Any], origin: F64) -> F32:
    xyz = np.empty((len(records), 3), np.float32)
    for column, name in enumerate("XYZ"):
        np.add(
            records[name] * file.scales[column],
            file.offsets[column] - origin[column],
            out=xyz[:, column],
            casting="same_kind",
        )
    return xyz


def _colours(records: NDArray[Any], bits: int) -> U8:
    rgb = np.empty((len(records), 3), np.uint8)
    for column, name in enumerate(("red", "green", "blue")):
        values = records[name]
        rgb[:, column] = values >> 8 if bits == 16 else np.minimum(values, 255)
    return rgb


def _intensity(records: NDArray[Any], limits: tuple[float, float]) -> F32:
    low, high = limits
    values = records["intensity"].astype(np.float32)
    values -= np.float32(low)
    values *= np.float32(1.0 / max(high - low, 1.0))
    return values


@lru_cache(maxsize=256)
def _look(path: Path, size: int, changed: int) -> _Look:
    """A quick look at the file, kept as long as the file's size and time of change are the same."""
    del size, changed
    file = read_las_file(path)
    records = _first_points(path, file)
    xyz = np.stack([records[name] * file.scales[axis] + file.offsets[axis] for axis, name in enumerate("XYZ")], axis=1)
    bits = 0
    if "red" in (records.dtype.names or ()):
        brightest = max(int(records[name].max()) for name in ("red", "green", "blue"))
        bits = 16 if brightest > 255 else 8 if brightest > 0 else 0
    sources = np.unique(records["point_source_id"])
    intensity = guess_range(records["intensity"]) if records["intensity"].any() else None
    return _Look(
        file,
        xyz.min(axis=0),
        xyz.max(axis=0),
        bits,
        intensity if intensity is None or intensity[1] > 1 else (0.0, 65535.0),
        tuple(int(source) for source in sources) if len(sources) > 1 else (),
    )


def _first_points(path: Path, file: LasFile) -> NDArray[Any]:
    """Records from all over the file."""
    if file.chunks is None:
        return sample_records(path, _records(file), _LOOK_RECORDS)
    with path.open("rb") as stream:
        indices = rows_of(np.arange(len(file.chunks.starts)), _LOOK_CHUNKS)
        heads = [_check_head(path, stream, file, file.chunks, int(index)) for index in indices]
    firsts = np.frombuffer(b"".join(heads), _dtype(file))
    return np.concatenate([firsts, *_whole_chunks(path, file, file.chunks, _LOOK_WHOLE)])


def _whole_chunks(path: Path, file: LasFile, chunks: Chunks, wanted: int) -> list[NDArray[Any]]:
    """The points of at most ``wanted`` whole chunks spread over the file; of huge chunks, only the file's first points.

    Chunks are decompressed one by one, since lazrs cannot jump in files whose chunks differ in size.
    """
    if int(chunks.points.max()) > _HUGE:
        with path.open("rb") as stream:
            _check_head(path, stream, file, chunks, 0)
        with laspy.open(path, read_evlrs=False) as reader:
            return [_as_records(reader.read_points(min(_LOOK_RECORDS, file.points)))]
    indices = np.unique(rows_of(np.arange(len(chunks.starts)), wanted))
    with path.open("rb") as stream:
        return [_decompressed(path, stream, file, chunks, int(index)) for index in indices]


def _decompressed(path: Path, stream: BinaryIO, file: LasFile, chunks: Chunks, index: int) -> NDArray[Any]:
    _check_head(path, stream, file, chunks, index)
    stream.seek(int(chunks.starts[index]))
    length, count = int(chunks.lengths[index]), int(chunks.points[index])
    raw, out = stream.read(length), bytearray(count * file.point_size)
    lazrs.decompress_points_with_chunk_table(raw, chunks.laszip, out, [(count, len(raw))])
    return np.frombuffer(out, _dtype(file))
