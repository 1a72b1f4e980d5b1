"""The plan of each storey: spaces with their areas, walls, doors as they stand, windows, and what is not closed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from scan2bim.model.elements import Building, Door, Opening, Ring, Space, Storey, Window
from scan2bim.model.shapes import opening_outline, wall_footprints
from scan2bim.report import palette
from scan2bim.report.plan_symbols import draw_opening, draw_scanner, draw_stair, opening_label
from scan2bim.report.raster import sheet_image
from scan2bim.report.sheet import Floats, Image, Mark, Picture, Shape, Sheet, Text, View, line, text_width

if TYPE_CHECKING:
    import shapely

GAP_TOLERANCE: Final = 0.1
"""Metres: a space's edge that is further from every wall and column counts as open."""
_SHORTEST_GAP: Final = 0.05  # metres: shorter open edges are corners
_PANEL: Final = (900.0, 760.0)  # pixels that the largest storey's plan may take
_SCALES: Final = (8.0, 110.0)  # pixels a metre: the least that is legible, the most that is useful
_MARGIN: Final = 36.0  # pixels round a plan
_HEAD: Final = 78.0  # pixels for a storey's title
_FOOT: Final = 50.0  # pixels for scale bar and legend
_MIN_WIDTH: Final = 600.0  # pixels of a panel, for its title
_LEGEND_WIDTH: Final = 1300.0  # pixels
_IN_A_ROW: Final = 3  # storeys
_LARGEST: Final = 4000.0  # pixels of a panel, however large the building
_DEFAULT_HEIGHT: Final = 2.5  # metres of a storey whose height is not known, to tell its scanners
_BARS: Final = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # metres of the scale bar
_LABELLED: Final = 28.0  # pixels a metre from which openings carry their sizes


@dataclass(frozen=True, slots=True, eq=False)
class PlanBackground:
    """A slice of the scan under a plan: counts (rows, columns) of points, row 0 at the lowest y.

    origin: x, y (metres, the model's frame) of the corner of pixel 0, 0. pixel: its edge, metres.
    """

    counts: npt.NDArray[np.integer] | npt.NDArray[np.floating]
    origin: tuple[float, float]
    pixel: float

    def __post_init__(self) -> None:
        if self.counts.ndim != 2 or self.pixel <= 0:
            raise ValueError(f"counts must be 2D and pixel positive, not {self.counts.shape} and {self.pixel}")


@dataclass(frozen=True, slots=True)
class _Extent:
    """Metres."""

    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def width(self) -> float:
        return self.high[0] - self.low[0]

    @property
    def height(self) -> float:
        return self.high[1] - self.low[1]


def draw_plan(storey: Storey, building: Building, *, background: PlanBackground | None = None) -> Image:
    """The storey's plan as (h, w, 3) sRGB, with title, legend and scale bar; over a slice of the scan where given."""
    return sheet_image(storey_sheet(storey, building, background=background))


def storey_sheet(storey: Storey, building: Building, *, background: PlanBackground | None = None) -> Sheet:
    """The sheet that ``draw_plan`` rasterises."""
    return _sheet(building, (storey,), background)


def building_sheet(building: Building) -> Sheet:
    """All storeys side by side, at one scale."""
    return _sheet(building, building.storeys, None)


def open_edges(storey: Storey) -> dict[str, tuple[Floats, ...]]:
    """Per space (by id) the parts of its outline, each (n, 2) metres, along which no wall or column stands."""
    import shapely

    solid = [*wall_footprints(storey).values(), *(column.outline for column in storey.columns)]
    cover = shapely.buffer(shapely.union_all([_polygon(ring) for ring in solid]), GAP_TOLERANCE)
    edges: dict[str, tuple[Floats, ...]] = {}
    for space in storey.spaces:
        parts = shapely.get_parts(shapely.difference(shapely.boundary(_polygon(space.outline, space.holes)), cover))
        merged = shapely.get_parts(shapely.line_merge(shapely.union_all(parts)))
        edges[space.id] = tuple(shapely.get_coordinates(part) for part in merged if part.length > _SHORTEST_GAP)
    return edges


def _sheet(building: Building, storeys: Sequence[Storey], background: PlanBackground | None) -> Sheet:
    """One panel a storey, in rows, all at one scale, and the legend below."""
    extents = [_extent(storey) for storey in storeys]
    scale = _scale(extents)
    columns = len(storeys) if len(storeys) <= _IN_A_ROW else math.ceil(math.sqrt(len(storeys)))
    width = max([extent.width * scale + 2 * _MARGIN for extent in extents] + [_MIN_WIDTH])
    height = max([extent.height * scale for extent in extents], default=100.0) + _HEAD + _MARGIN
    marks: list[Mark] = []
    for number, (storey, extent) in enumerate(zip(storeys, extents, strict=True)):
        left, top = width * (number % columns), height * (number // columns)
        x0 = left + (width - extent.width * scale) / 2 - extent.low[0] * scale
        view = View(scale, x0, top + _HEAD + extent.high[1] * scale)
        marks += _storey_marks(view, storey, building, background)
        marks += _title(left + 20, top, storey, building)
    sheet_width = max(width * columns, _LEGEND_WIDTH)
    bottom = height * math.ceil(len(storeys) / max(columns, 1))
    marks += _legend(sheet_width, bottom, scale)
    return Sheet(math.ceil(sheet_width), math.ceil(bottom + _FOOT), tuple(marks))


def _extent(storey: Storey) -> _Extent:
    rings: list[Ring] = [*wall_footprints(storey).values()]
    for group in (storey.spaces, storey.slabs, storey.columns, storey.stairs):
        rings += [element.outline for element in group]
    points = np.array([point for ring in rings for point in ring] or [(0.0, 0.0), (5.0, 4.0)])
    low, high = points.min(axis=0), points.max(axis=0)
    return _Extent((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))


def _scale(extents: Sequence[_Extent]) -> float:
    """Pixels a metre at which the largest storey fits its panel."""
    fit = min([min(_PANEL[0] / max(e.width, 0.1), _PANEL[1] / max(e.height, 0.1)) for e in extents], default=50.0)
    largest = max([max(e.width, e.height) for e in extents], default=1.0)
    legible = min(_SCALES[0], _LARGEST / max(largest, 0.1))
    return min(max(fit, legible), _SCALES[1])


def _polygon(outline: Ring, holes: Sequence[Ring] = ()) -> shapely.Geometry:
    import shapely

    return shapely.make_valid(shapely.Polygon(outline, holes)) if len(outline) > 2 else shapely.Polygon()


def _storey_marks(view: View, storey: Storey, building: Building, background: PlanBackground | None) -> Iterator[Mark]:
    opacity = 1.0 if background is None else 0.4
    if background is not None:
        yield _slice_picture(view, background)
    for number, space in enumerate(storey.spaces):
        colour = palette.SPACES[number % len(palette.SPACES)]
        rings = tuple(view.page(ring) for ring in (space.outline, *space.holes))
        yield Shape(rings, fill=colour, opacity=opacity)
    for stair in storey.stairs:
        yield from draw_stair(view, stair)
    yield from _walls(view, storey, background is not None)
    for column in storey.columns:
        yield Shape((view.page(column.outline),), fill=palette.COLUMN, stroke=palette.INK, opacity=opacity)
    hosted = [(wall, opening) for wall in storey.walls for opening in wall.openings]
    for wall, opening in hosted:
        yield from draw_opening(view, wall, opening)
    for edges in open_edges(storey).values():
        for edge in edges:
            yield line(view.page(edge), palette.GAP, 3, dash=7)
    for position in _scanner_positions(storey, building):
        yield from draw_scanner(view, position)
    if view.scale >= _LABELLED:
        for wall, opening in hosted:
            yield opening_label(view, wall, opening)
    for space in storey.spaces:
        yield from _space_label(view, space)


def _walls(view: View, storey: Storey, see_through: bool) -> Iterator[Mark]:
    """Each wall less its openings; over a scan only tinted, with its outline."""
    import shapely

    footprints = wall_footprints(storey)
    for wall in storey.walls:
        voids = [shapely.buffer(_polygon(opening_outline(wall, opening)), 1e-4) for opening in wall.openings]
        body = shapely.difference(_polygon(footprints[wall.id]), shapely.union_all(voids))
        colour = palette.wall_colour(wall)
        for part in shapely.get_parts(body).tolist():
            if isinstance(part, shapely.Polygon):
                rings = tuple(
                    view.page(shapely.get_coordinates(ring)[:-1]) for ring in (part.exterior, *part.interiors)
                )
                yield Shape(rings, fill=colour, opacity=0.45 if see_through else 1.0)
                yield Shape(rings, stroke=colour if see_through else palette.INK, width=1)


def _scanner_positions(storey: Storey, building: Building) -> list[tuple[float, float, float]]:
    low = storey.elevation.value
    high = low + (storey.height.value if storey.height is not None else _DEFAULT_HEIGHT)
    return [scan.position for scan in building.scans if scan.position and low <= scan.position[2] <= high]


def _slice_picture(view: View, background: PlanBackground) -> Picture:
    """Points dark on white, by the logarithm of their number."""
    counts = np.log1p(np.maximum(background.counts, 0).astype(np.float64))[::-1]
    full = np.percentile(counts[counts > 0], 95) if np.any(counts > 0) else 1.0
    shade = np.clip(counts / full, 0, 1)[..., None]
    shade = np.where(shade > 0, 0.25 + 0.75 * shade, 0)
    pixels = np.round(255 + (np.array([0, 70, 130]) - 255) * shade).astype(np.uint8)
    step = view.scale * background.pixel
    top = background.origin[1] + len(counts) * background.pixel
    (x, y), *_ = view.page([(background.origin[0], top)]).tolist()
    return Picture(np.ascontiguousarray(pixels), np.array([[step, 0, x], [0, step, y]], np.float64))


def _space_label(view: View, space: Space) -> Iterator[Mark]:
    """Name and area in the middle of the widest part, as large as fits, at least legible."""
    import shapely

    polygon = _polygon(space.outline, space.holes)
    if shapely.is_empty(polygon) or shapely.area(polygon) == 0:
        return
    circle = shapely.maximum_inscribed_circle(polygon)
    x, y = view.page(shapely.get_coordinates(circle)[:1])[0].tolist()
    area = f"{space.area:.1f} m²"
    room = 2 * circle.length * view.scale / max(text_width(space.name, 1.0), text_width(area, 1.0))
    size = min(max(room, 9.0), 18.0)
    yield Text(x, y - 0.15 * size, space.name, size, palette.INK, "middle", bold=True, halo=True)
    yield Text(x, y + 1.0 * size, area, size * 0.9, palette.INK, "middle", halo=True)


def _title(x: float, top: float, storey: Storey, building: Building) -> Iterator[Mark]:
    height = f", height {storey.height.value:.2f} m" if storey.height is not None else ", height not known"
    yield Text(x, top + 28, f"{building.name} · {storey.name}", 19, palette.INK, bold=True)
    yield Text(x, top + 48, f"floor at {storey.elevation.value:+.2f} m{height}", 13, palette.FAINT)
    yield Text(x, top + 66, _counts(storey), 13, palette.FAINT)


def _counts(storey: Storey) -> str:
    """What is in the storey, in one line."""
    openings: list[Opening] = [opening for wall in storey.walls for opening in wall.openings]
    states = Counter(opening.fill.state for opening in openings if isinstance(opening.fill, Door))
    windows = sum(isinstance(opening.fill, Window) for opening in openings)
    passages = sum(opening.fill is None for opening in openings)
    gaps = sum(bool(edges) for edges in open_edges(storey).values())
    doors = ", ".join(f"{states[state]} {state}" for state in palette.DOORS if states[state])
    parts = [
        f"{_count(len(storey.spaces), 'space')}, {sum(space.area for space in storey.spaces):.1f} m²",
        _count(len(storey.walls), "wall"),
        _count(states.total(), "door") + (f" ({doors})" if doors else ""),
        _count(windows, "window"),
        _count(passages, "passage"),
    ]
    return " · ".join([*parts, f"{_count(gaps, 'space')} not closed"] if gaps else parts)


def _count(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _legend(width: float, top: float, scale: float) -> Iterator[Mark]:
    """Scale bar and the meaning of the colours, in one row below the plans."""
    y = top + 30.0
    yield line(np.array([[20.0, top], [width - 20.0, top]]), palette.pale(palette.FAINT, 0.5), 1)
    metres = max((bar for bar in _BARS if bar * scale <= 150), default=_BARS[0])
    for k in range(4):
        x0, x1 = (20.0 + metres * scale * (k + part) / 4 for part in (0, 1))
        box = np.array([[x0, y - 8], [x1, y - 8], [x1, y], [x0, y]])
        yield Shape((box,), fill=palette.INK if k % 2 == 0 else (255, 255, 255), stroke=palette.INK)
    yield Text(28.0 + metres * scale, y, f"{metres:g} m", 13, palette.INK)
    x = 100.0 + metres * scale
    for words, colour, kind in _LEGEND:
        yield _swatch(x, y, colour, kind)
        yield Text(x + 22, y, words, 13, palette.INK)
        x += 46 + text_width(words, 12.5)


_LEGEND: Final = (
    ("wall", palette.WALL, "area"),
    ("thickness assumed", palette.ASSUMED_WALL, "area"),
    *((f"door {state}", colour, "area") for state, colour in palette.DOORS.items()),
    ("window", palette.WINDOW, "area"),
    ("passage", palette.PASSAGE, "line"),
    ("not closed", palette.GAP, "line"),
    ("scanner", palette.SCANNER, "ring"),
)


def _swatch(x: float, y: float, colour: tuple[int, int, int], kind: str) -> Mark:
    if kind == "line":
        return line(np.array([[x, y - 5], [x + 16, y - 5]]), colour, 3, dash=4)
    if kind == "ring":
        angles = np.linspace(0, math.tau, 17)[:-1]
        return Shape(
            (np.column_stack([x + 8 + 5 * np.cos(angles), y - 5 + 5 * np.sin(angles)]),), stroke=colour, width=2
        )
    return Shape((np.array([[x, y - 11], [x + 16, y - 11], [x + 16, y + 1], [x, y + 1]]),), fill=colour)
