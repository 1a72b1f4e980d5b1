"""Trims round a closed door: strips of one width that lie on the wall and lap over the opening's edge on all sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scan2bim.openings.closed.sections import F64, REACH, Mask, Section
from scan2bim.openings.orthoimage import PIXEL

FARTHEST = 0.10
"""Distance outwards from a rectangle's side, metres, up to which a trim's inner edge is its own and not the next
thing's.
"""
WIDEST_GAP = 0.035
"""Metres across an edge that may be unseen between what is outside and what is inside."""
STANDS_OUT = 0.004
"""Metres by which a trim stands out from the wall at least."""
WIDTH = (0.02, 0.15)
"""Widths of trims, metres."""
LINING = (0.015, 0.05)
"""Widths, metres, of the strip of lining that shows between trim and leaf."""
FLUSH = 0.02
"""Distance from the wall, metres, up to which a leaf right inside a trim may have a gap that shows its edge."""
LAP = 0.025
"""Metres by which a trim laps over a lining that shows behind it: usual linings are 22 to 30 mm thick."""
OUTLINE = 0.02
"""Metres from a rectangle's side up to which a trim's outer edge is what that side was told by."""
ALIKE = 0.015
"""Metres by which the widths of a door's trims may differ, as they are seen."""
JUMP = 0.015
"""Step of depth, metres, that no trim has: there it begins or a thing before it does."""
DEPTH_STEP, COLOUR_STEP = 0.003, 0.03
"""Least change of depth (metres) and colour (of 1) that is an edge, if it exceeds four times the columns' noise."""


@dataclass(frozen=True, slots=True)
class Trim:
    """A trim beside a side: its ``inner`` and ``outer`` edges, metres outwards from there, None where something hides
    them; ``lined`` whether a strip of lining shows inside it.
    """

    inner: float | None
    outer: float | None
    lined: bool

    @property
    def width(self) -> float | None:
        """Metres, None where one of its edges is hidden."""
        return None if self.inner is None or self.outer is None else self.outer - self.inner


def trims_round(sections: Sequence[Section], wall: float) -> list[Trim | None]:
    """The trim beside each side: of the strips that stand out from the wall at depth ``wall`` the innermost that is as
    wide as those of most sides.
    """
    found = [_strips(section, wall) for section in sections]
    widths = [[t.width for t in strips if t.width is not None] for strips in found]
    every = [w for ws in widths for w in ws]
    agree = [sum(any(abs(w - other) < ALIKE for other in ws) for ws in widths) for w in every]
    usual = every[int(np.argmax(agree))] if every and max(agree) > 1 else None
    return [min(strips, key=lambda t: _unlike(t, usual), default=None) for strips in found]


def all_round(trims: Sequence[Trim | None], sections: Sequence[Section]) -> list[float | None]:
    """The inner edges of the trims of all sides, where they are known or follow from those of the others: trims are as
    wide on all sides, and where each that was seen ends at its rectangle's side, that is their outline.
    """
    seen = [trim for trim in trims if trim is not None]
    widths = [t.width for t in seen if t.width is not None]
    outline = bool(seen) and all(t.outer is not None and abs(t.outer) < OUTLINE for t in seen)
    out: list[float | None] = []
    for trim, section in zip(trims, sections, strict=True):
        if trim is not None and trim.inner is not None:
            out.append(trim.inner)
            continue
        outer = trim.outer if trim is not None else 0.0 if outline else None
        inner = outer - float(np.median(widths)) if outer is not None and widths else None
        out.append(inner if inner is not None and _is_hidden(section, inner) else None)
    return out


def _strips(section: Section, wall: float) -> list[Trim]:
    """The strips of a trim's width that stand out from the wall, the innermost first."""
    t, depth = section.t, section.values[:, 3] - wall
    out: list[Trim] = []
    for first, last in _runs(depth > STANDS_OUT, np.abs(np.diff(depth)) > JUMP):
        begins, ends = _gap(t, first - 1), _gap(t, last)
        low, high = t[first] - (begins or PIXEL) / 2, t[last] + (ends or PIXEL) / 2
        bare = last < len(t) - 1 and abs(depth[last + 1]) < STANDS_OUT
        in_corner = last == len(t) - 1 and t[last] < REACH - WIDTH[0]
        if not WIDTH[0] <= high - low <= WIDTH[1] or (last == len(t) - 1 and not in_corner):
            continue
        outer = float(high) if bare and ends else None
        if begins is None or first < 2:
            out.append(Trim(None, outer, False))
            continue
        top = float(np.median(depth[first : last + 1]))
        inner = crossing(t, depth, first - 1, (top + depth[first - 2]) / 2)
        if inner > FARTHEST:
            break
        out.append(Trim(inner, outer, _is_lined(section, depth, first, inner)))
    return [trim for trim in out if trim.inner is not None or trim.outer is not None]


def _unlike(trim: Trim, usual: float | None) -> int:
    """0 for a trim as wide as is usual, 1 for one of which an edge is hidden, 2 for another."""
    if usual is None or trim.width is None:
        return int(usual is not None)
    return 0 if abs(trim.width - usual) < ALIKE else 2


def _is_hidden(section: Section, place: float) -> bool:
    """Whether something hides what is at a place."""
    t = section.t
    below, above = t[t < place - PIXEL / 2], t[t > place + PIXEL / 2]
    return (above.min() if len(above) else np.inf) - (below.max() if len(below) else -np.inf) > WIDEST_GAP


def _gap(t: F64, i: int) -> float | None:
    """Metres between a place and the next, None where there is none near."""
    known = 0 <= i < len(t) - 1 and t[i + 1] - t[i] <= WIDEST_GAP
    return float(t[i + 1] - t[i]) if known else None


def _is_lined(section: Section, depth: F64, first: int, inner: float) -> bool:
    """Whether a strip of lining shows inside the trim that begins at ``first``, its inner edge at ``inner``, and then a
    gap or something deeper.
    """
    strip = first - 2
    while strip >= 0 and abs(depth[strip]) < STANDS_OUT:
        strip -= 1
    if LINING[0] <= section.t[first - 2] - section.t[strip + 1] + PIXEL * (strip < first - 2) <= LINING[1]:
        return True
    if abs(depth[first - 2]) > FLUSH:
        return False
    gap = hairline(section, first - 2, first - 5)
    return gap is not None and inner - gap > LINING[0]


def hairline(section: Section, start: int, stop: int) -> float | None:
    """Where the first of the places from ``start`` down to ``stop`` is that is a gap: darker or deeper than both its
    neighbours.
    """
    means, least = section.means, least_change(section)
    for i in range(start, max(stop, 1), -1):
        line = means[i] - np.maximum(means[i - 1], means[i + 1])
        lower = means[i] - np.minimum(means[i - 1], means[i + 1])
        if (line < -least).any() and (lower[:3] < 0).all():
            return float(section.t[i])
    return None


def least_change(section: Section) -> F64:
    """Least change of colour and depth that is none of chance."""
    return np.maximum(np.array([COLOUR_STEP] * 3 + [DEPTH_STEP]), 4 * section.noise)


def crossing(t: F64, values: F64, at: int, level: float) -> float:
    """Where the values pass a level between ``at`` and the next place, or half way."""
    a, b = values[at], values[at + 1]
    share = (level - a) / (b - a) if abs(b - a) > 1e-9 else 0.5
    return float(t[at] + np.clip(share, 0.0, 1.0) * (t[at + 1] - t[at]))


def _runs(mask: Mask, breaks: Mask) -> list[tuple[int, int]]:
    """First and last place of each run of a mask (n,), which also end at ``breaks`` (n - 1,) between places."""
    begins = mask & np.append(True, ~mask[:-1] | breaks)[: len(mask)]
    ends = mask & np.append(~mask[1:] | breaks, True)[: len(mask)]
    return list(zip(np.flatnonzero(begins).tolist(), np.flatnonzero(ends).tolist(), strict=True))
