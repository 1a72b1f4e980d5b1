"""Colours of elements: linear as in the model, sRGB as on a screen, and stand-ins where the scan gave none."""

from __future__ import annotations

from typing import Final

from scan2bim.model.elements import Colour, Element

_STAND_INS: Final[dict[str, Colour]] = {
    "Wall": (0.72, 0.70, 0.66),
    "Slab": (0.42, 0.40, 0.38),
    "Covering": (0.85, 0.85, 0.84),
    "Space": (0.45, 0.62, 0.80),
    "Column": (0.55, 0.55, 0.55),
    "Stair": (0.50, 0.45, 0.38),
    "Door": (0.40, 0.22, 0.10),
    "Window": (0.55, 0.75, 0.85),
}
_GREY: Final[Colour] = (0.6, 0.6, 0.6)


def colour_of(element: Element) -> Colour:
    """The element's linear colour, or its kind's stand-in."""
    return element.colour or _STAND_INS.get(type(element).__name__, _GREY)


def to_srgb(colour: Colour) -> tuple[int, int, int]:
    """Linear to sRGB, 0-255 (IEC 61966-2-1)."""
    red, green, blue = (round(255 * _encode(channel)) for channel in colour)
    return red, green, blue


def to_linear(srgb: tuple[int, int, int]) -> Colour:
    """SRGB, 0-255, to linear."""
    red, green, blue = (_decode(channel / 255) for channel in srgb)
    return red, green, blue


def _encode(value: float) -> float:
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


def _decode(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
