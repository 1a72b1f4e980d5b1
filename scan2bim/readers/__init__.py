"""Readers: a file a format, all streamed.

paths = find_inputs(["scans/"])
for header in read_headers(paths[0]):
    for chunk in read_chunks(header):
        ...
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol, cast

from scan2bim.cloud.scan import CHUNK_POINTS, Chunk, ScanHeader
from scan2bim.readers.formats import SUFFIXES, Format, detect
from scan2bim.readers.inputs import find_inputs, natural_key, one_a_kind
from scan2bim.readers.points import mapped_errors

__all__ = ["SUFFIXES", "find_inputs", "natural_key", "one_a_kind", "read_chunks", "read_headers", "sample_points"]

_MODULES: dict[Format, str] = {
    "E57": "e57",
    "LAS": "las",
    "PLY": "ply",
    "PCD": "pcd",
    "PTS": "pts",
    "PTX": "ptx",
    "TEXT": "text",
}
"""The module of each format, imported when a file of that format is met."""


class Reader(Protocol):
    """What each format's module offers."""

    def read_headers(self, path: Path) -> tuple[ScanHeader, ...]:
        """Headers of all scans of a file."""
        ...

    def read_chunks(self, header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
        """The points of one scan."""
        ...

    def sample_points(self, header: ScanHeader, count: int) -> Chunk:
        """Some points of one scan."""
        ...


def read_headers(path: Path | str) -> tuple[ScanHeader, ...]:
    """One header per scan of a file, without reading its points. A file is read as what it holds, whatever its name.

    Raises ClosedFormatError, DamagedFileError or InputError.
    """
    path = Path(path)
    form, notes = detect(path)
    with mapped_errors(path, form):
        headers = _reader(form).read_headers(path)
    return tuple(replace(header, notes=(*notes, *header.notes)) for header in headers)


def read_chunks(header: ScanHeader, chunk_points: int = CHUNK_POINTS) -> Iterator[Chunk]:
    """The points of one scan, ``chunk_points`` records or fewer at a time, in the order of the file.

    Memory is bounded by the chunk, whatever the file's size. Raises DamagedFileError or InputError, at the latest at
    the end: a file that
    ends early is never read without an error.
    """
    form, _ = detect(header.path)
    with mapped_errors(header.path, form):
        yield from _reader(form).read_chunks(header, chunk_points)


def sample_points(header: ScanHeader, count: int = 50_000) -> Chunk:
    """At most ``count`` points of one scan, spread over it as far as the format allows to jump (E57: its beginning).

    Raises DamagedFileError or InputError.
    """
    form, _ = detect(header.path)
    with mapped_errors(header.path, form):
        return _reader(form).sample_points(header, count)


def _reader(form: Format) -> Reader:
    return cast(Reader, importlib.import_module(f"scan2bim.readers.{_MODULES[form]}"))
