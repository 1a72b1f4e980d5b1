"""Windows that a mullion parts: one opening of the wall, where what stands between them is no pier."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.shapes import OpeningShape
from scan2bim.openings.wall_image import WallImage

WIDEST = 0.2
"""Width, metres, of the widest mullion: two frames and a post."""
SAME = 0.03
"""Metres within which the sills and the heads of such windows agree."""
BACK = 0.008
"""Metres that a mullion stands back behind the wall's face, at least: a pier is even with it to the millimetre."""
FAR_BACK = 0.02
"""The same, where things hide the face beside the windows: over its whole length a wall is even to a centimetre."""
RIM = 0.1
"""Metres at heads and sills that say nothing: frames."""
EDGE, BESIDE = 0.05, 0.4
"""Metres from an opening between which the wall's face beside it is looked at."""
INSET = 0.2
"""Share of a mullion's width at each of its edges that says nothing."""
DEEP = 0.1
"""Depth, metres, up to which what was seen between two windows stands between them."""
FEWEST = 30
"""Points that tell where a surface lies."""


def without_mullions(found: Sequence[OpeningShape], image: WallImage) -> list[OpeningShape]:
    """The openings of one wall, windows side by side as one where what parts them stands back behind the face."""
    others = [opening for opening in found if opening.kind != "window"]
    joined: list[OpeningShape] = []
    for window in sorted((o for o in found if o.kind == "window"), key=lambda o: o.offset):
        last = next((o for o in joined if _beside(o, window) and _stands_back(o, window, image)), None)
        if last is None:
            joined.append(window)
        else:
            joined[joined.index(last)] = _joined(last, window)
    return [*others, *joined]


def _beside(first: OpeningShape, second: OpeningShape) -> bool:
    """Whether a window ends right before another one that is as high, as far as both sills and heads were seen, or what
    parts them was taken for part of both.
    """
    apart = second.offset - first.offset - first.width
    (sill, head), (low, high) = _rows(first), _rows(second)
    level = _within(sill - low, first.hidden[2], second.hidden[2])
    return 0.0 < abs(apart) < WIDEST and level and _within(high - head, first.hidden[3], second.hidden[3])


def _within(above: float, mine: float, other: float) -> bool:
    """Whether two sides, of which one lies ``above`` metres farther in, may be one, as far as they are hidden outwards:
    that one by ``mine``, the other by ``other`` metres.
    """
    return -other - SAME < above < mine + SAME


def _stands_back(first: OpeningShape, second: OpeningShape, image: WallImage) -> bool:
    """Whether what is between two windows stands back behind the wall's face beside them, on the side that shows more
    of it.
    """
    left, right = sorted((first.offset + first.width, second.offset))
    start, end = first.offset, second.offset + second.width
    inset = INSET * (right - left)
    rows = (image.up > first.sill + RIM) & (image.up < first.sill + first.height - RIM)
    between = rows & (image.along > left + inset) & (image.along < right - inset) & (np.abs(image.depth) < DEEP)
    before = (image.along > start - BESIDE) & (image.along < start - EDGE)
    after = (image.along > end + EDGE) & (image.along < end + BESIDE)
    side = int((image.side[between] == 1).sum() > (image.side[between] == 0).sum())
    face = _depth(image, rows & (before | after) & image.on_face & (image.side == side))
    here = _depth(image, between & (image.side == side))
    if here is None:
        return False
    return here > FAR_BACK if face is None else here - face > BACK


def _depth(image: WallImage, at: NDArray[np.bool_]) -> float | None:
    """Median depth, metres, of some of a wall's points; None if they are few."""
    return float(np.median(image.depth[at])) if np.count_nonzero(at) >= FEWEST else None


def _joined(first: OpeningShape, second: OpeningShape) -> OpeningShape:
    middle = (first.offset + first.width + second.offset) / 2
    areas = np.array([first.width, second.width])
    lower, upper = (min((first, second), key=lambda o: o.hidden[k]) for k in (2, 3))
    sill, head = _rows(lower)[0], _rows(upper)[1]
    return replace(
        first,
        sill=sill,
        height=round(head - sill, 4),
        width=round(second.offset + second.width - first.offset, 4),
        looked_through=round(float(np.average([first.looked_through, second.looked_through], weights=areas)), 3),
        points=first.points + second.points,
        stations=tuple(sorted({*first.stations, *second.stations})),
        hidden=(first.hidden[0], second.hidden[1], lower.hidden[2], upper.hidden[3]),
        bars=(*first.bars, round(float(middle), 4), *second.bars),
    )


def _rows(opening: OpeningShape) -> tuple[float, float]:
    return opening.sill, opening.sill + opening.height
