"""Small diagrams as SVG: lines and points over two axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

WIDTH, HEIGHT, LEFT, BELOW, TOP = 460, 320, 52, 42, 18
COLOURS = ("#1f5fa8", "#c0502a", "#3a8a4c", "#777777")


@dataclass(frozen=True, slots=True)
class Series:
    """A name and its points; ``joined`` by a line or not."""

    name: str
    points: Sequence[tuple[float, float]]
    joined: bool = True


@dataclass(frozen=True, slots=True)
class Axis:
    """Words, and the least and greatest value shown."""

    words: str
    low: float
    high: float

    def place(self, value: float, start: float, end: float) -> float:
        """Where a value stands between two ends in the picture."""
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return start + share * (end - start)


def write_diagram(path: Path, x: Axis, y: Axis, all_of: Sequence[Series]) -> None:
    """Write the diagram."""
    path.parent.mkdir(parents=True, exist_ok=True)
    right, bottom = WIDTH - 14, HEIGHT - BELOW
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="Helvetica, sans-serif"'
        ' font-size="11">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        f'<rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}" fill="none" stroke="#999999"/>',
    ]
    for i in range(6):
        a, b = x.low + (x.high - x.low) * i / 5, y.low + (y.high - y.low) * i / 5
        px, py = x.place(a, LEFT, right), y.place(b, bottom, TOP)
        parts.append(f'<text x="{px:.1f}" y="{bottom + 15}" text-anchor="middle">{a:.2f}</text>')
        parts.append(f'<text x="{LEFT - 5}" y="{py + 4:.1f}" text-anchor="end">{b:.2f}</text>')
        parts.append(f'<path d="M{LEFT} {py:.1f} H{right}" stroke="#e4e4e4"/>')
    parts.append(f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 8}" text-anchor="middle">{x.words}</text>')
    parts.append(f'<text x="{LEFT}" y="12">{y.words}</text>')
    for number, series in enumerate(all_of):
        colour = COLOURS[number % len(COLOURS)]
        places = [(x.place(a, LEFT, right), y.place(b, bottom, TOP)) for a, b in series.points]
        if series.joined and places:
            line = " L".join(f"{a:.1f} {b:.1f}" for a, b in places)
            parts.append(f'<path d="M{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in places]
        legend = bottom - 12 - 15 * (len(all_of) - 1 - number)
        parts.append(f'<text x="{LEFT + 10}" y="{legend}" fill="{colour}">{series.name}</text>')
    path.write_text("\n".join([*parts, "</svg>", ""]), encoding="utf-8")
