"""Pictures of each step for each face of a wall, like the founding paper's figures 2 to 5, into a folder."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.config import OpeningSettings
from scan2bim.openings.closed.find import ClosedDoor
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.orthoimage import COARSE, PIXEL, Orthoimage
from scan2bim.openings.paper.closed import PaperDoors, closed_doors_of
from scan2bim.openings.paper.rectangles import Rectangles

UNKNOWN = (200, 120, 200)
"""Colour of pixels without data."""
DEPTH_SHOWN = 0.05
"""Metres before and behind the wall's plane between which depth is drawn from blue to red."""
MOST_DRAWN = 60
"""Candidate rectangles that are drawn."""
RED, GREEN, WHITE = (40, 40, 230), (60, 200, 60), (255, 255, 255)
Picture = NDArray[np.uint8]


def draw_wall(
    folder: Path, name: str, faces: Sequence[Face], doors: Sequence[ClosedDoor], settings: OpeningSettings
) -> None:
    """Write ``name``-SIDE-STEP.png of each face: its orthoimage (colour, depth, labels), the paper's segments,
    discontinuities, lines, rectangles and doors, and the doors of the full method.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for face in faces:
        image = face.image
        steps = closed_doors_of(image, settings)
        base = _colour(image)
        pictures = {
            "1-colour": base,
            "2-depth": _depth(image),
            "3-labels": _labels(image),
            "4-patches": _patches(base, steps),
            "5-segments": _segments(steps),
            "6-gradient": _grey(steps.edges.gradient),
            "7-discontinuities": _discontinuities(steps),
            "8-lines": _lines(base, steps),
            "9-rectangles": _rectangles(base, steps.candidates),
            "10-doors-paper": _doors(base, steps.doors),
            "11-doors-full": _doors(base, [door.box for door in doors]),
        }
        for step, picture in pictures.items():
            _write(folder / f"{name}-{image.side}-{step}.png", picture)


def _write(path: Path, picture: Picture) -> None:
    """Rows of images count upwards from the floor, those of files downwards."""
    _, data = cv2.imencode(".png", np.ascontiguousarray(picture[::-1]))
    path.write_bytes(data.tobytes())


def _colour(image: Orthoimage) -> Picture:
    out = (image.rgb[..., ::-1] * 255).astype(np.uint8)
    out[~image.known] = UNKNOWN
    return out


def _depth(image: Orthoimage) -> Picture:
    share = np.clip(image.depth / (2 * DEPTH_SHOWN) + 0.5, 0, 1)
    out = np.asarray(cv2.applyColorMap((share * 255).astype(np.uint8), cv2.COLORMAP_TURBO), np.uint8)
    out[~image.known] = UNKNOWN
    return out


def _labels(image: Orthoimage) -> Picture:
    """Occupied green, opening (looked through) red, occluded blue; brighter where more stations say so."""
    planes = np.stack([image.blocked, image.on, image.through], 2).astype(np.float32)
    small = (planes / max(float(planes.max()), 1.0) * 255).astype(np.uint8)
    size = round(COARSE / PIXEL)
    rows, cols = image.depth.shape
    return small.repeat(size, 0).repeat(size, 1)[:rows, :cols]


def _patches(base: Picture, steps: PaperDoors) -> Picture:
    """Coherent patches by cluster, inconsistent ones white."""
    out = base.copy()
    for (row, col), label in zip(steps.segmentation.patches.tolist(), steps.segmentation.label.tolist(), strict=True):
        cv2.rectangle(out, (col - 2, row - 2), (col + 2, row + 2), WHITE if label < 0 else _hue(label), -1)
    return out


def _segments(steps: PaperDoors) -> Picture:
    """Segments by hue, the wall's own red."""
    segment = steps.segmentation.segment
    out = np.zeros((*segment.shape, 3), np.uint8)
    for label in range(int(segment.max()) + 1):
        out[segment == label] = RED if label == steps.segmentation.wall else _hue(label)
    return out


def _hue(label: int) -> tuple[int, int, int]:
    r, g, b = colorsys.hsv_to_rgb((0.5 + 0.26 * label) % 1.0, 0.8, 0.86)
    return int(255 * b), int(255 * g), int(255 * r)


def _grey(values: NDArray[np.float32]) -> Picture:
    top = max(float(np.percentile(values, 99.5)), 1e-6)
    return np.repeat((np.clip(values / top, 0, 1) * 255).astype(np.uint8)[..., None], 3, 2)


def _discontinuities(steps: PaperDoors) -> Picture:
    """Of colour green, of depth red, of both yellow: together J'_CD."""
    out = np.zeros((*steps.edges.colour.shape, 3), np.uint8)
    out[..., 1], out[..., 2] = steps.edges.colour * 255, steps.edges.depth * 255
    return out


def _lines(base: Picture, steps: PaperDoors) -> Picture:
    out = base.copy()
    out[:, list(steps.upright)] = GREEN
    out[list(steps.level)] = RED
    return out


def _rectangles(base: Picture, found: Rectangles) -> Picture:
    out = base.copy()
    chosen = np.linspace(0, len(found) - 1, min(MOST_DRAWN, len(found))).astype(int).tolist()
    for number, k in enumerate(chosen):
        corners = (int(found.left[k]), 0), (int(found.right[k]), int(found.top[k]))
        cv2.rectangle(out, *corners, _hue(number), 1)
    return out


def _doors(base: Picture, doors: Sequence[Rectangle]) -> Picture:
    out = base.copy()
    for box in doors:
        corners = (round(box.left / PIXEL), 0), (round(box.right / PIXEL), round(box.top / PIXEL))
        cv2.rectangle(out, *corners, GREEN, 2)
    return out
