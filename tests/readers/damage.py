"""Damaged and odd files, made from small good ones: the same from run to run."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from readers.writers import (
    E57Scan,
    cloud,
    e57_from_pages,
    e57_pages,
    e57_scan,
    edit_e57_xml,
    pcd_fields,
    ply_columns,
    ptx_text,
    real,
    scaled,
    whole,
    write_copc,
    write_e57,
    write_las,
    write_pcd,
    write_ply,
    write_pts,
    write_text,
)

Case = tuple[str, bytes]
"""File name and content."""
POINTS = 300


def good_files(folder: Path) -> list[Path]:
    """One small file of every format and variant."""
    points = cloud(POINTS)
    files = [
        write_e57(
            folder / "cartesian.e57", [e57_scan(points, rotation=(1, 0, 0, 0), translation=(1, 2, 3)), e57_scan(points)]
        ),
        write_e57(folder / "spherical.e57", [_spherical()]),
        write_e57(folder / "scaled.e57", [_scaled()]),
        write_las(folder / "plain.las", points),
        write_las(folder / "old.las", points, 3, "1.2", sources=np.arange(POINTS).astype(np.uint16) // 100),
        write_las(folder / "layered.laz", points),
        write_las(folder / "pointwise.laz", points, 2, "1.2"),
        write_copc(folder / "tree.copc.laz", points),
        write_pts(folder / "blocks.pts", [points, points]),
        write_text(folder / "plain.xyz", points),
        write_text(folder / "named.csv", points, head="x,y,z,intensity,r,g,b\n", separator=","),
    ]
    (folder / "tree.copc.plain.las").unlink(missing_ok=True)
    (folder / "two.ptx").write_text(ptx_text(points, 20, 15, np.eye(4), (0, 0, 0)) * 2)
    for encoding in ("ascii", "binary_little_endian", "binary_big_endian"):
        files.append(write_ply(folder / f"{encoding}.ply", ply_columns(points), encoding))
    for data in ("ascii", "binary", "binary_compressed"):
        files.append(write_pcd(folder / f"{data}.pcd", pcd_fields(points), data))
    return [*files, folder / "two.ptx"]


def _spherical() -> E57Scan:
    rng = np.random.default_rng(3)
    fields = [
        ("sphericalRange", real(), rng.uniform(1, 9, POINTS)),
        ("sphericalAzimuth", real(), rng.uniform(-3, 3, POINTS)),
    ]
    fields += [("sphericalElevation", real(), rng.uniform(-1, 1, POINTS))]
    return E57Scan([*fields, ("sphericalInvalidState", whole(0, 2), rng.integers(0, 3, POINTS).astype(np.uint8))])


def _scaled() -> E57Scan:
    points = cloud(POINTS)
    fields = [
        (f"cartesian{axis}", scaled(-(2**20), 2**20, 1 / 256), points.xyz[:, i].astype(np.float64))
        for i, axis in enumerate("XYZ")
    ]
    fields += [
        (f"color{name}", whole(0, 4095), points.rgb[:, i].astype(np.uint16))
        for i, name in enumerate(("Red", "Green", "Blue"))
    ]
    return E57Scan([*fields, ("intensity", whole(0, 255), points.rgb[:, 0].astype(np.uint8))])


def cases(files: list[Path], flips: int) -> Iterator[Case]:
    """All damaged files: general damage to each good file, then damage that only a format knows."""
    for path in files:
        raw = path.read_bytes()
        for name, damaged in _general(raw, flips, seed=len(path.name)):
            yield f"{path.stem}-{name}{path.suffix}", damaged
        for suffix in (".las", ".e57", ".xyz", ".ply"):
            if suffix != path.suffix and path.stem in ("cartesian", "plain", "layered", "ascii", "two"):
                yield f"{path.stem}{path.suffix[1:]}-as{suffix}", raw
    by_name = {path.name: path.read_bytes() for path in files}
    yield from _swapped(by_name)
    yield from _e57(by_name, flips)
    yield from _las(by_name)
    yield from _headers_of_text(by_name)
    yield from _odd_values()


def _general(raw: bytes, flips: int, seed: int) -> Iterator[Case]:
    rng = np.random.default_rng(seed)
    for share in (0.02, 0.3, 0.7, 0.97):
        yield f"cut{int(share * 100)}", raw[: int(len(raw) * share)]
    yield "cutlast", raw[:-9]
    yield "empty", b""
    yield "twice", raw + raw
    yield "tail", raw + b"\xfe garbage" * 10
    yield "headless", raw[200:]
    for index in range(flips):
        damaged = bytearray(raw)
        for position in rng.integers(0, len(raw) if index % 2 else min(len(raw), 600), 1 + index % 5):
            damaged[position] ^= int(rng.integers(1, 256))
        yield f"flip{index}", bytes(damaged)
    for index, start in enumerate(rng.integers(0, len(raw), 2)):
        length = min(400, len(raw) - start)
        yield f"zeros{index}", raw[:start] + bytes(length) + raw[start + length :]
        yield f"ones{index}", raw[:start] + b"\xff" * length + raw[start + length :]


def _swapped(files: dict[str, bytes]) -> Iterator[Case]:
    """The beginning of one file before the rest of another."""
    pairs = [("plain.las", "layered.laz"), ("layered.laz", "pointwise.laz"), ("cartesian.e57", "spherical.e57")]
    pairs += [
        ("binary.pcd", "binary_compressed.pcd"),
        ("ascii.ply", "binary_little_endian.ply"),
        ("blocks.pts", "two.ptx"),
    ]
    for first, second in pairs:
        for one, other in ((first, second), (second, first)):
            yield f"swapped-{Path(other).stem}-{one}", files[one][:300] + files[other][300:]


XML_EDITS: dict[str, tuple[bytes, bytes]] = {
    "manypoints": (rb'recordCount="300"', b'recordCount="9000000000000000000"'),
    "morepoints": (rb'recordCount="300"', b'recordCount="400"'),
    "fewerpoints": (rb'recordCount="300"', b'recordCount="100"'),
    "nopoints": (rb'recordCount="300"', b'recordCount="0"'),
    "negative": (rb'recordCount="300"', b'recordCount="-5"'),
    "overflow": (rb'recordCount="300"', b'recordCount="99999999999999999999999"'),
    "word": (rb'recordCount="300"', b'recordCount="many"'),
    "offsetfar": (rb'fileOffset="\d+"', b'fileOffset="99999999"'),
    "offsetzero": (rb'fileOffset="\d+"', b'fileOffset="0"'),
    "offsetoff": (rb'fileOffset="\d+"', b'fileOffset="52"'),
    "offsetxml": (rb'fileOffset="\d+"', b'fileOffset="1500"'),
    "doctype": (rb"<e57Root", b'<!DOCTYPE a [<!ENTITY b "ccc">]><e57Root'),
    "deep": (rb"<e57Root", b"<a>" * 5000 + b"<e57Root"),
    "nodata": (rb"data3D", b"data4D"),
    "axisgone": (rb"(cartesian|spherical)(X|Range)", b"strange"),
    "axistwice": (rb"cartesianY|sphericalAzimuth", b"cartesianX"),
    "string": (rb'<(cartesianX|sphericalRange) type="\w+"', rb'<\1 type="String"'),
    "structure": (rb'<(cartesianX|sphericalRange) type="\w+"', rb'<\1 type="Structure"'),
    "integer": (rb'<(cartesianX|sphericalRange) type="\w+"', rb'<\1 type="Integer" minimum="0" maximum="9"'),
    "constant": (
        rb'<(color\w+) type="Integer" minimum="0" maximum="\d+"',
        rb'<\1 type="Integer" minimum="7" maximum="7"',
    ),
    "widecolour": (rb'<(color\w+) type="Integer" minimum="0" maximum="\d+"', rb'<\1 type="Integer"'),
    "signed": (
        rb'<(color\w+) type="Integer" minimum="0" maximum="\d+"',
        rb'<\1 type="Integer" minimum="-128" maximum="127"',
    ),
    "reversed": (rb'minimum="0" maximum="\d+"', b'minimum="255" maximum="0"'),
    "scalezero": (rb'scale="[^"]*"', b'scale="0"'),
    "scalenan": (rb'scale="[^"]*"', b'scale="nan"'),
    "scalehuge": (rb'scale="[^"]*"', b'scale="1e300"'),
    "single": (rb'type="Float"', b'type="Float" precision="single"'),
    "double": (rb' precision="single"', b""),
    "posenan": (rb'<w type="Float">[^<]*</w>', b'<w type="Float">nan</w>'),
    "posezero": (rb'<w type="Float">[^<]*</w>', b'<w type="Float">0</w>'),
    "poselong": (rb'<w type="Float">[^<]*</w>', b'<w type="Float">1e9</w>'),
    "posestring": (rb'<w type="Float">[^<]*</w>', b'<w type="String">1</w>'),
    "posegone": (rb'<translation type="Structure">.*?</translation>', b""),
    "axisofpose": (rb'<x type="Float">[^<]*</x>', b""),
    "namestructure": (rb'<name type="String">.*?</name>', b'<name type="Structure"></name>'),
    "noname": (rb'<name type="String">.*?</name>', b""),
    "noprototype": (rb'<prototype type="Structure">.*?</prototype>', b""),
    "emptyprototype": (rb'<prototype type="Structure">.*?</prototype>', b'<prototype type="Structure"></prototype>'),
    "nopointsnode": (rb"<points .*?</points>", b""),
    "pointsstring": (rb"<points .*?</points>", b'<points type="String"></points>'),
    "codec": (rb'<codecs type="Vector"[^>]*>', b'<codecs type="Vector"><vectorChild type="Integer">5</vectorChild>'),
    "unclosed": (rb"</data3D>", b""),
    "binary": (rb"<guid", b"\0\x01\x02<guid"),
    "latin": (rb"<guid", b"\xff\xfe<guid"),
    "nocodecs": (rb"<codecs .*?</codecs>", b""),
    "codecsstring": (rb"<codecs .*?</codecs>", b'<codecs type="String"></codecs>'),
    "protostring": (rb'<prototype type="Structure">.*?</prototype>', b'<prototype type="String"></prototype>'),
    "protonested": (
        rb'<prototype type="Structure">',
        b'<prototype type="Structure"><a type="Structure"><b type="Vector"></b></a>',
    ),
    "scannedstring": (
        rb"<vectorChild type=.Structure.>.*?</vectorChild>",
        b'<vectorChild type="String"></vectorChild>',
    ),
    "scansnone": (rb"<data3D .*?</data3D>", b'<data3D type="Vector"></data3D>'),
    "scansinteger": (rb"<data3D .*?</data3D>", b'<data3D type="Integer">4</data3D>'),
    "emptyxml": (rb".*", b""),
}


def _e57(files: dict[str, bytes], flips: int) -> Iterator[Case]:
    """Damage below right checksums: in the XML part, and in the packets."""
    for stem in ("cartesian", "spherical", "scaled"):
        raw = files[f"{stem}.e57"]
        for name, (pattern, by) in XML_EDITS.items():
            edited = edit_e57_xml(
                raw, lambda xml, pattern=pattern, by=by: re.sub(pattern, by, xml, count=0, flags=re.DOTALL)
            )
            if e57_pages(edited) != e57_pages(raw):
                yield f"{stem}-xml-{name}.e57", edited
        rng = np.random.default_rng(len(stem))
        for index in range(flips):
            payload = bytearray(e57_pages(raw))
            for position in rng.integers(48, 120 if index % 2 else len(payload), 1 + index % 3):
                payload[position] ^= int(rng.integers(1, 256))
            yield f"{stem}-sealed{index}.e57", e57_from_pages(bytes(payload))
    yield "page.e57", files["cartesian.e57"][:40] + struct.pack("<Q", 2**60) + files["cartesian.e57"][48:]
    for index, offset in enumerate((16, 24, 32)):
        for value in (0, 2**63, len(files["cartesian.e57"]) - 10):
            yield f"header{index}-{value}.e57", e57_with(files["cartesian.e57"], offset, value)


def e57_with(raw: bytes, offset: int, value: int) -> bytes:
    return raw[:offset] + struct.pack("<Q", value) + raw[offset + 8 :]


LAS_EDITS: dict[str, tuple[int, str, float]] = {
    "manypoints": (247, "<Q", 2**62),
    "morepoints": (247, "<Q", POINTS + 1),
    "fewerpoints": (247, "<Q", POINTS - 100),
    "nopoints": (247, "<Q", 0),
    "manyold": (107, "<I", 2**32 - 1),
    "offsetfar": (96, "<I", 2**32 - 1),
    "offsetzero": (96, "<I", 0),
    "manyvlrs": (100, "<I", 2**32 - 1),
    "format": (104, "<B", 63),
    "otherformat": (104, "<B", 6),
    "size": (105, "<H", 65535),
    "sizesmall": (105, "<H", 3),
    "headersize": (94, "<H", 65535),
    "headersmall": (94, "<H", 1),
    "version": (25, "<B", 9),
    "major": (24, "<B", 7),
    "scalezero": (131, "<d", 0.0),
    "scalenan": (131, "<d", float("nan")),
    "scalehuge": (131, "<d", 1e300),
    "offsetnan": (155, "<d", float("inf")),
    "offsetbig": (155, "<d", 1e300),
    "boundsnan": (179, "<d", float("nan")),
    "evlrs": (243, "<I", 2**32 - 1),
}


def _las(files: dict[str, bytes]) -> Iterator[Case]:
    for name in ("plain.las", "layered.laz", "tree.copc.laz", "pointwise.laz", "old.las"):
        raw, stem = files[name], Path(name).stem
        for edit, (offset, form, value) in LAS_EDITS.items():
            damaged = bytearray(raw)
            struct.pack_into(form, damaged, offset, value)
            yield f"{stem}-head-{edit}{Path(name).suffix}", bytes(damaged)
        if name.endswith(".laz"):
            yield from _laz(stem, raw)


def _laz(stem: str, raw: bytes) -> Iterator[Case]:
    start = struct.unpack_from("<I", raw, 96)[0]
    table = struct.unpack_from("<q", raw, start)[0]
    for value in (-1, 0, 2**62, len(raw), start + 9, len(raw) - 9):
        yield f"{stem}-table{value}.laz", raw[:start] + struct.pack("<q", value) + raw[start + 8 :]
    for value in (0, 2, 1000, 2**32 - 1):
        yield f"{stem}-chunks{value}.laz", raw[: table + 4] + struct.pack("<I", value) + raw[table + 8 :]
    vlr = raw.index(b"laszip encoded") - 2 + 54
    for offset, form, value in (
        (12, "<I", 0),
        (12, "<I", 1),
        (12, "<I", 2**32 - 2),
        (0, "<H", 1),
        (0, "<H", 9),
        (32, "<H", 900),
        (36, "<H", 9),
    ):
        damaged = bytearray(raw)
        struct.pack_into(form, damaged, vlr + offset, value)
        yield f"{stem}-laszip{offset}-{value}.laz", bytes(damaged)
    for index in range(8):
        yield f"{stem}-body{index}.laz", raw[: start + 40] + bytes([index * 36]) * 100 + raw[start + 140 :]


TEXT_EDITS: dict[str, list[tuple[str, bytes, bytes]]] = {
    "ply": [
        ("many", rb"element vertex 300", b"element vertex 999999999999999999"),
        ("overflow", rb"element vertex 300", b"element vertex 99999999999999999999999"),
        ("more", rb"element vertex 300", b"element vertex 301"),
        ("none", rb"element vertex 300", b"element vertex 0"),
        ("negative", rb"element vertex 300", b"element vertex -3"),
        ("format", rb"format \w+", b"format strange"),
        ("otherformat", rb"format \w+", b"format ascii"),
        ("type", rb"property float x", b"property complex x"),
        ("gone", rb"property float x", b"property float q"),
        ("twice", rb"property float y", b"property float x"),
        ("list", rb"property float nx", b"property list uchar int nx"),
        ("orphan", rb"element vertex 300\n", b""),
        ("before", rb"element vertex 300", b"element a 99999999999\nproperty float b\nelement vertex 300"),
        ("empty", rb"element vertex 300", b"element a 999999999999\nelement vertex 300"),
        ("noend", rb"end_header", b"comment"),
    ],
    "pcd": [
        ("many", rb"(WIDTH|POINTS) 300", rb"\1 999999999999999999"),
        ("more", rb"(WIDTH|POINTS) 300", rb"\1 301"),
        ("none", rb"(WIDTH|POINTS) 300", rb"\1 0"),
        ("unlike", rb"WIDTH 300", b"WIDTH 200"),
        ("nopoints", rb"POINTS 300\n", b""),
        ("sizes", rb"SIZE 4 4", b"SIZE 3 4"),
        ("fewsizes", rb"SIZE 4 4", b"SIZE 4"),
        ("count", rb"COUNT 1 1 1 1 1", b"COUNT 1 1 1 1 99999999999"),
        ("type", rb"TYPE F F", b"TYPE U F"),
        ("fields", rb"FIELDS x y z", b"FIELDS a b c"),
        ("twice", rb"FIELDS x y z", b"FIELDS x y x"),
        ("data", rb"DATA \w+", b"DATA zipped"),
        ("otherdata", rb"DATA \w+", b"DATA binary_compressed"),
        ("ascii", rb"DATA \w+", b"DATA ascii"),
        ("viewpoint", rb"VIEWPOINT [^\n]*", b"VIEWPOINT 0 0 nan 1 0 0 0"),
        ("viewshort", rb"VIEWPOINT [^\n]*", b"VIEWPOINT 1"),
    ],
    "pts": [
        ("many", rb"^300", b"99999999999999"),
        ("overflow", rb"^300", b"9" * 40),
        ("more", rb"^300", b"301"),
        ("fewer", rb"^300", b"299"),
        ("zero", rb"^300", b"0"),
        ("negative", rb"^300", b"-300"),
        ("word", rb"\n[-0-9.]+ ", b"\nhello "),
        ("nan", rb"\n[-0-9.]+ ", b"\nnan "),
        ("huge", rb"\n[-0-9.]+ ", b"\n1e308 "),
        ("columns", rb" [0-9]+\n", b"\n"),
        ("binary", rb"\n[-0-9.]+ ", b"\n\x00\x01 "),
    ],
    "ptx": [
        ("many", rb"^20\n15", b"2000000000\n2000000000"),
        ("overflow", rb"^20\n15", b"9" * 40 + b"\n15"),
        ("more", rb"^20\n15", b"20\n16"),
        ("fewer", rb"^20\n15", b"20\n14"),
        ("zero", rb"^20\n15", b"0\n15"),
        ("matrix", rb"1\.0 0\.0 0\.0 0\.0", b"nan 0.0 0.0 0.0"),
        ("matrixzero", rb"1\.0 0\.0 0\.0 0\.0", b"0.0 0.0 0.0 0.0"),
        ("matrixword", rb"1\.0 0\.0 0\.0 0\.0", b"a b c d"),
        ("matrixshort", rb"1\.0 0\.0 0\.0 0\.0\n", b""),
    ],
    "xyz": [
        ("words", rb"\n[-0-9.]+ ", b"\nabc "),
        ("long", rb"\n", b" "),
        ("nan", rb"\n[-0-9.]+ ", b"\nnan "),
        ("huge", rb"\n[-0-9.]+ ", b"\n1e308 "),
        ("exponent", rb"\n[-0-9.]+ ", b"\n1e99999999999999 "),
        ("digits", rb"\n[-0-9.]+ ", b"\n" + b"1234567890" * 30 + b" "),
        ("two", rb"\n([-0-9.]+) [^\n]*", rb"\n\1 \1"),
        ("blank", rb"[0-9]", b" "),
        ("high", rb"\n([-0-9.]+) ", b"\n\\1\xff\xfe "),
    ],
}


def _headers_of_text(files: dict[str, bytes]) -> Iterator[Case]:
    for name, raw in files.items():
        for edit, pattern, by in TEXT_EDITS.get(Path(name).suffix[1:], []):
            damaged = re.sub(pattern, by, raw)
            if damaged != raw:
                yield f"{Path(name).stem}-edit-{edit}{Path(name).suffix}", damaged
    raw = files["binary_compressed.pcd"]
    start = raw.index(b"DATA binary_compressed\n") + 23
    for packed, unpacked in ((2**32 - 1, 6000), (10, 6000), (500, 2**32 - 1), (0, 0)):
        yield f"lzf-{packed}-{unpacked}.pcd", raw[:start] + struct.pack("<II", packed, unpacked) + raw[start + 8 :]
    for index, byte in enumerate((0x00, 0x1F, 0x20, 0xE0, 0xFF)):
        yield f"lzf-body{index}.pcd", raw[: start + 8] + bytes([byte]) * (len(raw) - start - 8)


def _odd_values() -> Iterator[Case]:
    nothing = "".join("nan nan nan\n" for _ in range(50))
    yield "onlynan.xyz", nothing.encode()
    yield "onlynan.pts", b"50\n" + nothing.encode()
    yield "same.xyz", b"1 2 3\n" * 100
    yield "one.xyz", b"1 2 3"
    yield "huge.xyz", b"1e300 2 3\n1 2 3\n-1e300 0 0\n" * 20
    yield "far.xyz", b"1e14 1e14 1e14\n" * 20
    yield "line.xyz", b"1 " * 200_000
    yield "novalue.xyz", b"\n" * 5000
    yield "comments.xyz", b"# nothing here\n" * 500
    yield "zeros.e57", bytes(4096)
    yield "noise.las", np.random.default_rng(0).bytes(5000)
    yield "noise.txt", np.random.default_rng(1).bytes(5000)
    yield "letters.csv", b"a,b,c\nd,e,f\n" * 100
    yield "onlyhead.csv", b"x,y,z\n"
    yield "signature.e57", b"ASTM-E57"
    yield "signature.las", b"LASF"
    yield "signature.ply", b"ply\n"
    yield "signature.pcd", b"# .PCD v0.7\n"


def write_cases(folder: Path, flips: int, wanted: Callable[[str], bool] = lambda _: True) -> int:
    """Writes good files into ``folder/good`` and all cases into ``folder``; their number."""
    (folder / "good").mkdir(parents=True)
    count = 0
    for name, content in cases(good_files(folder / "good"), flips):
        if wanted(name):
            path = folder / name
            if path.exists():
                raise ValueError(f"two cases are named {name}")
            path.write_bytes(content)
            count += 1
    return count
