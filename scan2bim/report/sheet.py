"""A sheet of simple marks, in pixels (96 to the inch) with y down, which is written as SVG or PDF or rasterised.

Colours are sRGB, 0-255. Marks are drawn in their order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Rgb: TypeAlias = tuple[int, int, int]
Floats: TypeAlias = npt.NDArray[np.float64]
Image: TypeAlias = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Closed rings (even-odd filled) or, where not closed, lines.

    rings: each (n, 2) pixels. width: of the stroke, pixels. dash: length of dashes and gaps, pixels, 0 for none.
    """

    rings: tuple[Floats, ...]
    fill: Rgb | None = None
    stroke: Rgb | None = None
    width: float = 1.0
    opacity: float = 1.0
    dash: float = 0.0
    closed: bool = True


@dataclass(frozen=True, slots=True)
class Text:
    """Words at a point of their baseline. size: height of the font, pixels. halo: drawn on a white rim.

    angle: degrees by which the baseline is turned counter-clockwise about the point.
    """

    x: float
    y: float
    words: str
    size: float
    colour: Rgb
    anchor: Literal["start", "middle", "end"] = "start"
    bold: bool = False
    halo: bool = False
    angle: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture that darkens what is below it (white leaves it as it is): (h, w, 3) sRGB, rows down.

    matrix: (2, 3) from its pixel corners to the sheet's pixels.
    """

    pixels: Image
    matrix: Floats


Mark: TypeAlias = Shape | Text | Picture


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Marks on a white sheet of this size in pixels."""

    width: int
    height: int
    marks: tuple[Mark, ...]


@dataclass(frozen=True, slots=True)
class View:
    """From plan metres (y up) to a sheet's pixels (y down): scale in pixels a metre, the page position of x, y = 0."""

    scale: float
    x0: float
    y0: float

    def page(self, points: Iterable[tuple[float, float]] | Floats) -> Floats:
        """(n, 2) metres to (n, 2) pixels."""
        plan = np.asarray(points if isinstance(points, np.ndarray) else list(points), np.float64).reshape(-1, 2)
        return np.column_stack([self.x0 + self.scale * plan[:, 0], self.y0 - self.scale * plan[:, 1]])


def line(points: Floats, colour: Rgb, width: float, dash: float = 0.0) -> Shape:
    """An open line through pixels (n, 2)."""
    return Shape((points,), None, colour, width, dash=dash, closed=False)


def text_width(words: str, size: float) -> float:
    """About how wide words are in the fonts used, pixels."""
    return 0.56 * size * len(words)
