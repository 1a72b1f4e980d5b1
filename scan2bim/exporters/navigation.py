"""For robots: an occupancy map of each storey in the form of the ROS map_server, door poses and a graph of spaces.

``house.nav.json`` is the graph; the maps (PGM and YAML) lie in a folder beside it. A map shows the building without its
doors' leaves: where they are and how they turn stands in the graph.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from scan2bim.exporters.parts import parts_folder
from scan2bim.exporters.space_graph import MapFile, is_way, space_graph
from scan2bim.model.elements import Building, Storey
from scan2bim.model.shapes import opening_outline, wall_footprints

RESOLUTION: Final = 0.05
"""Metres a pixel, as usual for indoor robots; a wall of 5 cm still shows."""
FREE, UNKNOWN, OCCUPIED = 254, 205, 0
"""Grey values as map_server writes them."""
_MARGIN: Final = 1.0  # metres of unknown round the building
_FINE: Final = 4  # bits below a pixel in which outlines are drawn
_LARGEST: Final = 20_000  # pixels a side; a larger building gets coarser maps

Grey = npt.NDArray[np.uint8]


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the graph as ``path`` and the maps beside it, and say what was left out. Raises OSError."""
    folder = parts_folder(path, "nav")
    folder.mkdir(exist_ok=True)
    maps = tuple(_write_map(storey, folder, number) for number, storey in enumerate(building.storeys))
    path.write_text(space_graph(building, maps).model_dump_json(indent=1) + "\n", encoding="utf-8")
    return ("Furniture is not in the maps: the model holds none.",)


def occupancy(storey: Storey) -> tuple[Grey, tuple[float, float], float]:
    """A storey's map (rows, columns), its first row at the greatest y; x, y of its lower left corner; metres a pixel.

    Occupied is any pixel that a wall, column or stair touches; free what else lies in a space or a way between spaces.
    """
    walls = wall_footprints(storey)
    spaces = [shapely.Polygon(space.outline, space.holes) for space in storey.spaces]
    ways = [
        shapely.Polygon(opening_outline(wall, opening))
        for wall in storey.walls
        for opening in wall.openings
        if is_way(opening)
    ]
    through = shapely.union_all(shapely.buffer(np.array(ways, object), 1e-3, cap_style="square"))
    solid = [shapely.Polygon(ring) for ring in walls.values()]
    solid += [shapely.Polygon(thing.outline) for thing in (*storey.columns, *storey.stairs) if len(thing.outline) > 2]
    bounds = shapely.total_bounds([*spaces, *solid]) if spaces or solid else np.zeros(4)
    size = float(max(bounds[2] - bounds[0], bounds[3] - bounds[1])) + 2 * _MARGIN
    pixel = RESOLUTION * max(1, math.ceil(size / RESOLUTION / _LARGEST))
    low = np.floor((bounds[:2] - _MARGIN) / pixel) * pixel
    columns, rows = (math.ceil(span / pixel) for span in (bounds[2:] + _MARGIN - low).tolist())
    image = np.full((rows, columns), UNKNOWN, np.uint8)
    _draw(image, shapely.make_valid(np.array(spaces, object)), low, pixel, FREE)
    _draw(image, shapely.buffer(np.array(ways, object), pixel), low, pixel, FREE)
    blocked = shapely.difference(shapely.make_valid(np.array(solid, object)), through)
    _draw(image, blocked, low, pixel, OCCUPIED)
    return np.ascontiguousarray(image[::-1]), (float(low[0]), float(low[1])), pixel


def _draw(image: Grey, shapes: Iterable[shapely.Geometry], low: npt.NDArray[np.float64], pixel: float, grey: int) -> None:
    """Fill all pixels that the shapes touch; the image's first row is at the lowest y."""
    for shape in shapely.get_parts(np.array(list(shapes), object)).tolist():
        if isinstance(shape, shapely.Polygon) and not shape.is_empty:
            rings = [shapely.get_coordinates(ring)[:-1] for ring in (shape.exterior, *shape.interiors)]
            # a pixel's middle is at whole numbers for OpenCV
            fine = [np.round(((ring - low) / pixel - 0.5) * (1 << _FINE)).astype(np.int32) for ring in rings]
            cv2.fillPoly(image, fine, grey, shift=_FINE)


def _write_map(storey: Storey, folder: Path, number: int) -> MapFile:
    image, (x, y), pixel = occupancy(storey)
    name = f"storey_{number}"
    rows, columns = image.shape
    header = f"P5\n{columns} {rows}\n255\n".encode("ascii")
    (folder / f"{name}.pgm").write_bytes(header + image.tobytes())
    lines = (
        f"image: {name}.pgm",
        "mode: trinary",
        f"resolution: {pixel:.6g}",
        f"origin: [{x:.6f}, {y:.6f}, 0.0]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    )
    (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return MapFile(
        yaml=f"{folder.name}/{name}.yaml", image=f"{folder.name}/{name}.pgm", resolution=pixel, origin=(x, y, 0.0)
    )
