"""Openings of a wall that were looked through: rectangles in which its face is missing (the paper's section IV).

Where the face is missing, and a station looked through or something was seen behind the face, pixels are clustered by
region growing; a cluster's rectangle comes from lateral histograms, and its sides are then moved to the edges of the
wall's face and to the reveals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.raster import closed
from scan2bim.openings.bars import bars_of
from scan2bim.openings.clusters import HOLE, RAIL, clusters, face_missing
from scan2bim.openings.edges import MARGIN
from scan2bim.openings.kinds import (
    HIGHEST_SILL,
    NARROWEST,
    RIM,
    RING,
    SOLID,
    WHOLE,
    glazed,
    in_glass,
    is_pane,
    is_recess,
    kind_of,
    share,
    solid,
    wall_above,
)
from scan2bim.openings.mullions import without_mullions
from scan2bim.openings.shapes import OpeningShape
from scan2bim.openings.sides import Sides, sides_of
from scan2bim.openings.wall_image import PIXEL, Box, WallImage, answered, part
from scan2bim.structure.shapes import WallShape

SMALLEST_AREA = 0.12
"""Square metres: hatches and roof lights are larger, holes in the sampling are smaller."""
SAME = 0.03
"""Metres within which jambs of windows one above the other agree."""
LOWEST_WINDOW = 0.3
"""Least width and height of an opening, metres."""
HIGHEST_THRESHOLD = 0.2
"""Height, metres, up to which what is seen at the foot of an opening in an inner wall is its threshold, a leaf's lower
edge or a thing that lies there: inner windows begin far higher.
"""
BAR = 0.15
"""Height, metres, of the strip of wall between two windows that stand right above each other."""
SLIT = 0.1
"""Least width and height, metres, of what is seen of an opening that is hidden beyond."""
SHARE = 0.25
"""Share of the rectangle's height (width) that a column (row) of the lateral histogram must fill to belong to it."""
LOWEST_SIGHT = 0.45
"""Height, metres, up to which an opening's lower part may be hidden by the floor behind it."""
ACROSS = 0.6
"""Share of the width of a strip of wall below an opening."""
HIGHEST_HIDDEN = 0.9
"""Height, metres, up to which it may be hidden by furniture in inner walls, where windows are rare."""
PANEL = 0.5
"""Width, metres, from which on a solid part beside what was looked through is something else: a door beside a window.
"""
FRAME = 0.12
"""Width, metres, of the frame that is left between the two."""
LEAST_REVEALS = 3
"""Reveals that must be seen of a pane that nobody looked through."""
FRAMED, BLANK = 2, 0.1
"""Reveals that must be seen of an opening of which more than this share is blank: something may have hidden it."""
STEP, STEPS = 0.0075, 3
"""Standard deviation, metres, of a side where the face ends and a frame begins behind it, and how many such sides do
instead of reveals."""
LEAST_THROUGH = 0.06
"""Share of an opening that must have been looked through: less comes through the gaps round a closed leaf."""
BACKED = 0.25
"""Share of what was looked through on which a face must have been seen to go on across an opening: of a face that
hardly anybody saw, a leaf's edge may be all.
"""
HIDDEN, LEAF = 0.3, 0.8
"""Width, metres, that an open leaf may hide beside a jamb: it stands off the wall at an angle; and where the leaf was
seen within the wall, before the jamb.
"""
SURE = 0.012
"""Standard deviation, metres, up to which a side was seen: reveals, frames and the ends of the face."""
Mask = NDArray[np.bool_]
Seen = tuple[OpeningShape, Sides]
"""An opening and what was seen of its sides."""


def find_open(storey: int, number: int, wall: WallShape, image: WallImage) -> list[OpeningShape]:
    """Openings of one wall that were looked through: by pulses that came back, and where those leave it open by such as
    never did, which dark things may have swallowed.
    """
    found = _found(storey, number, wall, answered(image))
    if image.lost.any():
        found = _completed(found, _found(storey, number, wall, image))
    return without_mullions([opening for opening, _ in found], image)


def _found(storey: int, number: int, wall: WallShape, image: WallImage) -> list[Seen]:
    """Those of one image."""
    missing = face_missing(image)
    found: list[Seen] = []
    doubtful: list[Box] = []
    for cluster in clusters(missing, image):
        box = _box(cluster, wall, image) if _area(cluster) >= SMALLEST_AREA else None
        seen = None if box is None else _opening(storey, number, wall, image, _to_floor(box, wall, image, missing))
        rest = _rectangle(cluster) if seen is None else None
        found += [seen] if seen is not None else []
        doubtful += [rest] if rest is not None else []
    for box in doubtful:
        seen = None if wall.left and wall.right else _opening(storey, number, wall, image, box, in_line=True)
        found += [seen] if seen is not None and any(_in_line(seen[0], other) for other, _ in found) else []
    return found


def _completed(found: Sequence[Seen], more: Sequence[Seen]) -> list[Seen]:
    """Openings with those of an image in which ``more`` was seen in place of them, unless these go on beyond sides that
    were seen well.
    """
    kept = list(found)
    for opening in more:
        rivals = [other for other in kept if _apart(opening, other) < 0.0]
        if not any(_beyond(opening, other) for other in rivals):
            kept = [other for other in kept if _apart(opening, other) >= 0.0] + [opening]
    return kept


def _apart(a: Seen, b: Seen) -> float:
    """Metres between two openings, less than 0 if they overlap."""
    (left, right, bottom, top), (start, end, low, high) = _ends(a), _ends(b)
    return max(left - end, start - right, bottom - high, low - top)


def _beyond(opening: Seen, other: Seen) -> bool:
    """Whether an opening goes on beyond a side of another one that was seen well."""
    for k, (place, known) in enumerate(zip(_ends(opening), _ends(other), strict=True)):
        outwards = known - place if k in (0, 2) else place - known
        if outwards > SAME and other[1][k].sigma <= SURE:
            return True
    return False


def _ends(seen: Seen) -> Box:
    opening = seen[0]
    return opening.offset, opening.offset + opening.width, opening.sill, opening.sill + opening.height


def _in_line(opening: OpeningShape, other: OpeningShape) -> bool:
    """Whether a doubtful window stands above or below another one, with a jamb of its own seen where the other's is; or
    right below or above it, with both jambs hidden, so that they may be the other's.
    """
    if opening.kind != "window" or other.kind != "window":
        return False
    rail = max(other.sill - opening.sill - opening.height, opening.sill - other.sill - other.height)
    ends = opening.offset - other.offset, other.offset + other.width - opening.offset - opening.width
    seen = any(abs(end) < SAME and hidden == 0.0 for end, hidden in zip(ends, opening.hidden[:2], strict=True))
    far = zip(ends, opening.hidden[:2], strict=True)
    return rail > 0.0 and (seen or (rail < BAR and all(-SAME < end < hidden + SAME for end, hidden in far)))


def _area(mask: Mask) -> float:
    return float(mask.sum()) * PIXEL * PIXEL


def _box(cluster: Mask, wall: WallShape, image: WallImage) -> Box | None:
    """The rectangle of a cluster without solid leaves or panels beside what was looked through; where that is too
    little all of it, if it is a pane, else None.
    """
    box = _rectangle(cluster)
    clear = closed((cluster & (image.blank | (image.through > 0)) & ~image.face).astype(np.uint8), 2 * HOLE).astype(
        bool
    )
    inner = _rectangle(clear) if clear.sum() >= LEAST_THROUGH * cluster.sum() else None
    if box is None or inner is None:
        return box if box is not None and is_pane(wall, image, box) else None
    left, right, bottom, top = box
    if inner[0] - left > PANEL and solid(image, (left, inner[0] - FRAME, bottom, top)):
        left = inner[0] - FRAME
    if right - inner[1] > PANEL and solid(image, (inner[1] + FRAME, right, bottom, top)):
        right = inner[1] + FRAME
    if inner[2] - bottom > PANEL and solid(image, (left, right, bottom, inner[2] - FRAME)):
        bottom = inner[2] - FRAME
    return left, right, bottom, top


def _rectangle(region: Mask) -> Box | None:
    """Left, right, bottom, top (metres) of a cluster by its lateral histograms; None if it fills it badly."""
    columns, rows = region.sum(0), region.sum(1)
    if not columns.any():
        return None
    left, right = _span(columns, SHARE * float(np.percentile(columns[columns > 0], 90)))
    bottom, top = _span(rows, SHARE * float(np.percentile(rows[rows > 0], 90)))
    inner = region[bottom:top, left:right]
    if inner.size == 0 or inner.mean() < 0.4:
        return None
    return left * PIXEL, right * PIXEL, bottom * PIXEL, top * PIXEL


def _span(histogram: NDArray[np.int64], least: float) -> tuple[int, int]:
    at = np.flatnonzero(histogram >= least)
    return (int(at[0]), int(at[-1]) + 1) if len(at) else (0, 0)


def _to_floor(box: Box, wall: WallShape, image: WallImage, missing: Mask) -> Box:
    """Down to the floor where no wall was seen between the rectangle and the floor: rays that pass low soon meet the
    floor.
    """
    left, right, bottom, top = box
    under = part(image.face & ~missing, left + 2 * PIXEL, right - 2 * PIXEL, 4 * PIXEL, bottom)
    walled = bool(under.size) and ((under.mean(0) > 0.15).mean() > 0.6 or _rail(under))
    seen_low = part(image.through > 0, left + 2 * PIXEL, right - 2 * PIXEL, 6 * PIXEL, bottom)
    outer = not (wall.left and wall.right)
    dark = seen_low.size == 0 or seen_low.mean() < 0.2
    if walled or (dark and bottom > (LOWEST_SIGHT if outer else HIGHEST_HIDDEN)):
        return box
    return _bare(image, left, -1, top), _bare(image, right, 1, top), 0.0, top


def _rail(face: Mask) -> bool:
    """Whether a strip of wall goes across, as between windows that stand one above the other."""
    whole = (face.mean(1) > ACROSS).astype(np.float32)
    return len(whole) >= RAIL and bool((np.convolve(whole, np.ones(RAIL), "valid") >= RAIL - 0.5).any())


def _bare(image: WallImage, side: float, step: int, top: float) -> float:
    """A jamb moved outwards, behind a leaf that hides it, to where the wall's face begins, if that is near."""
    behind = np.asarray(image.behind.any(0))
    for k in range(round(LEAF / PIXEL)):
        at = side + step * k * PIXEL
        strip = part(image.face, min(at, at + 2 * step * PIXEL), max(at, at + 2 * step * PIXEL), MARGIN, top - MARGIN)
        if strip.size and strip.any(1).mean() > 0.3:
            inside = part(behind, min(at, at - step * RIM), max(at, at - step * RIM), MARGIN, top - MARGIN)
            return at if k * PIXEL < HIDDEN or inside.any(1).mean() > 0.3 else side
    return side


def _supported(image: WallImage, box: Box) -> int:
    """How many of the four sides have the wall's face beside them, on a third of their length."""
    left, right, bottom, top = box
    wall = image.face
    beside = (
        part(wall, left - RIM, left - PIXEL, bottom, top).any(1),
        part(wall, right + PIXEL, right + RIM, bottom, top).any(1),
        part(wall, left, right, bottom - RIM, bottom - PIXEL).any(0),
        part(wall, left, right, top + PIXEL, top + RIM).any(0),
    )
    return sum(1 for side in beside if side.size and side.mean() > 1 / 3)


def _opening(
    storey: int, number: int, wall: WallShape, image: WallImage, box: Box, *, in_line: bool = False
) -> Seen | None:
    """Sides moved to the edges of the face, then told apart: door, window or passage. Of a window ``in_line`` with
    another one less need have been seen.
    """
    left, right, bottom, top = box
    outer = not (wall.left and wall.right)
    sides = sides_of(image, box, outer)
    left, right, lower, top = (side.inner if outer and side.hidden > 0 else side.place for side in sides)
    bottom = lower if bottom > 0.0 or (sides[2].wall and sides[2].hidden == 0.0) else 0.0
    bottom = 0.0 if bottom < (HIGHEST_SILL if outer else HIGHEST_THRESHOLD) else bottom
    top = min(top, wall.top - wall.base)
    far = [round(side.hidden, 4) if outer else 0.0 for side in sides]
    hidden = (far[0], far[1], far[2] if bottom > 0.0 else 0.0, far[3])
    width, height = right - left, top - bottom
    if min(width + far[0] + far[1], height + far[3] + hidden[2]) < LOWEST_WINDOW or min(width, height) < SLIT:
        return None
    if bottom == 0.0 and width < NARROWEST:
        return None
    box = (left, right, bottom, top)
    supported = _supported(image, box)
    least = _least_sides(wall, box, hidden, sides, in_line)
    if supported < least or _is_whole(wall, box) or _backed(wall, image, box):
        return None
    lintel = wall_above(image, left, right, top)
    kind, leaves = kind_of(wall, image, box, lintel)
    through = share(image.through > 0, box)
    jambs = sum(1 for side in sides[:2] if side.reveal > 0)
    if not _shows(wall, image, box, through, sides, in_line) or (kind == "window" and in_glass(image, box)):
        return None
    opening = OpeningShape(
        storey,
        number,
        kind,
        "closed" if leaves else "open" if kind == "door" else "unknown",
        round(left, 4),
        round(bottom, 4),
        round(width, 4),
        round(height, 4),
        round(float(np.hypot(sides[0].sigma, sides[1].sigma)), 4),
        round(float(np.hypot(sides[2].sigma, sides[3].sigma)), 4),
        round(through, 3),
        jambs,
        lintel,
        sum(side.reveal for side in sides),
        tuple(sorted(n for n, looked in image.lookers.items() if part(looked, *box).any())),
        0.0,
        leaves=leaves or None,
        sides=supported,
        glazed=True if leaves else None,
        hidden=hidden,
        bars=bars_of(image, box) if any(hidden[:2]) else (),
    )
    return opening, sides


def _shows(wall: WallShape, image: WallImage, box: Box, through: float, sides: Sides, in_line: bool) -> bool:
    """Whether enough was seen of an opening of which a share was looked ``through``, and of its sides."""
    reveals = sum(1 for side in sides if side.reveal > 0)
    if through < LEAST_THROUGH / 2:
        if is_recess(wall, image, box):
            return False
        if reveals < (1 if in_line else LEAST_REVEALS) and not is_pane(wall, image, box):
            return False
    framed = reveals >= FRAMED or sum(1 for side in sides if side.wall and side.sigma <= STEP) >= STEPS
    if not framed and share(image.blank, box) > BLANK:
        return False
    lost = share(image.lost, box)
    return not (lost > BLANK and reveals == 0 and through - lost < LEAST_THROUGH / 2 and not glazed(image, box))


def _least_sides(
    wall: WallShape, box: Box, hidden: tuple[float, float, float, float], sides: Sides, in_line: bool
) -> int:
    """How many sides of an opening must have the wall's face beside them."""
    reveals = sum(1 for side in sides if side.reveal > 0)
    touching = _touching(wall, box, sides)
    least = (1 if box[2] == 0.0 else 2) + (touching > 0)
    if in_line:
        return 1
    if box[2] > 0.0 and reveals >= LEAST_REVEALS:
        least -= touching > 0
    if box[2] > 0.0 and reveals >= 2:
        return max(1, least - sum(1 for away in hidden if away > HIDDEN))
    return least


def _touching(wall: WallShape, box: Box, sides: Sides) -> int:
    """How many of the wall's ends and its upper edge an opening reaches, without a reveal there: there may be no wall,
    but a roof's slope.
    """
    gaps = zip(
        (box[0], wall.length - box[1], wall.top - wall.base - box[3]), (sides[0], sides[1], sides[3]), strict=True
    )
    return sum(1 for gap, side in gaps if gap < 2 * PIXEL and side.reveal == 0)


def _backed(wall: WallShape, image: WallImage, box: Box) -> bool:
    """Whether one face of an inner wall goes on across an opening in the other: rays went into a mirror, or a niche."""
    if not (wall.left and wall.right):
        return False
    left, right, bottom, top = box
    around = left - RING, right + RING, bottom - RING, top + RING
    inset = min(RIM, (right - left) / 4)
    middle = left + inset, right - inset, bottom + inset, top - inset
    faces = [(part(points > 0, *middle), part(points > 0, *around)) for points in image.faces]
    least = max(LEAST_THROUGH, BACKED * share(image.through > 0, middle))
    return any(here.size and here.mean() > max(SOLID * ring.mean(), least) for here, ring in faces)


def _is_whole(wall: WallShape, box: Box) -> bool:
    """Whether an opening leaves nothing of the wall but rims: a glass front, or no wall at all."""
    length = wall.length
    return box[0] + length - box[1] < 2 * WHOLE and box[2] + wall.top - wall.base - box[3] < 2 * WHOLE
