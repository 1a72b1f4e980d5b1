"""Text files in blocks of whole lines: skipping, sampling, and rows of numbers in chunks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import F32, F64, Chunk
from scan2bim.errors import DamagedFileError
from scan2bim.readers.parse import parse_rows
from scan2bim.readers.points import colour_scale, guess_range, make_chunk, to_bytes, unpack_colours

BLOCK = 4 << 20
"""Bytes read at once: large beside a call's cost, small beside a chunk."""
_LONGEST = 1 << 16
"""Bytes of a line. A line of points has some hundred: longer ones are no text."""
_STRETCH = 1 << 16
"""Bytes per stretch when sampling."""
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True)
class Columns:
    """The meaning of ``count`` columns: indices of coordinates, colours and intensity, and the decimal sign.

    ``packed`` is a column of colours packed in one number, as PCD has them: whole, or the bits of a single float.
    """

    count: int
    xyz: tuple[int, int, int] = (0, 1, 2)
    rgb: tuple[int, int, int] | None = None
    intensity: int | None = None
    decimal: str = "."
    packed: int | None = None

    def take(self) -> tuple[int, ...]:
        """Indices of the columns in the order of rows: x, y, z, then intensity, then r, g, b or the packed colour."""
        single = tuple(index for index in (self.intensity,) if index is not None)
        return (*self.xyz, *single, *(self.rgb or ()), *(() if self.packed is None else (self.packed,)))


@dataclass(frozen=True, slots=True)
class Span:
    """Lines from byte ``start`` up to ``end`` of a file, ``rows`` of them with points; None where not counted."""

    start: int
    end: int
    rows: int | None


@dataclass(frozen=True, slots=True, eq=False)
class TextScaling:
    """What a look at some rows suggests: origin (3,), factor of colours, range of intensity."""

    origin: F64
    colour: float
    intensity: tuple[float, float]


def read_rows(path: Path, span: Span, columns: Columns, chunk_points: int) -> Iterator[F64]:
    """Rows (n, k) in the order of ``Columns.take``, at most ``chunk_points`` at a time, each overwritten by the next.

    Raises DamagedFileError at a line that is no row, and where there are more or fewer rows than ``span.rows``.
    """
    take, decimal = _plan(columns), ord(columns.decimal)
    most = chunk_points if span.rows is None else min(chunk_points, span.rows)
    out = np.empty((most, len(columns.take())))
    filled = done = 0
    for offset, block in _blocks(path, span.start, span.end):
        position = 0
        while position < len(block):
            filled, position, bad = parse_rows(block, position, len(block), columns.count, take, decimal, out, filled)
            if bad:
                raise _bad_line(path, offset + position, columns)
            if filled == len(out):
                done += filled
                yield out
                filled = 0
                out = out if span.rows is None else out[: max(min(len(out), span.rows - done), 1)]
    if filled:
        yield out[:filled]
    if span.rows is not None and done + filled != span.rows:
        raise DamagedFileError(path, f"holds {done + filled:,} points where {span.rows:,} were announced.", _AGAIN)


def _plan(columns: Columns) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    plan = np.full(columns.count, -1, np.int64)
    plan[list(columns.take())] = np.arange(len(columns.take()))
    return plan


def _blocks(path: Path, start: int, end: int) -> Iterator[tuple[int, np.ndarray[tuple[int], np.dtype[np.uint8]]]]:
    """(offset in the file, bytes) of blocks of whole lines; the last line gets an end if it has none."""
    with path.open("rb") as file:
        file.seek(start)
        rest, offset = b"", start
        while (left := end - offset - len(rest)) > 0:
            raw = file.read(min(BLOCK, left))
            if not raw:
                break
            whole = rest + raw
            cut = max(whole.rfind(b"\n"), whole.rfind(b"\r")) + 1
            if cut == 0 and len(whole) > _LONGEST:
                raise DamagedFileError(
                    path, f"a line at byte {offset:,} is longer than {_LONGEST:,} bytes: no text of points.", _AGAIN
                )
            if cut:
                yield offset, np.frombuffer(whole[:cut], np.uint8)
            rest, offset = whole[cut:], offset + cut
        if rest.strip():
            yield offset, np.frombuffer(rest + b"\n", np.uint8)


def _bad_line(path: Path, position: int, columns: Columns) -> DamagedFileError:
    with path.open("rb") as file:
        number, left = 1, position
        while left > 0 and (raw := file.read(min(BLOCK, left))):
            number, left = number + raw.count(b"\n"), left - len(raw)
        file.seek(position)
        line = file.read(80).splitlines()[0].decode("ascii", errors="replace").strip()
    return DamagedFileError(
        path,
        f"line {number:,} should hold {columns.count} numbers, holds {line[:60]!r}.",
        "Correct or remove the line, or export it again.",
    )


def skip_lines(file: BinaryIO, start: int, count: int) -> int | None:
    """The byte behind ``count`` lines from byte ``start`` on, None where the file has fewer.

    A last line needs no end.
    """
    file.seek(start)
    position, left, last = start, count, b"\n"
    while left > 0:
        raw = file.read(BLOCK)
        if not raw:
            return position if left == 1 and last != b"\n" else None
        found = raw.count(b"\n")
        if found >= left:
            ends = np.flatnonzero(np.frombuffer(raw, np.uint8) == 10)
            return position + int(ends[left - 1]) + 1
        position, left, last = position + len(raw), left - found, raw[-1:]
    return position


def sample_rows(path: Path, span: Span, columns: Columns, count: int) -> F64:
    """Rows from stretches spread over the span, at most ``count``; lines that are no rows are passed over."""
    stretches = max(min(count // 256, (span.end - span.start) // _STRETCH), 1)
    starts = np.linspace(span.start, max(span.end - _STRETCH, span.start), stretches).astype(np.int64)
    parts = [_stretch(path, span, columns, int(start), -(-count // stretches)) for start in np.unique(starts)]
    return np.concatenate(parts)[:count]


def _stretch(path: Path, span: Span, columns: Columns, start: int, count: int) -> F64:
    with path.open("rb") as file:
        file.seek(start)
        raw = file.read(min(_STRETCH, span.end - start))
    whole_end = start + len(raw) >= span.end
    first = 0 if start == span.start else max(raw.find(b"\n"), raw.find(b"\r")) + 1
    last = len(raw) if whole_end else max(raw.rfind(b"\n"), raw.rfind(b"\r")) + 1
    text = np.frombuffer(raw[first:last] + b"\n", np.uint8)
    out = np.empty((count, len(columns.take())))
    filled, position = 0, 0
    while position < len(text) and filled < count:
        filled, position, bad = parse_rows(
            text, position, len(text), columns.count, _plan(columns), ord(columns.decimal), out, filled
        )
        if bad:
            position += int(np.argmax(text[position:] == 10)) + 1
    return out[:filled]


def look(rows: F64, columns: Columns, origin: F64) -> TextScaling:
    """The scaling that some rows suggest."""
    after = 3 + (columns.intensity is not None)
    intensity = guess_range(rows[:, 3]) if columns.intensity is not None else (0.0, 1.0)
    return TextScaling(origin, colour_scale(rows[:, after:]) if columns.rgb else 1.0, intensity)


def _packed(values: F64) -> F32 | NDArray[np.uint32]:
    """Packed colours as the numbers they are: whole ones above 1, else the bits of single floats."""
    clean = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    whole = len(clean) > 0 and clean.max() > 1.0 and bool((clean == np.round(clean)).all())
    return np.clip(clean, 0, 2**32 - 1).astype(np.uint32) if whole else clean.astype(np.float32)


def to_chunk(rows: F64, columns: Columns, scaling: TextScaling, drop_zeros: bool = False) -> Chunk:
    """A chunk (a copy) of rows (n, k); with ``drop_zeros`` points at exactly 0 0 0 are none."""
    valid = (rows[:, 0] != 0) | (rows[:, 1] != 0) | (rows[:, 2] != 0) if drop_zeros else None
    with np.errstate(invalid="ignore", over="ignore"):
        xyz = (rows[:, :3] - scaling.origin).astype(np.float32)
        after = 3 + (columns.intensity is not None)
        rgb = to_bytes(rows[:, after : after + 3], scaling.colour) if columns.rgb else None
        if columns.packed is not None:
            rgb = unpack_colours(_packed(rows[:, -1]))
        intensity = None
        if columns.intensity is not None:
            low, high = scaling.intensity
            intensity = ((rows[:, 3] - low) / (high - low if high > low else 1.0)).astype(np.float32)
        return make_chunk(xyz, rgb, intensity, valid=None if valid is None or valid.all() else valid)
