"""Open doors, passages and windows: rectangles in a wall that stations looked through (the paper's section IV).

Centroids are clustered by region growing; a cluster's rectangle comes from lateral histograms, and its sides are then
moved to the reveals, the surfaces inside the wall's thickness, which are good to millimetres.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raster import closed, opened
from scan2bim.openings.shapes import Kind, OpeningShape
from scan2bim.openings.wall_image import PIXEL, WallImage
from scan2bim.structure.shapes import WallShape

SMALLEST_AREA = 0.15
"""Square metres: hatches and roof lights are larger, holes in the sampling are smaller."""
NARROWEST, WIDEST_DOOR = 0.45, 2.6
"""Clear widths of doors, metres (trade: single 0.5 to 1.5, double to 2.5)."""
WIDEST_SINGLE = 1.3
"""Clear width, metres, up to which an opening whose lintel cannot be seen (scan cut below the ceiling) is taken for a
door."""
LOWEST_HEAD, HIGHEST_SILL = 1.55, 0.15
"""A door's head lies at least this high over the floor, its sill at most this high, metres."""
REVEAL = 0.14
"""How far from the rough edge, metres, a reveal is looked for: a frame's width and two pixels."""
SHARE = 0.5
"""Share of the rectangle's height (width) that a column (row) of the lateral histogram must fill to belong to it."""
LOWEST_SIGHT = 0.45
"""Height, metres, up to which an opening's lower part may be hidden by the floor behind it."""
WIDEST_FRAME = 0.25
"""Width, metres, of frames and linings between what was looked through and the wall's own edge."""
MULLION = 0.25
"""Width, metres, up to which what parts two rectangles is a mullion or transom of one opening."""
RIM = 0.15
"""Width, metres, of an opening's rim, in which lining and frame are left out when panes are looked for."""
Box = tuple[float, float, float, float]
"""Left, right, bottom, top in metres, along the wall from its start and up from its base."""
F64 = NDArray[np.float64]


def find_open(storey: int, number: int, wall: WallShape, image: WallImage) -> list[OpeningShape]:
    """Openings of one wall that were looked through."""
    mask = opened(closed(image.opening.astype(np.uint8), 3), 4)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    large = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] * PIXEL * PIXEL >= SMALLEST_AREA]
    boxes = [box for k in large if (box := _rectangle(labels == k)) is not None]
    boxes = _join_panes([_to_wall_edges(_to_floor(box, image), image) for box in boxes])
    openings = [_refined(storey, number, wall, image, box) for box in boxes]
    return [o for o in openings if o is not None]


def _to_floor(box: Box, image: WallImage) -> Box:
    """Down to the floor where no wall was seen between the rectangle and the floor: rays that pass low soon meet the
    floor.
    """
    left, right, bottom, top = box
    under = _part(image.data, left + PIXEL, right - PIXEL, 2 * PIXEL, bottom)
    seen_low = _part(image.through > 0, left + PIXEL, right - PIXEL, 3 * PIXEL, bottom)
    hidden = bottom > LOWEST_SIGHT and (seen_low.size == 0 or seen_low.mean() < 0.2)
    if hidden or (under.size and under.mean() > 0.25):
        return box
    return left, right, 0.0, top


def _to_wall_edges(box: Box, image: WallImage) -> Box:
    """Each side outwards, over the frame, to where the wall's face begins."""
    left, right, bottom, top = box
    for _ in range(round(WIDEST_FRAME / PIXEL)):
        rows, cols = (bottom + PIXEL, top - PIXEL), (left + PIXEL, right - PIXEL)
        if _bare(image, left - PIXEL, left, *rows):
            left -= PIXEL
        if _bare(image, right, right + PIXEL, *rows):
            right += PIXEL
        if _bare(image, *cols, top, top + PIXEL):
            top += PIXEL
        if bottom > 0 and _bare(image, *cols, bottom - PIXEL, bottom):
            bottom -= PIXEL
    return left, right, max(bottom, 0.0), top


def _bare(image: WallImage, left: float, right: float, bottom: float, top: float) -> bool:
    strip = _part(image.data, left, right, bottom, top)
    return bool(strip.size and strip.mean() < 0.3)


def _join_panes(boxes: list[Box]) -> list[Box]:
    """Rectangles side by side or one above the other with a mullion between them are one opening."""
    boxes = sorted(boxes)
    merged = True
    while merged:
        merged = False
        for i, a in enumerate(boxes):
            mate = next((b for b in boxes[i + 1 :] if _same_opening(a, b)), None)
            if mate is not None:
                boxes.remove(mate)
                boxes[i] = (min(a[0], mate[0]), max(a[1], mate[1]), min(a[2], mate[2]), max(a[3], mate[3]))
                merged = True
                break
    return boxes


def _same_opening(a: Box, b: Box) -> bool:
    sideways, upwards = max(a[0], b[0]) - min(a[1], b[1]), max(a[2], b[2]) - min(a[3], b[3])
    level = abs(a[2] - b[2]) < 0.2 and abs(a[3] - b[3]) < 0.2
    upright = abs(a[0] - b[0]) < 0.2 and abs(a[1] - b[1]) < 0.2
    return (sideways < MULLION and level) or (upwards < MULLION and upright) or (sideways < 0 and upwards < 0)


def _rectangle(region: NDArray[np.bool_]) -> Box | None:
    """Left, right, bottom, top (metres) of a cluster by its lateral histograms; None if it fills it badly."""
    columns, rows = region.sum(0), region.sum(1)
    left, right = _span(columns, SHARE * float(np.percentile(columns[columns > 0], 90)))
    bottom, top = _span(rows, SHARE * float(np.percentile(rows[rows > 0], 90)))
    inner = region[bottom:top, left:right]
    if inner.size == 0 or inner.mean() < 0.4:
        return None
    return left * PIXEL, right * PIXEL, bottom * PIXEL, top * PIXEL


def _span(histogram: NDArray[np.int64], least: float) -> tuple[int, int]:
    at = np.flatnonzero(histogram >= least)
    return (int(at[0]), int(at[-1]) + 1) if len(at) else (0, 0)


def _refined(storey: int, number: int, wall: WallShape, image: WallImage, box: Box) -> OpeningShape | None:
    """Sides moved to the reveals, then told apart: door, window or passage."""
    left, right, bottom, top = box
    along, up = image.inner[:, 0], image.inner[:, 1]
    tall = (up > bottom + 0.1) & (up < top - 0.1)
    wide = (along > left + 0.1) & (along < right - 0.1)
    left, left_points = _edge(along[tall], image.inner_points[tall], left, 1.0)
    right, right_points = _edge(along[tall], image.inner_points[tall], right, -1.0)
    top, head_points = _edge(up[wide], image.inner_points[wide], top, -1.0)
    if bottom < HIGHEST_SILL:
        bottom = 0.0
    else:
        bottom, _ = _edge(up[wide], image.inner_points[wide], bottom, 1.0)
    height_of_wall = wall.top - wall.base
    top = min(top, height_of_wall)
    width, height = right - left, top - bottom
    if width < (NARROWEST if bottom == 0.0 else NARROWEST - 0.1) or height < 0.3:
        return None
    lintel = _wall_above(image, left, right, top)
    kind = _kind(wall, image, (left, right, bottom, top), lintel)
    inside = _part(image.opening, left, right, bottom, top)
    share = float(inside.mean()) if inside.size else 0.0
    jambs = int(left_points > 0) + int(right_points > 0)
    return OpeningShape(
        storey,
        number,
        kind,
        "open" if kind == "door" else "unknown",
        round(left, 4),
        round(bottom, 4),
        round(width, 4),
        round(height, 4),
        0.005 if jambs == 2 else PIXEL / 2,
        0.005 if head_points else PIXEL / 2,
        round(share, 3),
        jambs,
        lintel,
        left_points + right_points + head_points,
        tuple(sorted(n for n, looked in image.lookers.items() if _part(looked, left, right, bottom, top).any())),
        round(_confidence(kind, share, jambs, lintel), 3),
    )


def _edge(place: F64, points: NDArray[np.int64], rough: float, inward: float) -> tuple[float, int]:
    """The reveal at a rough edge: median place of the outermost crowded 2 cm within reach, and its points; the rough
    edge if none.
    """
    near = np.abs(place - rough) < REVEAL
    if near.sum() < 4:
        return rough, 0
    values, weights = place[near], points[near]
    steps = np.floor((values - rough + REVEAL) / 0.01).astype(int)
    counts = np.convolve(np.bincount(steps, minlength=int(2 * REVEAL / 0.01) + 1), np.ones(3), mode="same")
    strong = np.flatnonzero(counts >= 0.5 * counts.max())
    best = strong[0] if inward > 0 else strong[-1]
    close = np.abs(values - (rough - REVEAL + (best + 0.5) * 0.01)) < 0.02
    if close.sum() < 4:
        return rough, 0
    return float(np.median(values[close])), int(weights[close].sum())


def _part(mask: NDArray[np.bool_], left: float, right: float, bottom: float, top: float) -> NDArray[np.bool_]:
    rows = slice(max(0, round(bottom / PIXEL)), max(0, round(top / PIXEL)))
    return mask[rows, max(0, round(left / PIXEL)) : max(0, round(right / PIXEL))]


def _wall_above(image: WallImage, left: float, right: float, top: float) -> bool:
    """Whether the wall's face was seen above the opening."""
    above = _part(image.data, left, right, top + PIXEL, top + 0.4)
    return bool(above.size and above.mean() > 0.3)


def _kind(wall: WallShape, image: WallImage, box: Box, lintel: bool) -> Kind:
    left, right, bottom, top = box
    if bottom > HIGHEST_SILL:
        return "window"
    outer = not (wall.left and wall.right)
    if top < LOWEST_HEAD:
        return "window" if outer else "passage"
    if outer and _glazed(image, left, right, bottom, top):
        return "window" if right - left > 1.3 else "door"
    door_like = lintel or (not wall.top_seen and right - left <= WIDEST_SINGLE)
    return "door" if door_like and NARROWEST <= right - left <= WIDEST_DOOR else "passage"


def _glazed(image: WallImage, left: float, right: float, bottom: float, top: float) -> bool:
    """Whether something hangs in the opening between its sides, within the wall: panes return some pulses, bars and
    frames all.
    """
    along, up = (image.inner - [left + RIM, bottom + RIM]).T
    width, height = right - left - 2 * RIM, top - bottom - 2 * RIM
    inside = (along > 0) & (along < width) & (up > 0) & (up < height)
    cells = np.unique(np.floor(np.stack([along[inside], up[inside]]) / 0.1), axis=1).shape[1]
    return width > 0 and height > 0 and cells * 0.01 / (width * height) > 0.08


def _confidence(kind: Kind, share: float, jambs: int, lintel: bool) -> float:
    return min(
        0.97, 0.35 + 0.35 * share + 0.1 * jambs + (0.1 if lintel else 0.0) - (0.05 if kind == "passage" else 0.0)
    )
