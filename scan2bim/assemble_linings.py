"""Thick walls that are a thinner wall with linings before it, as the walls in their line tell: furred and party walls.

A wall whose two faces were seen is one strip of solid. Where a thinner wall comes out of both its ends, on one line and
of one thickness, that wall goes on within it as its *core*, and what lies before it is a *lining*. Where the core's
hidden face is, nobody saw: its thickness and the lining's are assumed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import Point, SpaceShape, StoreyShape, StructureShape, WallShape

SOLID = 2.5
"""Length, metres, up to which what stands before a wall is a pier or a chimney, as solid as the wall."""
THINNEST, THICKEST = 0.06, 0.2
"""Metres that a lining can be thick: less is a panel, more a shaft."""
EVEN = 0.02
"""Metres by which faces differ that are one."""
ALIKE = 0.01
"""Metres by which thicknesses differ that are one."""
IN_LINE = 0.9986
"""Cosine of 3 degrees within which walls run alike."""
NEXT = 0.5
"""Metres from the end of a wall, on the axis of one that crosses it, within which the one in its line begins: half of
the thickest and a little."""
OVER = 0.8
"""Share of a wall's length along which it stands over or under another one to be the same wall."""
SHORTEST = 0.3
"""Metres of the shortest piece of a lining."""
BEFORE = 0.05
"""Metres before a lining within which the space begins that it lines."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Layers:
    """How thick a wall's ``core`` is, and what lies on the ``left`` and the ``right`` of it, metres; 0 for nothing."""

    core: float
    left: float
    right: float

    @property
    def aside(self) -> float:
        """Metres from the wall's axis to the left to the core's."""
        return (self.right - self.left) / 2


def with_linings(
    structure: StructureShape, openings: Sequence[OpeningShape]
) -> tuple[StructureShape, tuple[OpeningShape, ...]]:
    """The structure with the linings of its walls as walls of their own, the last ones of their storeys, and the
    openings where their walls' starts were moved. Walls with openings stay as they are.
    """
    found = find_layers(structure, {(o.storey, o.wall) for o in openings})
    storeys = list(structure.storeys)
    moved = list(openings)
    for number, layers in enumerate(found):
        if not layers:
            continue
        old, storeys[number] = storeys[number], _parted(storeys[number], layers)
        starts = [
            float(old.walls[k].locate(np.array([storeys[number].walls[k].start]))[0][0]) for k in range(len(old.walls))
        ]
        moved = [replace(o, offset=o.offset - starts[o.wall]) if o.storey == number else o for o in moved]
    return replace(structure, storeys=tuple(storeys)), tuple(moved)


def find_layers(structure: StructureShape, hosts: Collection[tuple[int, int]]) -> list[dict[int, Layers]]:
    """Storey by storey the layers of walls, by number; ``hosts``: storey and number of walls that have openings."""
    plain = [
        [k for k, w in enumerate(s.walls) if _is_plain(w) and (number, k) not in hosts]
        for number, s in enumerate(structure.storeys)
    ]
    found = [
        {k: layers for k in numbers if (layers := _going_through(s.walls[k], s.walls)) is not None}
        for s, numbers in zip(structure.storeys, plain, strict=True)
    ]
    stacked = [dict(layers) for layers in found]
    for number, numbers in enumerate(plain):
        walls = structure.storeys[number].walls
        next_to = [other for other in (number - 1, number + 1) if 0 <= other < len(found)]
        known = [(structure.storeys[other].walls[k], v) for other in next_to for k, v in found[other].items()]
        for k in (k for k in numbers if k not in found[number]):
            alike = [v for wall, layers in known if (v := _over(walls[k], wall, layers)) is not None]
            if alike:
                stacked[number][k] = alike[0]
    for s, numbers, layers in zip(structure.storeys, plain, stacked, strict=True):
        joined = {k: v for k in numbers if k not in layers and (v := _joined(k, s.walls, layers)) is not None}
        layers.update(joined)
    return stacked


def _is_plain(wall: WallShape) -> bool:
    return wall.faces == 2 and wall.thickness_sigma is not None and not wall.bulge and not wall.profile


def _going_through(wall: WallShape, walls: Iterable[WallShape]) -> Layers | None:
    """The layers of a wall from whose ends one thinner wall comes out, on one line."""
    if wall.length < SOLID:
        return None
    ends: list[tuple[float, float]] = []
    for at in (0.0, wall.length):
        beyond = [
            (w.length, w.thickness, y) for w in walls if w is not wall and (y := _line_at(wall, w, at)) is not None
        ]
        beyond = [w for w in beyond if _layers(wall, w[1], w[2]) is not None]
        if not beyond:
            return None
        ends.append(max(beyond)[1:])
    (one, y), (other, z) = ends
    if abs(one - other) > ALIKE or abs(y - z) > ALIKE:
        return None
    return _layers(wall, (one + other) / 2, (y + z) / 2)


def _line_at(wall: WallShape, other: WallShape, at: float) -> float | None:
    """Metres to the left of a wall's axis of another wall that begins at one of its ends, in its line; else None."""
    if not _is_plain(other) or abs(float(wall.chord[0] @ other.chord[0])) < IN_LINE:
        return None
    along, left = wall.locate(np.array([other.start, other.end]))
    nearest = int(np.abs(along - at).argmin())
    outwards = float(along[1 - nearest] - at) * (1.0 if at else -1.0)
    return float(left[nearest]) if abs(float(along[nearest]) - at) < NEXT and outwards > NEXT else None


def _layers(wall: WallShape, core: float, aside: float) -> Layers | None:
    """The layers of a wall with a core of this thickness whose axis lies some metres to the left; None for a core that
    does not lie within it, or linings that are none.
    """
    sides = (wall.thickness - core) / 2 - aside, (wall.thickness - core) / 2 + aside
    if not all(abs(side) < EVEN or THINNEST < side < THICKEST for side in sides) or max(sides) < EVEN:
        return None
    left, right = (side if side > EVEN else 0.0 for side in sides)
    return Layers(wall.thickness - left - right, left, right)


def _over(wall: WallShape, other: WallShape, layers: Layers) -> Layers | None:
    """The layers of a wall that stands over or under one with these ``layers`` and has the same faces."""
    turn = float(wall.chord[0] @ other.chord[0])
    if abs(turn) < IN_LINE or abs(wall.thickness - other.thickness) > EVEN:
        return None
    along, left = other.locate(np.array([wall.start, wall.end]))
    shared = min(float(along.max()), other.length) - max(float(along.min()), 0.0)
    if shared < OVER * wall.length or abs(float(left.mean())) > EVEN:
        return None
    sides = (layers.left, layers.right) if turn > 0 else (layers.right, layers.left)
    return Layers(wall.thickness - sum(sides), *sides)


def _joined(number: int, walls: Sequence[WallShape], known: dict[int, Layers]) -> Layers | None:
    """The layers of a wall that is joined to one with ``known`` layers and as thick as its core and a lining, on the
    side on which a thinner wall goes on flush with its face.
    """
    wall = walls[number]
    meeting = {j.other for j in wall.joins} | {
        k for k, w in enumerate(walls) if any(j.other == number for j in w.joins)
    }
    linings = [
        side
        for k in meeting & set(known)
        for side in (known[k].left, known[k].right)
        if side and abs(known[k].core + side - wall.thickness) < ALIKE
    ]
    if not linings:
        return None
    half = wall.thickness / 2
    sides: set[bool] = set()
    for other in walls:
        for at in (0.0, wall.length):
            y = _line_at(wall, other, at) if other.thickness < half else None
            if y is not None and abs(abs(y) + other.thickness / 2 - half) < EVEN:
                sides.add(y > 0)
    if len(sides) != 1:
        return None
    side = float(np.mean(linings))
    return Layers(wall.thickness - side, *((side, 0.0) if sides.pop() else (0.0, side)))


def _parted(storey: StoreyShape, layers: dict[int, Layers]) -> StoreyShape:
    """A storey with these walls as cores and linings."""
    walls = list(storey.walls)
    for number, parts in layers.items():
        walls[number] = _core(walls[number], parts)
    for number, parts in layers.items():
        if parts.aside:
            walls = _drawn_to(number, walls)
    linings: list[WallShape] = []
    for number, parts in layers.items():
        others = shapely.union_all([_body(w) for k, w in enumerate(walls) if k != number])
        linings += [
            p for side in (1.0, -1.0) for p in _linings(storey.walls[number], parts, side, others, storey.spaces)
        ]
    return replace(storey, walls=(*walls, *linings))


def _core(wall: WallShape, layers: Layers) -> WallShape:
    start, end = wall.place(np.array([0.0, wall.length]), layers.aside)
    return replace(
        wall,
        start=_point(start),
        end=_point(end),
        thickness=round(layers.core, 4),
        thickness_sigma=None,
        left=() if layers.left else wall.left,
        right=() if layers.right else wall.right,
        faces=2 - bool(layers.left) - bool(layers.right),
        layer_of=wall.thickness,
    )


def _drawn_to(number: int, walls: list[WallShape]) -> list[WallShape]:
    """The walls with the ends that are joined to one of them on its axis."""
    axis = walls[number]
    out = list(walls)
    ends = {(k, j.at) for k, w in enumerate(walls) for j in w.joins if j.other == number}
    ends |= {(j.other, j.other_at) for j in axis.joins if j.other_at != "path"}
    for k, at in ends:
        wall = out[k]
        _, left = axis.locate(np.array([wall.start, wall.end]))
        rise = float(left[1] - left[0])
        if wall.bulge or abs(rise) < 0.5 * wall.length:
            continue
        point = _point(wall.place(np.array([-float(left[0]) / rise * wall.length]))[0])
        out[k] = replace(wall, start=point) if at == "start" else replace(wall, end=point)
    return out


def _linings(
    wall: WallShape, layers: Layers, side: float, others: shapely.Geometry, spaces: Sequence[SpaceShape]
) -> list[WallShape]:
    """The linings on the left (``side`` 1) or right (-1) of a wall, between what crosses it, each with the space on its
    left.
    """
    thickness = layers.left if side > 0 else layers.right
    if not thickness:
        return []
    aside = side * (wall.thickness - thickness) / 2
    axis = shapely.LineString(wall.place(np.array([0.0, wall.length]), aside))
    out: list[WallShape] = []
    for piece in shapely.get_parts(shapely.difference(axis, others)):
        along = np.sort(wall.locate(shapely.get_coordinates(piece))[0])
        if along[-1] - along[0] < SHORTEST:
            continue
        ends = wall.place(along[[0, -1]] if side > 0 else along[[-1, 0]], aside)
        front = shapely.LineString(wall.place(along[[0, -1]], side * (wall.thickness / 2 + BEFORE)))
        beside = wall.left if side > 0 else wall.right
        beside = tuple(k for k in beside if spaces[k].polygon.intersection(front).length > 0.5 * SHORTEST)
        out.append(
            replace(
                wall,
                start=_point(ends[0]),
                end=_point(ends[1]),
                thickness=round(thickness, 4),
                thickness_sigma=None,
                left=beside,
                right=(),
                faces=1,
                joins=(),
                layer_of=wall.thickness,
            )
        )
    return out


def _body(wall: WallShape) -> shapely.Polygon:
    return shapely.buffer(wall.line, wall.thickness / 2, cap_style="flat")


def _point(xy: F64) -> Point:
    return round(float(xy[0]), 4), round(float(xy[1]), 4)
