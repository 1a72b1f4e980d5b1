"""A shaded picture of the model from above and aside, each storey without its ceiling: one looks into the rooms."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from scan2bim.geometry.meshes import Mesh, flat_mesh, move_mesh, prism_mesh
from scan2bim.model.elements import Building, Opening, Storey, Wall, Window
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import area_body, door_leaves, leaf_body, pane_body, upright_body, wall_angle, wall_bodies
from scan2bim.report import palette
from scan2bim.report.raster import encode_png, sheet_image
from scan2bim.report.sheet import Floats, Image, Sheet, Text
from scan2bim.report.zbuffer import Body, Camera, render, seen_size

_ASIDE: Final = math.radians(-62)
"""Of the viewer from the main walls' direction, so that both directions of walls are seen."""
_HEIGHT: Final = math.radians(52)
"""High enough that a wall hides less of the floor behind it than its height."""
_MARGIN: Final = 24  # pixels round a storey
_HEAD: Final = 40  # pixels for its name
_LIFT: Final = 0.01  # metres by which a space's floor lies over the slab, so that it is seen
_WALL: Final = (228, 226, 220)
_ASSUMED: Final = (206, 210, 220)
_SLAB: Final = (176, 176, 172)
_STAIR: Final = (205, 190, 165)
_STAIR_HEIGHT: Final = 0.15  # metres: a stair is shown as a plate where it stands; its envelope would hide the room
_IN_A_ROW: Final = 3  # storeys


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """A storey's bodies and where they lie in the picture, metres."""

    storey: Storey
    bodies: list[Body]
    low: Floats
    high: Floats


def draw_view(building: Building, *, panel: tuple[int, int] = (1000, 800)) -> Image:
    """All storeys that have any body, side by side at one scale, as (h, w, 3) sRGB.

    panel: width and height in pixels that the largest storey may take.
    """
    camera = Camera(building.frame.yaw + _ASIDE, _HEIGHT)
    scenes = [_scene(storey, camera) for storey in building.storeys]
    shown = [scene for scene in scenes if scene.bodies]
    sizes = np.array([scene.high - scene.low for scene in shown]).reshape(-1, 2)
    largest = sizes.max(axis=0, initial=1.0)
    scale = float(min(panel[0] / largest[0], panel[1] / largest[1]))
    width, height = (math.ceil(side * scale) + 2 * _MARGIN for side in largest)
    columns = max(1, len(shown) if len(shown) <= _IN_A_ROW else math.ceil(math.sqrt(len(shown))))
    rows = max(1, math.ceil(len(shown) / columns))
    image = np.full((rows * (height + _HEAD), columns * width, 3), 255, np.uint8)
    for number, scene in enumerate(shown):
        top, left = (height + _HEAD) * (number // columns), width * (number % columns)
        middle = (scene.low + scene.high) / 2 - np.array([width, height]) / 2 / scale
        image[top + _HEAD : top + _HEAD + height, left : left + width] = render(
            scene.bodies, camera, scale, middle, (width, height)
        )
        image[top : top + _HEAD, left : left + width] = _head(f"{building.name} · {scene.storey.name}", width)
    return image


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write ``draw_view`` as a PNG file, and say what it leaves out. Raises OSError."""
    path.write_bytes(encode_png(draw_view(building)))
    return ("Ceilings and roofs are not drawn in a view.",)


def storey_bodies(storey: Storey) -> list[Body]:
    """What is shown of a storey: walls, leaves, panes, floors, columns and stairs; no ceilings and no roof."""
    bodies = [*_wall_bodies(storey), *_floor_bodies(storey)]
    bodies += [Body(upright_body(column), palette.COLUMN) for column in storey.columns]
    bodies += [
        Body(prism_mesh(stair.outline, (), stair.base, stair.base + _STAIR_HEIGHT), _STAIR) for stair in storey.stairs
    ]
    return [body for body in bodies if len(body.mesh.triangles)]


def _scene(storey: Storey, camera: Camera) -> _Scene:
    bodies = storey_bodies(storey)
    low, high = seen_size(bodies, camera) if bodies else (np.zeros(2), np.zeros(2))
    return _Scene(storey, bodies, low, high)


def _head(words: str, width: int) -> Image:
    return sheet_image(Sheet(width, _HEAD, (Text(20, 28, words, 19, palette.INK, bold=True),)))


def _wall_bodies(storey: Storey) -> Iterator[Body]:
    meshes = wall_bodies(storey)
    for wall in storey.walls:
        measured = wall.thickness.source == "measured"
        yield Body(
            move_mesh(meshes[wall.id], wall_angle(wall), (*wall.start, wall.base)),
            _WALL if measured else _ASSUMED,
            palette.wall_colour(wall),
        )
        for opening in wall.openings:
            yield from _fill_bodies(wall, opening)


def _fill_bodies(wall: Wall, opening: Opening) -> Iterator[Body]:
    colour = palette.opening_colour(opening)
    for leaf in door_leaves(wall, opening):
        mesh = move_mesh(leaf_body(leaf), leaf.angle, (*leaf.hinge, 0.0))
        yield Body(_stand(wall, mesh, opening), colour)
    if isinstance(opening.fill, Window):
        yield Body(_stand(wall, pane_body(wall, opening), opening), palette.pale(colour, 0.6))


def _stand(wall: Wall, mesh: Mesh, opening: Opening) -> Mesh:
    """A mesh of an opening's frame, from its lower corner nearer to the wall's start, in the building's frame."""
    along, up = opening.offset.value, opening.sill.value
    x0, y0, z0 = point_on_wall(wall, along, 0.0, up)
    x1, y1, _ = point_on_wall(wall, along + opening.width.value, 0.0, up)
    return move_mesh(mesh, math.atan2(y1 - y0, x1 - x0), (x0, y0, z0))


def _floor_bodies(storey: Storey) -> Iterator[Body]:
    for slab in storey.slabs:
        if slab.use != "ROOF":
            yield Body(area_body(slab), _SLAB)
    for number, space in enumerate(storey.spaces):
        colour = palette.SPACES[number % len(palette.SPACES)]
        yield Body(flat_mesh(space.outline, space.holes, space.base + _LIFT), colour, colour)
