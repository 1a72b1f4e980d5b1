"""Sizes of openings in a plan, moved off the names of rooms, the scanners and each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from scan2bim.model.elements import Opening, Point3, Wall
from scan2bim.report.plan_symbols import opening_label
from scan2bim.report.sheet import Text, View, text_width

_STEPS: Final = tuple(12.0 * step for step in range(9))
"""Pixels by which a label is moved away from its opening, the first that is free."""
_RING: Final = 8.0
"""Pixels that a scanner's sign reaches from its place."""

Box = tuple[float, float, float, float]


def opening_labels(
    view: View, hosted: Iterable[tuple[Wall, Opening]], names: Sequence[Text], scanners: Iterable[Point3]
) -> Iterator[Text]:
    """The size of each opening beside it, as near as it is most free of what stands there already."""
    taken = [_box(name) for name in names]
    for x, y in (view.page([position[:2]])[0].tolist() for position in scanners):
        taken.append((x - _RING, y - _RING, x + _RING, y + _RING))
    for wall, opening in hosted:
        tries = [opening_label(view, wall, opening, step) for step in _STEPS]
        label = min(tries, key=lambda text: sum(_shared(_box(text), box) for box in taken))
        taken.append(_box(label))
        yield label


def _box(text: Text) -> Box:
    half = text_width(text.words, text.size) / 2
    return text.x - half, text.y - 0.8 * text.size, text.x + half, text.y + 0.2 * text.size


def _shared(one: Box, other: Box) -> float:
    """Square pixels that two boxes share."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return max(width, 0.0) * max(height, 0.0)
