"""A sheet as pixels."""

from __future__ import annotations

import math
import unicodedata
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from scan2bim.errors import StageError
from scan2bim.report.sheet import Floats, Image, Picture, Rgb, Shape, Sheet, Text

_SHIFT: Final = 4  # bits of a pixel's fraction that shapes are drawn to
_HALO: Final = [(x, y) for x in (-2, -1, 0, 1, 2) for y in (-2, -1, 0, 1, 2) if (x, y) != (0, 0)]


def sheet_image(sheet: Sheet) -> Image:
    """The sheet as (height, width, 3) sRGB."""
    image = np.full((sheet.height, sheet.width, 3), 255, np.uint8)
    for mark in sheet.marks:
        match mark:
            case Shape():
                _draw_shape(image, mark)
            case Text():
                _draw_text(image, mark)
            case Picture():
                _draw_picture(image, mark)
    return image


def encode_png(image: Image) -> bytes:
    """An sRGB picture as the bytes of a PNG file. Raises StageError where it cannot be encoded."""
    done, data = cv2.imencode(".png", np.ascontiguousarray(image[..., ::-1]), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    if not done:
        raise StageError(f"A picture of {image.shape[1]} x {image.shape[0]} pixels cannot be written as PNG.")
    return data.tobytes()


def _draw_shape(image: Image, shape: Shape) -> None:
    rings = [_fixed(ring) for ring in shape.rings if len(ring)]
    if not rings:
        return
    target = image.copy() if shape.opacity < 1.0 else image
    if shape.fill is not None:
        cv2.fillPoly(target, rings, shape.fill, cv2.LINE_AA, _SHIFT)
    if shape.stroke is not None:
        lines = rings if not shape.dash else [dash for ring in shape.rings for dash in _dashes(ring, shape)]
        closed = shape.closed and not shape.dash
        cv2.polylines(target, lines, closed, shape.stroke, max(1, round(shape.width)), cv2.LINE_AA, _SHIFT)
    if shape.opacity < 1.0:
        cv2.addWeighted(target, shape.opacity, image, 1.0 - shape.opacity, 0.0, dst=image)


def _fixed(points: Floats) -> npt.NDArray[np.int32]:
    """Pixels, whose middles are at integers for the drawing functions, in fractions."""
    return np.round((points - 0.5) * (1 << _SHIFT)).astype(np.int32)


def _dashes(ring: Floats, shape: Shape) -> list[npt.NDArray[np.int32]]:
    """The line cut into dashes and gaps of one length, in pixels' fractions."""
    points = np.concatenate([ring, ring[:1]]) if shape.closed else ring
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    starts = np.arange(0.0, along[-1], 2 * shape.dash)
    ends = np.minimum(starts + shape.dash, along[-1])
    cuts = [np.concatenate([[a], along[(along > a) & (along < b)], [b]]) for a, b in zip(starts, ends, strict=True)]
    return [_fixed(np.column_stack([np.interp(cut, along, points[:, k]) for k in (0, 1)])) for cut in cuts]


def _draw_picture(image: Image, picture: Picture) -> None:
    """Multiply the sheet by the picture under its matrix, nearest pixel."""
    if picture.pixels.size == 0:
        return
    matrix = picture.matrix.copy()
    matrix[:, 2] += matrix[:, :2].sum(axis=1) / 2 - 0.5  # from pixel corners to pixel middles
    size, white = (image.shape[1], image.shape[0]), (255, 255, 255)
    laid = cv2.warpAffine(picture.pixels, matrix, size, flags=cv2.INTER_NEAREST, borderValue=white)
    cv2.multiply(image, laid, dst=image, scale=1 / 255)


def _draw_text(image: Image, text: Text) -> None:
    if text.angle:
        _draw_turned(image, text)
        return
    x = text.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor] * _measure(text)
    origin = (round(x), round(text.y))
    if text.halo:
        for dx, dy in _HALO:
            _put(image, text, (origin[0] + dx, origin[1] + dy), (255, 255, 255))
    _put(image, text, origin, text.colour)


def _draw_turned(image: Image, text: Text) -> None:
    """Draw the words on a patch of their own, turn it, and darken the image by it."""
    reach = math.ceil(_measure(text) + 2 * text.size)
    patch = np.full((2 * reach, 2 * reach, 3), 255, np.uint8)
    _draw_text(patch, replace(text, x=reach, y=reach, angle=0.0))
    turn = cv2.getRotationMatrix2D((reach, reach), text.angle, 1.0)
    patch = cv2.warpAffine(patch, turn, patch.shape[:2], flags=cv2.INTER_LINEAR, borderValue=(255, 255, 255))
    left, top = round(text.x) - reach, round(text.y) - reach
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(left + 2 * reach, image.shape[1]), min(top + 2 * reach, len(image))
    if x0 < x1 and y0 < y1:
        part = image[y0:y1, x0:x1]
        np.minimum(part, patch[y0 - top : y1 - top, x0 - left : x1 - left], out=part)


def _weight(text: Text) -> int:
    return 700 if text.bold else 400


if hasattr(cv2, "FontFace"):  # OpenCV 5 draws with a font of its own; before, with strokes and ASCII alone
    _FACE: Final = cv2.FontFace("sans")

    def _measure(text: Text) -> float:
        _, _, width, _ = cv2.getTextSize((0, 0), text.words, (0, 0), _FACE, round(text.size), _weight(text))
        return float(width)

    def _put(image: Image, text: Text, origin: tuple[int, int], colour: Rgb) -> None:
        cv2.putText(image, text.words, origin, colour, _FACE, round(text.size), _weight(text))

else:

    def _measure(text: Text) -> float:
        (width, _), _ = cv2.getTextSize(_ascii(text.words), cv2.FONT_HERSHEY_SIMPLEX, text.size / 30, 1)
        return float(width)

    def _put(image: Image, text: Text, origin: tuple[int, int], colour: Rgb) -> None:
        strokes = 2 if text.bold else 1
        scale = text.size / 30  # capitals of the stroke font are 22 pixels high, of a font of size 30 too
        cv2.putText(image, _ascii(text.words), origin, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, strokes, cv2.LINE_AA)

    def _ascii(words: str) -> str:
        plain = words.replace("ß", "ss").replace("·", "-").replace("×", "x")
        return unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode("ascii")
