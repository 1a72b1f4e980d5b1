"""Linings of doors that fill the wall's depth and lie flush with its face: of its plane, of another colour.

The reveals that show are the lining's own; the opening in the wall ends where its colour does. A door's lining is the
same on both sides and at the head, so that the three are looked at together: paint differs by little from paint.
"""

from __future__ import annotations

from collections.abc import Sequence

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
TRIM, DEEPEST_TRIM = 0.005, 0.04
"""Metres from which on a strip stands out of the wall and is a trim, and up to which trims do."""
F64 = NDArray[np.float64]


def flush_lining(
    images: Sequence[Orthoimage], box: tuple[float, float, float], sides: Sequence[int] = (0, 1, 2)
) -> float | None:
    """Width, metres, of the lining round a door's clear ``box`` (left, right, top), by the face that shows it best;
    None where none shows. Only ``sides`` of left (0), right and head are asked.
    """
    found = [_lining(image, box, sides) for image in images]
    return max((f for f in found if f is not None), default=(0.0, None))[1]


def _lining(image: Orthoimage, box: tuple[float, float, float], sides: Sequence[int]) -> tuple[float, float] | None:
    """The contrast of a lining on one face, and its width."""
    t = np.arange(STEP, WALL[1], STEP)
    around = box[0], box[1], 0.0, box[2]
    shown = [c for side in sides if (c := _against_wall(t, *profile(image, around, (0, 1, 3)[side]))) is not None]
    if len(shown) < SIDES:
        return None
    stack = np.array(shown)
    known = np.isfinite(stack[..., 0]).sum(0) >= SIDES
    t, stack = t[known], stack[:, known]
    if len(t) < 3 or t[0] > NARROWEST:
        return None
    step = _step(t, np.nanmean(stack, 0), stack)
    return None if step is None or _stands_out(image, around, step[1]) else step


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


def _step(t: F64, mean: F64, stack: F64) -> tuple[float, float] | None:
    """The clearest place where a strip of one colour ends and the wall begins: contrast and width."""
    best: tuple[float, float] | None = None
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
        clear = abs(contrast) > LEAST and spread < EVEN * abs(contrast)
        if clear and (each * np.sign(contrast) > ALIKE * abs(contrast)).sum() >= SIDES:
            crossing = _crossing(t, mean[:, channel], k, float(strip[channel] + wall[channel]) / 2)
            found = abs(contrast) - spread, crossing
            best = found if best is None or found[0] > best[0] else best
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
