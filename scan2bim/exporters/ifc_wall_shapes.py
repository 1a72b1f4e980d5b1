"""Bodies and axes of walls: straight or curved, slanted, with an upper edge that is not level."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scan2bim.exporters.ifc_file import Entity, IfcFile
from scan2bim.exporters.ifc_shapes import axes, extrusion, polyline, profile
from scan2bim.geometry.arcs import Arc
from scan2bim.model.elements import Point2, Ring, Wall
from scan2bim.model.queries import wall_arc

LEVEL = 1e-4
"""Metres. Parts of an upper edge that are this near to the wall's height are not cut."""

STRAIGHT = 1e-6
"""Bulge below which an axis is straight: a sagitta of a millionth of half the chord."""

BESIDE = 10.0
"""Metres that a cut reaches beyond the wall's sides and ends."""


def axis_curve(ifc: IfcFile, wall: Wall) -> Entity:
    """The centre line in the wall's frame: a line of two points, or an arc."""
    axis = wall_arc(wall)
    if is_curved(wall):
        return _arc(ifc, axis, 0.0, axis.length, 0.0)
    return polyline(ifc, ((0.0, 0.0), (axis.length, 0.0)))


def wall_solid(ifc: IfcFile, wall: Wall, outline: Ring) -> tuple[Entity, str]:
    """The body in the wall's frame and its kind of representation."""
    height, lean = wall.height.value, wall.lean
    if is_curved(wall):
        area = ifc.add("IfcArbitraryClosedProfileDef", "AREA", None, _curved_outline(ifc, wall, outline))
        solid = extrusion(ifc, area, height)
    elif lean:
        widened = tuple((x, y / math.cos(lean)) for x, y in outline)
        upwards = ifc.direction((0.0, math.sin(lean), math.cos(lean)))
        place = axes(ifc, (0.0, 0.0, 0.0))
        depth = round(height / math.cos(lean), 6)
        solid = ifc.add("IfcExtrudedAreaSolid", profile(ifc, widened), place, upwards, depth)
    else:
        solid = extrusion(ifc, profile(ifc, outline), height)
    cuts = _sloping(wall)
    for cut in cuts:
        solid = ifc.add("IfcBooleanClippingResult", "DIFFERENCE", solid, cut.half_space(ifc))
    return solid, "Clipping" if cuts else "SweptSolid"


class _Cut:
    """What lies above a stretch of an upper edge; ``bounded`` to the stretch where the edge bends inwards."""

    def __init__(self, start: Point2, end: Point2, bounded: bool, first: bool, last: bool) -> None:
        self._start, self._end, self._bounded = start, end, bounded
        self._left = start[0] - (BESIDE if first else 0.0)
        self._right = end[0] + (BESIDE if last else 0.0)

    def half_space(self, ifc: IfcFile) -> Entity:
        (x0, z0), (x1, z1) = self._start, self._end
        run = math.hypot(x1 - x0, z1 - z0)
        along = ((x1 - x0) / run, 0.0, (z1 - z0) / run)
        place = ifc.add(
            "IfcAxis2Placement3D",
            ifc.point((x0, 0.0, z0)),
            ifc.direction((-along[2], 0.0, along[0])),
            ifc.direction(along),
        )
        plane = ifc.add("IfcPlane", place)
        if not self._bounded:
            return ifc.add("IfcHalfSpaceSolid", plane, False)
        corners = (self._left, -BESIDE), (self._right, -BESIDE), (self._right, BESIDE), (self._left, BESIDE)
        boundary = polyline(ifc, corners, closed=True)
        return ifc.add("IfcPolygonalBoundedHalfSpace", plane, False, axes(ifc, (0.0, 0.0, 0.0)), boundary)


def _sloping(wall: Wall) -> list[_Cut]:
    """The cuts that make the upper edge."""
    edge = wall.profile
    if not edge:
        return []
    bounded = not _bends_outwards(edge)
    stretches = [(a, b) for a, b in zip(edge, edge[1:], strict=False) if b[0] - a[0] > LEVEL]
    cuts: list[_Cut] = []
    for number, (a, b) in enumerate(stretches):
        if max(abs(a[1] - wall.height.value), abs(b[1] - wall.height.value)) > LEVEL:
            cuts.append(_Cut(a, b, bounded, number == 0, number == len(stretches) - 1))
    return cuts


def _bends_outwards(edge: Sequence[Point2]) -> bool:
    """Whether no point of the edge lies below the line between others: then whole half-spaces cut it."""
    turns = [
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        for a, b, c in zip(edge, edge[1:], edge[2:], strict=False)
    ]
    steps = all(b[0] - a[0] > LEVEL for a, b in zip(edge, edge[1:], strict=False))
    return steps and all(turn <= LEVEL for turn in turns)


def _curved_outline(ifc: IfcFile, wall: Wall, outline: Ring) -> Entity:
    """Arcs along the faces, straight lines across the ends; the outline's x runs along the axis."""
    axis = wall_arc(wall)
    segments: list[Entity] = []
    for (x0, y0), (x1, y1) in zip(outline, (*outline[1:], outline[0]), strict=True):
        if y0 == y1 and x0 != x1:
            curve = _arc(ifc, axis, min(x0, x1), max(x0, x1), y0)
        else:
            curve = polyline(ifc, (_place(axis, x0, y0), _place(axis, x1, y1)))
        segments.append(ifc.add("IfcCompositeCurveSegment", "CONTINUOUS", y0 != y1 or x1 > x0, curve))
    return ifc.add("IfcCompositeCurve", segments, False)


def _place(axis: Arc, along: float, left: float) -> Point2:
    x, y = axis.place(np.array(along), np.array(left)).tolist()
    return (x, y)


def _arc(ifc: IfcFile, axis: Arc, first: float, last: float, left: float) -> Entity:
    """The arc beside the axis from one distance along it to another. Angles are in radians, the file's unit."""
    radius = 1.0 / axis.curvature
    quarter = -math.pi / 2 if radius > 0.0 else math.pi / 2
    centre = (axis.chord / 2, radius * math.cos(axis.angle / 2))
    circle = ifc.add("IfcCircle", ifc.add("IfcAxis2Placement2D", ifc.point(centre)), round(abs(radius - left), 6))
    trims = [
        (ifc.add("IfcParameterValue", round((axis.direction(s) + quarter) % math.tau, 12)),) for s in (first, last)
    ]
    return ifc.add("IfcTrimmedCurve", circle, *trims, radius > 0.0, "PARAMETER")


def is_curved(wall: Wall) -> bool:
    """Whether the wall's axis is an arc that can be told from a line."""
    return abs(wall.bulge) > STRAIGHT


def leaning_axes(ifc: IfcFile, wall: Wall, along: float, left: float, up: float, width: float) -> Entity:
    """The coordinate system of an opening: x along the axis, y across the wall to the left, z up in its plane.

    Origin: ``along`` the axis (of a curved wall that of the opening's straight box), ``left`` of it, ``up`` over the
    wall's base.
    """
    if is_curved(wall):
        middle, axis = along + width / 2, wall_arc(wall)
        turn = axis.direction(middle)
        cosine, sine = math.cos(turn), math.sin(turn)
        x, y = _place(axis, middle, 0.0)
        place = (x - cosine * width / 2 - sine * left, y - sine * width / 2 + cosine * left, up)
        return axes(ifc, place, (cosine, sine))
    if not wall.lean:
        return axes(ifc, (along, left, up))
    cosine, sine = math.cos(wall.lean), math.sin(wall.lean)
    place = ifc.point((along, left * cosine + up * sine / cosine, up - left * sine))
    upwards = ifc.direction((0.0, sine, cosine))
    return ifc.add("IfcAxis2Placement3D", place, upwards, ifc.direction((1.0, 0.0, 0.0)))
