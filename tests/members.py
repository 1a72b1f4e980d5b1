"""Scenes with columns and beams for the tests of this folder."""

from __future__ import annotations

import math

from scan2bim.simulate.scene import Box, Placement, Point2, Room, Scene, Station, StoreySpec, WallSpec

YAW = 0.3
HEIGHT = 2.8


def post(name: str, centre: Point2, size: tuple[float, float], yaw: float = 0.0) -> Box:
    """A column as high as the storey."""
    return Box(name, centre, (*size, HEIGHT), yaw=yaw, colour=(200, 200, 196))


def round_post(name: str, centre: Point2, diameter: float) -> list[Box]:
    """A prism of 24 sides, made of the 12 boxes that each reach from one side to the opposite one."""
    side = diameter * math.tan(math.pi / 24)
    return [post(name, centre, (diameter, side), k * math.pi / 12) for k in range(12)]


def hung(name: str, centre: Point2, size: tuple[float, float], under: float, top: float = HEIGHT) -> Box:
    """A box from ``under`` up to ``top`` over the floor."""
    return Box(name, centre, (*size, top - under), base=under, colour=(210, 208, 200))


def room_of(name: str, points: list[Point2], boxes: list[Box], stations: list[Point2], *inner: WallSpec) -> Scene:
    """A storey with outer walls along a counter-clockwise ring of axis points."""
    pairs = zip(points, points[1:] + points[:1], strict=True)
    walls = tuple(WallSpec(f"wall {i}", a, b, 0.3, True) for i, (a, b) in enumerate(pairs))
    rooms = (Room("hall", (1.0, 1.0)),)
    storey = StoreySpec("ground floor", (*walls, *inner), rooms, height=HEIGHT, boxes=tuple(boxes))
    eyes = tuple(Station(f"station {i}", (*p, 1.55), 0.7 * i) for i, p in enumerate(stations))
    return Scene(name, (storey,), eyes, Placement(YAW, (2.0, -1.0, 0.0)))
