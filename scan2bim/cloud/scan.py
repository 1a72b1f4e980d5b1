"""What a reader gives: one header per scan, then its points in chunks."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
U16 = NDArray[np.uint16]

CHUNK_POINTS = 1 << 17
"""Points per chunk: some 5 MB with colour, so that it stays near the processor, and large beside the cost of a call."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Rigid motion from a scanner's frame to the file's common frame: ``rotation @ p + translation``.

    rotation (3, 3) float64; translation (3,) float64 in the file's unit.
    """

    rotation: F64
    translation: F64


@dataclass(frozen=True, slots=True, eq=False)
class ScanHeader:
    """What a file says of one scan before its points are read.

    ``path`` and ``index`` name the scan (its place in the file). ``points`` is the number of records, hits and misses
    alike. ``origin`` (3,) float64 is taken off the coordinates of every chunk, so that float32 keeps its digits.
    ``pose`` is None where the file holds none: then the scanner's position is unknown. ``lower`` and ``upper`` (3,)
    float64 bound the points in the *file's common frame* (pose applied) where the file states it. ``unit`` is metres
    per file unit where the file states it, ``crs`` its coordinate reference system. ``columns`` and ``rows`` are those
    of a structured scan. ``sources`` lists the point source ids of a LAS file that holds several stations, in rising
    order.
    """

    path: Path
    index: int
    name: str
    points: int
    origin: F64
    pose: Pose | None = None
    lower: F64 | None = None
    upper: F64 | None = None
    has_colour: bool = False
    has_intensity: bool = False
    columns: int | None = None
    rows: int | None = None
    unit: float | None = None
    crs: str | None = None
    sources: tuple[int, ...] = ()
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """Some points of one scan, in the order of the file, invalid and non-finite ones already left out.

    ``xyz`` (n, 3) float32 or float64, C-contiguous, in the scanner's frame less the header's ``origin``, in the file's
    unit: a point in the file's common frame is ``pose.rotation @ (origin + xyz) + pose.translation``. ``rgb`` (n, 3)
    uint8, stretched to 0-255 by the file's colour limits, or None. ``intensity`` (n,) float32 in 0-1 by the file's
    limits, or None. ``source`` (n,) uint16 point source id, only where the header lists ``sources``. ``misses`` (m, 3)
    float32 unit directions in the scanner's frame along which a pulse was sent and nothing came back (E57 invalidState
    1), or None. ``dropped`` counts the records left out because they were invalid or not finite.
    """

    xyz: F32 | F64
    rgb: U8 | None = None
    intensity: F32 | None = None
    source: U16 | None = None
    misses: F32 | None = None
    dropped: int = 0

    def __post_init__(self) -> None:
        n = len(self.xyz)
        if self.xyz.shape != (n, 3) or (self.rgb is not None and self.rgb.shape != (n, 3)):
            raise ValueError(
                f"xyz and rgb must be (n, 3), are {self.xyz.shape} and {None if self.rgb is None else self.rgb.shape}"
            )
        for name, values in (("intensity", self.intensity), ("source", self.source)):
            if values is not None and values.shape != (n,):
                raise ValueError(f"{name} must be ({n},), is {values.shape}")
