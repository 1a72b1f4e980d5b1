"""Wall faces in plan: straight runs of plan columns, grown from seeds and fitted to millimetres.

A face is one visible side of a wall. Runs in one line are one face, also across a door or a wardrobe, and faces that
are nearly parallel to the building's main directions are made so where that moves no point by more than the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.curtains import without_curtains
from scan2bim.structure.fits import BAND, SPARSE, Face, fit_line, settled
from scan2bim.structure.furniture import without_furniture
from scan2bim.structure.leaves import is_closed_leaf, without_open_leaves
from scan2bim.structure.plan import SAME_LEVEL, Columns, Plan
from scan2bim.structure.runs import grow, local_lines
from scan2bim.structure.steps import EVEN, LONG_ENOUGH, TURNED, mod_quarter, parallel_lines, turn_to, turned
from scan2bim.structure.strays import with_strays
from scan2bim.structure.strips import ceiling_on

FEWEST_BINS = 4
"""Heights of 10 cm that a column must fill to be upright at all: 40 cm, more than a skirting board or a book."""
SHORTEST = 0.20
"""Length of a face, metres, below which its direction is noise."""
PARALLEL = 0.996
"""Cosine above which two runs may be one line (5 degrees): short runs are that uncertain; the band decides."""
OBLIQUE = 0.17
"""Cosine above which a face is not square to another (80 degrees)."""
DEEPEST_RECESS = 0.6
"""Depth, metres, up to which what stands back behind a wall's face belongs to an opening or niche of that wall."""
RECESS, JAMB = 0.03, 0.3
"""Metres that what stands in a recess lies behind the wall at least, and beside the wall's end at most."""
TALL = 0.6
"""Share of its seen length that what stands behind a wall's face must reach the ceiling zone to be the wall there."""
NOT_TALL = 0.15
"""Share of such a stretch, at most, on which the face before it does so: cupboards in line with the wall."""
STANDS = 0.3
"""Share of a wall's columns that were seen to come down to the floor, where furniture hides the foot of others."""
LEAST_KNOWN = 0.3
"""Share of a nook's ceiling that must have been seen: cupboards in it hide the rest."""
LEAST_NOOK = 0.5
"""Length, metres, of the shortest part of a wall that stands back."""
BESIDE = 0.3
"""Share of such a face's length that the middles of both are apart at least; else the wall is uneven, unless ..."""
UNEVEN = 0.2
"""... at most this share of the columns is followed by one of another line: panels in a row."""
PARALLEL_WITHIN = 0.003
"""Radians by which walls that are meant to be parallel differ, as fitted: curtains and leaves do by more."""
ALONG = 0.015
"""Radians up to which what lies far apart is in line along a main direction: 3 cm over 2 m."""
GAP = 3.0
"""Runs in one line are one face across gaps up to this, metres: doors, windows, cupboards."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Many faces with their centres and normals (n, 2) and ends (n, 2, 2), to be asked which of them lie in one line
    with another that looks the same way; rather one too many.
    """

    faces: Sequence[Face]
    centres: F64
    normals: F64
    ends: F64

    @staticmethod
    def of(faces: Sequence[Face]) -> Lines:
        """Those of faces."""
        centres = np.array([face.centre for face in faces]).reshape(-1, 2)
        normals = np.array([face.normal for face in faces]).reshape(-1, 2)
        return Lines(faces, centres, normals, np.array([face.ends() for face in faces]).reshape(-1, 2, 2))

    def continuing(self, face: Face, off: float) -> list[Face]:
        """Those whose ends lie within ``off`` metres of a face's line."""
        near = np.abs((self.ends - face.centre) @ face.normal).max(1, initial=0.0) < off + 1e-6
        return self._alike(face, near)

    def continued(self, face: Face, off: float) -> list[Face]:
        """Those within ``off`` metres of whose line a face's ends lie."""
        away = np.abs(((face.ends()[:, None] - self.centres) * self.normals).sum(2))
        return self._alike(face, away.max(0, initial=0.0) < off + 1e-6)

    def through(self, places: F64) -> list[Face]:
        """Those whose lines pass any of places (n, 2) within EVEN."""
        low, high = places.min(0), places.max(0)
        away = np.abs((((low + high) / 2 - self.centres) * self.normals).sum(1))
        return [self.faces[k] for k in np.flatnonzero(away < np.hypot(*(high - low)) / 2 + 2 * EVEN).tolist()]

    def behind(self, face: Face) -> list[Face]:
        """Those that stand back behind a face, no deeper than a recess."""
        behind = -((self.ends - face.centre) @ face.normal)
        deep = (behind > 0.03).all(1) & (behind < DEEPEST_RECESS).all(1)
        return [self.faces[k] for k in np.flatnonzero(deep & (self.normals @ face.normal > PARALLEL)).tolist()]

    def _alike(self, face: Face, near: NDArray[np.bool_]) -> list[Face]:
        return [self.faces[k] for k in np.flatnonzero(near & (self.normals @ face.normal > PARALLEL - 1e-9)).tolist()]


def find_faces(plan: Plan) -> tuple[Face, ...]:
    """Faces of the storey's walls, longest first; upright things that stay below the ceiling zone are left out."""
    columns = plan.columns
    upright = (columns.bins >= FEWEST_BINS) | (columns.high >= 2)
    faces = [
        f
        for f in grow_faces(columns, plan.floor.shape, upright, columns.high >= 3)
        if f.tall >= min(0.4, 0.5 * f.length)
    ]
    faces = [f for f in faces if f.tall >= 0.12 * f.length]
    faces = with_strays(columns, _square_up(columns, faces), columns.high >= 3)
    faces = without_curtains(plan, without_furniture(plan, faces))
    faces = _without_fillings(plan, without_open_leaves(faces, columns, main_direction(faces)))
    faces = sorted((f for f in faces if not over_sills(plan, f, faces)), key=lambda f: -f.length)
    return tuple(settled(columns, face, columns.high >= 3) for face in without_recesses(faces, faces))


def over_sills(plan: Plan, face: Face, faces: Sequence[Face]) -> bool:
    """Whether a face that nowhere comes down to the floor stands back in the line of one that does, and the room's
    ceiling does not go on over what lies between: panes and frames of windows, in one line, and as long as the piers.
    """
    if (plan.columns.low[face.columns] >= FEWEST_BINS).mean() > NOT_TALL:
        return False
    for wall in faces:
        depth = float((wall.centre - face.centre) @ face.normal)
        if wall.normal @ face.normal < PARALLEL or not RECESS < depth < DEEPEST_RECESS:
            continue
        along = np.sort((wall.ends() - face.centre) @ face.direction)
        if (
            max(along[0] - face.high, face.low - along[1]) > JAMB
            or (plan.columns.low[wall.columns] >= FEWEST_BINS).mean() < STANDS
        ):
            continue
        within = ceiling_on(plan, face, 0.0, max(depth - PLAN, PLAN))
        known = np.isfinite(within)
        room = ceiling_on(plan, face, depth + 0.1, depth + 0.5)
        if known.mean() < LEAST_KNOWN or not np.isfinite(room).any():
            return True
        if float(np.nanmedian(room) - np.median(within[known])) > SAME_LEVEL:
            return True
    return False


def _without_fillings(plan: Plan, faces: Sequence[Face]) -> list[Face]:
    """Faces without the stretches on which only low things stand in their line, before a wall that stands back there:
    screens and cupboards before a nook, in line with the walls beside it.
    """
    out: list[Face] = []
    backs = Lines.of([back for back in faces if back.tall >= max(TALL * _seen(plan, back), LEAST_NOOK)])
    for face in faces:
        parts = [face]
        for back in backs.behind(face):
            low, high = np.sort((back.ends() - face.centre) @ face.direction).tolist()
            if is_closed_leaf(face, back, faces, plan.columns):
                continue
            split = [_parts_beside(plan, p, low, high) if _filled(plan, p, back) else [p] for p in parts]
            parts = [p for some in split for p in some]
        out += parts
    return out


def _seen(plan: Plan, face: Face) -> float:
    """Metres of a face on which anything was seen of it."""
    along = (plan.columns.xy[face.columns] - face.centre) @ face.direction
    return covered_length(along, SPARSE if face.sided else PLAN)


def _filled(plan: Plan, face: Face, back: Face) -> bool:
    """Whether the ceiling goes on between a face and what stands ``back`` behind it, as high as before it, and little
    of the face reaches up to it there.
    """
    ends = (back.ends() - face.centre) @ face.direction
    low, high = max(float(ends.min()), face.low), min(float(ends.max()), face.high)
    if high - low < LEAST_NOOK:
        return False
    along = (plan.columns.xy[face.columns] - face.centre) @ face.direction
    tall = (plan.columns.high[face.columns] >= 3) & (along > low) & (along < high)
    if covered_length(along[tall], PLAN) > NOT_TALL * (high - low):
        return False
    depth = -float((back.centre - face.centre) @ face.normal)
    stretch = replace(face, low=low, high=high)
    within, before = ceiling_on(plan, stretch, -depth, 0.0), ceiling_on(plan, stretch, 0.1, 0.5)
    known = np.isfinite(within)
    if known.mean() < LEAST_KNOWN or not np.isfinite(before).any():
        return False
    return abs(float(np.median(within[known]) - np.nanmedian(before))) < SAME_LEVEL


def _parts_beside(plan: Plan, face: Face, low: float, high: float) -> list[Face]:
    """What is left of a face without its stretch from ``low`` to ``high``."""
    columns = plan.columns
    along = (columns.xy[face.columns] - face.centre) @ face.direction
    sides = [face.columns[side] for side in (along < low, along > high)]
    fitted = [fit_line(columns, at, columns.high >= 3, face.normal) for at in sides if len(at) >= 4]
    return [f for f in fitted if f.length >= SHORTEST]


def grow_faces(
    columns: Columns, shape: tuple[int, ...], upright: NDArray[np.bool_], wall_like: NDArray[np.bool_]
) -> list[Face]:
    """Straight runs of the ``upright`` columns (m,) of a raster of this ``shape``, those in one line joined;
    ``wall_like`` columns count more.
    """
    index = np.full(shape, -1, np.int64)
    at = np.flatnonzero(upright)
    index[columns.pixel[at, 1], columns.pixel[at, 0]] = at
    angle, line = local_lines(index, columns.pixel, columns.xy, columns.view)
    region = grow(index, columns.pixel, columns.xy, columns.bins.astype(np.float64), columns.view, angle, line, BAND)
    fitted = _fit_all(columns, region, wall_like)
    main = main_direction(fitted)
    fitted = [part for face in fitted for part in _steps(columns, face, main, wall_like)]
    longest = sorted(fitted, key=lambda f: -f.length)
    straight = Lines.of([f for f in longest if abs(turn_to(f.normal, main)) < ALONG])
    fitted = [_straightened(columns, face, straight, main, wall_like) for face in fitted]
    return _merge_collinear(columns, fitted, main, wall_like)


def _steps(columns: Columns, face: Face, main: float, wall_like: NDArray[np.bool_]) -> list[Face]:
    """A wall and the door leaf or panel beside it, a few centimetres off its face, each for itself where one oblique
    line was grown through all; else the face as it is.
    """
    offset = columns.xy[face.columns] - face.centre
    lines = parallel_lines(offset, face.normal, face.length, main)
    if lines is None:
        return [face]
    normal, across, places = lines
    away = np.abs(across[:, None] - places)
    on = away.min(1) < 2 * EVEN
    nearest = away[on].argmin(1)
    if not nearest.any() or _uneven(nearest, (offset @ face.direction)[on], face.length):
        return [face]
    parts = [face.columns[on][nearest == k] for k in range(len(places))]
    fitted = [fit_line(columns, at, wall_like, normal) for at in parts if len(at) >= 4]
    return [f for f in fitted if f.length >= SHORTEST]


def _straightened(columns: Columns, face: Face, straight: Lines, main: float, wall_like: NDArray[np.bool_]) -> Face:
    """A short face that is a little turned, as of a wall's stub and what stands beside it, as far as it lies on the
    line of a longer one of the ``straight`` faces along the ``main`` directions, longest first; else the face as it is.
    """
    off = abs(turn_to(face.normal, main))
    if face.length > LONG_ENOUGH or not EVEN < off * face.length < TURNED:
        return face
    xy = columns.xy[face.columns]
    for other in straight.through(xy):
        if other.length <= face.length:
            break
        away, along = (xy - other.centre) @ other.normal, (xy - other.centre) @ other.direction
        near = (along > other.low - GAP) & (along < other.high + GAP)
        on = (np.abs(away) < EVEN) & near & wall_like[face.columns]
        if other.normal @ face.normal > OBLIQUE and covered_length(along[on], PLAN) >= SHORTEST:
            return fit_line(columns, face.columns[on], wall_like, other.normal)
    return face


def _uneven(line: I64, along: F64, length: float) -> bool:
    """Whether columns that lie on several lines (n,), some metres ``along`` the face (n,), lie there by turns."""
    changes = np.count_nonzero(np.diff(line[np.argsort(along)]))
    apart = abs(np.median(along[line == 0]) - np.median(along[line > 0]))
    return bool(apart < BESIDE * length and changes > UNEVEN * len(line))


def without_recesses(faces: Sequence[Face], walls: Sequence[Face]) -> list[Face]:
    """``faces`` less those that stand back behind one of ``walls``: window frames, panes, shutters, backs of niches,
    casements and curtains that stand oblique in an opening.

    Such a face lies within the stretch of a longer wall, or mostly, if it reaches the ceiling far less often.
    """
    if not walls:
        return list(faces)
    normal, centre = np.array([w.normal for w in walls]), np.array([w.centre for w in walls])
    direction = np.stack([normal[:, 1], -normal[:, 0]], 1)
    low, high = np.array([w.low for w in walls]) - 0.15, np.array([w.high for w in walls]) + 0.15
    length = high - low - 0.3
    tall = np.array([w.tall for w in walls]) / np.maximum(length, 0.1)
    kept: list[Face] = []
    for face in faces:
        from_wall = face.ends()[:, None] - centre
        behind = -(from_wall * normal).sum(2)
        along = (from_wall * direction).sum(2)
        turned = normal @ face.normal
        oblique = (np.abs(turned) > OBLIQUE) & (np.abs(turned) < PARALLEL)
        deep = (behind.min(0) > 0.03) & (behind.max(0) < DEEPEST_RECESS)
        stands_back = deep & ((turned > PARALLEL) | oblique)
        within = (along.min(0) > low) & (along.max(0) < high) & (length > face.length)
        overlap = np.minimum(along.max(0), high) - np.maximum(along.min(0), low)
        lower = (overlap > 0.5 * face.length) & (face.tall < 0.6 * tall * face.length)
        if not (stands_back & (within | lower)).any():
            kept.append(face)
    return kept


def main_direction(faces: Sequence[Face], within: float = PARALLEL_WITHIN) -> float:
    """Angle (radians, -pi/4 to pi/4) of the building's main wall direction, weighted by length; 0 without faces.
    ``within``: radians off it from which on a face counts for a quarter.
    """
    if not faces:
        return 0.0
    angles = np.array([np.arctan2(f.direction[1], f.direction[0]) for f in faces])
    length = np.array([f.length for f in faces])
    bins = np.zeros(180)
    np.add.at(bins, np.floor(np.mod(np.degrees(angles), 90.0) * 2).astype(int) % 180, length)
    best = float(np.radians((np.argmax(bins + np.roll(bins, 1) + np.roll(bins, -1)) + 0.5) / 2))
    off = mod_quarter(angles - best)
    off, weight = off[np.abs(off) < np.radians(1.5)], length[np.abs(off) < np.radians(1.5)] ** 2
    order = np.argsort(off)
    middle = float(off[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])
    for _ in range(4):
        middle = float(np.average(off, weights=weight / (1 + ((off - middle) / within) ** 2) ** 2))
    return float(mod_quarter(np.array([best + middle]))[0])


def _fit_all(columns: Columns, region: I64, wall_like: NDArray[np.bool_]) -> list[Face]:
    order = np.argsort(region, kind="stable")
    order = order[region[order] >= 0]
    groups = np.split(order, np.flatnonzero(np.diff(region[order])) + 1) if len(order) else []
    faces = [fit_line(columns, g, wall_like) for g in groups if len(g) >= 4]
    return [f for f in faces if f.length >= SHORTEST and f.length > 6 * f.rms]


def _merge_collinear(columns: Columns, faces: list[Face], main: float, wall_like: NDArray[np.bool_]) -> list[Face]:
    """Runs of one line and one side become one face; repeated until nothing merges."""
    while True:
        faces = sorted(faces, key=lambda f: -f.length)
        parent = np.arange(len(faces))
        ends = np.array([f.ends() for f in faces]).reshape(-1, 2, 2)
        normals = np.array([f.normal for f in faces]).reshape(-1, 2)
        for i, a in enumerate(faces):
            if parent[i] != i:
                continue
            off = np.abs((ends[i + 1 :] - a.centre) @ a.normal)
            near = (
                (np.abs(normals[i + 1 :] @ a.normal) > PARALLEL) & (off[:, 0] < 1.5 * BAND) & (off[:, 1] < 1.5 * BAND)
            )
            for j in np.flatnonzero(near) + i + 1:
                if parent[j] == j and _in_line(a, faces[j], main):
                    parent[j] = i
        if (parent == np.arange(len(faces))).all():
            return faces
        joined: list[Face] = []
        order = np.argsort(parent, kind="stable")
        for group in np.split(order, np.flatnonzero(np.diff(parent[order])) + 1):
            members = [faces[j] for j in group]
            columns_of = [m.columns for m in members]
            joined.append(members[0] if len(members) == 1 else fit_line(columns, np.concatenate(columns_of), wall_like))
        faces = joined


def _in_line(a: Face, b: Face, main: float) -> bool:
    """Whether the shorter face b continues the longer face a; across a gap longer than both together only along the
    ``main`` directions, since any two short runs have a line through them.
    """
    side = float(a.normal @ b.normal)
    if abs(side) < PARALLEL or (a.sided and b.sided and side < 0):
        return False
    ends = b.ends() - a.centre
    if np.abs(ends @ a.normal).max() > BAND * (1.0 if b.length > 0.5 else 1.4):
        return False
    along = np.sort(ends @ a.direction)
    gap = float(max(along[0] - a.high, a.low - along[1]))
    middle = b.ends().mean(0) - a.ends().mean(0)
    oblique = gap > a.length + b.length and abs(turn_to(middle, main)) > ALONG
    return gap < GAP and not oblique


def _square_up(columns: Columns, faces: list[Face]) -> list[Face]:
    """Turn faces that are nearly so parallel or square to the main direction, where that moves their ends by less than
    their noise, or where a leaf behind the wall's face has turned them.
    """
    main = main_direction(faces)
    out: list[Face] = []
    for face in faces:
        off = turn_to(face.normal, main)
        lines = parallel_lines(columns.xy[face.columns] - face.centre, face.normal, face.length, main)
        if lines is not None:
            out.append(replace(face, centre=face.centre + lines[2][0] * lines[0], normal=lines[0]))
            continue
        if abs(off) * face.length / 2 > max(0.008, 1.5 * face.rms) or abs(off) > TURNED:
            out.append(face)
            continue
        normal = turned(face.normal, -off)
        xy = columns.xy[face.columns]
        near = np.abs((xy - face.centre) @ face.normal) < BAND
        weight = columns.bins[face.columns[near]]
        shift = float(np.average((xy[near] - face.centre) @ normal, weights=weight)) if near.any() else 0.0
        out.append(replace(face, centre=face.centre + shift * normal, normal=normal))
    return out
