"""Chains of lengths beside a plan."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from scan2bim.model.dimension_lines import DimensionLine
from scan2bim.report.palette import FAINT
from scan2bim.report.sheet import Mark, Text, View, line, text_width

_FIRST: Final = 32.0  # pixels from a wall to its chain
_WHOLE: Final = 54.0  # pixels to the chain of the whole
ROOM: Final = 72.0
"""Pixels that chains take beside a plan."""
_TICK: Final = 4.0  # pixels
_TEXT: Final = 10.0  # pixels
_LEAST: Final = 0.9
"""Of a text's width that its length must have to be written."""


def draw_dimensions(view: View, chain: DimensionLine) -> Iterator[Mark]:
    """The chain's line, a tick at each point, a thread to what is measured, and the lengths in metres."""
    away = np.array([chain.outwards[0], -chain.outwards[1]]) * (_FIRST if chain.row == 1 else _WHOLE)
    points = view.page(chain.points)
    first, last = points[0] + away, points[-1] + away
    along = (last - first) / max(float(np.linalg.norm(last - first)), 1e-9)
    ends = np.array([first + along * float((point - points[0]) @ along) for point in points])
    yield line(np.stack([ends[0], ends[-1]]), FAINT, 1)
    tick = (along + np.array([-along[1], along[0]])) * _TICK / math.sqrt(2)
    for point, end in zip(points, ends, strict=True):
        yield line(np.stack([end - tick, end + tick]), FAINT, 1)
        yield line(np.stack([point + away * 0.2, end + away / np.linalg.norm(away) * _TICK]), FAINT, 0.5)
    for (start, end), length in zip(pairwise(ends), chain.lengths, strict=True):
        words = f"{length:.2f}"
        if np.linalg.norm(end - start) > _LEAST * text_width(words, _TEXT):
            yield _length(words, (start + end) / 2, along)


def _length(words: str, place: np.ndarray, along: np.ndarray) -> Text:
    """Words over a line, read from below or from the right."""
    angle = (math.degrees(math.atan2(-along[1], along[0])) + 90) % 180 - 90
    up = np.array([-math.sin(math.radians(angle)), -math.cos(math.radians(angle))])
    x, y = (place + 3.0 * up).tolist()
    return Text(x, y, words, _TEXT, FAINT, "middle", angle=angle)
