"""Downstand beams: straight strips that hang below the ceiling on both sides of them, from wall or column to the next.

Their flanks reach the ceiling like a wall's faces do. What tells a beam from the lintel over an opening is that at its
ends no wall goes on in its line; from lamps and ducts that it is closed up to the ceiling and does not end in the air.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from shapely.geometry import Point, Polygon

from scan2bim.cloud.surfels import PLAN, TALL
from scan2bim.geometry.stretches import covered_length
from scan2bim.structure.pillars import Pillar
from scan2bim.structure.plan import Plan, pixels_in
from scan2bim.structure.shapes import BeamShape, ring_of

WIDEST = 21
"""Pixels: strips of less than 1 m may be beams, wider ones are lower ceilings."""
THINNEST = 0.13
"""Width, metres, below which a strip is a pipe, a rail or a cable tray."""
SHORTEST = 1.0
"""Length, metres, of the shortest beam looked for."""
LONGER = 2.0
"""A beam is longer than wide by this factor at least."""
DROP = (0.08, 1.2)
"""Metres that a beam hangs below the ceiling beside it: less are joints and mouldings, more are galleries."""
CLEAR = 1.9
"""Height, metres, under a beam: one passes below it."""
LEVEL = 0.04
"""Metres that a beam's underside may vary."""
BESIDE = 2
"""Pixels beside a strip at which the ceiling must be higher by STEEP of the whole drop: vaults rise more gently."""
STEEP = 0.6
FULL = 0.7
"""Share of a strip's rectangle that must hang at one level."""
HIDDEN = 13
"""Pixels: stretches of 65 cm of a strip may be hidden by what hangs or stands below it, as by a column."""
FLANKED = 0.3
"""Share of a beam's length along which its flanks must be seen, where it hangs deep enough for that, ..."""
DEEP = 0.35
"""... which is from this drop on, metres: three surfels one above the other between FLUSH and its edge."""
AT_END = 0.35
"""Distance, metres, from a beam's end within which it must meet a wall or a column."""
STUB = 0.3
"""Length, metres, of wall in line with a strip from which on that strip is a lintel in it."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """A strip along the building's main direction or across it: ``axes`` (2, 2) unit vectors along and across; ``low``
    and ``high`` (2,) its corners along those, metres; ``under`` and ``top`` (z) of it and of the ceiling beside it.
    """

    axes: F64
    low: F64
    high: F64
    under: float
    top: float

    @property
    def polygon(self) -> Polygon:
        """Its outline in plan, counter-clockwise."""
        (a, b), (c, d) = self.low, self.high
        return Polygon(np.array([[a, b], [c, b], [c, d], [a, d]]) @ self.axes)

    def local(self, xy: F64) -> F64:
        """Points (n, 2) along and across it."""
        return xy @ self.axes.T


def find_beams(plan: Plan, main: float, pillars: Sequence[Pillar]) -> list[Strip]:
    """Beams of a storey along and across the building's ``main`` direction (radians). ``plan`` has its columns yet."""
    strips = [_fitted(s, plan) for angle in (main, main + np.pi / 2) for s in _strips(plan, angle)]
    strips = [s for s in strips if _closed_up(s, plan)]
    supports = [p.polygon for p in pillars]
    found: list[Strip] = []
    while more := [s for s in strips if s not in found and all(_rests(s, end, plan, supports) for end in (-1, 1))]:
        found += more
        supports += [s.polygon for s in more]
    return found


def without_beams(plan: Plan, beams: Sequence[Strip]) -> Plan:
    """The plan as if the beams were not there: nothing hangs where they are, and the ceiling goes on over them."""
    if not beams:
        return plan
    place = np.zeros(plan.floor.shape, bool)
    height = plan.ceiling_z.copy()
    for beam in beams:
        inside = pixels_in(beam.polygon.buffer(1.5 * PLAN, join_style="mitre"), plan)
        place |= inside
        height[inside] = beam.top
    pixel = plan.columns.pixel
    hung = place[pixel[:, 1], pixel[:, 0]] & (plan.columns.low == 0)
    return replace(
        plan,
        ceiling=np.where(place, np.uint8(1), plan.ceiling),
        ceiling_z=height,
        soffit=np.where(place, np.uint8(0), plan.soffit),
        columns=plan.columns.pick(~hung),
    )


def beam_of(beam: Strip, plan: Plan) -> BeamShape:
    """A beam as the stage's result; ``plan`` still has its columns."""
    size = beam.high - beam.low
    inside = pixels_in(beam.polygon, plan)
    near = np.abs(plan.overhead_z[inside] - beam.under) < LEVEL
    return BeamShape(
        ring_of(np.array(beam.polygon.exterior.coords)),
        round(beam.under, 4),
        round(beam.top, 4),
        (round(float(size[0]), 3), round(float(size[1]), 3)),
        round(float(near.mean()) if len(near) else 0.0, 3),
    )


def _strips(plan: Plan, angle: float) -> list[Strip]:
    """Level strips along a direction (radians) that hang lower than what is beside them."""
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    height, origin = _turned(plan, axes)
    known = np.isfinite(height)
    beside = cv2.morphologyEx(
        np.where(known, height, np.float32(-1e3)), cv2.MORPH_CLOSE, np.ones((WIDEST, 1), np.uint8)
    )
    drop = beside - height
    hangs = known & (drop > DROP[0]) & (drop < DROP[1]) & (height > plan.levels.floor + CLEAR) & (beside > -500)
    along = cv2.morphologyEx(hangs.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((1, HIDDEN), np.uint8))
    along = cv2.morphologyEx(along, cv2.MORPH_OPEN, np.ones((2, round(SHORTEST / PLAN)), np.uint8))
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(along)
    parts = (
        _strip(height, np.asarray(beside, np.float32), hangs & (np.asarray(labels) == k), boxes[k], axes, origin)
        for k in range(1, count)
    )
    return [strip for strip in parts if strip is not None]


def _strip(
    height: F32, beside: F32, hangs: NDArray[np.bool_], box: NDArray[np.int32], axes: F64, origin: F64
) -> Strip | None:
    """The strip in a ``box`` (left, lower, width, height, ...) of the rasters, if it is level and ends in steps."""
    col, row, wide, tall = (int(v) for v in box[:4])
    part = (slice(row, row + tall), slice(col, col + wide))
    under = float(np.median(height[part][hangs[part]]))
    level = hangs[part] & (np.abs(height[part] - under) < LEVEL)
    rows = np.flatnonzero(level.mean(1) > 0.5)
    if not len(rows) or level[rows[0] : rows[-1] + 1].mean() < FULL or wide < LONGER * len(rows):
        return None
    top = float(np.median(beside[part][level]))
    first, last = row + int(rows[0]), row + int(rows[-1])
    outside = [height[r, part[1]] for r in (first - BESIDE, last + BESIDE) if 0 <= r < len(height)]
    steps = [float(np.nanmedian(z)) - under if np.isfinite(z).any() else 0.0 for z in outside]
    if len(steps) < 2 or min(steps) < STEEP * (top - under):
        return None
    low, high = origin + np.array([[col, first], [col + wide, last + 1]]) * PLAN
    return Strip(axes, low, high, under, top)


def _turned(plan: Plan, axes: F64) -> tuple[F32, F64]:
    """Heights of what hangs overhead in a raster along ``axes`` (2, 2), and that raster's origin along them."""
    rows, cols = plan.overhead_z.shape
    corners = plan.origin + np.array([[0, 0], [cols, 0], [cols, rows], [0, rows]]) * PLAN
    local = corners @ axes.T
    origin = local.min(0)
    size = np.ceil(np.ptp(local, axis=0) / PLAN).astype(int) + 1
    shift = (origin @ axes - plan.origin) / PLAN + 0.5 * axes.sum(0) - 0.5
    matrix = np.column_stack([axes.T, shift])
    turned = cv2.warpAffine(
        plan.overhead_z,
        matrix,
        (int(size[0]), int(size[1])),
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
        borderValue=float("nan"),
    )
    return np.asarray(turned, np.float32), origin


def _fitted(strip: Strip, plan: Plan) -> Strip:
    """The strip with its sides where its flanks were seen."""
    at = strip.local(plan.columns.xy)
    hung = (plan.columns.low == 0) & (at[:, 0] > strip.low[0]) & (at[:, 0] < strip.high[0])
    low, high = strip.low.copy(), strip.high.copy()
    for side in (low, high):
        on = hung & (np.abs(at[:, 1] - side[1]) < 1.5 * PLAN)
        if on.sum() * PLAN > FLANKED * (high - low)[0]:
            side[1] = np.median(at[on, 1])
    return replace(strip, low=low, high=high)


def _closed_up(strip: Strip, plan: Plan) -> bool:
    """Whether a strip is as wide as a beam and its flanks were seen, if it hangs so deep that they can be."""
    if not THINNEST < strip.high[1] - strip.low[1] < WIDEST * PLAN:
        return False
    drop = strip.top - strip.under
    if drop < DEEP:
        return True
    at = strip.local(plan.columns.xy)
    tall = plan.columns.bins * TALL > 0.5 * drop
    inside = (at[:, 0] > strip.low[0]) & (at[:, 0] < strip.high[0]) & tall
    seen = [
        covered_length(at[inside & (np.abs(at[:, 1] - side) < 1.5 * PLAN), 0], PLAN)
        for side in (strip.low[1], strip.high[1])
    ]
    return max(seen) > FLANKED * float(strip.high[0] - strip.low[0])


def _rests(strip: Strip, end: int, plan: Plan, supports: Sequence[Polygon]) -> bool:
    """Whether the strip's start (-1) or end (1) lies on one of ``supports`` (columns, beams) or meets a wall across,
    and no wall goes on in its line.
    """
    place = strip.low[0] if end < 0 else strip.high[0]
    middle = np.array([place, (strip.low[1] + strip.high[1]) / 2])
    if any(p.distance(Point(middle @ strip.axes)) < AT_END for p in supports):
        return True
    columns = plan.columns
    at = strip.local(columns.xy) - np.array([place, 0.0])
    out = at[:, 0] * end
    upright = columns.low >= 2
    between = upright & (at[:, 1] > strip.low[1] - PLAN) & (at[:, 1] < strip.high[1] + PLAN)
    flush = np.minimum(np.abs(at[:, 1] - strip.low[1]), np.abs(at[:, 1] - strip.high[1])) < PLAN
    beyond = between & flush & (out > 0) & (out < 4 * STUB)
    if covered_length(out[beyond], PLAN) > STUB:
        return False
    across = between & (np.abs(out) < AT_END)
    return bool(covered_length(at[across, 1], PLAN) > 0.5 * (strip.high[1] - strip.low[1]))
