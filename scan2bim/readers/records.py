"""Fixed-size binary records: read in chunks or sampled, straight into structured arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import F32, F64, U8, Chunk
from scan2bim.errors import DamagedFileError
from scan2bim.readers.points import (
    choose_origin,
    colour_scale,
    guess_range,
    make_chunk,
    to_bytes,
    truncated,
    unpack_colours,
)

_STRETCH = 512
"""Records read at once when sampling."""


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """``count`` records of ``dtype`` from byte ``offset`` of a file."""

    offset: int
    dtype: np.dtype[Any]
    count: int

    @property
    def end(self) -> int:
        """The byte behind the last record."""
        return self.offset + self.count * self.dtype.itemsize


@dataclass(frozen=True, slots=True)
class Fields:
    """Names of the fields that hold coordinates, colour and intensity; all but the coordinates may be absent.

    ``packed`` is a uint32 field with red, green and blue in its lower three bytes.
    """

    xyz: tuple[str, str, str]
    rgb: tuple[str, str, str] | None = None
    intensity: str | None = None
    packed: str | None = None

    def all(self) -> tuple[str, ...]:
        """All names."""
        return (*self.xyz, *(self.rgb or ()), *(name for name in (self.intensity, self.packed) if name))


@dataclass(frozen=True, slots=True, eq=False)
class Scaling:
    """What a look at some records says beyond the header: origin (3,), factor of colours, range of intensity."""

    origin: F64
    colour: float = 1.0
    intensity: tuple[float, float] = (0.0, 1.0)


def check_room(path: Path, form: str, records: Records) -> None:
    """Raises DamagedFileError where the file is too short for the records that its header announces."""
    size = path.stat().st_size
    if records.count < 0 or size < records.end:
        raise truncated(path, form, records.end, size)


def read_records(path: Path, records: Records, chunk_points: int) -> Iterator[NDArray[Any]]:
    """All records, ``chunk_points`` or fewer at a time. Each array is overwritten by the next: copy what is to stay."""
    size = records.dtype.itemsize
    buffer = bytearray(min(chunk_points, records.count) * size)
    with path.open("rb", buffering=0) as file:
        file.seek(records.offset)
        left = records.count
        while left > 0:
            part = memoryview(buffer)[: min(left * size, len(buffer))]
            _fill(path, file, part)
            left -= len(part) // size
            yield np.frombuffer(part, records.dtype)


def _fill(path: Path, file: Any, part: memoryview) -> None:
    filled = 0
    while filled < len(part):
        count = file.readinto(part[filled:])
        if not count:
            raise DamagedFileError(path, "the file ended while it was read.", "Copy or export it again.")
        filled += count


def sample_records(path: Path, records: Records, count: int) -> NDArray[Any]:
    """At most ``count`` records in stretches spread over the file."""
    stretches = max(min(count, records.count) // _STRETCH, 1)
    size = records.dtype.itemsize
    length = min(_STRETCH if stretches > 1 else count, records.count)
    starts = np.unique(np.linspace(0, records.count - length, stretches).astype(np.int64))
    parts: list[bytes] = []
    with path.open("rb") as file:
        for start in starts:
            file.seek(records.offset + int(start) * size)
            raw = file.read(length * size)
            parts.append(raw[: len(raw) // size * size])
    return np.frombuffer(b"".join(parts), records.dtype)


def look(records: NDArray[Any], fields: Fields, origin: F64 | None = None) -> Scaling:
    """The scaling that some records suggest, with the origin where it is known already."""
    with np.errstate(invalid="ignore", over="ignore"):
        if origin is None:
            origin = choose_origin(np.stack([records[name].astype(np.float64) for name in fields.xyz], axis=1))
        colour = colour_scale(np.stack([records[name] for name in fields.rgb])) if fields.rgb else 1.0
        intensity = guess_range(records[fields.intensity]) if fields.intensity else (0.0, 1.0)
    return Scaling(origin, colour, intensity)


def to_chunk(records: NDArray[Any], fields: Fields, scaling: Scaling) -> Chunk:
    """A chunk (a copy) of records (n,)."""
    with np.errstate(invalid="ignore", over="ignore"):
        xyz = _coordinates(records, fields, scaling.origin)
        rgb = _colours(records, fields.rgb, scaling.colour) if fields.rgb else None
        if fields.packed:
            rgb = unpack_colours(records[fields.packed])
        intensity = _intensity(records, fields.intensity, scaling.intensity) if fields.intensity else None
        return make_chunk(xyz, rgb, intensity)


def _coordinates(records: NDArray[Any], fields: Fields, origin: F64) -> F32:
    xyz = np.empty((len(records), 3), np.float32)
    for column, name in enumerate(fields.xyz):
        values = records[name]
        xyz[:, column] = values.astype(np.float64) - origin[column] if origin[column] else values
    return xyz


def _colours(records: NDArray[Any], names: tuple[str, str, str], scale: float) -> U8:
    rgb = np.empty((len(records), 3), np.uint8)
    for column, name in enumerate(names):
        rgb[:, column] = to_bytes(records[name], scale)
    return rgb


def _intensity(records: NDArray[Any], name: str, limits: tuple[float, float]) -> F32:
    low, high = limits
    values = records[name].astype(np.float32)
    values -= np.float32(low)
    values *= np.float32(1.0 / (high - low) if high > low else 1.0)
    return values
