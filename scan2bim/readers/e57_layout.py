"""What the records of one E57 scan hold and how to read them: coordinates, invalid states, colour, intensity."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scan2bim.errors import DamagedFileError
from scan2bim.readers.e57_file import Section

libe57: Any = importlib.import_module("pye57.libe57")
"""The binding, which has no types."""

CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
COLOURS = ("colorRed", "colorGreen", "colorBlue")
EXACT = 53
"""Bits of the whole numbers that float64 holds exactly."""
Node = Any
"""A libE57 node: the binding has no types."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The values that stand for 0 and 1 of an attribute."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Packing:
    """How the values of a field lie in its stream: floats of 32 or 64 ``bits``, else whole numbers less ``low``, and
    the value is ``scale`` times the number plus ``offset``.
    """

    bits: int
    real: bool
    low: int = 0
    scale: float = 1.0
    offset: float = 0.0

    @property
    def fits_byte(self) -> bool:
        """Whether every value that the bits can hold is a whole number of 0 to 255."""
        whole = not self.real and self.scale == 1.0 and self.offset == 0.0
        return whole and self.low >= 0 and self.low + (1 << self.bits) <= 256


@dataclass(frozen=True, slots=True)
class Layout:
    """How to read a scan's records.

    axes: the three coordinate fields. dtype: of the coordinates, "f4" where the file has single floats, else "f8".
    invalid: the field of
    the invalid state. colour: limits of red, green, blue, with ``colour_dtype`` of the buffers. bits: of a record, at
    least. packings: of all fields by name, in the order of their streams; None where some are packed unusually.
    """

    axes: tuple[str, str, str]
    dtype: str
    invalid: str | None
    colour: tuple[Limits, Limits, Limits] | None
    colour_dtype: str
    intensity: Limits | None
    bits: int
    packings: Mapping[str, Packing] | None

    @property
    def spherical(self) -> bool:
        """Whether the coordinates are range, azimuth and elevation."""
        return self.axes == SPHERICAL


@dataclass(frozen=True, slots=True)
class Records:
    """Where the records of a scan lie in its file, and how to read them."""

    section: Section
    layout: Layout


def scan_layout(path: Path, index: int, scan: Node) -> Layout:
    """The layout of a scan. Raises DamagedFileError where it has no coordinates."""
    fields = _fields(prototype(scan))
    axes = next((axes for axes in (CARTESIAN, SPHERICAL) if all(axis in fields for axis in axes)), None)
    if axes is None:
        raise DamagedFileError(
            path, f"scan {index} has no coordinates, only {', '.join(fields) or 'nothing'}.", "Export it again."
        )
    state = "cartesianInvalidState" if axes is CARTESIAN else "sphericalInvalidState"
    colours = [fields[name] for name in COLOURS if name in fields]
    limits = [_colour_limits(scan, name, fields[name]) for name in COLOURS if name in fields]
    return Layout(
        axes,
        "f4" if axes is CARTESIAN and all(_is_single(fields[axis]) for axis in axes) else "f8",
        state if state in fields else None,
        (limits[0], limits[1], limits[2]) if len(limits) == 3 else None,
        "u1" if all(_is_byte(node) for node in colours) else "f8",
        _intensity_limits(scan, fields["intensity"]) if "intensity" in fields else None,
        sum(_bits(node) for node in fields.values()),
        _packings(scan),
    )


def prototype(scan: Node) -> Node:
    """The structure that describes one record of a scan."""
    return libe57.StructureNode(scan["points"].prototype())


def _fields(prototype: Node) -> dict[str, Node]:
    """Numeric fields of the standard by name; nested ones and those of extensions are left out."""
    nodes = [prototype[index] for index in range(prototype.childCount())]
    numeric = (libe57.FloatNode, libe57.IntegerNode, libe57.ScaledIntegerNode)
    return {node.elementName(): node for node in nodes if isinstance(node, numeric)}


def number(node: Node, *names: str) -> float | None:
    """The finite number at a path of child names, or None where there is none."""
    for name in names:
        if not isinstance(node, libe57.StructureNode) or not node.isDefined(name):
            return None
        node = node[name]
    value = _value(node)
    return value if value is not None and math.isfinite(value) else None


def text(node: Node, name: str) -> str:
    """The string child of that name, or an empty one."""
    if not node.isDefined(name) or not isinstance(node[name], libe57.StringNode):
        return ""
    return str(node[name].value()).strip()


def _value(node: Node) -> float | None:
    if isinstance(node, libe57.ScaledIntegerNode):
        return float(node.scaledValue())
    if isinstance(node, libe57.FloatNode | libe57.IntegerNode):
        return float(node.value())
    return None


def declared_range(node: Node) -> Limits | None:
    """The range that a field's prototype declares, None where it declares none (the whole range of the type)."""
    if isinstance(node, libe57.ScaledIntegerNode):
        low, high = float(node.scaledMinimum()), float(node.scaledMaximum())
    else:
        low, high = float(node.minimum()), float(node.maximum())
    if not (math.isfinite(low) and math.isfinite(high)) or max(abs(low), abs(high)) > 1e9 or high <= low:
        return None
    return Limits(low, high)


def _colour_limits(scan: Node, name: str, node: Node) -> Limits:
    stated = _stated_limits(scan, "colorLimits", name, node)
    return stated or declared_range(node) or (Limits(0, 1) if isinstance(node, libe57.FloatNode) else Limits(0, 255))


def _intensity_limits(scan: Node, node: Node) -> Limits:
    return _stated_limits(scan, "intensityLimits", "intensity", node) or declared_range(node) or Limits(0, 1)


def _stated_limits(scan: Node, group: str, name: str, node: Node) -> Limits | None:
    """The scan's own limits of a field, unless they are empty or wider than the field (some writers' slip)."""
    low, high = number(scan, group, f"{name}Minimum"), number(scan, group, f"{name}Maximum")
    if low is None or high is None or high <= low:
        return None
    declared = declared_range(node)
    whole = isinstance(node, libe57.IntegerNode)
    return None if whole and declared is not None and high > declared.high + 1 else Limits(low, high)


def _is_single(node: Node) -> bool:
    return isinstance(node, libe57.FloatNode) and node.precision() == libe57.E57_SINGLE


def _is_byte(node: Node) -> bool:
    return isinstance(node, libe57.IntegerNode) and node.minimum() >= 0 and node.maximum() <= 255


def _bits(node: Node) -> int:
    if isinstance(node, libe57.FloatNode):
        return 32 if node.precision() == libe57.E57_SINGLE else 64
    return max(int(node.maximum()) - int(node.minimum()), 0).bit_length()


def _packings(scan: Node) -> dict[str, Packing] | None:
    """How all fields of a scan's records are packed, None if one is packed unusually."""
    records = prototype(scan)
    nodes = [records[index] for index in range(records.childCount())]
    found = {node.elementName(): packing for node in nodes if (packing := _packing(node)) is not None}
    return found if len(found) == len(nodes) else None


def _packing(node: Node) -> Packing | None:
    if isinstance(node, libe57.FloatNode):
        return Packing(32 if node.precision() == libe57.E57_SINGLE else 64, True)
    if not isinstance(node, libe57.IntegerNode | libe57.ScaledIntegerNode):
        return None
    low, high = node.minimum(), node.maximum()
    if not (-(1 << EXACT) < low <= high < 1 << EXACT):
        return None
    bits = (high - low).bit_length()
    if isinstance(node, libe57.IntegerNode):
        return Packing(bits, False, low)
    return Packing(bits, False, low, node.scale(), node.offset())


@dataclass(slots=True, eq=False)
class Buffers:
    """Arrays that a reader fills, ``capacity`` records at a time.

    xyz (capacity, 3); rgb (capacity, 3) or None; intensity (capacity,) float32 or None; state (capacity,) uint8 or
    None.
    """

    xyz: np.ndarray[Any, np.dtype[Any]]
    rgb: np.ndarray[Any, np.dtype[Any]] | None
    intensity: np.ndarray[Any, np.dtype[np.float32]] | None
    state: np.ndarray[Any, np.dtype[np.uint8]] | None


def make_buffers(layout: Layout, capacity: int) -> Buffers:
    """Buffers for a layout."""
    return Buffers(
        np.zeros((capacity, 3), layout.dtype),
        np.zeros((capacity, 3), layout.colour_dtype) if layout.colour else None,
        np.zeros(capacity, "f4") if layout.intensity else None,
        np.zeros(capacity, "u1") if layout.invalid else None,
    )


def named_columns(layout: Layout, buffers: Buffers) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """The column of the buffers (capacity,) that each wanted field goes to, by the field's name."""
    columns = {name: buffers.xyz[:, column] for column, name in enumerate(layout.axes)}
    if buffers.rgb is not None:
        columns |= {name: buffers.rgb[:, column] for column, name in enumerate(COLOURS)}
    if buffers.intensity is not None:
        columns["intensity"] = buffers.intensity
    if layout.invalid and buffers.state is not None:
        columns[layout.invalid] = buffers.state
    return columns
