"""Records of E57 scans unpacked by our own code are those that libE57 unpacks, bit for bit."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from readers.writers import E57Scan, e57_from_pages, e57_pages, real, scaled, whole, write_e57

from scan2bim.errors import DamagedFileError
from scan2bim.readers import e57_pages as e57_pages_module
from scan2bim.readers import read_chunks, read_headers
from scan2bim.readers.e57_file import PAGE, PAYLOAD, check_file
from scan2bim.readers.e57_header import scans_of
from scan2bim.readers.e57_layout import Records, make_buffers
from scan2bim.readers.e57_library import LibraryReader
from scan2bim.readers.e57_points import PointReader, point_reader
from scan2bim.readers.points import stamp

COUNT = 30_000
"""Records: several packets, which hold 64 kB at most."""
AXES = ("cartesianX", "cartesianY", "cartesianZ")
COLOURS = ("colorRed", "colorGreen", "colorBlue")
Field = tuple[str, Callable[[Any], Any], np.ndarray]


def numbers(low: int, high: int, seed: int, count: int = COUNT) -> np.ndarray:
    return np.random.default_rng(seed).integers(low, high, count, endpoint=True).astype(np.float64)


def packed(bits: int, scale: float = 0.0005, offset: float = 0.25) -> list[Field]:
    """Three axes of about so many bits each, not from zero on, with scale and offset."""
    fields: list[Field] = []
    for axis, name in enumerate(AXES):
        low, high = -(1 << bits) // 3, (1 << (bits + axis)) - (1 << bits) // 3 - 1
        fields.append((name, scaled(low, high, scale, offset), numbers(low, high, axis) * scale + offset))
    return fields


def floats(single: bool) -> list[Field]:
    kind = np.float32 if single else np.float64
    return [
        (name, real(single), np.random.default_rng(i).normal(0, 9, COUNT).astype(kind)) for i, name in enumerate(AXES)
    ]


def coloured(low: int = 0, high: int = 255, kind: Any = np.uint8) -> list[Field]:
    return [(name, whole(low, high), numbers(low, high, 9 + i).astype(kind)) for i, name in enumerate(COLOURS)]


STATE: Field = ("cartesianInvalidState", whole(0, 2), numbers(0, 2, 5).astype(np.uint8))
ROW: Field = ("rowIndex", whole(0, 1234), numbers(0, 1234, 6).astype(np.uint16))
LAYOUTS: dict[str, list[Field]] = {
    "scaled": [*packed(13), STATE, *coloured(), ("intensity", whole(0, 255), numbers(0, 255, 7)), ROW],
    "one bit": packed(1),
    "many bits": packed(45, 1e-12),
    "single floats": [*coloured(), *floats(True), STATE, ("intensity", real(True), numbers(0, 1, 3).astype("f4"))],
    "double floats": [ROW, *floats(False), ("intensity", scaled(-2048, 2047, 0.001), numbers(-2048, 2047, 3) * 0.001)],
    "wide colours": [*floats(False), *coloured(0, 1023, np.uint16), ("intensity", real(), numbers(0, 1, 3) / 3)],
    "narrow colours": [*floats(True), *coloured(3, 66), ("intensity", whole(-5, 5), numbers(-5, 5, 3))],
    "constant": [
        (AXES[0], scaled(7, 7, 0.5, 1.0), np.full(COUNT, 7.0)),
        *packed(9)[1:],
        ("intensity", whole(3, 3), np.full(COUNT, 3.0)),
    ],
}  # fmt: skip


def records_of(path: Path) -> Records:
    """Of the only scan of a file."""
    return scans_of(*stamp(path))[0].records


def both(path: Path, capacity: int) -> Iterator[tuple[Any, Any, int, int]]:
    """The buffers that our reader and libE57's fill, time after time, and how many records they say."""
    records = records_of(path)
    ours, theirs = make_buffers(records.layout, capacity), make_buffers(records.layout, capacity)
    reader = point_reader(path, records, ours)
    assert isinstance(reader, PointReader)
    with reader, LibraryReader(path, 0, records, theirs) as library:
        done = 0
        while done < records.section.records:
            count = reader.read()
            yield ours, theirs, count, library.read()
            done += count


@pytest.mark.parametrize("capacity", [COUNT, 997])
@pytest.mark.parametrize("name", LAYOUTS)
def test_records_are_those_of_libe57_bit_for_bit(tmp_path: Path, name: str, capacity: int) -> None:
    path = write_e57(tmp_path / "a.e57", [E57Scan(LAYOUTS[name])])
    for ours, theirs, count, expected in both(path, capacity):
        assert count == expected
        for part in ("xyz", "rgb", "intensity", "state"):
            mine, other = getattr(ours, part), getattr(theirs, part)
            assert (mine is None) == (other is None)
            assert mine is None or mine[:count].tobytes() == other[:count].tobytes(), part


def test_fields_that_are_packed_unusually_are_left_to_libe57(tmp_path: Path) -> None:
    fields = [*packed(9), ("timeStamp", whole(0, 1 << 60), numbers(0, 1000, 4))]
    path = write_e57(tmp_path / "a.e57", [E57Scan(fields)])
    records = records_of(path)
    assert point_reader(path, records, make_buffers(records.layout, 9)) is None


def logical(physical: int) -> int:
    return physical // PAGE * PAYLOAD + physical % PAGE


def with_packet(path: Path, place: int, data: bytes) -> Path:
    """A copy of a file with bytes of its first packet of points replaced, under right checksums."""
    payload = bytearray(e57_pages(path.read_bytes()))
    at = logical(check_file(path)[0].data) + place
    payload[at : at + len(data)] = data
    copy = path.with_name("edited.e57")
    copy.write_bytes(e57_from_pages(bytes(payload)))
    return copy


@pytest.mark.parametrize("kind", [0, 2], ids=["index", "nothing"])
def test_packets_of_an_index_and_of_nothing_are_passed_over(tmp_path: Path, kind: int) -> None:
    """The first packet of points is made such a one: its records are missing, the rest is still there."""
    path = write_e57(tmp_path / "a.e57", [E57Scan(LAYOUTS["single floats"])])
    records = records_of(path)
    found: list[tuple[int, np.ndarray]] = []
    for file in (path, with_packet(path, 0, bytes([kind]))):
        buffers = make_buffers(records.layout, COUNT)
        reader = point_reader(file, records, buffers)
        assert reader is not None
        with reader:
            found.append((reader.read(), buffers.xyz))
    (whole_count, every), (count, rest) = found
    assert whole_count == COUNT and 0 < count < COUNT
    assert np.array_equal(every[COUNT - count :], rest[:count])


@pytest.mark.parametrize(
    ("place", "data"),
    [(0, b"\x07"), (2, struct.pack("<H", 6)), (2, struct.pack("<H", 7)), (4, b"\x63\x00"), (6, b"\xff\xff")],
    ids=["kind", "odd length", "short", "number of streams", "length of a stream"],
)
def test_a_malformed_packet_is_an_error(tmp_path: Path, place: int, data: bytes) -> None:
    path = write_e57(tmp_path / "a.e57", [E57Scan(LAYOUTS["scaled"])])
    header = replace(read_headers(path)[0], path=with_packet(path, place, data))
    with pytest.raises(DamagedFileError, match="packets of points is malformed"):
        next(read_chunks(header))


@pytest.mark.parametrize("unpage", [e57_pages_module.unpage_by_table, e57_pages_module.unpage])
def test_pages_give_what_they_hold_up_to_the_first_with_a_wrong_checksum(unpage: Callable[..., int]) -> None:
    payload = np.random.default_rng(2).integers(0, 256, 5 * PAYLOAD).astype(np.uint8)
    pages = np.frombuffer(e57_from_pages(payload.tobytes()), np.uint8).reshape(-1, PAGE).copy()
    out = np.zeros_like(payload)
    assert unpage(pages, e57_pages_module.CRC_TABLES, out) == -1
    assert np.array_equal(out, pages[:, :PAYLOAD].ravel())
    for place in (0, 700, PAYLOAD - 1, PAYLOAD, PAGE - 1):
        wrong = pages.copy()
        wrong[3, place] ^= 1
        assert unpage(wrong, e57_pages_module.CRC_TABLES, out) == 3
