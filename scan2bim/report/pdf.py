"""Sheets as the pages of a PDF file: vectors and text, to scale when printed at full size."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from scan2bim.report.raster import encode_png
from scan2bim.report.sheet import Picture, Rgb, Shape, Sheet, Text

if TYPE_CHECKING:
    from reportlab.pdfgen.canvas import Canvas

POINTS: Final = 0.75
"""Points of a PDF in a sheet's pixel: 72 and 96 to the inch."""
_FONTS: Final = ("Helvetica", "Helvetica-Bold")


def write_pdf(sheets: Sequence[Sheet], path: Path, title: str) -> None:
    """A page a sheet. The date is left out, so that reruns are equal. Raises OSError."""
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1, pageCompression=1)
    canvas.setTitle(title)
    canvas.setCreator("scan2bim")
    for sheet in sheets:
        canvas.setPageSize((sheet.width * POINTS, sheet.height * POINTS))
        canvas.transform(POINTS, 0, 0, -POINTS, 0, sheet.height * POINTS)
        for mark in sheet.marks:
            match mark:
                case Shape():
                    _draw_shape(canvas, mark)
                case Text():
                    _draw_text(canvas, mark)
                case Picture():
                    _draw_picture(canvas, mark)
        canvas.showPage()
    canvas.save()


def _draw_shape(canvas: Canvas, shape: Shape) -> None:
    path: Any = canvas.beginPath()
    for ring in shape.rings:
        for number, (x, y) in enumerate(ring.tolist()):
            (path.lineTo if number else path.moveTo)(x, y)
        if shape.closed and len(ring):
            path.close()
    canvas.saveState()
    canvas.setFillAlpha(shape.opacity)
    canvas.setStrokeAlpha(shape.opacity)
    canvas.setLineJoin(1)
    if shape.fill is not None:
        canvas.setFillColorRGB(*_colour(shape.fill))
    if shape.stroke is not None:
        canvas.setStrokeColorRGB(*_colour(shape.stroke))
        canvas.setLineWidth(shape.width)
    if shape.dash:
        canvas.setDash(shape.dash, shape.dash)
    canvas.drawPath(path, stroke=int(shape.stroke is not None), fill=int(shape.fill is not None), fillMode=0)
    canvas.restoreState()


def _draw_text(canvas: Canvas, text: Text) -> None:
    """Words in a font that every reader has; what that font lacks becomes a question mark."""
    font = _FONTS[int(text.bold)]
    words = text.words.encode("cp1252", "replace").decode("cp1252")
    width = canvas.stringWidth(words, font, text.size)
    canvas.saveState()
    canvas.translate(text.x, text.y)
    canvas.scale(1, -1)
    canvas.rotate(text.angle)
    left = -width * {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor]
    if text.halo:
        _put(canvas, words, (font, text.size), left, (255, 255, 255), mode=1)
    _put(canvas, words, (font, text.size), left, text.colour, mode=0)
    canvas.restoreState()


def _put(canvas: Canvas, words: str, font: tuple[str, float], left: float, colour: Rgb, *, mode: int) -> None:
    """Words at ``left`` on the baseline, filled (mode 0) or with a wide outline (1)."""
    canvas.saveState()
    canvas.setFillColorRGB(*_colour(colour))
    canvas.setStrokeColorRGB(*_colour(colour))
    canvas.setLineWidth(3)
    canvas.setLineJoin(1)
    line: Any = canvas.beginText(left, 0)
    line.setFont(*font)
    line.setTextRenderMode(mode)
    line.textOut(words)
    canvas.drawText(line)
    canvas.restoreState()


def _draw_picture(canvas: Canvas, picture: Picture) -> None:
    from reportlab.lib.utils import ImageReader

    if picture.pixels.size == 0:
        return
    (a, c, e), (b, d, f) = picture.matrix.tolist()
    rows, columns = picture.pixels.shape[:2]
    canvas.saveState()
    canvas.transform(a, b, c, d, e, f)
    canvas.transform(1, 0, 0, -1, 0, rows)
    canvas.setBlendMode("Multiply")
    canvas.drawImage(ImageReader(io.BytesIO(encode_png(picture.pixels))), 0, 0, columns, rows)
    canvas.restoreState()


def _colour(colour: Rgb) -> tuple[float, float, float]:
    red, green, blue = (channel / 255 for channel in colour)
    return red, green, blue
