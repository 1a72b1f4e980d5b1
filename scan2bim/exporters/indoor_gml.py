"""IndoorGML 1.0.3: rooms as cells, doors, passages and open sides as their boundaries, and the graph of ways.

One layer: a state for each room, a transition for each way from one to another. Ways that lead out end at a cell without
a shape, the outside. Coordinates are those of the scans, metres; external references are the GlobalIds of IFC and USD.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

import shapely

from scan2bim.exporters.space_graph import Edge, centre_of, is_way, space_graph
from scan2bim.model.ceilings import space_body
from scan2bim.model.elements import Building, Point2, Point3, Space
from scan2bim.model.ids import ifc_guid, stable_id
from scan2bim.model.plates import valid_areas
from scan2bim.model.queries import opening_corners, openings_of

CORE: Final = "http://www.opengis.net/indoorgml/1.0/core"
GML: Final = "http://www.opengis.net/gml/3.2"
XLINK: Final = "http://www.w3.org/1999/xlink"
XSI: Final = "http://www.w3.org/2001/XMLSchema-instance"
_SCHEMA: Final = f"{CORE} http://schemas.opengis.net/indoorgml/1.0/indoorgmlcore.xsd"
_IFC: Final = "urn:iso:std:iso:16739"
OUTSIDE: Final = "outside"
_NO_NAME: Final = re.compile(r"[^A-Za-z0-9_.-]")

Corners = Sequence[Point3]
Face = Sequence[Corners]
"""A plane piece: its outline and the holes in it."""


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the building as ``path`` and say what was left out. Raises OSError."""
    for prefix, uri in (("core", CORE), ("gml", GML), ("xlink", XLINK), ("xsi", XSI)):
        ET.register_namespace(prefix, uri)
    root = _Document(building).root()
    ET.indent(root, " ")
    path.write_bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n")
    return ("Stairs are ways without a cell of their own.",)


class _Document:
    """Makes the elements of one building."""

    def __init__(self, building: Building) -> None:
        self._building = building
        self._spaces = {space.id: (space, storey.name) for storey in building.storeys for space in storey.spaces}
        self._gates = _gates(building)
        edges = [edge for edge in space_graph(building, ()).edges if edge.spaces[0] != edge.spaces[1]]
        self._edges = {_edge_key(edge): edge for edge in edges}
        self._leads_out = any(None in edge.spaces for edge in edges)

    def root(self) -> ET.Element:
        """The document's one element."""
        root = _feature(None, "IndoorFeatures", _name("building", self._building.id), self._building.name)
        root.set(f"{{{XSI}}}schemaLocation", _SCHEMA)
        self._bounds(root)
        primal = _feature(_core(root, "primalSpaceFeatures"), "PrimalSpaceFeatures", "cells")
        for space, storey in self._spaces.values():
            self._cell(_core(primal, "cellSpaceMember"), space, storey)
        if self._leads_out or not self._spaces:
            cell = _feature(_core(primal, "cellSpaceMember"), "CellSpace", _name("cell", OUTSIDE), OUTSIDE)
            _link(cell, "duality", _name("state", OUTSIDE))
        for key in self._edges:
            if key in self._gates:
                self._boundary(_core(primal, "cellSpaceBoundaryMember"), key)
        graph = _feature(_core(root, "multiLayeredGraph"), "MultiLayeredGraph", "graph")
        layers = _feature(graph, "spaceLayers", "layers")
        self._layer(_feature(_core(layers, "spaceLayerMember"), "SpaceLayer", "layer"))
        return root

    def _bounds(self, root: ET.Element) -> None:
        """The box round all rooms, with the name of the coordinate reference system where it is known."""
        boxes = [self._placed(_box(space)) for space, _ in self._spaces.values()]
        if not boxes:
            return
        crs = self._building.frame.crs
        envelope = _gml(_gml(root, "boundedBy"), "Envelope", srsDimension="3", **({"srsName": crs} if crs else {}))
        for name, pick in (("lowerCorner", min), ("upperCorner", max)):
            values = (pick(corner[k] for box in boxes for corner in box) for k in range(3))
            _gml(envelope, name).text = _numbers(values)

    def _cell(self, parent: ET.Element, space: Space, storey: str) -> None:
        cell = _feature(parent, "CellSpace", _name("cell", space.id), space.name, f"storey={storey}")
        faces = _faces(space)
        if faces:
            self._solid(_core(_core(cell, "cellSpaceGeometry"), "Geometry3D"), space, faces)
        _link(cell, "duality", _name("state", space.id))
        _reference(cell, space.id)
        for key, edge in self._edges.items():
            if space.id in edge.spaces and key in self._gates:
                _link(cell, "partialboundedBy", _name("boundary", key))

    def _solid(self, parent: ET.Element, space: Space, faces: Sequence[Face]) -> None:
        shell = _gml(_gml(_gml(parent, "Solid", _name("solid", space.id)), "exterior"), "Shell")
        for number, face in enumerate(faces):
            self._polygon(_gml(shell, "surfaceMember"), f"{_name('face', space.id)}-{number}", face)

    def _polygon(self, parent: ET.Element, name: str, rings: Face) -> None:
        polygon = _gml(parent, "Polygon", name)
        for number, ring in enumerate(rings):
            line = _gml(_gml(polygon, "interior" if number else "exterior"), "LinearRing")
            self._positions(line, [*ring, ring[0]])

    def _boundary(self, parent: ET.Element, key: str) -> None:
        boundary = _feature(parent, "CellSpaceBoundary", _name("boundary", key))
        _link(boundary, "duality", _name("way", key))
        shape = _core(_core(boundary, "cellSpaceBoundaryGeometry"), "geometry3D")
        self._polygon(shape, _name("gate", key), [self._gates[key]])
        if self._edges[key].via is not None:
            _reference(boundary, key)

    def _layer(self, layer: ET.Element) -> None:
        """A node for each room, an edge for each way."""
        nodes = _feature(layer, "nodes", "nodes")
        for space, _ in self._spaces.values():
            self._state(_core(nodes, "stateMember"), space.id, self._middle(space.id))
        if self._leads_out or not self._spaces:
            self._state(_core(nodes, "stateMember"), OUTSIDE, None)
        if self._edges:
            edges = _feature(layer, "edges", "edges")
            for key, edge in self._edges.items():
                self._transition(_core(edges, "transitionMember"), key, edge)

    def _state(self, parent: ET.Element, space: str, middle: Point3 | None) -> None:
        state = _feature(parent, "State", _name("state", space))
        _link(state, "duality", _name("cell", space))
        for key, edge in self._edges.items():
            if space in (part or OUTSIDE for part in edge.spaces):
                _link(state, "connects", _name("way", key))
        if middle is not None:
            point = _gml(_core(state, "geometry"), "Point", _name("point", space))
            _gml(point, "pos", srsDimension="3").text = _numbers(self._placed([middle])[0])

    def _transition(self, parent: ET.Element, key: str, edge: Edge) -> None:
        ends = [self._middle(space) for space in edge.spaces]
        gate = [_mean(self._gates[key])] if key in self._gates else []
        path = [point for point in (ends[0], *gate, ends[1]) if point is not None]
        way = _feature(parent, "Transition", _name("way", key), None, f"kind={edge.kind}")
        if len(path) > 1:
            _core(way, "weight").text = f"{sum(map(math.dist, path, path[1:])):.4f}"
        for space in edge.spaces:
            _link(way, "connects", _name("state", space or OUTSIDE))
        if key in self._gates:
            _link(way, "duality", _name("boundary", key))
        if len(path) > 1:
            line = _gml(_core(way, "geometry"), "LineString", _name("path", key))
            self._positions(line, path)

    def _middle(self, space: str | None) -> Point3 | None:
        return None if space is None else centre_of(self._spaces[space][0])[0]

    def _positions(self, parent: ET.Element, corners: Corners) -> None:
        text = " ".join(_numbers(corner) for corner in self._placed(corners))
        _gml(parent, "posList", srsDimension="3").text = text

    def _placed(self, corners: Corners) -> list[Point3]:
        """In the coordinates of the scans."""
        dx, dy, dz = self._building.frame.shift
        return [(x + dx, y + dy, z + dz) for x, y, z in corners]


def _faces(space: Space) -> list[Face]:
    """The faces of a room's body, wound so that they look outwards; under a sloping ceiling in triangles."""
    if space.ceiling:
        return [[[(x, y, z) for x, y, z in corners]] for corners in space_body(space).corners.tolist()]
    areas = valid_areas(space.outline, space.holes)
    if not areas:
        return []
    area = max(areas, key=lambda part: part.area)
    low, high = space.base, space.base + space.height.value
    rings: list[list[Point2]] = [
        [(x, y) for x, y in shapely.get_coordinates(ring)[:-1].tolist()] for ring in (area.exterior, *area.interiors)
    ]
    faces: list[Face] = [[[(x, y, high) for x, y in ring] for ring in rings]]
    faces.append([[(x, y, low) for x, y in reversed(ring)] for ring in rings])
    for ring in rings:
        for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]], strict=True):
            faces.append([[(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)]])
    return faces


def _gates(building: Building) -> dict[str, Corners]:
    """The rectangles that ways lead through: of doors and passages by their id, of open sides by both spaces'."""
    gates: dict[str, Corners] = {}
    for hosted in openings_of(building):
        if is_way(hosted.opening):
            thing = hosted.opening.fill or hosted.opening
            gates[thing.id] = list(opening_corners(hosted.wall, hosted.opening))
    for space in (space for storey in building.storeys for space in storey.spaces):
        low, high = space.base, space.base + space.height.value
        for side in sorted(space.open_sides, key=lambda side: math.dist(side.start, side.end)):
            corners = (*side.start, low), (*side.end, low), (*side.end, high), (*side.start, high)
            gates.setdefault(_pair(space.id, side.to), corners)
    return gates


def _edge_key(edge: Edge) -> str:
    return edge.via if edge.via is not None else _pair(*(space or OUTSIDE for space in edge.spaces))


def _pair(one: str, other: str) -> str:
    return stable_id("open side", *sorted((one, other)))


def _mean(corners: Corners) -> Point3:
    x, y, z = (sum(values) / len(corners) for values in zip(*corners, strict=True))
    return x, y, z


def _box(space: Space) -> Corners:
    (x0, y0, x1, y1) = shapely.LineString([*space.outline, *space.outline[:1]]).bounds
    return (x0, y0, space.base), (x1, y1, space.base + space.height.value)


def _name(kind: str, identifier: str) -> str:
    """An identifier as XML allows them: of letters, digits and a few marks."""
    return f"{kind}-{stable_id('gml', identifier) if _NO_NAME.search(identifier) else identifier}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.4f}" for value in values)


def _core(parent: ET.Element, name: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{CORE}}}{name}")


def _gml(parent: ET.Element, name: str, identifier: str | None = None, **attributes: str) -> ET.Element:
    made = ET.SubElement(parent, f"{{{GML}}}{name}", attributes)
    if identifier is not None:
        made.set(f"{{{GML}}}id", identifier)
    return made


def _feature(
    parent: ET.Element | None, name: str, identifier: str, title: str | None = None, words: str | None = None
) -> ET.Element:
    """An element with an id and, where given, a description and a name."""
    made = ET.Element(f"{{{CORE}}}{name}") if parent is None else _core(parent, name)
    made.set(f"{{{GML}}}id", identifier)
    for tag, text in (("description", words), ("name", title)):
        if text is not None:
            _gml(made, tag).text = text
    return made


def _link(parent: ET.Element, name: str, target: str) -> None:
    _core(parent, name).set(f"{{{XLINK}}}href", f"#{target}")


def _reference(parent: ET.Element, identifier: str) -> None:
    """The same thing in IFC."""
    reference = _core(parent, "externalReference")
    _core(reference, "informationSystem").text = _IFC
    _core(_core(reference, "externalObject"), "name").text = ifc_guid(identifier)
