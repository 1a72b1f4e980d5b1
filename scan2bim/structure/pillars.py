"""Columns of the building (pillars): small closed outlines, round or rectangular, that stand up to the ceiling.

"Column" is the element; the plan's ``Columns`` are surfels one above the other, of which a pillar's outline is made.
What tells a pillar from a wall's piece is that it is seen from outside on several sides; from a wardrobe or a person
that it reaches the ceiling; from a pipe its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon

from scan2bim.cloud.surfels import PLAN, TALL
from scan2bim.geometry.raster import closed
from scan2bim.geometry.sections import Section, fit_circle, fit_rectangle
from scan2bim.structure.faces import Face
from scan2bim.structure.plan import Plan, pixels_in
from scan2bim.structure.shapes import ColumnShape, ring_of

THINNEST, THICKEST = 0.12, 1.2
"""Sizes across, metres, of pillars: thinner are pipes, thicker are shafts and cores, which walls enclose."""
SLIMMEST = 2.5
"""Ratio of a pillar's sides from which on it is a piece of wall."""
UPRIGHT = 0.4
"""Share of the clear height that a plan column must fill to be part of a pillar: furniture may hide the rest."""
REACHING = 3
"""Heights of 10 cm, of the four below the ceiling, that a pillar fills: what ends lower is furniture."""
LOWEST = 1.8
"""Clear height, metres, of the lowest place where a pillar is looked for: not under the eaves of a roof."""
FEWEST = 6
"""Plan columns that an outline needs: two sides of the thinnest pillar."""
FIT = 0.02
"""Root mean square distance, metres, of a pillar's surface to its outline: noise and registration together."""
CLEAR_FIT = 0.006
"""The same of a pillar of which only two sides were seen: chance puts what stands at random in two lines, too."""
ROUNDER = 0.6
"""Ratio of both fits' residuals below which the section is round rather than rectangular."""
OUTWARD = 0.3
"""Mean cosine between the outline's outward normals and the views: a niche or shaft is seen from inside."""
SHADOW = 7
"""Pixels: gaps of 35 cm in floor or ceiling lie between a sparse scan's points, or in the pillar's own shadow."""
ROUND_ABOUT = 0.8
"""Share of a ring round a pillar over or under which ceiling or floor was seen: the corner of a wall has less."""
ALL_SIDES = 0.85
"""Share of its outline from which on a pillar was seen from all sides and is no corner, ..."""
BESIDE = 0.5
"""... and share of the ring that then suffices: it may stand close to a wall or front."""
LINTEL = 2.25
"""Height over the floor, metres, below which a strip that ends at a pillar is a lintel and the pillar a wall's pier:
doors are lower, and nobody passes under lower beams.
"""
RING = (0.10, 0.30)
"""Inner and outer distance, metres, of that ring from the outline."""
LONGEST_POST = 0.8
"""Length, metres, of the longest face in a spiral stair that is no wall."""
POST_BESIDE = 0.1
"""Metres by which such a face may stand out of the stair's outline: a stringer does."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Pillar:
    """A pillar: its ``section`` in plan, ``base`` and ``top`` (z, metres) and whether the ceiling there was seen;
    ``members`` plan columns on its surface, ``coverage`` the share of its outline that was seen.
    """

    section: Section
    base: float
    top: float
    top_seen: bool
    members: I64
    coverage: float

    @property
    def polygon(self) -> Polygon:
        """Its outline."""
        return Polygon(self.section.outline)

    @property
    def kind(self) -> Literal["round", "rectangular"]:
        """Of its section."""
        return "round" if self.section.round else "rectangular"


def find_pillars(plan: Plan, main: float, stairs: Sequence[Polygon] = ()) -> list[Pillar]:
    """Free-standing pillars of a storey; ``main`` is the building's main direction (radians). What stands in ``stairs``
    is a post of theirs.
    """
    columns = plan.columns
    clear = plan.grid.roof[columns.pixel[:, 1], columns.pixel[:, 0]] - plan.grid.floor
    upright = (columns.bins * TALL >= UPRIGHT * clear) & (columns.high >= 1) & (clear > LOWEST)
    loose = _clusters(plan, upright, upright | (columns.high >= 2))
    taken = np.zeros(len(columns), bool)
    for group in loose:
        taken[group] = True
    tied = [g for g in _clusters(plan, upright & ~taken, upright) if not _is_pier(plan, g, upright)]
    found = [_pillar(plan, group, main) for group in [*loose, *tied]]
    posts = shapely.union_all(stairs)
    return [p for p in found if p is not None and not posts.intersects(p.polygon)]


def _is_pier(plan: Plan, group: I64, upright: NDArray[np.bool_]) -> bool:
    """Whether what hangs from the ceiling beside a group of plan columns comes down as far as lintels do."""
    columns = plan.columns
    low, high = columns.xy[group].min(0) - RING[1], columns.xy[group].max(0) + RING[1]
    beside = ((columns.xy > low) & (columns.xy < high)).all(1) & ~upright & (columns.high >= 2)
    hung = columns.low == 0
    down = columns.bins[beside & hung] * TALL
    if not len(down):
        return False
    roof = plan.grid.roof[columns.pixel[group[0], 1], columns.pixel[group[0], 0]] - plan.grid.floor
    return bool(roof - np.percentile(down, 75) < LINTEL)


def without_pillars(plan: Plan, pillars: Sequence[Pillar]) -> Plan:
    """The plan as if the pillars were not there: no surface where they stand, floor and ceiling go on through them."""
    if not pillars:
        return plan
    place = np.zeros(plan.floor.shape, bool)
    height = plan.ceiling_z.copy()
    for pillar in pillars:
        inside = pixels_in(pillar.polygon.buffer(RING[0]), plan)
        place |= inside
        height[inside & ~np.isfinite(height)] = pillar.top
    pixel = plan.columns.pixel
    return replace(
        plan,
        floor=np.where(place, np.uint8(1), plan.floor),
        ceiling=np.where(place, np.uint8(1), plan.ceiling),
        ceiling_z=height,
        soffit=np.where(place, np.uint8(0), plan.soffit),
        void=np.where(place, np.uint8(0), plan.void),
        columns=plan.columns.pick(~place[pixel[:, 1], pixel[:, 0]]),
    )


def column_of(pillar: Pillar, plan: Plan) -> ColumnShape:
    """A pillar as the stage's result; its members are plan columns of ``plan``."""
    columns, at = plan.columns, pillar.members
    red, green, blue = (int(c) for c in np.median(columns.rgb[at], axis=0))
    return ColumnShape(
        ring_of(pillar.section.outline),
        pillar.kind,
        (round(pillar.section.size[0], 4), round(pillar.section.size[1], 4)),
        round(pillar.base, 4),
        round(pillar.top, 4),
        pillar.top_seen,
        round(pillar.section.rms, 4),
        int(columns.points[at].sum()),
        round(pillar.coverage, 3),
        tuple(int(s) for s in np.unique(columns.station[at])),
        (red, green, blue),
    )


def _clusters(plan: Plan, wanted: NDArray[np.bool_], linking: NDArray[np.bool_]) -> list[I64]:
    """Those ``wanted`` plan columns (m,) in groups with less than 10 cm between the ``linking`` ones (m,), if a
    group is no larger than a pillar.
    """
    mask = np.zeros(plan.floor.shape, np.uint8)
    at = plan.columns.pixel[linking]
    mask[at[:, 1], at[:, 0]] = 1
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(cv2.dilate(mask, np.ones((3, 3), np.uint8)))
    small = np.hypot(boxes[:, cv2.CC_STAT_WIDTH] - 2, boxes[:, cv2.CC_STAT_HEIGHT] - 2) * PLAN < 1.5 * THICKEST
    label = np.asarray(labels, np.int64)[plan.columns.pixel[:, 1], plan.columns.pixel[:, 0]]
    members = np.flatnonzero(wanted & small[label] & (label > 0))
    members = members[np.argsort(label[members], kind="stable")]
    groups = np.split(members, np.flatnonzero(np.diff(label[members])) + 1)
    return [g for g in groups if len(g) >= FEWEST]


def _pillar(plan: Plan, group: I64, main: float) -> Pillar | None:
    """The pillar that a group of plan columns is, if it is one."""
    columns = plan.columns
    if (columns.high[group] >= REACHING).sum() < len(group) / 3:
        return None
    xy, weight = columns.xy[group], columns.bins[group].astype(np.float64)
    section = _section(xy, weight, main)
    if section is None:
        return None
    near = section.distance(xy)
    fits = near < 2 * FIT
    view = columns.view[group[fits]]
    known = np.linalg.norm(view, axis=1) > 0.1
    outward = (view * section.outward(xy[fits])).sum(1)[known]
    if fits.mean() < 0.75 or (len(outward) and outward.mean() < OUTWARD):
        return None
    top = _ceiling_round(plan, section)
    pillar = Pillar(
        section,
        plan.grid.floor,
        plan.levels.top if top is None else top,
        top is not None,
        group[fits],
        section.coverage(xy[fits], PLAN),
    )
    return pillar if _stands_free(plan, pillar) else None


def _section(xy: F64, weight: F64, main: float) -> Section | None:
    """The round or rectangular section that fits points (n, 2), None if neither does or its size is not a pillar's."""
    rectangle, circle = fit_rectangle(xy, weight, main), fit_circle(xy, weight)
    section = circle if circle.rms < ROUNDER * rectangle.rms and circle.sides >= 5 else rectangle
    thin, thick = sorted(section.size)
    enough, clear = (5, 7) if section.round else (2, 3)
    right = section.sides >= enough and section.rms < (FIT if section.sides >= clear else CLEAR_FIT)
    return section if right and thin > THINNEST and thick < min(THICKEST, SLIMMEST * thin) else None


def _ceiling_round(plan: Plan, section: Section) -> float | None:
    """Height of the ceiling round a section, metres; None if none was seen."""
    heights = plan.ceiling_z[pixels_in(Polygon(section.outline).buffer(RING[1]), plan)]
    heights = heights[np.isfinite(heights)]
    return float(np.median(heights)) if len(heights) else None


def _stands_free(plan: Plan, pillar: Pillar) -> bool:
    """Whether floor or ceiling was seen round a pillar: the corner of a wall is solid or unseen on its far sides."""
    inner, outer = (pixels_in(shapely.buffer(pillar.polygon, d, join_style="mitre"), plan) for d in RING)
    ring = outer & ~inner
    seen = closed(plan.ceiling | plan.floor | plan.soffit, SHADOW) > 0
    share = float(np.mean(seen[ring])) if ring.any() else 0.0
    return share > (BESIDE if pillar.coverage > ALL_SIDES else ROUND_ABOUT)


def without_posts(faces: Sequence[Face], spirals: Sequence[Polygon]) -> list[Face]:
    """Faces less the short ones in spiral stairs: newels, stringers and balusters. Along straight ones stand walls."""
    whole = shapely.union_all(spirals).buffer(POST_BESIDE)
    return [f for f in faces if f.length > LONGEST_POST or not whole.contains(LineString(f.ends()))]
