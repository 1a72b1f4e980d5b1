"""Cell complex: the lines of the wall faces cut the storey's plan into cells, which one global optimisation labels
space or solid.

Design: "Cell complex plus global optimisation". Spaces come out closed, and a door does not leak, because a label may
change only along cell edges and pays for every metre of edge on which no face was seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from scan2bim.cloud.surfels import PLAN
from scan2bim.geometry.graphs import source_side
from scan2bim.geometry.raster import closed, opened
from scan2bim.structure.faces import PARALLEL, Face, without_recesses
from scan2bim.structure.plan import Plan

LONGEST_BARE = 0.8
"""Length, metres, from which an edge of the floor or ceiling without a wall face is drawn as a cut."""
REACH = 4.0
"""How far a face's line is drawn on past its ends, metres: corners behind cupboards, wide passages."""
CAP = 0.6
"""Length, metres, of the cuts at a face's ends: most walls are thinner."""
LEAST_OPEN = 1.0
"""Square metres in one piece of clear evidence outside all cells from which on the cuts are drawn deeper: a return wall
that nobody saw leaves a room open.
"""
BARE_EDGE = 0.30
"""Cost per metre of a label change where no face was seen, in square metres of full evidence."""
SEEN_EDGE = 0.02
"""Cost per metre of a label change on a face that was seen: keeps borders short."""
SIDE = 0.5
"""Evidence per metre of seen face for air on its front and wall on its back, in square metres of full evidence."""
WALL_DEPTH = 0.5
"""Metres behind a face for which it speaks: the larger a cell behind it, the less of it is that wall."""
FREE = 0.0
"""Evidence per square metre where a station looked through just below ceiling height but no ceiling was seen: open
wells, but also outdoors.
"""
NOTHING = -0.2
"""Evidence per square metre where neither floor, ceiling nor free space was seen: the inside of walls, the outside."""
THIN = (0.03, 0.30)
"""Distances, metres, between the faces of one wall that are taken to go on together."""
PAIRED = 0.4
"""Length, metres, along which both must have been seen."""
SHORTEST_GAP = 0.3
"""Length, metres, of the shortest stretch without a seen face that an opening may leave."""
BEHIND_GAP = 0.5
"""What a metre between two seen stretches speaks for wall behind it, of a metre of seen face: doors and windows."""
BRIDGED = 0.6
"""What a metre between two seen stretches of one face counts, of a metre of seen face: walls go on in line."""
OPEN, HALF_WALL = 0.3, 0.06
"""Share of a stretch without a seen face that must have been looked through for no wall to go on there, and metres
beside the face's line at which that is asked, too: in the middle of a partition.
"""
SCALE = 2000.0
"""Integer capacity per square metre of evidence in the graph cut."""
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Span = tuple[float, float]
"""From where to where along a face, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """``polygons`` (c,) shapely; ``edges`` (e, 2) the cells on both sides of an inner edge, ``ends`` (e, 2, 2) its end
    points; ``covered`` (e,) 0-1 how far a border there is expected: seen faces, and stretches between them; ``parted``
    (e,) the share of it on which a face was seen; ``hidden`` (e,) whether it lies between seen stretches of a face and
    was not looked through, so that a wall may go on there; ``evidence`` (c,) square metres, positive for space.
    """

    polygons: NDArray[np.object_]
    edges: I64
    ends: F64
    covered: F64
    parted: F64
    hidden: NDArray[np.bool_]
    evidence: F64


def space_evidence(plan: Plan, free: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Evidence per pixel, -1 to 1 for each square metre, that it belongs to a space; ``free`` was looked through."""
    ceiling, floor = plan.ceiling > 0, plan.floor > 0
    roofed = ceiling.any()
    score = np.full(floor.shape, NOTHING, np.float32)
    score[free] = FREE if roofed else 0.4
    if roofed:
        score[floor & (score < 0)] = 0.1
        score[ceiling] = 1.0
    else:
        score[closed(plan.floor | plan.things, 5) > 0] = 0.8
    score[plan.void > 0] = NOTHING
    return score


def edge_faces(plan: Plan, faces: Sequence[Face], score: NDArray[np.float32], main: float) -> list[Face]:
    """Lines along the building's ``main`` directions (radians) where the evidence for space ends and no wall face was
    seen: glass fronts, cupboard rows, stair wells. They only cut; nothing was seen on them.
    """
    space = opened(closed((score > 0.5).astype(np.uint8), 9), 7)
    found: list[Face] = []
    for angle in (main, main + np.pi / 2):
        normal = np.array([-np.sin(angle), np.cos(angle)])
        shift = np.rint(normal).astype(int)
        for sign in (1, -1):
            moved = np.roll(space, tuple(sign * shift[::-1]), (0, 1))
            row, col = np.nonzero((space > 0) & (moved == 0))
            middle = plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN
            xy = np.where(np.isfinite(plan.ceiling_xy[row, col]), plan.ceiling_xy[row, col], middle)
            found += _edge_lines(xy, sign * normal, [*faces, *found])
    return without_recesses(found, faces)


def _edge_lines(xy: F64, normal: F64, known: Sequence[Face]) -> list[Face]:
    """Lines through crowds of points (n, 2) that lie in line, ``normal`` towards the space; none where a face is known
    within 15 cm.
    """
    found: list[Face] = []
    direction = np.array([normal[1], -normal[0]])
    off, along = xy @ normal, xy @ direction
    for face in known:
        if abs(face.normal @ normal) > 0.99 and len(off):
            near = np.abs((xy - face.centre) @ face.normal) < 0.25
            t = (xy - face.centre) @ face.direction
            keep = ~(near & (t > face.low - 0.3) & (t < face.high + 0.3))
            xy, off, along = xy[keep], off[keep], along[keep]
    while len(off) > 20:
        base = off.min()
        counts = np.bincount(np.rint((off - base) / PLAN).astype(int))  # rows of pixels lie in the middle of bins
        best = int(np.argmax(counts))
        on = np.abs(off - base - best * PLAN) < 1.5 * PLAN
        t = np.sort(along[on])
        for run in np.split(t, np.flatnonzero(np.diff(t) > 0.6) + 1):
            if run[-1] - run[0] > LONGEST_BARE:
                mine = on & (along >= run[0]) & (along <= run[-1])
                for low, high, place in _ends_of(*_outermost(off[mine], along[mine])):
                    found.append(Face(normal * place, normal, low, high, np.zeros(0, np.int64), PLAN, 0.0, False))
        if counts[best] * PLAN < LONGEST_BARE:
            break
        off, along = off[~on], along[~on]
    return found


def _outermost(off: F64, along: F64) -> tuple[F64, F64]:
    """Where a surface ends that was seen in a band of pixels: the least offset in each step of 10 cm (s,), and how far
    along those lie (s,).
    """
    step = np.floor((along - along.min()) / 0.1 + 0.25).astype(np.int64)
    order = np.lexsort((off, step))
    first = order[np.unique(step[order], return_index=True)[1]]
    return off[first], along[first]


def _ends_of(off: F64, along: F64) -> list[tuple[float, float, float]]:
    """Stretches of such an end, parted where it steps back: from where to where they go and their place.

    The last pixel is on average half full, and the mean place of what was seen in it then a quarter pixel from the end.
    """
    count, total = np.arange(1, len(off)), np.cumsum(off)[:-1]
    step = np.abs(total / count - (off.sum() - total) / (len(off) - count))
    long = (along[:-1] - along[0] > LONGEST_BARE) & (along[-1] - along[1:] > LONGEST_BARE)
    clear = np.where(long, step, 0.0)
    k = int(np.argmax(clear)) + 1
    if clear.max(initial=0.0) > PLAN:
        return _ends_of(off[:k], along[:k]) + _ends_of(off[k:], along[k:])
    return [(float(along[0]), float(along[-1]), float(np.median(off)) - PLAN / 4)]


def cut_cells(plan: Plan, faces: Sequence[Face], score: NDArray[np.float32], free: NDArray[np.bool_]) -> Cells:
    """Cut the plan by the faces' lines and gather the evidence on cells and edges; ``free`` was looked through just
    below the ceiling.
    """
    spans = _spans(faces)
    polygons = _cells_between(faces, spans, CAP)
    if _left_out(polygons, plan, score) > LEAST_OPEN:
        polygons = _cells_between(faces, spans, REACH)
    evidence = _area_evidence(polygons, plan, score)
    cell, ends = _oriented_edges(polygons)
    key = _edge_keys(ends)
    _, inverse = np.unique(key, axis=0, return_inverse=True)
    order = np.argsort(inverse, kind="stable")
    pair = (
        order[np.flatnonzero(np.diff(inverse[order]) == 0)[:, None] + np.array([0, 1])]
        if len(order) > 1
        else np.zeros((0, 2), np.int64)
    )
    seen = _coverage(ends, faces, spans, plan)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    back = np.minimum(1.0, WALL_DEPTH * length / np.maximum(shapely.area(polygons)[cell], 1e-9))
    behind = np.maximum(seen.right, BEHIND_GAP * seen.bridged_right)
    np.add.at(evidence, cell, SIDE * length * (seen.left - behind * back * seen.opaque))
    parted, bridged, ends = seen.either[pair[:, 0]], seen.bridged[pair[:, 0]], ends[pair[:, 0]]
    covered = np.maximum(parted, BRIDGED * bridged)
    hidden = (bridged > 0.5) & (parted < 0.5) & (_open_share(ends, plan, free) < OPEN)
    return Cells(polygons, cell[pair], ends, covered, parted, hidden, evidence)


def _open_share(ends: F64, plan: Plan, free: NDArray[np.bool_]) -> F64:
    """Share (e,) of edges (e, 2, 2) that was looked through, on them and at half a wall's depth on either side: the
    least of the three.
    """
    way = ends[:, 1] - ends[:, 0]
    normal = np.stack([-way[:, 1], way[:, 0]], 1) / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    along = ends[:, None, 0] + way[:, None] * np.linspace(0.05, 0.95, 10)[:, None]
    at = along[None] + normal[None, :, None] * np.array([-HALF_WALL, 0.0, HALF_WALL])[:, None, None, None]
    pixel = np.clip(plan.grid.pixel_of(at), 0, np.array(free.shape[::-1]) - 1)
    return free[pixel[..., 1], pixel[..., 0]].mean(2).min(0)


def _cells_between(faces: Sequence[Face], spans: Sequence[Span], cap: float) -> NDArray[np.object_]:
    """Cells (c,) that the faces' lines close, drawn on past their ends, and cuts of ``cap`` metres at those."""
    reach = [min(REACH, 0.6 + 1.5 * f.length) for f in faces]
    lines = [
        f.centre + np.outer([min(low, f.low - r), max(high, f.high + r)], f.direction)
        for f, (low, high), r in zip(faces, spans, reach, strict=True)
    ]
    lines += [c for f in faces for c in _caps(f, cap)]
    noded = shapely.union_all(shapely.linestrings(np.array(lines)), grid_size=1e-6)
    polygons = np.array(list(shapely.get_parts(shapely.polygonize([noded]))), object)
    return polygons[shapely.area(polygons) > 1e-5]


def _left_out(polygons: NDArray[np.object_], plan: Plan, score: NDArray[np.float32]) -> float:
    """Square metres of the largest patch of clear evidence for space that lies in no cell: the lines leave a gap
    somewhere round it.
    """
    row, col = np.nonzero(score > 0.5)
    middle = plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN
    whole = shapely.coverage_union_all(polygons)
    shapely.prepare(whole)
    out = ~shapely.contains_xy(whole, middle[:, 0], middle[:, 1])
    mask = np.zeros(score.shape, np.uint8)
    mask[row[out], col[out]] = 1
    sizes = cv2.connectedComponentsWithStats(mask)[2][1:, cv2.CC_STAT_AREA]
    return float(sizes.max(initial=0)) * PLAN * PLAN


def _caps(face: Face, depth: float) -> tuple[F64, F64]:
    """Cuts across the wall behind a face at both of its ends: where a wall ends free, or a niche begins."""
    across = np.outer([-depth, CAP / 4], face.normal)
    first, last = face.ends()
    return first + across, last + across


def _area_evidence(polygons: NDArray[np.object_], plan: Plan, score: NDArray[np.float32]) -> F64:
    """Evidence of each cell, square metres: its mean pixel score times its area."""
    scale = 2
    labels = np.full((score.shape[0] * scale, score.shape[1] * scale), -1, np.int32)
    for number, polygon in enumerate(polygons):
        ring = (shapely.get_coordinates(polygon.exterior) - plan.origin) / PLAN * scale
        cv2.fillPoly(labels, [np.rint(ring * 16).astype(np.int32)], number, lineType=cv2.LINE_8, shift=4)
    fine = np.repeat(np.repeat(score, scale, 0), scale, 1)
    hit = labels >= 0
    count = np.bincount(labels[hit], minlength=len(polygons))
    total = np.bincount(labels[hit], weights=fine[hit], minlength=len(polygons))
    point = shapely.get_coordinates(shapely.point_on_surface(polygons))
    at = np.floor((point - plan.origin) / PLAN).astype(np.int64)
    at = np.clip(at, 0, np.array(score.shape[::-1]) - 1)
    mean = np.where(count > 3, total / np.maximum(count, 1), score[at[:, 1], at[:, 0]])
    return mean * shapely.area(polygons)


def _oriented_edges(polygons: NDArray[np.object_]) -> tuple[I64, F64]:
    """Cell number (e,) and end points (e, 2, 2) of every edge of every cell, the cell on its left."""
    polygons = shapely.orient_polygons(polygons)
    rings, ring_cell = shapely.get_rings(polygons, return_index=True)
    xy, owner = shapely.get_coordinates(rings, return_index=True)
    same = owner[1:] == owner[:-1]
    return ring_cell[owner[:-1][same]], np.stack([xy[:-1][same], xy[1:][same]], 1)


def _edge_keys(ends: F64) -> I64:
    """The same integers for an edge and its reverse, (e, 4), to 10 micrometres."""
    q = np.rint(ends * 1e5).astype(np.int64)
    swap = (q[:, 0, 0] > q[:, 1, 0]) | ((q[:, 0, 0] == q[:, 1, 0]) & (q[:, 0, 1] > q[:, 1, 1]))
    q[swap] = q[swap][:, ::-1]
    return q.reshape(-1, 4)


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """Per edge (e,): share on which a face was seen with its air on the ``left``, on the ``right`` of the edge (unsided
    faces give half to both), on ``either``; ``bridged`` share that lies between the ends of a face, seen or not: across
    a door, behind a cupboard; ``opaque`` where no pane is.
    """

    left: F64
    right: F64
    either: F64
    bridged: F64
    bridged_right: F64
    opaque: NDArray[np.bool_]


def _coverage(ends: F64, faces: Sequence[Face], spans: Sequence[Span], plan: Plan) -> Coverage:
    """What the faces, with their ``spans``, cover of each edge; ``ends`` (e, 2, 2)."""
    middle = ends.mean(1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    direction = (ends[:, 1] - ends[:, 0]) / np.maximum(length, 1e-9)[:, None]
    left, right, either, bridged, bridged_right = np.zeros((5, len(ends)))
    opaque = np.ones(len(ends), bool)
    for face, span in zip(faces, spans, strict=True):
        on = np.flatnonzero(
            (np.abs((middle - face.centre) @ face.normal) < 2e-4)
            & (np.abs(direction @ face.normal) < 1e-3 + 2e-4 / np.maximum(length, 1e-3))
        )
        if not len(on):
            continue
        seen, start = _seen_along(face, plan)
        along = np.sort((ends[on] - face.centre) @ face.direction, axis=1)
        same = direction[on] @ face.direction > 0
        if len(face.columns):
            inner = np.clip(along, face.low, face.high)
            between = (inner[:, 1] - inner[:, 0]) / np.maximum(length[on], 1e-9)
            bridged[on] = np.maximum(bridged[on], between)
            bridged_right[on] = np.maximum(bridged_right[on], np.where(same | (not face.sided), 0.0, between))
            inner = np.clip(along, *span)
            bridged[on] = np.maximum(bridged[on], (inner[:, 1] - inner[:, 0]) / np.maximum(length[on], 1e-9))
        total = np.concatenate([[0.0], np.cumsum(seen)])
        at = np.clip((along - start) / PLAN, 0, len(seen))
        share = np.interp(at[:, 1], np.arange(len(total)), total) - np.interp(at[:, 0], np.arange(len(total)), total)
        share = np.clip(share * PLAN / np.maximum(length[on], 1e-9), 0, 1)
        either[on] = np.maximum(either[on], share)
        sided = 1.0 if face.sided else 0.5
        left[on] = np.maximum(left[on], np.where(same, share * sided, share * (1 - sided)))
        right[on] = np.maximum(right[on], np.where(same, share * (1 - sided), share * sided))
        opaque[on] &= not face.glass
    return Coverage(left, right, either, bridged, bridged_right, opaque)


def _spans(faces: Sequence[Face]) -> list[Span]:
    """Along each face, from where to where it is to be expected: as far as the other face of its wall was seen.

    That is a face that looks the other way from behind it, as near as the two faces of a partition.
    """
    seen = [f for f in faces if len(f.columns)]
    normals = np.array([f.normal for f in seen]).reshape(-1, 2)
    ends = np.array([f.ends() for f in seen]).reshape(-1, 2, 2)
    spans: list[Span] = []
    for face in faces:
        low, high = face.low, face.high
        if len(face.columns):
            offset = ends[normals @ face.normal < -PARALLEL] - face.centre
            behind, along = -(offset @ face.normal), np.sort(offset @ face.direction, axis=1)
            shared = np.minimum(along[:, 1], high) - np.maximum(along[:, 0], low)
            paired = along[(behind.min(1) > THIN[0]) & (behind.max(1) < THIN[1]) & (shared > PAIRED)]
            low, high = float(paired[:, 0].min(initial=low)), float(paired[:, 1].max(initial=high))
        spans.append((low, high))
    return spans


def gaps(face: Face, plan: Plan) -> list[Face]:
    """Stretches of a face on which nothing was seen: openings, and what cupboards hide."""
    seen, start = _seen_along(face, plan)
    turns = np.flatnonzero(np.diff(np.concatenate([[1.0], seen, [1.0]])))
    ends = np.clip(start + turns.reshape(-1, 2) * PLAN, face.low, face.high)
    return [replace(face, low=float(a), high=float(b)) for a, b in ends if b - a > SHORTEST_GAP]


def _seen_along(face: Face, plan: Plan) -> tuple[F64, float]:
    """1 or 0 per 5 cm step along the face, and where the first step starts; gaps up to 25 cm count as seen."""
    start = face.low - 0.1
    if face.lintel:
        return np.ones(int(np.ceil((face.high + 0.1 - start) / PLAN))), start
    if len(face.columns) == 0:
        return np.zeros(1), start
    along = (plan.columns.xy[face.columns] - face.centre) @ face.direction
    seen = np.zeros(int(np.ceil((face.high + 0.1 - start) / PLAN)) + 1, np.uint8)
    seen[np.clip(((along - start) / PLAN).astype(np.int64), 0, len(seen) - 1)] = 1
    return closed(seen[None], 5, rows=1)[0].astype(np.float64), start


def label_cells(cells: Cells) -> NDArray[np.bool_]:
    """Which cells are space (c,): the minimum of evidence against plus cost of borders, by one graph cut."""
    length = np.linalg.norm(cells.ends[:, 1] - cells.ends[:, 0], axis=1)
    border = np.rint(SCALE * length * (SEEN_EDGE + BARE_EDGE * (1 - cells.covered))).astype(np.int64)
    return source_side(np.rint(SCALE * cells.evidence).astype(np.int64), cells.edges, border)
