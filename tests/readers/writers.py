"""Small files of every format and variant, written by independent libraries where there are any."""

from __future__ import annotations

import importlib
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

libe57: Any = importlib.import_module("pye57.libe57")
pye57: Any = importlib.import_module("pye57")
laspy: Any = importlib.import_module("laspy")


@dataclass(frozen=True, eq=False)
class Cloud:
    """Exact binary fractions, so that every format keeps them: xyz (n, 3), rgb (n, 3), intensity (n,) in 0-1."""

    xyz: np.ndarray
    rgb: np.ndarray
    intensity: np.ndarray


def cloud(count: int = 500, shift: tuple[float, float, float] = (0, 0, 0), seed: int = 7) -> Cloud:
    rng = np.random.default_rng(seed)
    xyz = rng.integers(-5 * 256, 5 * 256, (count, 3)) / 256 + np.array(shift)
    return Cloud(xyz, rng.integers(0, 256, (count, 3)).astype(np.uint8), rng.integers(0, 256, count) / 255)


# --- E57 -------------------------------------------------------------------------------------------------------------


@dataclass
class E57Scan:
    """One scan as it is to be written: (field name, prototype node maker, values), name, pose and limits."""

    fields: list[tuple[str, Callable[[Any], Any], np.ndarray]]
    name: str = "scan"
    rotation: tuple[float, float, float, float] | None = None
    translation: tuple[float, float, float] | None = None
    limits: dict[str, dict[str, float]] = field(default_factory=dict)


def real(single: bool = False, low: float | None = None, high: float | None = None) -> Callable[[Any], Any]:
    precision = libe57.E57_SINGLE if single else libe57.E57_DOUBLE
    most = libe57.E57_FLOAT_MAX if single else libe57.E57_DOUBLE_MAX
    return lambda image: libe57.FloatNode(
        image, 0.0 if low is None else low, precision, -most if low is None else low, most if high is None else high
    )


def whole(low: int, high: int) -> Callable[[Any], Any]:
    return lambda image: libe57.IntegerNode(image, low, low, high)


def scaled(low: int, high: int, scale: float, offset: float = 0.0) -> Callable[[Any], Any]:
    return lambda image: libe57.ScaledIntegerNode(image, low, low, high, scale, offset)


def write_e57(path: Path, scans: list[E57Scan], metadata: str = "", extension: bool = False) -> Path:
    image = libe57.ImageFile(str(path), "w")
    image.extensionsAdd("", libe57.E57_V1_0_URI)
    if extension:
        image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
    root = image.root()
    root.set("formatName", libe57.StringNode(image, "ASTM E57 3D Imaging Data File"))
    root.set("guid", libe57.StringNode(image, "{file}"))
    root.set("versionMajor", libe57.IntegerNode(image, 1))
    root.set("versionMinor", libe57.IntegerNode(image, 0))
    root.set("coordinateMetadata", libe57.StringNode(image, metadata))
    data = libe57.VectorNode(image, True)
    root.set("data3D", data)
    root.set("images2D", libe57.VectorNode(image, True))
    for index, scan in enumerate(scans):
        _write_scan(image, data, scan, index)
    image.close()
    return path


def _write_scan(image: Any, data: Any, scan: E57Scan, index: int) -> None:
    node = libe57.StructureNode(image)
    node.set("guid", libe57.StringNode(image, f"{{scan{index}}}"))
    node.set("name", libe57.StringNode(image, scan.name))
    for group, values in scan.limits.items():
        child = libe57.StructureNode(image)
        for name, value in values.items():
            child.set(name, _number(image, value))
        node.set(group, child)
    if scan.rotation is not None or scan.translation is not None:
        node.set("pose", _pose(image, scan))
    prototype = libe57.StructureNode(image)
    for name, maker, _ in scan.fields:
        prototype.set(name, maker(image))
    points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
    node.set("points", points)
    data.append(node)
    _write_points(image, points, scan)


def _number(image: Any, value: float) -> Any:
    return libe57.IntegerNode(image, value) if isinstance(value, int) else libe57.FloatNode(image, value)


def _pose(image: Any, scan: E57Scan) -> Any:
    pose = libe57.StructureNode(image)
    for name, axes, values in (("rotation", "wxyz", scan.rotation), ("translation", "xyz", scan.translation)):
        if values is not None:
            child = libe57.StructureNode(image)
            for axis, value in zip(axes, values, strict=True):
                child.set(axis, libe57.FloatNode(image, float(value)))
            pose.set(name, child)
    return pose


def _write_points(image: Any, points: Any, scan: E57Scan) -> None:
    count = len(scan.fields[0][2])
    if count == 0:
        return
    buffers = libe57.VectorSourceDestBuffer()
    arrays = [np.ascontiguousarray(values) for _, _, values in scan.fields]
    for (name, _, _), array in zip(scan.fields, arrays, strict=True):
        buffers.append(libe57.SourceDestBuffer(image, name, array, count, True, True))
    writer = points.writer(buffers)
    writer.write(count)
    writer.close()


def e57_scan(points: Cloud, **more: Any) -> E57Scan:
    """Cartesian doubles, byte colours, intensity in 0-1."""
    fields = [
        (f"cartesian{axis}", real(), points.xyz[:, column].astype(np.float64)) for column, axis in enumerate("XYZ")
    ]
    fields += [
        (f"color{name}", whole(0, 255), points.rgb[:, column].astype(np.uint8))
        for column, name in enumerate(("Red", "Green", "Blue"))
    ]
    fields.append(("intensity", real(single=True, low=0, high=1), points.intensity.astype(np.float32)))
    return E57Scan(fields, **more)


def crc32c(data: bytes) -> int:
    crc = 0xFFFFFFFF
    for byte in data:
        crc = _CRC[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


def _crc_table() -> list[int]:
    table: list[int] = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 if value & 1 else 0)  # noqa: PLW2901
        table.append(value)
    return table


_CRC = _crc_table()


def e57_pages(raw: bytes) -> bytes:
    """The payload of an E57 file's pages."""
    return b"".join(raw[start : start + 1020] for start in range(0, len(raw), 1024))


def e57_from_pages(payload: bytes) -> bytes:
    """An E57 file of a payload, with right checksums and right length in its header."""
    payload += b"\0" * (-len(payload) % 1020)
    length = len(payload) // 1020 * 1024
    payload = payload[:16] + struct.pack("<Q", length) + payload[24:]
    pages = [payload[start : start + 1020] for start in range(0, len(payload), 1020)]
    return b"".join(page + struct.pack(">I", crc32c(page)) for page in pages)


def edit_e57_xml(raw: bytes, edit: Callable[[bytes], bytes]) -> bytes:
    """An E57 file with another XML part and checksums that are right."""
    payload = e57_pages(raw)
    offset, length = struct.unpack_from("<QQ", raw, 24)
    start = offset // 1024 * 1020 + offset % 1024
    xml = edit(payload[start : start + length])
    payload = payload[:start] + xml
    payload = payload[:32] + struct.pack("<Q", len(xml)) + payload[40:]
    return e57_from_pages(payload)


# --- LAS -------------------------------------------------------------------------------------------------------------


def write_las(
    path: Path, points: Cloud, form: int = 7, version: str = "1.4", sources: np.ndarray | None = None, **more: Any
) -> Path:
    header = laspy.LasHeader(point_format=form, version=version)
    header.scales = np.full(3, 1 / 256)
    header.offsets = np.round(points.xyz.mean(axis=0))
    for vlr in more.get("vlrs", ()):
        header.vlrs.append(vlr)
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.xyz.T
    las.intensity = np.round(points.intensity * 65535).astype(np.uint16)
    if sources is not None:
        las.point_source_id = sources
    if form in (2, 3, 5, 7, 8, 10):
        las.red, las.green, las.blue = (points.rgb.astype(np.uint16) * more.get("colour_step", 257)).T
    las.write(str(path))
    return path


# --- PLY, PCD --------------------------------------------------------------------------------------------------------

PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int", "i2": "short"}


def write_ply(
    path: Path,
    columns: list[tuple[str, str, np.ndarray]],
    encoding: str,
    before: str = "",
    tail: bytes = b"",
    head: bytes = b"",
) -> Path:
    """``columns``: (name, type, values). ``before``: elements before the vertices, their data being ``head``."""
    count = len(columns[0][2])
    lines = ["ply", f"format {encoding} 1.0", "comment made by a test"]
    lines += [line for line in before.splitlines() if line]
    lines += [f"element vertex {count}", *(f"property {PLY_TYPES[kind]} {name}" for name, kind, _ in columns)]
    if tail:
        lines += ["element face 1", "property list uchar int vertex_indices"]
    text = ("\n".join([*lines, "end_header"]) + "\n").encode()
    if encoding == "ascii":
        rows = zip(*(values.tolist() for _, _, values in columns), strict=True)
        body = "".join(" ".join(repr(value) for value in row) + "\n" for row in rows).encode()
    else:
        order = "<" if "little" in encoding else ">"
        table = np.zeros(count, [(name, order + kind) for name, kind, _ in columns])
        for name, _, values in columns:
            table[name] = values
        body = table.tobytes()
    path.write_bytes(text + head + body + tail)
    return path


def ply_columns(points: Cloud, kind: str = "f4") -> list[tuple[str, str, np.ndarray]]:
    columns = [(axis, kind, points.xyz[:, column]) for column, axis in enumerate("xyz")]
    columns += [(axis, "f4", points.xyz[:, 0] * 0) for axis in ("nx", "ny", "nz")]
    columns += [(name, "u1", points.rgb[:, column]) for column, name in enumerate(("red", "green", "blue"))]
    return columns


def lzf_literals(data: bytes) -> bytes:
    """LZF without any matching: literals only."""
    return b"".join(
        bytes([len(part) - 1]) + part for part in (data[start : start + 32] for start in range(0, len(data), 32))
    )


def lzf_runs(data: bytes) -> bytes:
    """LZF that also uses back references for runs of equal bytes."""
    out, position = bytearray(), 0
    while position < len(data):
        run = 1
        while position + run < len(data) and data[position + run] == data[position] and run < 265:
            run += 1
        if run >= 4:
            length = run - 1 - 2
            out += bytes([0, data[position]])
            out += bytes([length << 5, 0]) if length < 7 else bytes([7 << 5, length - 7, 0])
        else:
            run = 1
            out += bytes([0, data[position]])
        position += run
    return bytes(out)


def write_pcd(
    path: Path,
    fields: list[tuple[str, str, np.ndarray]],
    data: str,
    viewpoint: str = "0 0 0 1 0 0 0",
    height: int = 1,
    pack: Callable[[bytes], bytes] = lzf_runs,
) -> Path:
    count = len(fields[0][2])
    kinds = [np.dtype(kind) for _, kind, _ in fields]
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS " + " ".join(name for name, _, _ in fields),
        "SIZE " + " ".join(str(kind.itemsize) for kind in kinds),
        "TYPE " + " ".join(kind.kind.upper() for kind in kinds),
        "COUNT " + " ".join("1" for _ in fields),
        f"WIDTH {count // height}",
        f"HEIGHT {height}",
        f"VIEWPOINT {viewpoint}",
        f"POINTS {count}",
        f"DATA {data}",
    ]
    path.write_bytes(("\n".join(lines) + "\n").encode() + _pcd_body(fields, data, pack))
    return path


def _pcd_body(fields: list[tuple[str, str, np.ndarray]], data: str, pack: Callable[[bytes], bytes]) -> bytes:
    if data == "ascii":
        rows = zip(*(values.astype(kind).tolist() for _, kind, values in fields), strict=True)
        return "".join(" ".join(repr(value) for value in row) + "\n" for row in rows).encode()
    if data == "binary":
        table = np.zeros(len(fields[0][2]), [(name, kind) for name, kind, _ in fields])
        for name, _, values in fields:
            table[name] = values
        return table.tobytes()
    planes = b"".join(values.astype(kind).tobytes() for _, kind, values in fields)
    packed = pack(planes)
    return struct.pack("<II", len(packed), len(planes)) + packed


def packed_rgb(points: Cloud) -> np.ndarray:
    r, g, b = points.rgb.astype(np.uint32).T
    return (r << 16) | (g << 8) | b


def pcd_fields(points: Cloud, colour: str = "f4") -> list[tuple[str, str, np.ndarray]]:
    packed = packed_rgb(points)
    fields = [(axis, "f4", points.xyz[:, column]) for column, axis in enumerate("xyz")]
    name, values = ("rgb", packed.view(np.float32)) if colour == "f4" else ("rgba", packed)
    return [*fields, (name, colour, values), ("intensity", "f4", points.intensity)]


# --- text ------------------------------------------------------------------------------------------------------------


def text_rows(points: Cloud, separator: str = " ", what: str = "xyzirgb", decimal: str = ".") -> list[str]:
    columns: list[list[str]] = [[repr(float(value)) for value in points.xyz[:, axis]] for axis in range(3)]
    if "i" in what:
        columns.append([f"{value:.9f}" for value in points.intensity])
    if "rgb" in what:
        columns += [[str(value) for value in points.rgb[:, axis]] for axis in range(3)]
    return [separator.join(row).replace(".", decimal) for row in zip(*columns, strict=True)]


def write_text(path: Path, points: Cloud, head: str = "", end: str = "\n", **how: Any) -> Path:
    rows = text_rows(points, **how)
    path.write_bytes((head + end.join(rows) + end).encode())
    return path


def write_pts(path: Path, clouds: list[Cloud], what: str = "xyzirgb") -> Path:
    path.write_text("".join(f"{len(part.xyz)}\n" + "\n".join(text_rows(part, what=what)) + "\n" for part in clouds))
    return path


def ptx_text(points: Cloud, columns: int, rows: int, matrix: np.ndarray, position: tuple[float, float, float]) -> str:
    """``matrix`` (4, 4) for column vectors; PTX stores it transposed."""
    lines = [str(columns), str(rows), " ".join(map(repr, map(float, position)))]
    lines += [" ".join(repr(float(value)) for value in row) for row in matrix[:3, :3].T]
    lines += [" ".join(repr(float(value)) for value in row) for row in matrix.T]
    return "\n".join([*lines, *text_rows(points)]) + "\n"


def write_copc(path: Path, points: Cloud) -> Path:
    """A COPC file: LAZ with a first record of COPC and chunks of differing sizes, the hierarchy left out."""
    lazrs: Any = importlib.import_module("lazrs")
    plain = write_las(path.with_suffix(".plain.las"), points, form=7)
    raw = plain.read_bytes()
    offset, size = struct.unpack_from("<I", raw, 96)[0], struct.unpack_from("<H", raw, 105)[0]
    vlr = lazrs.LazVlr.new_for_compression(7, 0, use_variable_size_chunks=True)
    records = _vlr(b"copc", 1, bytes(160)) + _vlr(b"laszip encoded", 22204, bytes(vlr.record_data()))
    start = 375 + len(records)
    head = bytearray(raw[:375])
    struct.pack_into("<II", head, 96, start, 2)
    head[104] |= 0x80
    with path.open("wb+") as file:
        file.write(bytes(head) + records)
        compressor = lazrs.LasZipCompressor(file, vlr)
        body = np.frombuffer(raw[offset:], np.uint8).reshape(-1, size)
        for part in np.array_split(body, [100, 150]):
            compressor.compress_many(np.ascontiguousarray(part).reshape(-1))
            compressor.finish_current_chunk()
        compressor.done()
    return path


def _vlr(user: bytes, record: int, data: bytes) -> bytes:
    return struct.pack("<H16sHH32s", 0, user, record, len(data), b"") + data
