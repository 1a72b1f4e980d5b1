"""Checks of an E57 file's own structure (ASTM E2807), made before libE57 is trusted with it.

libE57 parses the XML part and the packets in native code; what a damaged or hostile file could make it allocate,
recurse
into or loop over is refused here: lengths, offsets, page size, nesting, document types and record counts.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO
from xml.parsers import expat

from scan2bim.errors import DamagedFileError
from scan2bim.readers.points import truncated

PAGE = 1024
"""Bytes of a page; the standard allows no other size. The last 4 are its checksum."""
PAYLOAD = PAGE - 4
_HEADER = struct.Struct("<8sIIQQQQ")
_SECTION = struct.Struct("<B7xQQQ")
_MOST_XML = 512 << 20
"""Bytes. A scan takes some 5 kB of XML: a hundred thousand scans fit."""
_DEEPEST = 32
"""Elements inside each other. The standard's deepest path has 8; libE57 recurses once per level."""
_AGAIN = "Copy or export it again."


@dataclass(frozen=True, slots=True)
class Section:
    """A compressed vector: physical offset of its section and of its packets, logical length, records."""

    offset: int
    data: int
    length: int
    records: int


def check_file(path: Path) -> tuple[Section, ...]:
    """The sections of points of an E57 file, in the XML's order, once header, XML and section headers were found sound.

    Raises DamagedFileError.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        xml_offset, xml_length = _check_header(path, file.read(_HEADER.size), size)
        vectors = _check_xml(path, read_logical(file, xml_offset, xml_length))
        return tuple(_check_section(path, file, offset, records, size) for offset, records in vectors)


def _check_header(path: Path, raw: bytes, size: int) -> tuple[int, int]:
    if len(raw) < _HEADER.size:
        raise truncated(path, "E57", _HEADER.size, len(raw))
    signature, major, _, length, xml_offset, xml_length, page = _HEADER.unpack(raw)
    if signature != b"ASTM-E57" or page != PAGE or major != 1:
        raise DamagedFileError(
            path, f"damaged E57 header: version {major}, page size {page} (expected 1 and {PAGE}).", _AGAIN
        )
    if size < length:
        raise truncated(path, "E57", length, size)
    if size > length or size % PAGE:
        raise DamagedFileError(
            path, f"damaged E57 file: its header promises {length:,} bytes, the file has {size:,}.", _AGAIN
        )
    if not (_HEADER.size <= xml_offset < size and 0 < xml_length < size - xml_offset + PAGE) or xml_length > _MOST_XML:
        raise DamagedFileError(
            path, f"damaged E57 header: XML of {xml_length:,} bytes at {xml_offset:,}, beyond the file.", _AGAIN
        )
    return xml_offset, xml_length


def read_logical(file: BinaryIO, offset: int, length: int) -> bytes:
    """``length`` bytes of payload from physical ``offset`` on, without the pages' checksums (left to libE57)."""
    first, skip = divmod(offset, PAGE)
    pages = (skip + length + PAYLOAD - 1) // PAYLOAD
    file.seek(first * PAGE)
    raw = file.read(pages * PAGE)
    payload = b"".join(raw[start : start + PAYLOAD] for start in range(0, len(raw), PAGE))
    return payload[skip : skip + length]


def _check_xml(path: Path, xml: bytes) -> list[tuple[int, int]]:
    """(file offset, record count) of each compressed vector of points."""
    watch = _XmlWatch(path)
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = watch.start, watch.end
    parser.StartDoctypeDeclHandler = watch.doctype
    try:
        parser.Parse(xml, True)
    except expat.ExpatError as error:
        raise DamagedFileError(path, f"damaged E57 file: its XML part cannot be parsed: {error}.", _AGAIN) from error
    return watch.vectors


class _XmlWatch:
    """Follows the XML part, collects the compressed vectors, refuses what libE57 would crash on."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.vectors: list[tuple[int, int]] = []
        self.open: list[tuple[str, str]] = []
        self.prototypes = 0

    def start(self, name: str, attributes: dict[str, str]) -> None:
        parent = self.open[-1] if self.open else ("", "")
        kind = attributes.get("type", "")
        self.open.append((name, kind))
        if len(self.open) > _DEEPEST:
            raise DamagedFileError(self.path, f"damaged E57 file: XML nested deeper than {_DEEPEST}.", _AGAIN)
        if kind == "CompressedVector":
            self.prototypes = 0
            if name == "points":
                self.vectors.append((_whole(attributes, "fileOffset"), _whole(attributes, "recordCount")))
        self.prototypes += (name, kind) == ("prototype", "Structure") and parent[1] == "CompressedVector"

    def end(self, _: str) -> None:
        if self.open.pop()[1] == "CompressedVector" and self.prototypes != 1:
            raise DamagedFileError(self.path, "damaged E57 file: points without a description of their fields.", _AGAIN)

    def doctype(self, *_: object) -> None:
        raise DamagedFileError(
            self.path, "damaged E57 file: its XML holds a document type, which the standard forbids.", _AGAIN
        )


def _whole(attributes: dict[str, str], name: str) -> int:
    try:
        return int(attributes.get(name, "0"))
    except ValueError:
        return -1


def _check_section(path: Path, file: BinaryIO, offset: int, records: int, size: int) -> Section:
    if records == 0:
        return Section(offset, 0, 0, 0)
    if records < 0 or not 0 < offset <= size - _SECTION.size:
        raise DamagedFileError(path, f"damaged E57 file: {records:,} points at byte {offset:,} of {size:,}.", _AGAIN)
    kind, length, data, _ = _SECTION.unpack(read_logical(file, offset, _SECTION.size))
    if kind != 1 or not offset < data < size or not _SECTION.size <= length <= size - offset:
        raise DamagedFileError(
            path, f"damaged E57 file: no section of points at byte {offset:,} where one should be.", _AGAIN
        )
    return Section(offset, data, length, records)


def check_count(path: Path, index: int, section: Section, bits: int) -> None:
    """Refuses a record count that the section's bytes cannot hold at ``bits`` a record."""
    if section.records > max(section.length * 8 // max(bits, 1), 0) and section.records > 0:
        raise DamagedFileError(
            path,
            f"scan {index} announces {section.records:,} points, its {section.length:,} bytes cannot hold them.",
            _AGAIN,
        )
