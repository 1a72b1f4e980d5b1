"""The plan of each storey: spaces with their areas, walls, doors as they stand, windows, and what is not closed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from scan2bim.model.dimension_lines import dimension_lines
from scan2bim.model.elements import Building, Door, Opening, Ring, Space, Storey, Window
from scan2bim.model.shapes import opening_outline, wall_footprints
from scan2bim.report import palette, plan_dimensions
from scan2bim.report.plan_labels import opening_labels
from scan2bim.report.plan_symbols import draw_opening, draw_scanner, draw_stair
from scan2bim.report.raster import sheet_image
from scan2bim.report.sheet import Floats, Image, Mark, Picture, Shape, Sheet, Text, View, line, text_width

if TYPE_CHECKING:
    import shapely

GAP_TOLERANCE: Final = 0.1
"""Metres: a space's edge that is further from every wall and column counts as open."""
SHARED_REACH: Final = 0.15
"""Metres: an open edge this near to another space is where the two go over into each other."""
_SHORTEST_GAP: Final = 0.05  # metres: shorter open edges are corners
_PANEL: Final = (1150.0, 950.0)  # pixels that the largest storey's plan may take
_SCALES: Final = (50, 100, 200, 250, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 1_000_000)
_LEGIBLE: Final = 500  # the smallest of these scales that can be read; below it plans are only kept from being huge
_INCH: Final = 96 / 0.0254  # pixels a metre of paper
_MARGIN: Final = plan_dimensions.ROOM + 20.0  # pixels round a plan, for its sizes
_TITLE: Final = 78.0  # pixels for a storey's title
_HEAD: Final = _TITLE + plan_dimensions.ROOM  # pixels above a plan
_LEGEND_ROW: Final = 26.0  # pixels
_MIN_WIDTH: Final = 640.0  # pixels of a panel
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
    def size(self) -> tuple[float, float]:
        return self.high[0] - self.low[0], self.high[1] - self.low[1]


def draw_plan(storey: Storey, building: Building, *, background: PlanBackground | None = None) -> Image:
    """The storey's plan as (h, w, 3) sRGB, with title, legend and scale bar; over a slice of the scan where given."""
    return sheet_image(storey_sheet(storey, building, background=background))


def storey_sheet(storey: Storey, building: Building, *, background: PlanBackground | None = None) -> Sheet:
    """The sheet that ``draw_plan`` rasterises."""
    return _sheet(building, (storey,), background)


def building_sheet(building: Building) -> Sheet:
    """All storeys side by side, at one scale."""
    return _sheet(building, building.storeys, None)


@dataclass(frozen=True, slots=True, eq=False)
class OpenEdges:
    """The parts of spaces' outlines along which no wall or column stands: lines of (n, 2) metres.

    shared: where another space goes on behind. leaks: where nothing does. leaking: ids of the spaces that these bound.
    """

    shared: tuple[Floats, ...]
    leaks: tuple[Floats, ...]
    leaking: tuple[str, ...]


def find_open_edges(storey: Storey) -> OpenEdges:
    """Where the storey's spaces are not closed by walls."""
    import shapely

    solid = [*wall_footprints(storey).values(), *(column.outline for column in storey.columns)]
    cover = shapely.buffer(shapely.union_all([_polygon(ring) for ring in solid]), GAP_TOLERANCE)
    bodies = {space.id: _polygon(space.outline, space.holes) for space in storey.spaces}
    shared: list[Floats] = []
    leaks: list[Floats] = []
    leaking: list[str] = []
    for name, body in bodies.items():
        others = shapely.union_all([other for key, other in bodies.items() if key != name])
        near = shapely.buffer(others, SHARED_REACH)
        gaps = shapely.difference(shapely.boundary(body), cover)
        shared += _lines(shapely.intersection(gaps, near))
        found = _lines(shapely.difference(gaps, near))
        leaks += found
        leaking += [name] if found else []
    return OpenEdges(tuple(shared), tuple(leaks), tuple(leaking))


def _lines(shape: shapely.Geometry) -> list[Floats]:
    """The connected lines of a shape that are no mere corners."""
    import shapely

    parts = shapely.get_parts(shapely.line_merge(shapely.union_all(shapely.get_parts(shape))))
    return [shapely.get_coordinates(part) for part in parts if shapely.length(part) > _SHORTEST_GAP]


def _sheet(building: Building, storeys: Sequence[Storey], background: PlanBackground | None) -> Sheet:
    """One panel a storey, in rows, all at one scale, and the legend below."""
    extents = [_extent(storey, building) for storey in storeys]
    scale = _scale([_extent(storey) for storey in storeys])
    columns = len(storeys) if len(storeys) <= _IN_A_ROW else math.ceil(math.sqrt(len(storeys)))
    captions = [_counts(storey, find_open_edges(storey)) for storey in storeys]
    plans = [extent.size[0] * scale + 2 * _MARGIN for extent in extents]
    width = max(plans + [_MIN_WIDTH] + [text_width(caption, 13) + 40 for caption in captions])
    height = max([extent.size[1] * scale for extent in extents], default=100.0) + _HEAD + _MARGIN
    marks: list[Mark] = []
    for number, (storey, extent) in enumerate(zip(storeys, extents, strict=True)):
        left, top = width * (number % columns), height * (number // columns)
        x0 = left + (width - extent.size[0] * scale) / 2 - extent.low[0] * scale
        view = View(scale, x0, top + _HEAD + extent.high[1] * scale)
        marks += _storey_marks(view, storey, building, background)
        marks += _title(left + 20, top, storey, building, captions[number], round(_INCH / scale))
    sheet_width = width * max(columns, 1)
    legend = list(_legend(sheet_width, height * math.ceil(len(storeys) / max(columns, 1)), scale))
    bottom = max(mark.y for mark in legend if isinstance(mark, Text))
    return Sheet(math.ceil(sheet_width), math.ceil(bottom + _LEGEND_ROW), (*marks, *legend))


def _extent(storey: Storey, building: Building | None = None) -> _Extent:
    """The bounds of a storey; within a building also of its lines of lengths, before they are moved off it."""
    lines = () if building is None else dimension_lines(storey, building)
    rings: list[Ring] = [*wall_footprints(storey).values(), *(chain.points for chain in lines)]
    for group in (storey.spaces, storey.slabs, storey.columns, storey.stairs):
        rings += [element.outline for element in group]
    points = np.array([point for ring in rings for point in ring] or [(0.0, 0.0), (5.0, 4.0)])
    low, high = points.min(axis=0), points.max(axis=0)
    return _Extent((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))


def _scale(extents: Sequence[_Extent]) -> float:
    """Pixels a metre: the largest usual scale at which all storeys fit their panels or, not legible there, a sheet."""
    fit = min([min(_PANEL[0] / max(e.size[0], 0.1), _PANEL[1] / max(e.size[1], 0.1)) for e in extents], default=50.0)
    largest = _LARGEST / max([max(e.size) for e in extents], default=1.0)
    for scale in _SCALES:
        if _INCH / scale <= (fit if scale < _LEGIBLE else largest):
            return _INCH / scale
    return _INCH / _SCALES[-1]


def _polygon(outline: Ring, holes: Sequence[Ring] = ()) -> shapely.Geometry:
    import shapely

    return shapely.make_valid(shapely.Polygon(outline, holes)) if len(outline) > 2 else shapely.Polygon()


def _storey_marks(view: View, storey: Storey, building: Building, background: PlanBackground | None) -> Iterator[Mark]:
    opacity = 1.0 if background is None else 0.4
    for number, space in enumerate(storey.spaces):
        colour = palette.SPACES[number % len(palette.SPACES)]
        rings = tuple(view.page(ring) for ring in (space.outline, *space.holes))
        yield Shape(rings, fill=colour, opacity=opacity)
    for stair in storey.stairs:
        yield from draw_stair(view, stair)
    yield from _walls(view, storey, background is not None)
    for column in storey.columns:
        yield Shape((view.page(column.outline),), fill=palette.COLUMN, stroke=palette.INK, opacity=opacity)
    if background is not None:
        yield _slice_picture(view, _crop(background, _extent(storey, building), _MARGIN / 2 / view.scale))
    hosted = [(wall, opening) for wall in storey.walls for opening in wall.openings]
    for wall, opening in hosted:
        yield from draw_opening(view, wall, opening)
    edges = find_open_edges(storey)
    for group, colour in ((edges.shared, palette.SHARED), (edges.leaks, palette.GAP)):
        for edge in group:
            yield line(view.page(edge), colour, 3, dash=7)
    for chain in dimension_lines(storey, building):
        yield from plan_dimensions.draw_dimensions(view, chain)
    scanners = scanner_positions(storey, building)
    for position in scanners:
        yield from draw_scanner(view, position)
    names = [text for space in storey.spaces for text in _space_label(view, space)]
    if view.scale >= _LABELLED:
        yield from opening_labels(view, hosted, names, scanners)
    yield from names


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
                yield Shape(rings, fill=colour, opacity=0.3 if see_through else 1.0)
                yield Shape(rings, stroke=colour if see_through else palette.INK, width=1)


def scanner_positions(storey: Storey, building: Building) -> list[tuple[float, float, float]]:
    """Those of the scans taken in a storey."""
    low = storey.elevation.value
    high = low + (storey.height.value if storey.height is not None else _DEFAULT_HEIGHT)
    return [scan.position for scan in building.scans if scan.position and low <= scan.position[2] <= high]


def _crop(background: PlanBackground, extent: _Extent, margin: float) -> PlanBackground:
    """The part of the background within the extent and a margin, metres."""
    (x, y), pixel, counts = background.origin, background.pixel, background.counts
    low = (extent.low[0] - margin - x, extent.low[1] - margin - y)
    first = [max(0, math.floor(value / pixel)) for value in low]
    last = [
        max(0, math.ceil((value + size + 2 * margin) / pixel)) for value, size in zip(low, extent.size, strict=True)
    ]
    part = counts[first[1] : last[1], first[0] : last[0]]
    return PlanBackground(part, (x + first[0] * pixel, y + first[1] * pixel), pixel)


def _slice_picture(view: View, background: PlanBackground) -> Picture:
    """Points dark on white, by the logarithm of their number; pixels below the sheet's are joined to their darkest."""
    join = max(1, math.ceil(1 / (view.scale * background.pixel)))
    counts = _pool(np.maximum(background.counts, 0).astype(np.float64), join)[::-1]
    seen = counts > 0
    full = np.log1p(np.percentile(counts[seen], 95)) if np.any(seen) else 1.0
    shade = np.where(seen, 0.3 + 0.7 * np.clip(np.log1p(counts) / full, 0, 1), 0.0)[..., None]
    pixels = np.round(255 - (255 - np.array(palette.POINTS)) * shade).astype(np.uint8)
    pixel = background.pixel * join
    step = view.scale * pixel
    x, y = view.page([(background.origin[0], background.origin[1] + len(counts) * pixel)])[0].tolist()
    return Picture(np.ascontiguousarray(pixels), np.array([[step, 0, x], [0, step, y]], np.float64))


def _pool(counts: Floats, join: int) -> Floats:
    """The greatest of each ``join`` by ``join`` pixels, from the first row and column on."""
    rows, columns = (-size % join for size in counts.shape)
    padded = np.pad(counts, ((0, rows), (0, columns)))
    blocks = padded.reshape(padded.shape[0] // join, join, padded.shape[1] // join, join)
    return blocks.max(axis=(1, 3))


def _space_label(view: View, space: Space) -> Iterator[Text]:
    """Name and area in the middle of the widest part, as large as fits, at least legible."""
    import shapely

    parts = shapely.get_parts(_polygon(space.outline, space.holes)).tolist()
    polygons = [part for part in parts if isinstance(part, shapely.Polygon) and part.area > 0]
    if not polygons:
        return
    circle = shapely.maximum_inscribed_circle(max(polygons, key=lambda part: part.area))
    x, y = view.page(shapely.get_coordinates(circle)[:1])[0].tolist()
    area = f"{space.area:.1f} m²"
    room = 2 * circle.length * view.scale / max(text_width(space.name, 1.1), text_width(area, 1.0))
    size = min(max(room, 9.0), 18.0)
    yield Text(x, y - 0.15 * size, space.name, size, palette.INK, "middle", bold=True, halo=True)
    yield Text(x, y + 1.0 * size, area, size * 0.9, palette.INK, "middle", halo=True)


def _title(x: float, top: float, storey: Storey, building: Building, caption: str, scale: int) -> Iterator[Mark]:
    height = f", height {storey.height.value:.2f} m" if storey.height is not None else ", height not known"
    yield Text(x, top + 28, f"{building.name} · {storey.name}", 19, palette.INK, bold=True)
    yield Text(x, top + 48, f"1:{scale}, floor at {storey.elevation.value:+.2f} m{height}", 13, palette.FAINT)
    yield Text(x, top + 66, caption, 13, palette.FAINT)


def _counts(storey: Storey, edges: OpenEdges) -> str:
    """What is in the storey, in one line."""
    openings: list[Opening] = [opening for wall in storey.walls for opening in wall.openings]
    states = Counter(opening.fill.state for opening in openings if isinstance(opening.fill, Door))
    windows = sum(isinstance(opening.fill, Window) for opening in openings)
    passages = sum(opening.fill is None for opening in openings)
    gaps = len(edges.leaking)
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
        if x + 40 + text_width(words, 12.5) > width:
            x, y = 20.0, y + _LEGEND_ROW
        yield _swatch(x, y, colour, kind)
        yield Text(x + 22, y, words, 13, palette.INK)
        x += 46 + text_width(words, 12.5)


_LEGEND: Final = (
    ("wall", palette.WALL, "area"),
    ("thickness assumed", palette.ASSUMED_WALL, "area"),
    *((f"door {state}", colour, "area") for state, colour in palette.DOORS.items()),
    ("window", palette.WINDOW, "area"),
    ("passage", palette.PASSAGE, "line"),
    ("open to next space", palette.SHARED, "line"),
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
