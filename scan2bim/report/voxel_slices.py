"""Level slices through the labelled voxels of each storey, with a legend: ``.voxels.png``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from scan2bim.errors import UsageError
from scan2bim.model.elements import Building
from scan2bim.model.voxels import Label, VoxelGrid, VoxelSource
from scan2bim.report.palette import INK
from scan2bim.report.raster import encode_png, sheet_image
from scan2bim.report.sheet import Mark, Picture, Rgb, Shape, Sheet, Text

ONLY_BY_NAME: Final = True
"""Rays are cast for it: a folder of all formats does not get this one."""
COLOURS: Final[dict[Label, Rgb]] = {
    Label.NONE: (255, 255, 255),
    Label.CLUTTER: (235, 140, 0),
    Label.STRUCTURE: (62, 64, 72),
    Label.OUTLIER: (150, 60, 170),
    Label.OCCLUDED_CLUTTER: (250, 196, 190),
    Label.OCCLUDED_STRUCTURE: (220, 30, 40),
    Label.EMPTY: (214, 234, 248),
    Label.OPENING: (30, 160, 90),
}
HEIGHTS: Final = (0.35, 1.25, 2.15)
"""Metres over the storey's lowest floor at which it is cut: through furniture, through windows, over most furniture."""
WIDTH: Final = 620
"""Pixels of a slice, at most."""
MOST: Final = 8
"""Pixels of a voxel, at most."""
GAP: Final = 30


def export(building: Building, path: Path, voxels: VoxelSource | None) -> tuple[str, ...]:
    """Write the slices of all storeys as one picture. Raises UsageError without scans, OSError."""
    if voxels is None:
        raise UsageError(f"{path.name}: labelled voxels need the scans. Convert from them, not from a model.")
    marks: list[Mark] = []
    top, width = GAP, 4 * GAP + 780
    for grid in voxels(building):
        right, top = _draw_storey(grid, top, marks)
        width = max(width, right)
    legend = top
    for place, label in enumerate(label for label in Label if label != Label.NONE):
        x, y = GAP + 210 * (place % 4), legend + 26 * (place // 4)
        marks.append(_box(x, y, COLOURS[label]))
        marks.append(Text(x + 26, y + 13, label.words, 15, INK))
    path.write_bytes(encode_png(sheet_image(Sheet(width, legend + 52 + GAP, tuple(marks)))))
    return ()


def _draw_storey(grid: VoxelGrid, top: int, marks: list[Mark]) -> tuple[int, int]:
    """Add the slices of a storey below ``top``; gives the right end and the lower end, pixels."""
    rows, cols = _used(grid)
    scale = max(1, min(MOST, WIDTH // max(1, cols.stop - cols.start)))
    colours = np.array([COLOURS[label] for label in Label], np.uint8)
    marks.append(Text(GAP, top + 14, grid.name, 17, INK, bold=True))
    x, y = GAP, top + 50
    for height in HEIGHTS:
        layer = grid.layer_at(grid.origin[2] + grid.size / 2 + height)
        marks.append(Text(x, y - 8, f"{height:.2f} m over the floor", 13, INK))
        pixels = colours[grid.labels[layer, rows, cols][::-1]]
        matrix = np.array([[scale, 0.0, x], [0.0, scale, y]], np.float64)
        marks.append(Picture(np.ascontiguousarray(pixels), matrix))
        x += scale * pixels.shape[1] + GAP
    return x, y + scale * (rows.stop - rows.start) + GAP


def _used(grid: VoxelGrid) -> tuple[slice, slice]:
    """Rows and columns that hold labels other than outliers, and a few round them."""
    held = ((grid.labels != Label.NONE) & (grid.labels != Label.OUTLIER)).any(0)
    out: list[slice] = []
    for axis, count in ((1, held.shape[0]), (0, held.shape[1])):
        at = np.flatnonzero(held.any(axis))
        low, high = (int(at[0]), int(at[-1])) if len(at) else (0, count - 1)
        out.append(slice(max(0, low - 5), min(count, high + 6)))
    return out[0], out[1]


def _box(x: int, y: int, colour: Rgb) -> Shape:
    ring = np.array([[x, y], [x + 18, y], [x + 18, y + 16], [x, y + 16]], np.float64)
    return Shape((ring,), colour, INK)
