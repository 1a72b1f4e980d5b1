"""DXF floor plans: metres, true coordinates, layers a storey, and a sheet to scale a storey.

In model space the storeys lie over each other where they stand; the layers ``00_WALL``, ``01_WALL``, ... part them. Each
storey has a layout in paper space with a viewport at a usual scale in which the others are frozen. Entities carry the
GlobalId that IFC and USD have (extended data of the application SCAN2BIM). The same model gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from ezdxf import options  # pyright: ignore[reportPrivateImportUsage]
from ezdxf.enums import TextEntityAlignment
from ezdxf.filemanagement import new

from scan2bim.exporters.space_graph import centre_of
from scan2bim.model.dimension_lines import DimensionLine, dimension_lines
from scan2bim.model.elements import Building, Door, Element, Opening, Point2, Space, Storey, Wall, Window
from scan2bim.model.ids import ifc_guid
from scan2bim.model.shapes import door_leaves, opening_angle, opening_outline, to_plan, wall_footprints
from scan2bim.model.swing import leaf_outline

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfgfx import DXFGraphic
    from ezdxf.layouts.layout import Modelspace

APPLICATION: Final = "SCAN2BIM"
SCALES: Final = (20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000)
PAPERS: Final = ((420, 297), (594, 420), (841, 594), (1189, 841))
"""Landscape A3 to A0, millimetres."""
_SCALE: Final = 50
"""Of the plan's texts and dimensions, and of the sheets where they fit one."""
_BORDER: Final = 20  # millimetres of paper round a plan
_TEXT: Final = 0.0025  # metres of paper: letters of dimensions and rooms
_ROW: Final = 0.012  # metres of paper from a wall to its chain of lengths, and between chains
_ROW_WHOLE: Final = 0.02  # metres of paper from the outermost wall to the first chain of the whole, as first rows are there
_LAYERS: Final[dict[str, tuple[int, str, int]]] = {
    "WALL": (7, "CONTINUOUS", 35),
    "WALL_FILL": (254, "CONTINUOUS", 0),
    "DOOR": (30, "CONTINUOUS", 18),
    "WINDOW": (150, "CONTINUOUS", 18),
    "OPENING": (8, "DASHED", 18),
    "SPACE": (90, "CONTINUOUS", 9),
    "SPACE_TEXT": (94, "CONTINUOUS", 18),
    "COLUMN": (7, "CONTINUOUS", 35),
    "BEAM": (8, "DASHED", 18),
    "STAIR": (40, "CONTINUOUS", 18),
    "ROOF": (8, "DASHED", 18),
    "DIMENSION": (1, "CONTINUOUS", 13),
}
"""Colour (AutoCAD index), linetype and lineweight (hundredths of a millimetre) of each kind."""


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the plans as ``path`` and say what was left out. Raises OSError."""
    kept = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # no time of day, so that reruns are equal
    try:
        drawing = _drawing(building)
        with path.open("w", encoding="utf-8", newline="\n") as file:
            drawing.write(file)
    finally:
        options.write_fixed_meta_data_for_testing = kept
    return ("Slabs and ceilings are not drawn in a plan.",)


def _drawing(building: Building) -> Drawing:
    drawing = new("R2010", setup=["linetypes", "styles"], units=6)
    drawing.header["$MEASUREMENT"] = 1
    drawing.appids.add(APPLICATION)
    style = drawing.dimstyles.add("S2B")
    for name, value in _DIMENSION_STYLE.items():
        style.set_dxf_attrib(name, value)
    for number, storey in enumerate(building.storeys):
        plan = _Plan(drawing, f"{number:02d}", storey)
        plan.draw(building)
    for number, storey in enumerate(building.storeys):
        _add_sheet(drawing, building, storey, number)
    if building.storeys:
        drawing.layouts.delete("Layout1")
    return drawing


_DIMENSION_STYLE: Final = {
    "dimtxt": _TEXT * _SCALE,
    "dimtsz": 0.001 * _SCALE,
    "dimexe": 0.001 * _SCALE,
    "dimexo": 0.002 * _SCALE,
    "dimgap": 0.0008 * _SCALE,
    "dimdec": 2,
    "dimtad": 1,
    "dimzin": 0,
    "dimdsep": ord("."),
    "dimtxsty": "OpenSans",
    "dimclrd": 256,
    "dimclre": 256,
    "dimclrt": 256,
}


class _Plan:
    """Draws a storey into model space."""

    def __init__(self, drawing: Drawing, prefix: str, storey: Storey) -> None:
        self._prefix = prefix
        self._storey = storey
        self._space: Modelspace = drawing.modelspace()
        for name, (colour, line, weight) in _LAYERS.items():
            layer = drawing.layers.add(f"{prefix}_{name}", color=colour, linetype=line)
            layer.dxf.lineweight = weight

    def draw(self, building: Building) -> None:
        """Everything that a plan shows of the storey."""
        storey = self._storey
        for space in storey.spaces:
            self._draw_space(space)
        self._draw_walls()
        for group, layer in ((storey.columns, "COLUMN"), (storey.beams, "BEAM"), (storey.stairs, "STAIR")):
            for thing in group:
                self._outline(thing.outline, layer, thing)
        for roof in storey.roofs:
            self._outline([(x, y) for x, y, _ in roof.outline], "ROOF", roof)
        self._draw_steps()
        for line in dimension_lines(storey, building):
            self._draw_dimensions(line)

    def _draw_space(self, space: Space) -> None:
        for ring in (space.outline, *space.holes):
            self._outline(ring, "SPACE", space)
        (x, y, _), _ = centre_of(space)
        for words, rise in ((space.name, 0.7), (f"{space.area:.2f} m²", -0.9)):
            text = self._space.add_text(words, height=_TEXT * _SCALE, dxfattribs=self._layer("SPACE_TEXT"))
            text.set_placement((x, y + rise * _TEXT * _SCALE), align=TextEntityAlignment.MIDDLE_CENTER)
            _mark(text, space)

    def _draw_walls(self) -> None:
        outlines = wall_footprints(self._storey)
        for wall in self._storey.walls:
            voids = [shapely.Polygon(opening_outline(wall, opening)).buffer(1e-4) for opening in wall.openings]
            body = shapely.make_valid(shapely.Polygon(outlines[wall.id])).difference(shapely.union_all(voids))
            for part in shapely.get_parts(body).tolist():
                if isinstance(part, shapely.Polygon) and part.area > 1e-6:
                    self._fill(part, wall)
            for opening in wall.openings:
                self._draw_opening(wall, opening)

    def _fill(self, part: shapely.Polygon, wall: Wall) -> None:
        rings = [[(x, y) for x, y in list(ring.coords)[:-1]] for ring in (part.exterior, *part.interiors)]
        hatch = self._space.add_hatch(color=256, dxfattribs=self._layer("WALL_FILL"))
        for ring in rings:
            hatch.paths.add_polyline_path(ring, is_closed=True)
            self._outline(ring, "WALL", wall)
        _mark(hatch, wall)

    def _draw_opening(self, wall: Wall, opening: Opening) -> None:
        thing = opening.fill or opening
        match opening.fill:
            case Door():
                self._draw_door(wall, opening)
            case Window():
                self._outline(opening_outline(wall, opening), "WINDOW", thing)
                x0 = opening.offset.value
                ends = [to_plan(wall, x, 0.0) for x in (x0, x0 + opening.width.value)]
                _mark(self._space.add_line(*ends, dxfattribs=self._layer("WINDOW")), thing)
            case _:
                self._outline(opening_outline(wall, opening), "OPENING", thing)

    def _draw_door(self, wall: Wall, opening: Opening) -> None:
        """The opening, the leaf as it was found, and the arc that it sweeps: a quarter, or as far as it stood open."""
        assert opening.fill is not None
        self._outline(opening_outline(wall, opening), "OPENING", opening.fill)
        for leaf in door_leaves(wall, opening):
            corners = leaf_outline(wall, opening, leaf, leaf.angle)
            self._outline(corners, "DOOR", opening.fill)
            if leaf.turn:
                hinge = corners[0] if leaf.depth[0] == 0.0 else corners[3]
                closed = opening_angle(wall, opening) + (math.pi if leaf.reach < 0 else 0.0)
                open_ = closed + leaf.turn * max(math.pi / 2, abs(leaf.angle))
                low, high = (math.degrees(a) for a in ((closed, open_) if leaf.turn > 0 else (open_, closed)))
                arc = self._space.add_arc(hinge, abs(leaf.reach), low, high, dxfattribs=self._layer("DOOR"))
                _mark(arc, opening.fill)

    def _draw_steps(self) -> None:
        """A line at each riser of a flight, and its way up."""
        for stair in self._storey.stairs:
            for flight in stair.flights:
                start, end = np.array(flight.start), np.array(flight.end)
                along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
                across = np.array([-along[1], along[0]]) * flight.width.value / 2
                for share in np.linspace(0.0, 1.0, max(flight.risers or 2, 2)):
                    middle = start + share * (end - start)
                    points = (middle - across).tolist(), (middle + across).tolist()
                    _mark(self._space.add_line(*points, dxfattribs=self._layer("STAIR")), stair)
                line = self._space.add_line(flight.start, flight.end, dxfattribs=self._layer("STAIR"))
                _mark(line, stair)

    def _draw_dimensions(self, line: DimensionLine) -> None:
        distance = (_ROW * line.row + (_ROW_WHOLE - _ROW) * (line.row > 1)) * _SCALE
        first, last = line.points[0], line.points[-1]
        angle = (math.degrees(math.atan2(last[1] - first[1], last[0] - first[0])) + 90) % 180 - 90  # read from below
        base = (first[0] + distance * line.outwards[0], first[1] + distance * line.outwards[1])
        for start, end in zip(line.points, line.points[1:], strict=False):
            drawn = self._space.add_linear_dim(
                base, start, end, angle=angle, dimstyle="S2B", dxfattribs=self._layer("DIMENSION")
            )
            drawn.render()

    def _outline(self, points: Iterable[Point2], layer: str, element: Element) -> None:
        _mark(self._space.add_lwpolyline(list(points), close=True, dxfattribs=self._layer(layer)), element)

    def _layer(self, name: str) -> dict[str, str]:
        return {"layer": f"{self._prefix}_{name}"}


def _mark(entity: DXFGraphic, element: Element) -> None:
    """Let the entity carry the element's GlobalId."""
    entity.set_xdata(APPLICATION, [(1000, ifc_guid(element.id))])


def _add_sheet(drawing: Drawing, building: Building, storey: Storey, number: int) -> None:
    """A layout with the storey at the largest usual scale that a paper holds."""
    low, high = _extent(storey)
    scale, (width, height) = _fit(high - low)
    layout = drawing.layouts.new(f"{number:02d} 1-{scale}")
    layout.page_setup(size=(width, height), margins=(0, 0, 0, 0), units="mm")
    frame = [(_BORDER / 2, _BORDER / 2), (width - _BORDER / 2, height - _BORDER / 2)]
    corners = [frame[0], (frame[1][0], frame[0][1]), frame[1], (frame[0][0], frame[1][1])]
    layout.add_lwpolyline(corners, close=True)
    others = [
        layer.dxf.name
        for layer in drawing.layers
        if layer.dxf.name[2:3] == "_" and not layer.dxf.name.startswith(f"{number:02d}_")
    ]
    view = layout.add_viewport(
        center=(width / 2, height / 2),
        size=(width - 2 * _BORDER, height - 2 * _BORDER),
        view_center_point=tuple(((low + high) / 2).tolist()),
        view_height=(height - 2 * _BORDER) / 1000 * scale,
    )
    view.frozen_layers = others
    title = f"{building.name} · {storey.name} · 1:{scale} · floor at {storey.elevation.value:+.2f} m"
    layout.add_text(title, height=5).set_placement((_BORDER, _BORDER * 0.65))


def _extent(storey: Storey) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what is drawn, with its dimensions."""
    rings: Sequence[Sequence[Point2]] = [*wall_footprints(storey).values(), *(s.outline for s in storey.spaces)]
    points = np.array([point for ring in rings for point in ring] or [(0.0, 0.0), (5.0, 4.0)])
    margin = (_ROW_WHOLE + 2 * _ROW) * _SCALE
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _fit(size: np.ndarray) -> tuple[int, tuple[int, int]]:
    for scale in (s for s in SCALES if s >= _SCALE):
        for paper in PAPERS:
            if all(size[k] * 1000 / scale <= paper[k] - 2 * _BORDER for k in (0, 1)):
                return scale, paper
    return SCALES[-1], PAPERS[-1]
