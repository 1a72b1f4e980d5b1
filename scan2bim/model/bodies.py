"""All shown bodies of a storey in the building's frame, one element after the other, for formats of plain meshes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from scan2bim.geometry.meshes import Mesh, move_mesh
from scan2bim.model.elements import Area, Beam, Column, Element, Opening, RoofPlane, Stair, Storey, Wall, Window
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import (
    area_body,
    door_leaves,
    flight_bodies,
    frame_body,
    leaf_body,
    lining_body,
    opening_angle,
    pane_body,
    roof_body,
    upright_body,
    wall_angle,
    wall_bodies,
)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A mesh in a frame of its own: turned by ``angle`` (radians) about z, then shifted by ``place`` (metres).

    glass: whether one looks through it.
    """

    mesh: Mesh
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angle: float = 0.0
    glass: bool = False

    def placed(self) -> Mesh:
        """The mesh in the frame that the piece stands in."""
        return move_mesh(self.mesh, self.angle, self.place)


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """An element with its pieces; none of them is empty."""

    element: Element
    pieces: tuple[Piece, ...]


def storey_solids(storey: Storey) -> Iterator[Solid]:
    """Each element that has a body: leaves as they were found; no spaces, voids, nor stairs of unknown steps."""
    walls = wall_bodies(storey)
    for wall in storey.walls:
        place = (*wall.start, wall.base)
        yield from _solid(wall, [Piece(walls[wall.id], place, wall_angle(wall))])
        for opening in wall.openings:
            if opening.fill is not None:
                yield from _solid(opening.fill, _fill_pieces(wall, opening))
    for element in (*storey.slabs, *storey.coverings, *storey.columns, *storey.beams, *storey.stairs, *storey.roofs):
        yield from _solid(element, [Piece(_body(element))])


def _solid(element: Element, pieces: list[Piece]) -> Iterator[Solid]:
    filled = tuple(piece for piece in pieces if len(piece.mesh.triangles))
    if filled:
        yield Solid(element, filled)


def _fill_pieces(wall: Wall, opening: Opening) -> list[Piece]:
    place = point_on_wall(wall, opening.offset.value, 0.0, opening.sill.value)
    angle = opening_angle(wall, opening)
    if isinstance(opening.fill, Window):
        frame, pane = frame_body(wall, opening), pane_body(wall, opening)
        return [Piece(frame, place, angle), Piece(pane, place, angle, glass=True)]
    c, s = math.cos(angle), math.sin(angle)
    pieces = [Piece(lining_body(wall, opening), place, angle)]
    glazed = bool(opening.fill is not None and opening.fill.glazed)
    for leaf in door_leaves(wall, opening):
        x, y = leaf.hinge
        hinge = (place[0] + c * x - s * y, place[1] + s * x + c * y, place[2])
        pieces.append(Piece(leaf_body(leaf), hinge, angle + leaf.angle, glass=glazed))
    return pieces


def _body(element: Area | Column | Beam | Stair | RoofPlane) -> Mesh:
    match element:
        case Area():
            return area_body(element)
        case RoofPlane():
            return roof_body(element)
        case Stair():
            return flight_bodies(element)
        case _:
            return upright_body(element)
