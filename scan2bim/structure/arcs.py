"""Curved wall faces: circles through the plan columns that straight pieces follow only so far.

A round wall comes as a row of short straight faces, each turned a little against the last. A circle through two
neighbouring ones that goes on along the columns beside them, and lies nearer to them than the pieces do, is its face.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.polygons import largest_part
from scan2bim.structure.columns import Columns
from scan2bim.structure.faces import BAND, FEWEST_BINS, Face
from scan2bim.structure.plan import Plan

RADII = (0.8, 30.0)
"""Metres: smaller ones are columns, larger ones bend less over a room than walls do by mistake."""
LONGEST_PIECE = 3.5
"""Length, metres, of the longest straight piece: 5 cm of BAND on a radius of 30 m."""
BESIDE = 1.5
"""Metres between the ends of neighbouring pieces: a door lies between."""
TURN = (0.05, 1.2)
"""Radians by which neighbouring pieces are turned: 3 to 70 degrees."""
SHORTEST = 1.2
"""Length, metres, of the shortest curved face."""
LEAST_RISE = 0.08
"""Metres that a curved face must rise over its chord: three times BAND."""
BREAK = 1.5
"""Gap, metres, along the arc across which a face goes on: doors and windows."""
FULL = 0.55
"""Share of its length on which it must have been seen, and half of that up to the ceiling zone."""
BETTER = 0.7
"""Root mean square distance of the columns to the circle, of that to the straight pieces that it replaces."""
NEAR = 0.12
"""Metres from a curved face within which a space's outline is that face."""
CORNER = 0.25
"""Metres that a curved face goes on past the last that was seen of it, if a space's outline does."""
DEEPEST = 0.6
"""Metres that a space's outline may go into the openings of a curved wall: to panes and frames."""
TOUCH = 0.02
"""Metres from a curved face at which what lies behind it begins in its openings: a wall is thicker."""
PROBE = 0.15
"""Metres before and behind a curved face at which it is asked for the space."""
SAGITTA = 0.002
"""Metres that a polygon's edges leave an arc."""
ON_ARC = 0.006
"""Metres within which an edge of an outline made so lies on the arc."""
CLOSE, LONGER = (0.05, 0.35, 0.1), 1.5
"""Metres by which what hangs or stands before a straight face lies behind and before that at most, and by which the
face goes on beyond both ends of it, at least; and times as long as it that the face is.
"""
F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Bend:
    """A curved face: ``centre`` (2,) and ``radius`` metres, from angle ``first`` counter-clockwise by ``sweep``
    (radians); ``inside`` whether the air is on the side of the centre; ``rms`` metres.
    """

    centre: F64
    radius: float
    first: float
    sweep: float
    inside: bool
    rms: float

    @property
    def length(self) -> float:
        """Metres along the arc."""
        return self.sweep * self.radius

    def turns(self, xy: F64) -> F64:
        """Angles (n,) of places (n, 2) from ``first`` on, 0 to 2 pi."""
        offset = xy - self.centre
        return np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - self.first, 2 * np.pi)

    def places(self, xy: F64) -> F64:
        """As ``turns``, those beyond an end at that end."""
        turn = self.turns(xy)
        return np.where(turn > np.pi + self.sweep / 2, 0.0, np.minimum(turn, self.sweep))

    def off(self, xy: F64) -> F64:
        """Distances (n,) of places (n, 2) from the circle, positive outside."""
        return np.linalg.norm(xy - self.centre, axis=1) - self.radius

    def points(self, low: float, high: float, more: float = 0.0) -> F64:
        """Corners (n, 2) of a polygon along the arc between two turns, ``more`` metres outside of it."""
        radius = self.radius + more
        steps = max(2, 1 + int(np.ceil((high - low) / (2 * np.arccos(1 - SAGITTA / max(radius, 0.1))))))
        angle = self.first + np.linspace(low, high, steps)
        return self.centre + radius * np.stack([np.cos(angle), np.sin(angle)], 1)


def find_bends(plan: Plan, faces: Sequence[Face]) -> list[Bend]:
    """The curved faces of a storey, longest first."""
    columns = plan.columns
    upright = np.flatnonzero((columns.bins >= FEWEST_BINS) | (columns.high >= 2))
    standing = _Standing(upright, *columns.xy[upright].T.copy())
    pieces = sorted(
        (f for f in faces if f.length < LONGEST_PIECE and f.sided and len(f.columns)), key=lambda f: -f.length
    )
    found: list[Bend] = []
    for piece, others in zip(pieces, _neighbours(pieces), strict=True):
        for other in others:
            if any(_follows(bend, f) for bend in found for f in (piece, other)):
                continue
            bend = _bend(columns, standing, piece, other)
            if bend is None or any(_bulges_from(bend, f) for f in faces):
                continue
            if bend.rms < BETTER * _straight_rms(columns, bend, pieces):
                found.append(bend)
                break
    return sorted((_drawn_on(b) for b in found), key=lambda b: -b.length)


def _bulges_from(bend: Bend, face: Face) -> bool:
    """Whether an arc lies close before a straight face that is longer and goes on beyond both of its ends: something
    hangs or stands there.
    """
    arc = bend.points(0.0, bend.sweep)
    air = (bend.centre - arc.mean(0)) * (1.0 if bend.inside else -1.0)
    before, along = (arc - face.centre) @ face.normal, (arc - face.centre) @ face.direction
    near = before.min() > -CLOSE[0] and before.max() < CLOSE[1] and air @ face.normal > 0.0
    beyond = min(along.min() - face.low, face.high - along.max())
    return bool(face.sided and near and beyond > CLOSE[2] and face.length > LONGER * bend.length)


def _drawn_on(bend: Bend) -> Bend:
    """A curved face drawn on at both ends to the corners, of which the last that was seen falls short."""
    more = min(CORNER / bend.radius, (2 * np.pi - bend.sweep) / 2)
    return replace(bend, first=bend.first - more, sweep=bend.sweep + 2 * more)


def _follows(bend: Bend, face: Face) -> bool:
    """Whether a straight piece lies on a curved face."""
    places = np.vstack([face.ends(), face.ends().mean(0)])
    return bool((np.abs(bend.off(places)) < 2 * BAND).all() and (bend.turns(places) < bend.sweep + 0.1).all())


def _neighbours(pieces: Sequence[Face]) -> Iterator[list[Face]]:
    """For each piece those later ones that may follow one circle with it: turned a little, one beginning where the
    other ends, both seen from within or both from outside.
    """
    normals = np.array([piece.normal for piece in pieces]).reshape(-1, 2)
    ends = np.array([piece.ends() for piece in pieces]).reshape(-1, 2, 2)
    for number, (normal, (start, end)) in enumerate(zip(normals, ends, strict=True), start=1):
        turn = np.arccos(np.clip(normals[number:] @ normal, -1, 1))
        gaps = [np.linalg.norm(ends[number:, k] - place, axis=1) for k, place in ((0, end), (1, start))]
        near = (turn > TURN[0]) & (turn < TURN[1]) & (np.minimum(*gaps) < BESIDE)
        yield [pieces[number + k] for k in np.flatnonzero(near).tolist()]


def _bend(columns: Columns, standing: _Standing, piece: Face, other: Face) -> Bend | None:
    """The curved face along two neighbouring pieces and what goes on from there, if there is one."""
    at = np.concatenate([piece.columns, other.columns])
    bend: Bend | None = None
    for _ in range(4):
        circle = _circle(columns.xy[at], columns.bins[at].astype(np.float64))
        if circle is None:
            return None
        centre, radius = circle
        inside = bool((piece.normal + other.normal) @ (centre - (piece.centre + other.centre) / 2) > 0)
        at = _on_circle(columns, standing, centre, radius, inside)
        bend, at = _stretch(columns, at, centre, radius, inside, piece)
        if bend is None:
            return None
    return bend if bend is not None and _is_wall(columns, at, bend) else None


def _circle(xy: F64, weight: F64) -> tuple[F64, float] | None:
    """Centre and radius of the circle with the least algebraic distance to points (n, 2)."""
    middle = np.average(xy, axis=0, weights=weight)
    u = xy - middle
    rows = np.column_stack([2 * u, np.ones(len(u))]) * np.sqrt(weight)[:, None]
    (a, b, c), *_ = np.linalg.lstsq(rows, (u**2).sum(1) * np.sqrt(weight), rcond=None)
    radius = float(np.sqrt(max(c + a * a + b * b, 0.0)))
    centre = middle + np.array([a, b])
    return (centre, radius) if RADII[0] < radius < RADII[1] else None


@dataclass(frozen=True, slots=True, eq=False)
class _Standing:
    """Numbers of the upright columns, and their places ``x`` and ``y``; (n,) each."""

    numbers: I64
    x: F64
    y: F64


def _on_circle(columns: Columns, standing: _Standing, centre: F64, radius: float, inside: bool) -> I64:
    """Upright columns on a circle that were seen from its air."""
    distance = np.sqrt((standing.x - centre[0]) ** 2 + (standing.y - centre[1]) ** 2)
    at = standing.numbers[np.abs(distance - radius) < BAND]
    inward = -(columns.view[at] * (columns.xy[at] - centre)).sum(1) * (1.0 if inside else -1.0)
    return at[inward > -0.05 * radius]


def _stretch(
    columns: Columns, at: I64, centre: F64, radius: float, inside: bool, seed: Face
) -> tuple[Bend | None, I64]:
    """The stretch of columns on a circle that goes on from a piece without a longer gap, and those columns."""
    if len(at) < 10:
        return None, at
    start = float(np.arctan2(*(seed.ends().mean(0) - centre)[::-1]))
    offset = columns.xy[at] - centre
    turn = np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - start + np.pi, 2 * np.pi) - np.pi
    order = np.argsort(turn)
    gaps = np.flatnonzero(np.diff(turn[order]) * radius > BREAK)
    parts = np.split(order, gaps + 1)
    if len(parts) > 1 and (2 * np.pi - turn[order[-1]] + turn[order[0]]) * radius < BREAK:
        turn[parts[0]] += 2 * np.pi
        parts = [*parts[1:-1], np.concatenate([parts[-1], parts[0]])]
    mine = min(parts, key=lambda p: float(np.abs(turn[p]).min()))
    low, high = float(turn[mine].min()), float(turn[mine].max())
    rms = float(np.sqrt(np.mean((np.linalg.norm(offset[mine], axis=1) - radius) ** 2)))
    return Bend(centre, radius, start + low, min(high - low, 2 * np.pi), inside, rms), at[mine]


def _is_wall(columns: Columns, at: I64, bend: Bend) -> bool:
    """Whether a curved face is long, bent and full enough, and reaches the ceiling zone."""
    rise = bend.radius * (1 - np.cos(min(bend.sweep, np.pi) / 2))
    if bend.length < SHORTEST or rise < LEAST_RISE:
        return False
    step = np.floor(bend.turns(columns.xy[at]) * bend.radius / PLAN)
    seen, tall = len(np.unique(step)), len(np.unique(step[columns.high[at] >= 3]))
    return bool(seen * PLAN > FULL * bend.length and tall * PLAN > FULL / 2 * bend.length)


def _straight_rms(columns: Columns, bend: Bend, pieces: Sequence[Face]) -> float:
    """Root mean square distance of the columns of the pieces along a curved face to those pieces."""
    squares, count = 0.0, 0
    for piece in pieces:
        xy = columns.xy[piece.columns]
        on = (np.abs(bend.off(xy)) < BAND) & (bend.turns(xy) < bend.sweep)
        if on.mean() > 0.5:
            squares += float((((xy[on] - piece.centre) @ piece.normal) ** 2).sum())
            count += int(on.sum())
    return float(np.sqrt(squares / count)) if count else 0.0


def bent_to(space: Polygon, bends: Sequence[Bend]) -> Polygon:
    """A space whose outline follows the curved faces that it lies along."""
    for bend in bends:
        side = -1.0 if bend.inside else 1.0
        for low, high in _spans(space, bend):
            air, wall = _sector(bend, low, high, 0.0, side * NEAR), _sector(bend, low, high, 0.0, -side * DEEPEST)
            near, face = space.buffer(NEAR, join_style="mitre"), LineString(bend.points(low, high))
            bays = [p for p in shapely.get_parts(space.intersection(wall)) if p.distance(face) < TOUCH]
            rest = space.difference(shapely.union_all([air, *bays]))
            whole = shapely.union_all([rest, air.intersection(near)], grid_size=1e-6)
            solid = whole.buffer(0.01, join_style="mitre").buffer(-0.01, join_style="mitre")
            space = largest_part(solid, space)
    return shapely.orient_polygons(space)


def _sector(bend: Bend, low: float, high: float, inner: float, outer: float) -> Polygon:
    ring = np.concatenate([bend.points(low, high, inner), bend.points(low, high, outer)[::-1]])
    return Polygon(ring)


def _spans(space: BaseGeometry, bend: Bend) -> list[tuple[float, float]]:
    """Stretches (turns) of a curved face with the space before it and not behind it."""
    step = PLAN / bend.radius
    turn = np.arange(step / 2, bend.sweep, step)
    angle = bend.first + turn
    ray = np.stack([np.cos(angle), np.sin(angle)], 1)
    air = bend.centre + (bend.radius + (-PROBE if bend.inside else PROBE)) * ray
    solid = bend.centre + (bend.radius + (PROBE if bend.inside else -PROBE)) * ray
    deep = bend.centre + (bend.radius + (DEEPEST if bend.inside else -DEEPEST)) * ray
    before, behind, far = (shapely.contains_xy(space, *places.T) for places in (air, solid, deep))
    along = _without_gaps(before & ~behind, before & ~far, round(BREAK / PLAN))
    runs = np.flatnonzero(np.diff(np.concatenate([[0], along.astype(int), [0]])))
    spans = [(a * step, b * step) for a, b in runs.reshape(-1, 2).tolist()]
    return [(low, min(high, bend.sweep)) for low, high in spans if (high - low) * bend.radius > SHORTEST / 2]


def _without_gaps(mask: Mask, allowed: Mask, longest: int) -> Mask:
    """A mask (n,) with gaps of up to ``longest`` between two of its runs closed, where all of the gap is allowed."""
    out = mask.copy()
    runs = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]]))).reshape(-1, 2)
    for (_, end), (start, _) in pairwise(runs.tolist()):
        if start - end <= longest and allowed[end:start].all():
            out[end:start] = True
    return out
