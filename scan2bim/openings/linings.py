"""Linings and frames that lie flush with the wall round a window: of the wall's plane, of another colour.

The opening in the wall ends where they do; geometry alone shows its clear width between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.orthoimage import PIXEL, Orthoimage
from scan2bim.openings.shapes import NOT_HIDDEN, OpeningShape

NARROWEST, WIDEST = 0.015, 0.09
"""Widths of linings and frames seen from the front, metres."""
REACH = 0.15
"""Distance outwards from an edge, metres, over which colours are compared."""
FLUSH = 0.012
"""Metres within which a lining lies in the wall's plane."""
FEWEST = 8
"""Pixels of a line along a side that must be measured."""
STEP, CLEAR_STEP = 0.03, 0.08
"""Difference of colour, of 1, between lining and wall: what an eye sees, and more than light changes along a wall."""
EVEN = 0.5
"""Share of that step by which colours of lining and wall may differ among themselves."""
BESIDE = 0.05
"""Width, metres, of the wall beside a lining with which it is compared."""
ALIKE, SAME_COLOUR = 0.012, 0.12
"""Metres and colour, of 1, within which the linings of the sides of one window agree."""
LEAST_SIDES = 2
"""Sides on which a lining must be seen, one more if it is of nearly the wall's colour: a single one may be a pipe or a
strip of light."""
USUAL, FEWEST_WINDOWS = 0.4, 3
"""Share of a building's windows, and number, that must show one lining for all to have it. Of those that curtains or
furniture hide in part only the ones that show it count."""
INSET = 0.1
"""Distance, metres, from an opening's other sides, in which pixels say nothing about this one."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Lining:
    """Width, metres, sigma of its outer edge, colour (3,) and its difference from the wall's."""

    width: float
    sigma: float
    colour: F64
    step: float


def with_lining(opening: OpeningShape, images: Sequence[Orthoimage]) -> OpeningShape:
    """A window with the lining round it, if one shows on at least two sides of a face; ``images`` of both."""
    if opening.kind != "window":
        return opening
    left, bottom = opening.offset, opening.sill
    box = left, left + opening.width, bottom, bottom + opening.height
    found = [[_lining(*profile(image, box, side)) for side in range(4)] for image in images]
    best = max((_agreeing(sides) for sides in found), key=lambda s: sum(1 for x in s if x), default=[None] * 4)
    shown = [x for x in best if x]
    if len(shown) < LEAST_SIDES + (max((x.step for x in shown), default=0.0) < CLEAR_STEP):
        return opening
    usual = float(np.median([x.width for x in shown]))
    left, right, lower, upper = (x.width if x else usual for x in best)
    return _widened(opening, (left, right, lower, upper), max(x.sigma for x in shown), usual)


def with_usual_linings(found: Sequence[OpeningShape]) -> list[OpeningShape]:
    """Those windows of a building whose lining does not show with the one that most of its windows have: they are of
    one make.
    """
    seen = [o.lining for o in found if o.lining is not None]
    usual = float(np.median(seen)) if seen else 0.0
    windows = sum(1 for o in found if o.kind == "window" and (o.lining is not None or o.hidden == NOT_HIDDEN))
    if sum(1 for width in seen if abs(width - usual) < ALIKE) < max(FEWEST_WINDOWS, USUAL * windows):
        return list(found)
    return [
        _widened(o, (usual, usual, usual, usual), ALIKE / 2, None) if o.kind == "window" and o.lining is None else o
        for o in found
    ]


def _widened(
    opening: OpeningShape, outwards: tuple[float, float, float, float], sigma: float, lining: float | None
) -> OpeningShape:
    """With each side that was seen moved outwards."""
    left, right, lower, upper = (0.0 if opening.hidden[k] > 0 else outwards[k] for k in range(4))
    lower = min(lower, opening.sill)
    return replace(
        opening,
        offset=round(opening.offset - left, 4),
        width=round(opening.width + left + right, 4),
        sill=round(opening.sill - lower, 4),
        height=round(opening.height + lower + upper, 4),
        width_sigma=_with(opening.width_sigma, sigma),
        height_sigma=_with(opening.height_sigma, sigma),
        lining=None if lining is None else round(lining, 4),
    )


def _with(sigma: float | None, other: float) -> float | None:
    return None if sigma is None else round(float(np.hypot(sigma, other)), 4)


def _agreeing(sides: Sequence[_Lining | None]) -> list[_Lining | None]:
    """Those of one width and colour, as many as there are."""
    seen = [x for x in sides if x]
    groups = [[x for x in seen if _alike(x, first)] for first in seen]
    most = max(groups, key=len, default=[])
    return [x if any(x is y for y in most) else None for x in sides]


def _alike(a: _Lining, b: _Lining) -> bool:
    return abs(a.width - b.width) < ALIKE and float(np.abs(a.colour - b.colour).max()) < SAME_COLOUR


def profile(image: Orthoimage, box: tuple[float, float, float, float], side: int) -> tuple[F64, F64]:
    """Distances (n,) outwards from the left (0), right, lower or upper side of a box, and medians of colour (n, 3)
    there, nan where too little was seen in the wall's plane; ``box`` is left, right, bottom, top, metres.
    """
    left, right, bottom, top = box
    edge, outward = ((left, -1), (right, 1), (bottom, -1), (top, 1))[side]
    first = round(edge / PIXEL - 0.5)
    pixels = first + outward * np.arange(round(REACH / PIXEL) + 1)
    size = image.depth.shape[1 if side < 2 else 0]
    pixels = pixels[(pixels >= 0) & (pixels < size)]
    low, high = (bottom, top) if side < 2 else (left, right)
    span = slice(max(0, round((low + INSET) / PIXEL)), max(0, round((high - INSET) / PIXEL)))
    axis = 0 if side < 2 else 1
    along = np.arange(image.depth.shape[axis])[span]
    lines = np.ix_(along, pixels) if side < 2 else np.ix_(pixels, along)
    flush = (image.count[lines] > 0) & (np.abs(image.depth[lines]) < FLUSH)
    flush, rgb = (flush, image.rgb[lines]) if side < 2 else (flush.T, image.rgb[lines].transpose(1, 0, 2))
    count = flush.sum(0)
    ordered = np.sort(np.where(flush[..., None], rgb, np.inf), axis=0)
    out = np.full((len(pixels), 3), np.nan)
    for k in np.flatnonzero(count >= FEWEST).tolist():
        out[k] = (ordered[(count[k] - 1) // 2, k].astype(np.float64) + ordered[count[k] // 2, k]) / 2
    outwards = np.asarray(((pixels + 0.5) * PIXEL - edge) * outward, np.float64)
    return outwards, out


def _lining(t: F64, colour: F64) -> _Lining | None:
    """The strip beside an edge that differs from the wall farther out, from colours (n, 3) at distances ``t`` (n,)."""
    seen = np.isfinite(colour[:, 0]) & (t > -PIXEL / 2)
    t, colour = t[seen], colour[seen]
    best: tuple[float, _Lining] | None = None
    for k in range(1, len(t)):
        width = (t[k - 1] + t[k]) / 2
        outer = colour[k:][t[k:] < t[k] + BESIDE]
        if not NARROWEST <= width <= WIDEST or t[k] - t[k - 1] > 2.5 * PIXEL or len(outer) < 2:
            continue
        inside, wall = np.median(colour[:k], 0), np.median(outer, 0)
        step = float(np.abs(inside - wall).max())
        uneven = float(np.abs(colour[:k] - inside).max() + np.abs(outer - wall).max(1).mean())
        if step > STEP and uneven < EVEN * step and (best is None or step - uneven > best[0]):
            best = step - uneven, _Lining(float(width), float(t[k] - t[k - 1]) / 12**0.5, inside, step)
    return None if best is None else best[1]
