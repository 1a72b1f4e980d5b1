"""The colours of plans and views, sRGB, 0-255. They differ in lightness too, for those who see no colours."""

from __future__ import annotations

from typing import Final

from scan2bim.model.elements import Door, Opening, Wall, Window
from scan2bim.report.sheet import Rgb

INK: Final[Rgb] = (38, 40, 46)
FAINT: Final[Rgb] = (120, 124, 132)
WALL: Final[Rgb] = (62, 64, 72)
ASSUMED_WALL: Final[Rgb] = (150, 152, 160)
PASSAGE: Final[Rgb] = (118, 118, 118)
WINDOW: Final[Rgb] = (46, 134, 222)
COLUMN: Final[Rgb] = (90, 70, 60)
GAP: Final[Rgb] = (230, 30, 40)
SHARED: Final[Rgb] = (30, 150, 160)
POINTS: Final[Rgb] = (0, 60, 140)
SCANNER: Final[Rgb] = (200, 0, 140)
DOORS: Final[dict[str, Rgb]] = {
    "open": (20, 150, 70),
    "ajar": (235, 140, 0),
    "closed": (130, 60, 190),
    "unknown": (200, 90, 110),
}
SPACES: Final[tuple[Rgb, ...]] = (
    (255, 243, 214),
    (222, 240, 250),
    (228, 244, 222),
    (250, 228, 232),
    (236, 230, 248),
    (246, 240, 224),
    (220, 244, 240),
    (244, 234, 224),
)


def wall_colour(wall: Wall) -> Rgb:
    """Dark where the thickness was measured, light where it was assumed."""
    return WALL if wall.thickness.source == "measured" else ASSUMED_WALL


def opening_colour(opening: Opening) -> Rgb:
    """By what fills the opening and, for a door, by its state."""
    match opening.fill:
        case Door(state=state):
            return DOORS[state]
        case Window():
            return WINDOW
        case _:
            return PASSAGE


def pale(colour: Rgb, share: float = 0.25) -> Rgb:
    """The colour mixed into white."""
    red, green, blue = (round(255 - (255 - channel) * share) for channel in colour)
    return red, green, blue
