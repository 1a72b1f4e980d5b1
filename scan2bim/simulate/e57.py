"""Write sweeps as E57: one scan with its pose, rows and columns, colour, intensity, and the directions of misses."""

from __future__ import annotations

import importlib
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scan2bim.simulate.scanner import Sweep

RESOLUTION = 0.0005
"""Of stored coordinates, metres: a quarter of the usual range noise."""
MISS_LENGTH = 8.0
"""Length at which the direction of a miss is stored, metres: within indoor coordinates' bounds, 0.06 mrad fine."""
NAMESPACE = uuid.UUID("8d1f4f5e-55a0-5c27-9d3e-2f8a6d0c1b47")
"""Of the scans' identifiers, so that the same sweep makes the same file."""


@dataclass(frozen=True, slots=True)
class Field:
    """A column of the point records: whole numbers between bounds, times ``scale`` where that is not None."""

    name: str
    values: NDArray[np.int32]
    low: int
    high: int
    scale: float | None = None


def write_e57(path: Path, sweeps: list[Sweep]) -> None:
    """Write one E57 file with a scan for each sweep. Coordinates are scaled whole numbers of 0.5 mm."""
    libe57: Any = importlib.import_module("pye57.libe57")
    image = libe57.ImageFile(str(path), "w")
    try:
        scans = _root(libe57, image, path.name)
        for sweep in sweeps:
            _scan(libe57, image, scans, sweep)
    finally:
        image.close()


def _root(lib: Any, image: Any, name: str) -> Any:
    image.extensionsAdd("", lib.E57_V1_0_URI)
    root = image.root()
    for key, text in (("formatName", "ASTM E57 3D Imaging Data File"), ("guid", _guid(name))):
        root.set(key, lib.StringNode(image, text))
    root.set("versionMajor", lib.IntegerNode(image, lib.E57_FORMAT_MAJOR))
    root.set("versionMinor", lib.IntegerNode(image, lib.E57_FORMAT_MINOR))
    root.set("e57LibraryVersion", lib.StringNode(image, lib.E57_LIBRARY_ID))
    root.set("coordinateMetadata", lib.StringNode(image, ""))
    scans = lib.VectorNode(image, True)
    root.set("data3D", scans)
    root.set("images2D", lib.VectorNode(image, True))
    return scans


def _guid(name: str) -> str:
    return "{" + str(uuid.uuid5(NAMESPACE, name)) + "}"


def _scan(lib: Any, image: Any, scans: Any, sweep: Sweep) -> None:
    fields = _fields(sweep)
    node = lib.StructureNode(image)
    node.set("guid", lib.StringNode(image, _guid(sweep.name)))
    node.set("name", lib.StringNode(image, sweep.name))
    node.set("description", lib.StringNode(image, "simulated by scan2bim"))
    node.set("indexBounds", _index_bounds(lib, image, sweep))
    node.set("intensityLimits", _numbers(lib, image, {"intensityMinimum": 0, "intensityMaximum": 255}))
    colours = {f"color{c}{m}": v for c in ("Red", "Green", "Blue") for m, v in (("Minimum", 0), ("Maximum", 255))}
    node.set("colorLimits", _numbers(lib, image, colours))
    node.set("cartesianBounds", _bounds(lib, image, sweep))
    node.set("pose", _pose(lib, image, sweep))
    prototype = lib.StructureNode(image)
    for field in fields:
        prototype.set(field.name, _column(lib, image, field))
    points = lib.CompressedVectorNode(image, prototype, lib.VectorNode(image, True))
    node.set("points", points)
    scans.append(node)
    _records(lib, image, points, fields)


def _fields(sweep: Sweep) -> list[Field]:
    hits, misses = len(sweep.xyz), len(sweep.miss_directions)
    xyz = np.concatenate([sweep.xyz, sweep.miss_directions * MISS_LENGTH])
    steps = np.round(xyz / RESOLUTION).astype(np.int32)
    rows = np.concatenate([sweep.row, sweep.miss_row])
    columns = np.concatenate([sweep.column, sweep.miss_column])
    order = np.lexsort((rows, columns))
    rgb = np.concatenate([sweep.rgb, np.zeros((misses, 3), dtype=np.uint8)]).astype(np.int32)
    intensity = np.concatenate([np.round(sweep.intensity * 255), np.zeros(misses)]).astype(np.int32)
    state = np.repeat(np.array([0, 1], dtype=np.int32), [hits, misses])
    axes = [
        Field(f"cartesian{a}", steps[order, i], int(steps[:, i].min()), int(steps[:, i].max()), RESOLUTION)
        for i, a in enumerate("XYZ")
    ]
    colours = [
        Field(f"color{c}", np.ascontiguousarray(rgb[order, i]), 0, 255) for i, c in enumerate(("Red", "Green", "Blue"))
    ]
    return [
        *(Field(f.name, np.ascontiguousarray(f.values), f.low, f.high, f.scale) for f in axes),
        Field("cartesianInvalidState", state[order], 0, 2),
        *colours,
        Field("intensity", intensity[order], 0, 255),
        Field("rowIndex", rows[order], 0, int(rows.max())),
        Field("columnIndex", columns[order], 0, int(columns.max())),
    ]


def _column(lib: Any, image: Any, field: Field) -> Any:
    start = max(field.low, min(0, field.high))
    if field.scale is None:
        return lib.IntegerNode(image, start, field.low, field.high)
    return lib.ScaledIntegerNode(image, start, field.low, field.high, field.scale, 0.0)


def _index_bounds(lib: Any, image: Any, sweep: Sweep) -> Any:
    rows, columns = np.concatenate([sweep.row, sweep.miss_row]), np.concatenate([sweep.column, sweep.miss_column])
    bounds = {"rowMinimum": 0, "rowMaximum": int(rows.max()), "columnMinimum": 0, "columnMaximum": int(columns.max())}
    return _numbers(lib, image, {**bounds, "returnMinimum": 0, "returnMaximum": 0})


def _bounds(lib: Any, image: Any, sweep: Sweep) -> Any:
    """In the file's common frame, as most writers state them."""
    world = sweep.world()
    ends = zip("xyz", world.min(axis=0), world.max(axis=0), strict=True)
    return _numbers(
        lib, image, {f"{a}{m}imum": float(v) for a, low, high in ends for m, v in (("Min", low), ("Max", high))}
    )


def _pose(lib: Any, image: Any, sweep: Sweep) -> Any:
    x, y, z, w = (float(q) for q in Rotation.from_matrix(sweep.rotation).as_quat())
    pose = lib.StructureNode(image)
    pose.set("rotation", _numbers(lib, image, {"w": w, "x": x, "y": y, "z": z}))
    pose.set("translation", _numbers(lib, image, dict(zip("xyz", map(float, sweep.translation), strict=True))))
    return pose


def _numbers(lib: Any, image: Any, values: dict[str, int] | dict[str, float]) -> Any:
    node = lib.StructureNode(image)
    for key, value in values.items():
        node.set(key, lib.IntegerNode(image, value) if isinstance(value, int) else lib.FloatNode(image, value))
    return node


def _records(lib: Any, image: Any, points: Any, fields: list[Field]) -> None:
    buffers = lib.VectorSourceDestBuffer()
    kept = [f.values.astype(np.float64) * (1.0 if f.scale is None else f.scale) for f in fields]
    for field, values in zip(fields, kept, strict=True):
        buffers.append(lib.SourceDestBuffer(image, field.name, values, len(values), True, True))
    writer = points.writer(buffers)
    writer.write(len(kept[0]))
    writer.close()
