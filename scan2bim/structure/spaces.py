"""Spaces of a storey: its cells labelled space or solid, neighbours joined, and parted where nobody walks through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.cloud.panorama import Panorama
from scan2bim.geometry.graphs import connected_parts
from scan2bim.geometry.polygons import polygons_of
from scan2bim.structure.cells import THIN, Cells, cut_cells, edge_faces, gaps, label_cells, space_evidence
from scan2bim.structure.faces import Face, main_direction
from scan2bim.structure.free_space import looked_through
from scan2bim.structure.fronts import flanks, window_fronts, without_soffits, without_strips
from scan2bim.structure.panes import without_outside
from scan2bim.structure.plan import Plan

LEAST_MEAN = 0.35
"""Least mean evidence per square metre of a space: outdoors, seen through panes, reaches less."""
ENCLOSED = 0.7
"""Share of its border on which walls must have been seen for a space to need no such evidence, where no ceiling was
scanned: a hall of which the floor was not either.
"""
LEAST_PART = 0.25
"""Square metres below which nobody stands: what was cut off by lines that nearly coincide."""
SLIT = 0.03
"""Half-width, metres, of slits in a space that are closed: door leaves and curtains that stand in it."""
NECK = 0.12
"""Half-width, metres, of necks at which a space is parted: gaps between a wall's end and the next wall that only
sampling left, and through which nobody walks.
"""
LEAST_SEEN = 0.12
"""Share of a small hole's border along which a face was seen if something stands there."""
UNDER_CEILING = 0.2
"""Distance, metres, from the ceiling at which free space is asked for: above doors and windows."""
PASSAGE = 0.5
"""Width, metres, below which nobody walks from one part of a space to another: the narrowest doors have 60 cm."""
LEAST_ROOM, WIDTH = 2.0, 0.9
"""Area, square metres, of the smallest part that is a space of its own behind such a neck, or behind a wall of which
that stretch was not seen; and the width, metres, of one: more than that of cupboards.
"""


def find_spaces(
    plan: Plan, faces: Sequence[Face], panoramas: Sequence[Panorama]
) -> tuple[tuple[Polygon, ...], tuple[Face, ...]]:
    """Inner outlines of the storey's spaces, largest first, and the lintels of window fronts found with them."""
    if not faces:
        return (), ()
    plan = without_outside(plan, faces, panoramas)
    free = _free_above(plan, panoramas)
    bare = without_strips(plan)
    ends = edge_faces(bare, (), space_evidence(bare, free), main_direction(faces))
    lintels, kept = window_fronts(plan, ends, faces, panoramas)
    beside = [gap for f in kept if len(f.columns) for gap in (*gaps(f, plan), *flanks(f, kept))]
    plan = without_soffits(without_strips(plan, lintels), beside)
    score = space_evidence(plan, free)
    edges = [*lintels, *edge_faces(plan, [*kept, *lintels], score, main_direction(faces))]
    cells = cut_cells(plan, [*kept, *edges], score, free)
    inside = label_cells(cells)
    spaces = _merged(cells, inside, ENCLOSED if not plan.ceiling.any() else np.inf, bool(free.any()))
    return tuple(_filled(space, kept) for space in spaces), tuple(lintels)


def _filled(space: Polygon, faces: Sequence[Face]) -> Polygon:
    """A space without small holes along which no face was seen: where no ceiling hangs, as in skylights."""
    rings = list(space.interiors)
    if all(Polygon(ring).area > LEAST_ROOM for ring in rings):
        return space
    seen = shapely.union_all([shapely.buffer(LineString(face.ends()), SLIT) for face in faces if len(face.columns)])
    walled = (ring.intersection(seen).length > LEAST_SEEN * ring.length for ring in rings)
    kept = [ring for ring, wall in zip(rings, walled, strict=True) if wall or Polygon(ring).area > LEAST_ROOM]
    return Polygon(space.exterior, kept)


def _free_above(plan: Plan, panoramas: Sequence[Panorama]) -> NDArray[np.bool_]:
    """Pixels through which a station looked just below the ceiling, above doors and windows."""
    height = (plan.levels.ceiling if plan.levels.ceiling is not None else plan.levels.top) - UNDER_CEILING
    return looked_through(plan.origin, plan.floor.shape, panoramas, height)


def _merged(cells: Cells, inside: NDArray[np.bool_], enclosed: float, hidden: bool) -> tuple[Polygon, ...]:
    """Union of neighbouring space cells without what is too small or narrow to stand in, tiny holes filled; without
    enough evidence only where walls were seen on that much of the border. ``hidden``: as for ``joined``.
    """
    label = joined(cells, inside, hidden)
    spaces: list[Polygon] = []
    for number in np.unique(label[inside]):
        members = inside & (label == number)
        area = shapely.area(cells.polygons[members]).sum()
        if cells.evidence[members].sum() < LEAST_MEAN * area and _seen_round(cells, members) < enclosed:
            continue
        merged = shapely.union_all(cells.polygons[members], grid_size=1e-6)
        without_slits = merged.buffer(SLIT, join_style="mitre").buffer(-SLIT - NECK, join_style="mitre")
        solid = without_slits.buffer(NECK, join_style="mitre")
        parts = [p for part in shapely.get_parts(solid) for p in parted_at_necks(part)]
        spaces += [_tidy(p) for p in parts if p.area > 0.8 and not p.buffer(-0.25).is_empty]
    return tuple(sorted(spaces, key=lambda p: -p.area))


def joined(cells: Cells, inside: NDArray[np.bool_], hidden: bool = False) -> NDArray[np.int64]:
    """The part (c,) that each cell belongs to: cells inside are one where no face was seen between them. A border of a
    slit's width in all joins no two rooms, but what is too small for a room goes with the neighbour that it borders on
    most: lines that nearly coincide leave slivers.

    If walls may be ``hidden``, a face that was seen beside a border goes on there, where it parts two rooms; a strip
    as thin as a wall between two such borders stays apart.
    """
    between = inside[cells.edges].all(1) & (cells.parted < 0.5)
    label = _joined_over(cells, between & ~(cells.hidden & hidden))
    edges = cells.edges[between & cells.hidden & hidden]
    while True:
        pair = np.sort(label[edges], axis=1)
        pairs, count = np.unique(pair[pair[:, 0] != pair[:, 1]], axis=0, return_counts=True)
        parts = {int(k): shapely.union_all(cells.polygons[label == k], grid_size=1e-6) for k in np.unique(pairs)}
        walls = [k for k, part in parts.items() if part.buffer(-THIN[1] / 2, join_style="mitre").is_empty]
        small = [k for k, part in parts.items() if not _is_room(part) and k not in walls]
        goes = np.isin(pairs, small).any(1) & ~np.isin(pairs, walls).any(1)
        if not goes.any():
            return label
        first, second = pairs[int(np.argmax(np.where(goes, count, 0)))]
        label = np.where(label == second, first, label)


def _is_room(part: BaseGeometry) -> bool:
    """Whether a part is as large and wide as a room: less is what stands before a wall, and what is behind it."""
    return part.area > LEAST_ROOM and not part.buffer(-WIDTH / 2, join_style="mitre").is_empty


def _joined_over(cells: Cells, between: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The part (c,) that each cell belongs to, of those joined over some of the edges (e,)."""
    edges, length = cells.edges[between], np.linalg.norm(cells.ends[between, 1] - cells.ends[between, 0], axis=1)
    area = shapely.area(cells.polygons)
    label = connected_parts(len(area), edges[length > 2 * SLIT])
    while True:
        pair = np.sort(label[edges], axis=1)
        apart = pair[:, 0] != pair[:, 1]
        pairs, at = np.unique(pair[apart], axis=0, return_inverse=True)
        border = np.bincount(at.ravel(), length[apart], len(pairs))
        size = np.bincount(label, area)
        best = np.full(len(size), -1)
        for k in np.argsort(border, kind="stable"):
            best[pairs[k]] = k
        goes = best[(best >= 0) & (size < LEAST_PART)]
        told = np.union1d(goes, np.flatnonzero(border > 2 * SLIT))
        if not len(told):
            return label
        label = connected_parts(len(size), pairs[told])[label]


def _seen_round(cells: Cells, members: NDArray[np.bool_]) -> float:
    """Share of the border of some of the cells (c,) on which faces were seen."""
    rim = members[cells.edges].sum(1) == 1
    length = np.linalg.norm(cells.ends[rim, 1] - cells.ends[rim, 0], axis=1)
    return float((length * cells.parted[rim]).sum() / max(float(length.sum()), 1e-9))


def parted_at_necks(polygon: Polygon) -> list[Polygon]:
    """Parts that hang together only where nobody walks through; what is narrow everywhere stays with its neighbour."""
    half = PASSAGE / 2
    cores = [c.buffer(half, join_style="mitre") for c in shapely.get_parts(polygon.buffer(-half, join_style="mitre"))]
    rooms = [shapely.intersection(c, polygon) for c in cores if c.area > LEAST_ROOM]
    if len(rooms) < 2:
        return [polygon]
    for rest in shapely.get_parts(shapely.difference(polygon, shapely.union_all(rooms))):
        shared = shapely.area(shapely.intersection(rooms, rest.buffer(SLIT)))
        best = int(np.argmax(shared))
        rooms[best] = shapely.union_all([rooms[best], rest], grid_size=1e-6)
    return [p for room in rooms for p in polygons_of(room)]


def _tidy(polygon: Polygon) -> Polygon:
    """Without holes smaller than a column and without points in the middle of straight edges."""
    holes = [r for r in polygon.interiors if Polygon(r).area > 0.03]
    return shapely.orient_polygons(shapely.simplify(Polygon(polygon.exterior, holes), 0.003))
