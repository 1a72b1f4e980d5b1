"""A sheet as SVG."""

from __future__ import annotations

import base64
from typing import Final
from xml.sax.saxutils import escape

from scan2bim.report.raster import encode_png
from scan2bim.report.sheet import Floats, Mark, Picture, Rgb, Shape, Sheet, Text

_FONT = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"


MILLIMETRES: Final = 25.4 / 96
"""Of a sheet's pixel on paper."""


def sheet_svg(sheet: Sheet) -> str:
    """The sheet as the text of an SVG file."""
    width, height = (_number(pixels * MILLIMETRES) for pixels in (sheet.width, sheet.height))
    size = f'width="{width}mm" height="{height}mm" viewBox="0 0 {sheet.width} {sheet.height}"'
    head = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{_FONT}">',
        f'<rect width="{sheet.width}" height="{sheet.height}" fill="#ffffff"/>',
    ]
    return "\n".join([*head, *(_mark(mark) for mark in sheet.marks), "</svg>", ""])


def _mark(mark: Mark) -> str:
    match mark:
        case Shape():
            return _shape(mark)
        case Text():
            return _text(mark)
        case Picture():
            return _picture(mark)


def _shape(shape: Shape) -> str:
    path = " ".join(_path(ring) + (" Z" if shape.closed else "") for ring in shape.rings if len(ring))
    style = f'fill="{_colour(shape.fill)}" fill-rule="evenodd"'
    if shape.stroke is not None:
        style += f' stroke="{_colour(shape.stroke)}" stroke-width="{_number(shape.width)}" stroke-linejoin="round"'
    if shape.dash:
        style += f' stroke-dasharray="{_number(shape.dash)}"'
    if shape.opacity < 1.0:
        style += f' opacity="{_number(shape.opacity)}"'
    return f'<path d="{path}" {style}/>'


def _path(ring: Floats) -> str:
    return "M" + " L".join(f"{_number(x)} {_number(y)}" for x, y in ring.tolist())


def _text(text: Text) -> str:
    style = f'font-size="{_number(text.size)}" fill="{_colour(text.colour)}" text-anchor="{text.anchor}"'
    if text.bold:
        style += ' font-weight="bold"'
    if text.angle:
        style += f' transform="rotate({_number(-text.angle)} {_number(text.x)} {_number(text.y)})"'
    if text.halo:
        style += ' stroke="#ffffff" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
    return f'<text x="{_number(text.x)}" y="{_number(text.y)}" {style}>{escape(text.words)}</text>'


def _picture(picture: Picture) -> str:
    if picture.pixels.size == 0:
        return ""
    (a, c, e), (b, d, f) = picture.matrix.tolist()
    data = base64.b64encode(encode_png(picture.pixels)).decode("ascii")
    rows, columns = picture.pixels.shape[:2]
    matrix = " ".join(f"{value:.6g}" for value in (a, b, c, d, e, f))
    return (
        f'<image width="{columns}" height="{rows}" transform="matrix({matrix})" '
        f'style="image-rendering: pixelated; mix-blend-mode: multiply" href="data:image/png;base64,{data}"/>'
    )


def _colour(colour: Rgb | None) -> str:
    return "none" if colour is None else "#{:02x}{:02x}{:02x}".format(*colour)


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
