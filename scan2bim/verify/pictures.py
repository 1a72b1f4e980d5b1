"""Pictures of deviations: a map of an element's largest faces, as PNG."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.verify.ifc_model import ModelElement
from scan2bim.verify.status import Surface

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

WIDTH, HEIGHT = 420, 300
FACES = 2
"""Faces of an element that are drawn: both sides of a wall."""
UNSEEN = (225, 225, 225)
GAP = 8
SURROUNDINGS = 2.5
"""Metres round a finding that its plan shows."""
DRAWN, EDGES, FOUND = (214, 214, 214), (120, 120, 120), (215, 48, 31)
ENLARGED = 3
"""Most pixels of a cell and axis: programs that show the pictures enlarge them further."""


def deviation_colours(deviation: NDArray[np.float64], tolerance: float) -> U8:
    """Colours (k, 3), sRGB: green at none, yellow at the tolerance, red (proud) or blue (behind) at three times it."""
    away = np.clip(np.abs(deviation) / tolerance, 0, 3)
    green, yellow = np.array([38, 152, 80]), np.array([253, 219, 90])
    far = np.where(deviation[:, None] > 0, np.array([[200, 30, 30]]), np.array([[40, 60, 190]]))
    low = green + np.clip(away, 0, 1)[:, None] * (yellow - green)
    high = yellow + np.clip((away - 1) / 2, 0, 1)[:, None] * (far - yellow)
    return np.where(away[:, None] <= 1, low, high).astype(np.uint8)


def deviation_map(surface: Surface, cells: NDArray[np.int64], tolerance: float) -> bytes | None:
    """A picture of an element's faces with most measured cells; None where none was measured."""
    table = surface.table
    measured = surface.is_measured[cells]
    face = table.cell_face[cells]
    if not measured.any():
        return None
    count = np.bincount(face[measured])
    shown = [int(f) for f in np.argsort(-count)[:FACES] if count[f] >= 4]
    panels = [_panel(surface, cells[face == f], f, tolerance) for f in shown]
    if not panels:
        return None
    width = max(p.shape[1] for p in panels)
    padded = [np.pad(p, ((0, GAP), (0, width - p.shape[1]), (0, 0)), constant_values=255) for p in panels]
    image = np.concatenate(padded)[:-GAP]
    return _png(image)


def _png(image: U8) -> bytes:
    return cv2.imencode(".png", np.ascontiguousarray(image[:, :, ::-1]), (cv2.IMWRITE_PNG_COMPRESSION, 6))[1].tobytes()


def _panel(surface: Surface, cells: NDArray[np.int64], face: int, tolerance: float) -> U8:
    table = surface.table
    nu, nv = (int(n) for n in table.shape[face])
    image = np.full((nv, nu, 3), 255, np.uint8)
    at = table.cell_at[cells]
    colours = np.tile(np.array(UNSEEN, np.uint8), (len(cells), 1))
    measured = surface.is_measured[cells]
    colours[measured] = deviation_colours(surface.measured.mean[cells][measured], tolerance)
    image[nv - 1 - at[:, 1], at[:, 0]] = colours
    scale = min(WIDTH / nu, HEIGHT / nv)
    if scale >= 1:
        times = min(int(scale), ENLARGED)
        return image.repeat(times, axis=0).repeat(times, axis=1)
    size = (max(1, round(nu * scale)), max(1, round(nv * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


class Surroundings:
    """Plans of what is drawn round a finding."""

    def __init__(self, elements: Sequence[ModelElement]) -> None:
        self._drawn = [e.vertices for e in elements if e.role == "compared"]
        boxes = [(v.min(axis=0), v.max(axis=0)) for v in self._drawn]
        self._boxes = np.array(boxes, np.float64).reshape(-1, 2, 3)

    def picture(self, box: F64) -> bytes:
        """The plan round a box (2, 3), which is marked: what stands in its height, upright things over level ones."""
        middle = box.mean(axis=0)
        half = float((box[1] - box[0])[:2].max()) / 2 + SURROUNDINGS
        reach = np.array([half, half, 0.0])
        low, high = middle - reach, middle + reach
        low[2], high[2] = box[:, 2] + [0.05, -0.05]
        near = (self._boxes[:, 0] < high).all(axis=1) & (self._boxes[:, 1] > low).all(axis=1)
        scale = HEIGHT / (2 * half)
        image = np.full((HEIGHT, HEIGHT, 3), 255, np.uint8)
        upright = np.ptp(self._boxes, axis=1)[:, 2] > 0.5
        for number in np.flatnonzero(near & upright):
            hull = shapely.convex_hull(shapely.multipoints(self._drawn[number][:, :2]))
            corners = np.rint((shapely.get_coordinates(hull) - low[:2]) * scale).astype(np.int32)
            corners[:, 1] = HEIGHT - 1 - corners[:, 1]
            cv2.fillPoly(image, [corners], DRAWN)
            cv2.polylines(image, [corners], True, EDGES, 1, cv2.LINE_AA)
        ends = np.rint((box[:, :2] - low[:2]) * scale).astype(int)
        cv2.rectangle(image, (ends[0, 0], HEIGHT - 1 - ends[1, 1]), (ends[1, 0], HEIGHT - 1 - ends[0, 1]), FOUND, 2)
        return _png(image)
