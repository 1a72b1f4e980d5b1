"""Sides of openings that curtains or furniture hide: taken from like openings of the building, which repeat, from a
window's own bars, since windows are symmetric, else from how curtains hang.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scan2bim.openings.shapes import NOT_HIDDEN, OpeningShape

SAME = 0.03
"""Metres within which heads, sills, jambs and sizes of like openings agree: what edges and floors are off by."""
LIKE = 0.1
"""Metres within which the heights of openings of one head are about as like a given one."""
LEAST = 0.3
"""Least width and height of an opening, metres."""
BETWEEN = 0.04
"""Metres of wall that stay between two openings."""
LAP = 1 / 3
"""Share of what a curtain hides beside a window that is window: drawn aside it hangs rather before the wall, or as much
before the next window where no wall was seen between the two."""
UNIFORM = 12**0.5
"""A range by its standard deviation, if all within it is as likely."""
SURE = 0.02
"""Standard deviation, metres, up to which a width is that of other openings, too: no guess of what is hidden."""
PIER = 0.15
"""Width, metres, of the widest pier between two windows before which no curtain hangs."""
MIRRORED = 0.02
"""Standard deviation, metres, of a width from bars: twice that of a bar's middle."""
Range = tuple[float, float, float, float]
"""Nearer and farther end of what was seen, and how far the opening may go on beyond each, metres."""


def completed(found: Sequence[OpeningShape]) -> list[OpeningShape]:
    """The openings with their hidden sides set, the least hidden first: they help the others."""
    out = {k: o for k, o in enumerate(found) if o.hidden == NOT_HIDDEN}
    for k in sorted((k for k in range(len(found)) if k not in out), key=lambda k: sum(found[k].hidden)):
        opening = _bounded(found[k], [o for j, o in enumerate(found) if j != k])
        laps = _laps(opening, found[k], [o for j, o in enumerate(found) if j != k])
        opening = _sideways(opening, list(out.values()), laps)
        opening = _upwards(opening, [o for j, o in out.items() if not any(found[j].hidden[2:])])
        out[k] = replace(opening, hidden=NOT_HIDDEN)
    return [o for k in range(len(found)) if min((o := out[k]).width, o.height) >= LEAST]


def _bounded(opening: OpeningShape, others: Sequence[OpeningShape]) -> OpeningShape:
    """Hidden no farther than to the next openings of its wall."""
    left, right, lower, upper = opening.hidden
    for other in others:
        if (other.storey, other.wall) != (opening.storey, opening.wall):
            continue
        if _overlap(_rows(opening), _rows(other)) > SAME:
            before, after = opening.offset - _end(other), other.offset - _end(opening)
            left = min(left, max(before - BETWEEN, 0.0)) if before > -SAME else left
            right = min(right, max(after - BETWEEN, 0.0)) if after > -SAME else right
        if _overlap((opening.offset, _end(opening)), (other.offset, _end(other))) > SAME:
            below, above = opening.sill - _head(other), other.sill - _head(opening)
            lower = min(lower, max(below - BETWEEN, 0.0)) if below > -SAME else lower
            upper = min(upper, max(above - BETWEEN, 0.0)) if above > -SAME else upper
    return replace(opening, hidden=(left, right, lower, upper))


def _laps(opening: OpeningShape, whole: OpeningShape, others: Sequence[OpeningShape]) -> tuple[float, float]:
    """Shares of what is hidden left and right of an opening that belong to it: a third; half where the next opening
    ends what was hidden of the ``whole``; all of it beside a pier that was seen and is too narrow for a curtain.
    """
    rows = [o for o in others if (o.storey, o.wall) == (opening.storey, opening.wall)]
    rows = [o for o in rows if _overlap(_rows(opening), _rows(o)) > SAME]
    before = min((opening.offset - opening.hidden[0] - _end(o) for o in rows if o.offset < opening.offset), default=9.0)
    after = min((o.offset - _end(opening) - opening.hidden[1] for o in rows if o.offset > opening.offset), default=9.0)
    shared = opening.hidden[0] != whole.hidden[0], opening.hidden[1] != whole.hidden[1]
    left, right = (
        0.5 if half else 1.0 if pier < PIER else LAP for half, pier in zip(shared, (before, after), strict=True)
    )
    return left, right


def _sideways(opening: OpeningShape, known: Sequence[OpeningShape], laps: Sequence[float]) -> OpeningShape:
    """With both jambs: those of an opening above or below whose other jamb is the same, the one that its bars tell, the
    width of openings of its height, or of its head and most like it in height, or a share of what is hidden.
    """
    left, right = opening.hidden[:2]
    if left == 0.0 and right == 0.0:
        return opening
    span = (opening.offset, _end(opening), left, right)
    for other in known:
        stacked = (other.storey, other.wall) == (opening.storey, opening.wall) and other.sill != opening.sill
        if stacked and _fits((other.offset, _end(other)), span):
            return _wide(opening, other.offset, other.width, None)
    mirrored = _mirrored(opening)
    if mirrored is not None and _fits(mirrored, span):
        return _wide(opening, mirrored[0], mirrored[1] - mirrored[0], MIRRORED)
    alike = [
        o
        for o in known
        if o.kind == opening.kind and o.width_sigma is not None and o.width_sigma < SURE and _as_tall(opening, o)
    ]
    if opening.hidden[2:] == (0.0, 0.0):
        least = min((abs(o.height - opening.height) for o in alike), default=0.0)
        alike = [o for o in alike if abs(o.height - opening.height) < least + LIKE]
    width = _most_common([o.width for o in alike], span)
    if width is not None:
        return _wide(opening, *_placed(span, width), None)
    before, after = laps[0] * left, laps[1] * right
    return _wide(opening, span[0] - before, span[1] - span[0] + before + after, 2 * max(before, after) / UNIFORM)


def _mirrored(opening: OpeningShape) -> tuple[float, float] | None:
    """Both jambs of a window of which one is hidden, by its bars: the middle of the outer ones is its own."""
    if not opening.bars or min(opening.hidden[:2]) > 0:
        return None
    twice = opening.bars[0] + opening.bars[-1]
    return (opening.offset, twice - opening.offset) if opening.hidden[1] > 0 else (twice - _end(opening), _end(opening))


def _upwards(opening: OpeningShape, known: Sequence[OpeningShape]) -> OpeningShape:
    """With sill and head: the height of openings as wide as it, those at its own height first, or the middle of what is
    hidden.
    """
    lower, upper = opening.hidden[2:]
    if lower == 0.0 and upper == 0.0:
        return opening
    span = (opening.sill, _head(opening), lower, upper)
    wide = [o for o in known if o.kind == opening.kind and abs(o.width - opening.width) < SAME]
    level = [o.height for o in wide if _fits(_rows(o), span)]
    height = _most_common(level or [o.height for o in wide], span)
    if height is not None:
        sill, height = _placed(span, height)
        return replace(opening, sill=round(sill, 4), height=round(height, 4), height_sigma=None)
    sill = span[0] - min(lower, span[0]) / 2
    height = _head(opening) + upper / 2 - sill
    sigma = round(max(lower, upper) / UNIFORM, 4)
    return replace(opening, sill=round(sill, 4), height=round(height, 4), height_sigma=sigma)


def _as_tall(opening: OpeningShape, other: OpeningShape) -> bool:
    """Whether two openings may be of one height: heads agree, or heights where both were seen."""
    seen = opening.hidden[2] == 0.0 and opening.hidden[3] == 0.0
    return abs(_head(opening) - _head(other)) < SAME or (seen and abs(opening.height - other.height) < SAME)


def _fits(ends: tuple[float, float], span: Range) -> bool:
    """Whether two ends may be those of a span."""
    nearer, farther = span[0] - ends[0], ends[1] - span[1]
    return -SAME < nearer < span[2] + SAME and -SAME < farther < span[3] + SAME


def _most_common(sizes: Sequence[float], span: Range) -> float | None:
    """The size that most of those have which a span may have, None if it may have none of them."""
    seen, most = span[1] - span[0], span[1] - span[0] + span[2] + span[3]
    fitting = [s for s in sizes if seen - SAME < s < most + SAME]
    votes = [(sum(1 for other in fitting if abs(other - s) < SAME), -abs(s - (seen + most) / 2), s) for s in fitting]
    return max(votes)[2] if votes else None


def _placed(span: Range, size: float) -> tuple[float, float]:
    """Start and size of an opening of a size in a span: in the middle of where it may be."""
    first = max(span[0] - span[2], span[1] - size)
    last = min(span[0], span[1] + span[3] - size)
    return (first + last) / 2, size


def _wide(opening: OpeningShape, offset: float, width: float, sigma: float | None) -> OpeningShape:
    sigma = None if sigma is None else round(sigma, 4)
    return replace(opening, offset=round(offset, 4), width=round(width, 4), width_sigma=sigma)


def _end(opening: OpeningShape) -> float:
    return opening.offset + opening.width


def _head(opening: OpeningShape) -> float:
    return opening.sill + opening.height


def _rows(opening: OpeningShape) -> tuple[float, float]:
    return opening.sill, _head(opening)


def _overlap(a: tuple[float, float], b: tuple[float, float]) -> float:
    return min(a[1], b[1]) - max(a[0], b[0])
