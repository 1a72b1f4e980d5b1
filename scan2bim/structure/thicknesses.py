"""Thickness of walls of which scans saw one face: as rays through their openings tell, and as the building's others.

The outer walls of a building are mostly built alike, and those of one storey nearly always. So walls that agree share
one thickness, which is also assumed where nothing tells it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.panorama import Panorama
from scan2bim.geometry.polygons import filled, polygons_of
from scan2bim.structure.axes import Axis
from scan2bim.structure.crossings import PLACED, Crossings, agreed, seen_through

OUTER = 0.30
"""Assumed thickness, metres, of a wall of which one face was seen: the usual outer wall."""
INNER = 0.10
"""Assumed thickness, metres, of a wall within a storey of which one face was seen, where of no other both were."""
THICK = 0.26
"""Thickness, metres, from which on a wall is no partition."""
BEHIND = 0.6, 1.2
"""Metres behind a face between which the storey must go on for an inner wall: outer walls are thinner."""
UNKNOWN = 8.0
"""Metres between spaces up to which nobody entered what lies there, and it is part of the storey: rooms, cores."""
NEARLY = 0.85
"""Share of the smallest rectangle round it that a storey fills to be one: the rest are rooms that nobody entered."""
SHORTEST = 1.0
"""Length, metres, of the shortest wall whose openings are looked through."""
BESIDE = 0.5
"""Metres round a wall's space within which stations are asked: more see its openings from afar and aslant."""
ALIKE = 0.015
"""Metres by which a usual thickness may lie outside of what rays allow: where a jamb is, is known to half a centimetre.
"""
OTHERWISE = 0.03
"""The same for a storey or a single wall, which is built otherwise than its building where that does not suffice."""
ONE_SIDED = 0.06
"""The same where rays bound the thickness from one side alone: a jamb that was missed by a frame's width misleads them.
"""
LOOSE = 0.08
"""Metres between the least and the greatest thickness that rays allow, from which on it is not measured."""
LOOSER = 0.15
"""Metres between these, within which a thickness that others tell is taken as measured here, too."""
BOUNDED = 0.2
"""Metres between these, within which the likely thickness is nearer the truth than an assumed one that they exclude."""
FEWEST_JAMBS = 2
"""Jambs that tell what is usual in a building or storey."""
FEWEST_WINDOWED, WINDOWED = 2, 0.3
"""Walls with windows round a court, and their share of the length of its walls: a room behind has a hatch in one."""
THINNEST, THICKEST = 0.05, 0.6
"""Thicknesses, metres, that rays can tell: less is what lies behind panes, more a shaft or a terrace."""
ROUNDED = 0.005
"""Steps, metres, of what rays tell, so that other scans tell the same."""
ON_LINE, PARALLEL = 0.03, 0.9986
"""Distance, metres, and cosine of 3 degrees within which a border lies on a wall's face."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SoleFace:
    """The only seen face of a wall, ``ends`` (2, 2) in plan with the space on its left, the ``jambs`` of its openings
    that rays cross, and whether one of these has a ``sill``: a window.
    """

    ends: F64
    jambs: tuple[Crossings, ...]
    sill: bool = False


@dataclass(frozen=True, slots=True)
class Told:
    """A thickness and its standard deviation, metres, None where it is assumed."""

    thickness: float
    sigma: float | None


@dataclass(frozen=True, slots=True, eq=False)
class OneFaced:
    """Thickness of the walls of a storey of which one face was seen: of ``known`` ones, as ends (2, 2) of the face with
    the space on its left, thickness (metres) and its standard deviation (None if assumed); else ``inner``
    (metres) where the storey goes on behind them, within its ``outline``, and ``outer``.
    """

    outer: float = OUTER
    inner: float = INNER
    outline: BaseGeometry = field(default_factory=Polygon)
    known: tuple[tuple[F64, float, float | None], ...] = ()

    def behind(self, border: F64) -> tuple[float, float | None]:
        """Thickness and standard deviation (None if assumed) behind a border (2, 2) with the space on its left."""
        middle, way = border.mean(0), border[1] - border[0]
        for ends, thickness, sigma in self.known:
            length = float(np.linalg.norm(ends[1] - ends[0]))
            along, offset = (ends[1] - ends[0]) / length, middle - ends[0]
            off = abs(float(along[0] * offset[1] - along[1] * offset[0]))
            if along @ way > PARALLEL * np.linalg.norm(way) and off < ON_LINE and 0 < offset @ along < length:
                return thickness, sigma
        return self.assumed(border), None

    def assumed(self, border: F64) -> float:
        """Thickness, metres, behind a border (2, 2) of which nothing tells it."""
        return self.outer if self.is_outer(border) else self.inner

    def is_outer(self, border: F64) -> bool:
        """Whether the storey ends behind a border (2, 2)."""
        behind = _behind(border)
        inside = shapely.contains_xy(self.outline, behind[..., 0], behind[..., 1])
        return float(inside.mean()) < 0.5


def _behind(border: F64) -> F64:
    """Places (4, 9, 2) beyond the wall behind a border (2, 2) with the space on its left."""
    way = (border[1] - border[0]) / max(float(np.linalg.norm(border[1] - border[0])), 1e-9)
    depths = np.linspace(*BEHIND, 4)[:, None, None]
    return border[0] + np.linspace(0.1, 0.9, 9)[:, None] * (border[1] - border[0]) + depths * [way[1], -way[0]]


def sole_faces(
    axes: Sequence[Axis], spaces: Sequence[Polygon], base: float, top: float, panoramas: Sequence[Panorama]
) -> list[SoleFace]:
    """What the stations beside them tell of the straight walls of which one face was seen."""
    found: list[SoleFace] = []
    places = np.array([p.position[:2] for p in panoramas]).reshape(-1, 2)
    near = {number: shapely.buffer(space, BESIDE) for number, space in enumerate(spaces)}
    for axis in axes:
        front = axis.thickness < OUTER
        if axis.measured or axis.bulge or front or axis.length < SHORTEST or not panoramas:
            continue
        beside = shapely.union_all([near[number] for number in axis.left | axis.right])
        inside = shapely.contains_xy(beside, places[:, 0], places[:, 1])
        asked = [p for p, here in zip(panoramas, inside, strict=True) if here]
        ends = np.array([axis.start, axis.end]) + axis.inset
        through = seen_through(axis, base, top, asked)
        found.append(SoleFace(ends if axis.left else ends[::-1], through.jambs, through.sill))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class StoreyFaces:
    """Of a storey its ``spaces``, the ``axes`` of its walls, and the ``faces`` of those of which one was seen."""

    spaces: Sequence[Polygon]
    axes: Sequence[Axis]
    faces: Sequence[SoleFace]


def one_faced(storeys: Sequence[StoreyFaces], least: float) -> list[OneFaced]:
    """The walls of which one face was seen, storey by storey; outer ones are ``least`` metres thick where rays tell
    nothing in the whole building.
    """
    every = [face for storey in storeys for face in storey.faces]
    plain = [OneFaced(least, partition_of(s.axes), built_over(storeys[k:], every)) for k, s in enumerate(storeys)]
    outer = [[f for f in s.faces if p.is_outer(f.ends)] for s, p in zip(storeys, plain, strict=True)]
    building = _usual([face for faces in outer for face in faces], Told(OUTER, None), Told(least, None))
    out: list[OneFaced] = []
    for storey, faces, unknown in zip(storeys, outer, plain, strict=True):
        usual = building if _is_told(faces, building.thickness) else _usual(faces, building, building, OTHERWISE)
        walls = replace(unknown, outer=usual.thickness)
        known = [(f, usual if walls.is_outer(f.ends) else Told(walls.inner, None)) for f in storey.faces]
        told = [(face, _thickness_of(face, like)) for face, like in known]
        out.append(replace(walls, known=tuple((face.ends, t.thickness, t.sigma) for face, t in told)))
    return out


def built_over(storeys: Sequence[StoreyFaces], faces: Sequence[SoleFace]) -> BaseGeometry:
    """What the lowest of some storeys takes up: its own outline, and what the others stand over, without the courts
    that windows in the ``faces`` of any storey look into.
    """
    whole = shapely.union_all([outline_of(storey.spaces) for storey in storeys])
    rooms = shapely.union_all([space for storey in storeys for space in storey.spaces])
    unknown = polygons_of(whole.difference(rooms.buffer(BEHIND[0] - ON_LINE)))
    courts = [part for part in unknown if _is_court(part, faces)]
    return whole.difference(shapely.union_all(courts))


def _is_court(part: Polygon, faces: Sequence[SoleFace]) -> bool:
    """Whether windows look into a part of a storey that nobody entered from several of the walls beside it."""
    views = [(face, _behind(face.ends)) for face in faces]
    beside = [face for face, v in views if shapely.contains_xy(part, v[..., 0], v[..., 1]).mean() > 0.5]
    lengths = np.array([np.linalg.norm(face.ends[1] - face.ends[0]) for face in beside])
    with_windows = np.array([face.sill for face in beside], np.bool_)
    return with_windows.sum() >= FEWEST_WINDOWED and lengths[with_windows].sum() > WINDOWED * lengths.sum()


def outline_of(spaces: Sequence[Polygon]) -> BaseGeometry:
    """What a storey takes up within its outer walls: its spaces and what lies between them, also at its corners where
    it is nearly a rectangle.
    """
    whole = shapely.union_all(spaces).buffer(UNKNOWN / 2, join_style="mitre").buffer(-UNKNOWN / 2, join_style="mitre")
    outline = filled(whole)
    box = outline.minimum_rotated_rectangle
    return box if outline.area > NEARLY * box.area else outline


def partition_of(axes: Sequence[Axis]) -> float:
    """Thickness of most of the length of the partitions that were seen from both sides, metres."""
    told = sorted((a.thickness, a.length) for a in axes if a.measured and a.thickness < THICK)
    if not told:
        return INNER
    thickness, length = np.array(told).T
    return _rounded(float(thickness[np.searchsorted(np.cumsum(length), length.sum() / 2)]))


def _usual(faces: Sequence[SoleFace], usual: Told, otherwise: Told, alike: float = ALIKE) -> Told:
    """What the jambs of most walls tell: the usual thickness if they allow it, ``otherwise`` another one where they do
    not tell it.
    """
    jambs = [jamb for face in faces for jamb in face.jambs]
    bounds = agreed(jambs) if len(jambs) >= FEWEST_JAMBS else (0.0, np.inf, np.inf)
    if _is_within(bounds, LOOSE):
        return Told(_within(bounds, usual.thickness, alike), _sigma(bounds))
    like = usual if _is_within(bounds, BOUNDED) else otherwise
    return replace(otherwise, thickness=_within(bounds, like.thickness, alike))


def _thickness_of(face: SoleFace, usual: Told) -> Told:
    """The usual thickness of a wall where its jambs allow it, else what they tell; measured where they bound it from
    both sides, or nearly so what is measured on others.
    """
    low, _, high = bounds = agreed(face.jambs)
    if high < usual.thickness - OTHERWISE and not _is_thinner(face.jambs, usual.thickness):
        return usual
    thickness = _within(bounds, usual.thickness, OTHERWISE if _is_within(bounds, BOUNDED) else ONE_SIDED)
    if _is_within(bounds, LOOSE):
        return Told(thickness, _sigma(bounds) if usual.sigma is None else min(_sigma(bounds), usual.sigma))
    shared = thickness == usual.thickness and low > 0.0 and high < low + LOOSER
    return Told(thickness, usual.sigma if shared else None)


def _is_thinner(jambs: Sequence[Crossings], usual: float) -> bool:
    """Whether several jambs tell less than a usual thickness, metres, and none tells it: a frame that hides the reveal
    behind it makes a wall seem thinner, never thicker.
    """
    thinner = [high < usual - OTHERWISE for _, high in _bounded(jambs)]
    return len(thinner) >= FEWEST_JAMBS and all(thinner)


def _is_told(faces: Sequence[SoleFace], usual: float) -> bool:
    """Whether most jambs of a storey that bound the thickness from both sides allow a usual one, metres."""
    bounds = _bounded([jamb for face in faces for jamb in face.jambs])
    return sum(low - ALIKE < usual < high + ALIKE for low, high in bounds) > len(bounds) / 2


def _bounded(jambs: Sequence[Crossings]) -> list[tuple[float, float]]:
    """The bounds of those jambs that bound the thickness from both sides, metres."""
    return [b for b in (jamb.bounds() for jamb in jambs) if b[0] > 0.0 and np.isfinite(b[1])]


def _within(bounds: tuple[float, float, float], usual: float, alike: float = ALIKE) -> float:
    """The usual thickness, metres, where the bounds allow it nearly; else the likely one, or the nearer bound."""
    low, likely, high = bounds
    if low - alike < usual < high + alike or low > THICKEST or high < THINNEST:
        return usual
    return _rounded(likely if _is_within(bounds, BOUNDED) else float(np.clip(usual, low, high)))


def _sigma(bounds: tuple[float, float, float]) -> float:
    """Standard deviation, metres, of a thickness between these."""
    return float(np.hypot((bounds[2] - bounds[0]) / 12**0.5, PLACED))


def _is_within(bounds: tuple[float, float, float], span: float) -> bool:
    """Whether rays tell a thickness from both sides, within a ``span``, metres."""
    low, _, high = bounds
    return 0.0 < low <= high < low + span and high > THINNEST and low < THICKEST


def _rounded(thickness: float) -> float:
    return round(round(thickness / ROUNDED) * ROUNDED, 4)
