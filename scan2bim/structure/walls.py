"""Walls from the borders of the spaces: a wall is the solid strip between two of them, or behind one of them.

Thickness is measured where the strip has a space on both sides, and assumed where only one of its faces was ever seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.structure.arcs import Bend
from scan2bim.structure.axes import F64, Axis, AxisJoin
from scan2bim.structure.curved_walls import borders_on, curved_axes, is_on, with_curved
from scan2bim.structure.overlaps import parted, parted_again, reaching
from scan2bim.structure.portals import on_cut
from scan2bim.structure.thicknesses import INNER, OneFaced

THINNEST, THICKEST = 0.03, 0.80
"""Distances between faces, metres, that one wall can have (trade: 0.05 to 0.75)."""
GLASS = 0.08
"""Assumed thickness, metres, of a glass front: the profile of a usual frame."""
LEAST_SEEN = 0.12
"""Least share of its one face that must have been seen of a wall: less is a border where nothing was seen."""
PARALLEL = 0.9986
"""Cosine of 3 degrees: faces that differ by more are not those of one wall."""
SHORTEST = 0.30
"""Length, metres, below which a border with nothing behind it is a reveal or a pilaster's side, not a wall."""
LONGEST_STUB = 1.0
"""Length, metres, up to which a wall that lies mostly in another is a reveal."""
IN_OTHERS = 0.5
"""Share of its area that lies in others then."""
BRIDGE = 1.2
"""Gap, metres, across which walls in one line are one wall, if no space lies in it."""
DOORWAY = 0.3
"""Distance, metres, on both sides of a virtual border within which walls in one line go on across a gap of a door."""
LONGEST_PIER, DEEPEST = 6.0, 0.6
"""Length, metres, of piers, and how far they stand before a wall, behind which it goes on."""
SOLID = 2.5
"""Length, metres, up to which a pier is taken to be solid: what is longer is a lining."""
COVERED = 0.8
"""Share of a gap that piers must cover."""
TOUCH = 1e-3
"""Distance, metres, within which an end lies on a point."""
ALIKE = 0.05
"""Metres by which an end may move farther to lie on a longer wall: those on its both sides are seldom quite in line."""
AS_LONG, AS_THICK = 0.9, 0.01
"""Share of the length of the longest of some walls, and metres of thickness, by which others are about like it."""
IN_LINE = 0.04
"""Difference of axis and of thickness, metres, up to which walls in one line are one wall."""


@dataclass(frozen=True, slots=True, eq=False)
class _Border:
    """An edge of a space, the space on its left."""

    space: int
    start: F64
    direction: F64
    length: float

    @property
    def inward(self) -> F64:
        return np.array([-self.direction[1], self.direction[0]])


def find_walls(
    spaces: Sequence[Polygon],
    cuts: Sequence[LineString] = (),
    sole: OneFaced | None = None,
    panes: Sequence[LineString] = (),
    seen_share: Callable[[Axis], float] | None = None,
    bends: Sequence[Bend] = (),
) -> tuple[list[Axis], list[AxisJoin]]:
    """Walls between and round the spaces, with their ends joined.

    ``cuts`` are virtual borders, on which no wall stands; ``sole`` tells the thickness of walls of which one
    face was seen; ``panes`` are glass fronts; ``seen_share`` tells how much of a wall's faces was seen: a
    wall of which nothing was seen on the only side that it has is not made up; ``bends`` are curved faces, along which
    borders become curved walls, the last ones.
    """
    sole = sole or OneFaced()
    borders = [b for number, polygon in enumerate(spaces) for b in _borders(number, polygon)]
    borders = [b for b in borders if not any(is_on(b.start, b.start + b.direction * b.length, bend) for bend in bends)]
    near = _neighbours([np.array([b.start, b.start + b.direction * b.length]) for b in borders], THICKEST + 0.01)
    pieces = [piece for number in range(len(borders)) for piece in _pieces(number, borders, near[number], sole, panes)]
    pieces = [p for p in pieces if p.measured or not on_cut(np.array([p.start, p.end]) + p.inset, cuts)]
    axes = _merge(pieces, spaces, cuts)
    if seen_share is not None:
        axes = [a for a in axes if a.measured or seen_share(a) >= LEAST_SEEN]
    axes = [a for a in axes if a.length >= (0.15 if a.measured else SHORTEST)]
    axes = parted(_without_stubs(axes))
    axes, joins = parted_again(*_join_ends([_before_wall(a, axes, sole.inner) for a in axes]))
    return with_curved(reaching(axes, joins), joins, curved_axes(borders_on(spaces, bends), sole.outer))


def _before_wall(axis: Axis, axes: Sequence[Axis], thickness: float) -> Axis:
    """A wall of assumed thickness, longer than a pier, before another one that goes on behind it, as a lining: no
    thicker than a partition or what is between them.
    """
    if axis.measured or axis.sigma is not None or axis.length < SOLID:
        return axis
    before = axis.inset / max(float(np.linalg.norm(axis.inset)), 1e-9)
    for wall in axes:
        step = float((axis.start + axis.inset - wall.start - wall.inset) @ before)
        facing = not wall.measured and float(wall.inset @ before) > PARALLEL * wall.thickness / 2
        if not facing or not IN_LINE < step < DEEPEST:
            continue
        along = sorted(float((p - wall.start) @ wall.direction) for p in (axis.start, axis.end))
        if min(along[1], wall.length) - max(along[0], 0.0) > COVERED * axis.length:
            thickness = min(thickness, step, axis.thickness)
            move = before * (axis.thickness - thickness) / 2
            return replace(axis, start=axis.start + move, end=axis.end + move, thickness=thickness)
    return axis


def _without_stubs(axes: list[Axis]) -> list[Axis]:
    """Walls without those of which one face was seen and that lie in others: reveals, pilasters' sides."""
    prints = np.array([shapely.buffer(LineString([a.start, a.end]), a.thickness / 2, cap_style="flat") for a in axes])
    tree = shapely.STRtree(prints)
    kept: list[Axis] = []
    for number, axis in enumerate(axes):
        longer = [k for k in tree.query(prints[number]) if axes[k].length > axis.length]
        inside = shapely.intersection(prints[number], shapely.union_all(prints[longer])).area if longer else 0.0
        if axis.measured or axis.length > LONGEST_STUB or inside < IN_OTHERS * prints[number].area:
            kept.append(axis)
    return kept


def _neighbours(lines: Sequence[F64], distance: float) -> list[list[int]]:
    """For each line (2, 2) the numbers of those within ``distance`` metres of it, rising, itself among them."""
    if not lines:
        return []
    drawn = np.asarray(shapely.linestrings(np.array(lines)))
    one, other = shapely.STRtree(drawn).query(drawn, predicate="dwithin", distance=distance)
    order = np.lexsort((other, one))
    starts = np.searchsorted(one[order], np.arange(len(lines) + 1))
    return [[int(k) for k in other[order[a:b]]] for a, b in pairwise(starts)]


def _borders(number: int, polygon: Polygon) -> list[_Border]:
    out: list[_Border] = []
    for ring in [polygon.exterior, *polygon.interiors]:
        xy = shapely.get_coordinates(ring)
        for a, b in pairwise(xy):
            length = float(np.linalg.norm(b - a))
            if length > 0.02:
                out.append(_Border(number, a, (b - a) / length, length))
    return out


def _pieces(
    number: int, borders: Sequence[_Border], near: Sequence[int], sole: OneFaced, panes: Sequence[LineString]
) -> list[Axis]:
    """Wall pieces behind one border: towards the nearest facing border on each stretch, or alone."""
    own = borders[number]
    stretches: list[tuple[float, float, float, int]] = []
    for other_number in near:
        other = borders[other_number]
        if other_number == number or own.direction @ other.direction > -PARALLEL:
            continue
        distance = -float((other.start + other.direction * other.length / 2 - own.start) @ own.inward)
        along = sorted(
            float((p - own.start) @ own.direction) for p in (other.start, other.start + other.direction * other.length)
        )
        low, high = max(0.0, along[0]), min(own.length, along[1])
        if -0.01 <= distance <= THICKEST and high - low > 0.02:
            stretches.append((low, high, max(distance, 0.0), other_number))
    cuts = sorted({0.0, own.length, *(s[0] for s in stretches), *(s[1] for s in stretches)})
    out: list[Axis] = []
    for low, high in pairwise(cuts):
        over = [s for s in stretches if s[0] <= low + 1e-6 and s[1] >= high - 1e-6]
        nearest = min(over, key=lambda s: s[2], default=None)
        if nearest is None:
            out.append(_single(own, low, high, sole, panes))
        elif nearest[3] > number:
            out.append(_double(own, borders[nearest[3]], low, high, nearest[2]))
    return out


def _single(own: _Border, low: float, high: float, sole: OneFaced, panes: Sequence[LineString]) -> Axis:
    border = np.array([own.start + own.direction * t for t in (low, high)])
    glass = on_cut(border.mean(0, keepdims=True), panes)
    thickness, sigma = (GLASS, None) if glass else sole.behind(border)
    ends = border - own.inward * thickness / 2
    return Axis(ends[0], ends[1], thickness, False, frozenset({own.space}), frozenset(), sigma=sigma)


def _double(own: _Border, other: _Border, low: float, high: float, distance: float) -> Axis:
    middle = np.array([own.start + own.direction * t for t in (low, high)])
    far = other.start + np.outer((middle - other.start) @ other.direction, other.direction)
    ends = (middle + far) / 2
    measured = distance >= THINNEST
    return Axis(
        ends[0], ends[1], distance if measured else INNER, measured, frozenset({own.space}), frozenset({other.space})
    )


def _merge(pieces: list[Axis], spaces: Sequence[Polygon], cuts: Sequence[LineString]) -> list[Axis]:
    """Pieces in one line become one wall, the longest first, until nothing merges: also across doorways as high as the
    room, in which spaces meet at a virtual border of the ``cuts``.
    """
    obstacle = shapely.union_all([s.buffer(-0.02) for s in spaces]) if spaces else Polygon()
    doorways = [cut.buffer(DOORWAY, cap_style="square") for cut in cuts]
    obstacle = shapely.difference(obstacle, shapely.union_all(doorways)) if doorways else obstacle
    shapely.prepare(obstacle)
    while True:
        pieces = sorted(pieces, key=lambda a: -a.length)
        done: list[Axis] = []
        merged = False
        taken = [False] * len(pieces)
        near = _neighbours([np.array([a.start, a.end]) for a in pieces], LONGEST_PIER)
        for i, longest in enumerate(pieces):
            if taken[i]:
                continue
            piece = longest
            for j in near[i]:
                if j > i and not taken[j] and _continues(piece, pieces[j], obstacle, [pieces[k] for k in near[i]]):
                    piece = _union(piece, pieces[j])
                    taken[j] = merged = True
            done.append(piece)
        pieces = done
        if not merged:
            return pieces


def _continues(a: Axis, b: Axis, obstacle: BaseGeometry, around: Sequence[Axis]) -> bool:
    """Whether the shorter wall b goes on in the line of a, with like thickness, and no space between: near it, or
    behind piers that stand before both, of those ``around``.
    """
    if b.length > 0.1 and abs(a.direction @ b.direction) < PARALLEL:
        return False
    off = np.abs((np.array([b.start, b.end]) - a.start) @ a.normal).max()
    if off > IN_LINE or abs(a.thickness - b.thickness) > IN_LINE or a.measured != b.measured:
        return False
    if not a.measured and (bool(a.left) != bool(b.left)) == (a.direction @ b.direction > 0):
        return False
    along = sorted(float((p - a.start) @ a.direction) for p in (b.start, b.end))
    low, high = (a.length, along[0]) if along[0] > a.length / 2 else (along[1], 0.0)
    if high - low > BRIDGE and not (high - low < LONGEST_PIER and _behind_piers(a, low, high, around)):
        return False
    if high - low < 0.03:
        return True
    gap = shapely.linestrings([a.start + a.direction * (low + 0.01), a.start + a.direction * (high - 0.01)])
    return not obstacle.intersects(gap)


def _behind_piers(a: Axis, low: float, high: float, around: Sequence[Axis]) -> bool:
    """Whether walls of which one face was seen stand before the line of such a wall along most of a gap in it: piers,
    furred columns and ducts, behind which it goes on.
    """
    if a.measured:
        return False
    before = a.inset / max(float(np.linalg.norm(a.inset)), 1e-9)
    covered = 0.0
    for pier in around:
        step = float((pier.start + pier.inset - a.start - a.inset) @ before)
        if pier.measured or float(pier.inset @ before) <= PARALLEL * pier.thickness / 2 or not IN_LINE < step < DEEPEST:
            continue
        along = sorted(float((p - a.start) @ a.direction) for p in (pier.start, pier.end))
        covered += max(0.0, min(high, along[1]) - max(low, along[0]))
    return covered > COVERED * (high - low)


def _union(a: Axis, b: Axis) -> Axis:
    """One wall over both, on the line that their lengths weigh."""
    same = a.direction @ b.direction > 0
    along = [float((p - a.start) @ a.direction) for p in (b.start, b.end)]
    off = float(((b.start + b.end) / 2 - a.start) @ a.normal) * b.length / (a.length + b.length)
    low, high = min(0.0, *along), max(a.length, *along)
    weight = b.length / (a.length + b.length)
    return replace(
        a,
        start=a.start + a.direction * low + a.normal * off,
        end=a.start + a.direction * high + a.normal * off,
        thickness=a.thickness * (1 - weight) + b.thickness * weight,
        left=a.left | (b.left if same else b.right),
        right=a.right | (b.right if same else b.left),
    )


def _join_ends(axes: list[Axis]) -> tuple[list[Axis], list[AxisJoin]]:
    """Move each wall's ends onto the axes of the walls that they meet.

    Ends move along their own axes, so that the crossing points stay where they are;
    a wall that ends short of a point at
    which another one joins it is drawn on to that point.
    """
    points: list[tuple[int, str, int, F64]] = []
    moved = list(axes)
    near = _neighbours([np.array([a.start, a.end]) for a in axes], THICKEST + 0.5)
    for i in range(len(axes)):
        for at in ("start", "end"):
            best = _nearest_crossing(i, at, axes, near[i])
            if best is not None:
                other, point = best
                moved[i] = replace(moved[i], start=point) if at == "start" else replace(moved[i], end=point)
                points.append((i, at, other, point))
    for _, _, other, point in points:
        moved[other] = _reaching(moved[other], point)
    keep = [i for i, a in enumerate(moved) if a.length > 0.1 and a.direction @ axes[i].direction > 0]
    number = {old: new for new, old in enumerate(keep)}
    joins = [
        AxisJoin(number[i], at, number[other], _place_on(moved[other], point))
        for i, at, other, point in points
        if i in number and other in number and _ends_at(moved[i], at, point)
    ]
    return [moved[i] for i in keep], joins


def _reaching(axis: Axis, point: F64) -> Axis:
    """The wall drawn on to a point of its line, if it ends short of it."""
    along = float((point - axis.start) @ axis.direction)
    if along < 0:
        return replace(axis, start=point)
    return replace(axis, end=point) if along > axis.length else axis


def _ends_at(axis: Axis, at: str, point: F64) -> bool:
    return float(np.abs((axis.start if at == "start" else axis.end) - point).max()) < TOUCH


def _place_on(axis: Axis, point: F64) -> str:
    """Which part of a wall a point of its line is: "start", "end" or "path"."""
    along = float((point - axis.start) @ axis.direction)
    return "start" if along < TOUCH else "end" if along > axis.length - TOUCH else "path"


def _nearest_crossing(i: int, at: str, axes: Sequence[Axis], near: Sequence[int]) -> tuple[int, F64] | None:
    """The wall on whose axis the end ``at`` of wall i should lie, and the point; None for a free end. Of walls that are
    about as near the longest, of such that are about as long the thickest, of those the nearest.
    """
    own = axes[i]
    end, outward = (own.start, -own.direction) if at == "start" else (own.end, own.direction)
    found: list[tuple[float, int, F64]] = []
    for j in near:
        other = axes[j]
        cross = float(outward @ other.normal)
        if j == i or abs(cross) < 0.17:
            continue
        move = float((other.start - end) @ other.normal) / cross
        slack = (other.thickness / 2 + 0.12) / abs(cross)
        if not -min(slack, 0.8 * own.length) <= move <= slack:
            continue
        point = end + outward * move
        along = float((point - other.start) @ other.direction)
        room = own.thickness / 2 + 0.15
        if not -room <= along <= other.length + room:
            continue
        found.append((abs(move), j, point))
    if not found:
        return None
    least = min(move for move, _, _ in found)
    found = [f for f in found if f[0] < least + ALIKE]
    longest = max(axes[j].length for _, j, _ in found)
    found = [f for f in found if axes[f[1]].length > AS_LONG * longest]
    thickest = max(axes[j].thickness for _, j, _ in found)
    _, j, point = min((f for f in found if axes[f[1]].thickness > thickest - AS_THICK), key=lambda f: f[0])
    return j, point
