"""Window fronts: glazing that fills a wall from side to side, so that of the wall itself only a lintel is seen.

The pane and its frame stand back in the wall like any window's, but as no wall face is seen beside them they would be
taken for the wall's face. What tells is where the ceiling ends: at the lintel, a hand or two before the glass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, seen_through
from scan2bim.cloud.surfels import PLAN
from scan2bim.structure.faces import DEEPEST_RECESS, GAP, PARALLEL, Face
from scan2bim.structure.plan import Plan

LOOKED_THROUGH = 0.25
"""Share of a front's area that stations must have looked through: more than noise, less than curtains leave."""
UNDERSIDE = 0.4
"""Share of a front's length on which its lintel must have been seen from below."""
BEYOND = 0.12
"""Distance, metres, behind a front at which a pulse must still fly to have gone through it."""
IN_LINE = 0.05
"""Distance, metres, within which the end of the ceiling continues a wall's face: as well as a raster of 5 cm tells."""
F64 = NDArray[np.float64]


def glazing_under_lintels(plan: Plan, faces: Sequence[Face], panoramas: Sequence[Panorama]) -> list[Face]:
    """Those of ``faces`` that are glazing: before them hangs a lintel, and stations looked through them."""
    return [f for f in faces if _before(f, plan).any(0).mean() > UNDERSIDE and _looked_through(f, plan, panoramas)]


def without_reveals(plan: Plan, glazing: Sequence[Face]) -> Plan:
    """The plan with no ceiling in the depth of the wall before ``glazing``."""
    if not glazing:
        return plan
    reveal = np.zeros(plan.ceiling.shape, np.uint8)
    for face in glazing:
        pixel = _pixels(face, plan)[_before(face, plan)]
        reveal[pixel[:, 1], pixel[:, 0]] = 1
    reveal = cv2.dilate(reveal, np.ones((3, 3), np.uint8)) & (plan.soffit | (plan.ceiling == 0))
    return replace(
        plan,
        ceiling=np.where(reveal > 0, np.uint8(0), plan.ceiling),
        ceiling_z=np.where(reveal > 0, np.float32(np.nan), plan.ceiling_z),
    )


def lintels_before(edges: Sequence[Face], glazing: Sequence[Face], walls: Sequence[Face]) -> list[Face]:
    """``edges`` of the ceiling, those before ``glazing`` marked as lintels and moved into line with the ``walls`` that
    they continue.
    """
    out: list[Face] = []
    for edge in edges:
        behind = [g for g in glazing if _stands_back(g, edge)]
        if not behind:
            out.append(edge)
            continue
        along = np.concatenate([(g.ends() - edge.centre) @ edge.direction for g in behind])
        wide = replace(edge, low=min(edge.low, along.min()), high=max(edge.high, along.max()), lintel=True, sided=True)
        out.append(_in_line(wide, walls))
    return out


def _stands_back(face: Face, edge: Face) -> bool:
    """Whether a face lies behind an edge, in the depth of a wall, on more than half of its own length."""
    if face.normal @ edge.normal < PARALLEL:
        return False
    ends = face.ends() - edge.centre
    behind, along = -(ends @ edge.normal), np.sort(ends @ edge.direction)
    overlap = min(along[1], edge.high) - max(along[0], edge.low)
    return bool(behind.min() > 0.03 and behind.max() < DEEPEST_RECESS and overlap > 0.5 * face.length)


def _pixels(face: Face, plan: Plan) -> NDArray[np.int64]:
    """Pixels (depth, along, 2) before a face, to the depth of a wall, every 5 cm."""
    t, d = np.meshgrid(np.arange(face.low, face.high, PLAN), np.arange(PLAN / 2, DEEPEST_RECESS, PLAN))
    points = face.centre + t[..., None] * face.direction + d[..., None] * face.normal
    pixel = plan.grid.pixel_of(points.reshape(-1, 2))
    return np.clip(pixel, 0, np.array(plan.floor.shape[::-1]) - 1).reshape(*t.shape, 2)


def _before(face: Face, plan: Plan) -> NDArray[np.bool_]:
    """Which of those pixels (depth, along) lie under a lintel."""
    pixel = _pixels(face, plan)
    return plan.soffit[pixel[..., 1], pixel[..., 0]] > 0


def _looked_through(face: Face, plan: Plan, panoramas: Sequence[Panorama]) -> bool:
    """Whether stations looked through enough of a face's area; without stations, whether floor lies right behind it."""
    along = np.arange(face.low, face.high, 0.1)
    behind = face.centre + np.outer(along, face.direction) - BEYOND * face.normal
    if not panoramas:
        pixel = np.clip(plan.grid.pixel_of(behind), 0, np.array(plan.floor.shape[::-1]) - 1)
        return bool(plan.floor[pixel[:, 1], pixel[:, 0]].mean() > LOOKED_THROUGH)
    heights = plan.levels.floor + np.arange(0.4, 2.1, 0.2)
    points = np.empty((len(along), len(heights), 3), np.float32)
    points[..., :2], points[..., 2] = behind[:, None], heights
    flat = points.reshape(-1, 3)
    through, stopped = np.zeros(len(flat), bool), np.zeros(len(flat), bool)
    for panorama in panoramas:
        if (panorama.position[:2] - face.centre) @ face.normal > 0:
            said = seen_through(flat, panorama.position.astype(np.float32), panorama.ranges, np.float32(0.05), True)
            through |= said == 1
            stopped |= said == 3
    told = through | stopped
    return bool(told.any() and through[told].mean() > LOOKED_THROUGH)


def _in_line(edge: Face, faces: Sequence[Face]) -> Face:
    """The edge on the line of the nearest wall face that it continues, if there is one."""
    best: tuple[float, Face] | None = None
    for face in faces:
        offset = edge.ends() - face.centre
        along = np.sort(offset @ face.direction)
        gap = max(along[0] - face.high, face.low - along[1])
        off = float(np.abs(offset @ face.normal).max())
        follows = face.normal @ edge.normal > PARALLEL and gap < GAP and off < IN_LINE
        if follows and (best is None or off < best[0]):
            best = off, face
    if best is None:
        return edge
    face = best[1]
    along = np.sort((edge.ends() - face.centre) @ face.direction)
    return replace(edge, centre=face.centre, normal=face.normal, low=float(along[0]), high=float(along[1]))
