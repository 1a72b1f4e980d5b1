"""Linings of doors that fill the wall's depth and lie flush with its face: of its plane, of another colour.

The reveals that show are the lining's own; the opening in the wall ends where its colour does. A door's lining is the
same on both sides and at the head, so that the three are looked at together: paint differs by little from paint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.linings import profile
from scan2bim.openings.orthoimage import PIXEL, Orthoimage

STEP = 0.005
"""Metres between the places at which the sides' colours are put together."""
NARROWEST, WIDEST = 0.02, 0.08
"""Widths of linings seen from the front, metres."""
WALL = (0.095, 0.15)
"""Distances outwards, metres, between which the wall shows beside a lining."""
BESIDE = 0.035
"""Width, metres, of the wall beside a lining with which it is compared."""
LEAST = 0.02
"""Difference of colour, of 1, between lining and wall: twice what is left of a pixel's noise and of changing light."""
EVEN = 0.4
"""Share of that difference by which colours of lining and wall may differ among themselves."""
ALIKE = 0.4
"""Share of that difference that each side must show."""
SIDES = 2
"""Sides that must show it."""
MISSING = 0.35
"""Share of that difference below which a side shows no lining."""
AGREE = 0.012
"""Metres to which the sides of one lining agree: what all of them show together is surer."""
TRIM, DEEPEST_TRIM = 0.005, 0.04
"""Metres from which on a strip stands out of the wall and is a trim, and up to which trims do."""
FAINT, MOST = 0.008, 0.75
"""The same of both faces together, where the means of more sides have less noise: of at least three sides of which this
share must show it.
"""
PLAIN, NEAR = 0.01, (0.005, 0.03)
"""Difference of colour, of 1, up to which all is the wall's; and distances outwards, metres, between which a lining of
any width shows.
"""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lining:
    """A lining of ``width`` metres, and where it ends outwards from the left, right and upper side of a clear width:
    farther off where a leaf stands before it, at 0 where the wall begins right at the edge.
    """

    width: float
    sides: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """The ``width`` of a strip, its ``contrast``, the share of it that each side shows (s,), nan where unknown, and the
    ``channel`` that shows it best, in which it has a ``colour`` against the wall's.
    """

    contrast: float
    width: float
    shares: F64
    channel: int
    colour: float


def flush_lining(
    images: Sequence[Orthoimage], box: tuple[float, float, float], sides: Sequence[int] = (0, 1, 2)
) -> float | None:
    """Width, metres, of the lining round a door's clear ``box`` (left, right, top), by the face that shows it best;
    None where none shows. Only ``sides`` of left (0), right and head are asked.
    """
    step = _best_step(images, box, sides)
    return None if step is None else step.width


def seen_lining(images: Sequence[Orthoimage], box: tuple[float, float, float]) -> Lining | None:
    """The same of an open door, and where it ends on each side."""
    step = _best_step(images, box, (0, 1, 2))
    if step is None:
        return None
    ends = [_side_end(images, (box[0], box[1], 0.0, box[2]), side, step) for side in (0, 1, 3)]
    shown = [end for end in ends if end]
    usual = float(np.median(shown)) if len(shown) >= SIDES else step.width
    return Lining(usual, tuple(usual if end is None or 0.0 < abs(end - usual) < AGREE else end for end in ends))


def faint_lining(images: Sequence[Orthoimage], box: tuple[float, float, float]) -> Lining | None:
    """A lining of nearly the wall's colour, by all sides of both faces together."""
    t = np.arange(STEP, WALL[1], STEP)
    around = box[0], box[1], 0.0, box[2]
    sides = [_against_wall(t, *profile(image, around, side)) for image in images for side in (0, 1, 3)]
    shown = [colours for colours in sides if colours is not None]
    if len(shown) <= SIDES:
        return None
    step = _step_of(t, np.array(shown), FAINT)
    if step is None or any(_stands_out(image, around, step.width) for image in images):
        return None
    known = step.shares[np.isfinite(step.shares)]
    if len(known) <= SIDES or (known > ALIKE).mean() < MOST:
        return None
    return Lining(step.width, (step.width,) * 3)


def is_plain(images: Sequence[Orthoimage], box: tuple[float, float, float]) -> bool:
    """Whether the wall's own colour goes on right up to an opening's ``box`` (left, right, top), as far as it shows on
    any face: on two sides at least.
    """
    changes: list[float] = []
    for image in images:
        for side in (0, 1, 3):
            t, colours = profile(image, (box[0], box[1], 0.0, box[2]), side)
            seen = np.isfinite(colours[:, 0])
            beside, wall = seen & (t > NEAR[0]) & (t < NEAR[1]), seen & (t > WALL[0]) & (t < WALL[1])
            if beside.sum() >= 2 and wall.sum() >= 3:
                changes.append(float(np.abs(np.median(colours[beside], 0) - np.median(colours[wall], 0)).max()))
    return len(changes) >= SIDES and float(np.median(changes)) < PLAIN


def _best_step(images: Sequence[Orthoimage], box: tuple[float, float, float], sides: Sequence[int]) -> _Step | None:
    """The edge of a lining, by the face that shows it best."""
    found = [step for image in images if (step := _lining(image, box, sides)) is not None]
    return max(found, key=lambda step: (step.contrast, step.width), default=None)


def _side_end(
    images: Sequence[Orthoimage], around: tuple[float, float, float, float], side: int, step: _Step
) -> float | None:
    """Where a lining ends outwards from a side of a box (left, right, bottom, top), as the faces show it: 0 where there
    is none, None where no face tells.
    """
    t = np.arange(STEP, WALL[1], STEP)
    profiles = [_against_wall(t, *profile(image, around, side)) for image in images]
    ends = [end for colours in profiles if colours is not None and (end := _end(t, colours, step)) is not None]
    shown = [end for end in ends if end > 0.0]
    return float(np.median(shown)) if shown else 0.0 if ends else None


def _lining(image: Orthoimage, box: tuple[float, float, float], sides: Sequence[int]) -> _Step | None:
    """The edge of the lining that one face shows."""
    t = np.arange(STEP, WALL[1], STEP)
    around = box[0], box[1], 0.0, box[2]
    profiles = [_against_wall(t, *profile(image, around, (0, 1, 3)[side])) for side in sides]
    shown = [colours for colours in profiles if colours is not None]
    step = _step_of(t, np.array(shown), LEAST) if len(shown) >= SIDES else None
    return None if step is None or _stands_out(image, around, step.width) else step


def _end(t: F64, colours: F64, step: _Step) -> float | None:
    """Where a lining ends outwards from one side with colours (n, 3), by its colour; 0 where there is none, None where
    the side does not tell.
    """
    seen = np.isfinite(colours[:, 0])
    t, share = t[seen], colours[seen, step.channel] / step.colour
    lined = share > 0.5
    last = np.flatnonzero(lined)
    if not len(last):
        plain = len(t) and t[0] < NARROWEST and abs(share[t < step.width].mean()) < MISSING
        return 0.0 if plain else None
    k = int(last[-1])
    clear = lined[: k + 1].sum() > len(t[: k + 1]) / 2 and len(t) - k > 3 and t[k + 1] - t[k] < 3 * STEP
    return float(t[k] + t[k + 1]) / 2 if clear else None


def _step_of(t: F64, stack: F64, least: float) -> _Step | None:
    """As ``_step`` of sides (s, n, 3), at the distances at which enough of them are known."""
    known = np.isfinite(stack[..., 0]).sum(0) >= SIDES
    t, stack = t[known], stack[:, known]
    return _step(t, np.nanmean(stack, 0), stack, least) if len(t) >= 3 and t[0] <= NARROWEST else None


def _stands_out(image: Orthoimage, around: tuple[float, float, float, float], width: float) -> bool:
    """Whether a strip of a width round a box (left, right, bottom, top) is a trim: before the wall farther out."""
    left, right, _, top = around
    height, length = image.depth.shape
    x, z = (np.arange(length) + 0.5) * PIXEL, (np.arange(height) + 0.5) * PIXEL
    out = np.maximum(np.maximum(left - x, x - right)[None, :], (z - top)[:, None])
    seen = (image.count > 0) & (np.abs(image.depth) < DEEPEST_TRIM)
    strip, wall = seen & (out > 0) & (out < width), seen & (out > WALL[0]) & (out < WALL[1])
    if not strip.any() or not wall.any():
        return False
    return float(np.median(image.depth[strip]) - np.median(image.depth[wall])) > TRIM


def _against_wall(t: F64, places: F64, colours: F64) -> F64 | None:
    """Differences (n, 3) of colour from the wall's, at distances ``t`` (n,) outwards; None where no wall shows."""
    seen = np.isfinite(colours[:, 0])
    wall = seen & (places > WALL[0])
    if wall.sum() < 3:
        return None
    out = np.column_stack([np.interp(t, places[seen], c) for c in (colours[seen] - np.median(colours[wall], 0)).T])
    far = np.abs(t[:, None] - places[seen]).min(1) > 2 * STEP
    return np.where(far[:, None], np.nan, out)


def _step(t: F64, mean: F64, stack: F64, least: float) -> _Step | None:
    """The clearest place where a strip of one colour ends and the wall begins, of a contrast above the ``least``."""
    best: _Step | None = None
    for k in range(2, len(t)):
        width = float(t[k - 1] + t[k]) / 2
        if not NARROWEST <= width <= WIDEST or t[k] - t[k - 1] > 3 * STEP:
            continue
        body, outer = mean[: k - 1], mean[k + 1 :][t[k + 1 :] < t[k] + BESIDE]
        if len(body) < 2 or len(outer) < 3:
            continue
        strip, wall = np.median(body, 0), np.median(outer, 0)
        channel = int(np.abs(strip - wall).argmax())
        contrast = float(strip[channel] - wall[channel])
        spread = float(np.abs(body[:, channel] - strip[channel]).mean() + np.abs(outer - wall)[:, channel].mean())
        each = _known_mean(stack[:, : k - 1, channel]) - _known_mean(stack[:, k + 1 :, channel])
        clear = abs(contrast) > least and spread < EVEN * abs(contrast)
        if clear and (each * np.sign(contrast) > ALIKE * abs(contrast)).sum() >= SIDES:
            crossing = _crossing(t, mean[:, channel], k, float(strip[channel] + wall[channel]) / 2)
            found = _Step(abs(contrast) - spread, crossing, each / contrast, channel, contrast)
            best = found if best is None or found.contrast > best.contrast else best
    return best


def _known_mean(values: F64) -> F64:
    """Means (n,) of the known among values (n, m), nan where none is."""
    known = np.isfinite(values)
    return np.where(known.any(1), np.nansum(values, 1) / np.maximum(known.sum(1), 1), np.nan)


def _crossing(t: F64, values: F64, at: int, level: float) -> float:
    """Where the values pass a level near ``t[at]``."""
    near = np.arange(max(at - 2, 0), min(at + 2, len(t) - 1))
    passes = [i for i in near if (values[i] - level) * (values[i + 1] - level) <= 0]
    if not passes:
        return float(t[at - 1] + t[at]) / 2
    i = min(passes, key=lambda j: abs(j - at))
    return float(np.interp(0.0, sorted((values[i] - level, values[i + 1] - level)), [t[i], t[i + 1]]))
