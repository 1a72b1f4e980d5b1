"""Glass fronts: upright planes made of the few pulses that panes send back.

Such points hang before what their neighbours in the panorama saw, so that they are not trusted for walls. But where
they line up in a plane over metres, something stands there that ends the space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.structure.columns import F64, gather_columns
from scan2bim.structure.faces import Face, grow_faces, over_sills, without_recesses
from scan2bim.structure.fits import BAND
from scan2bim.structure.free_space import seen_beyond
from scan2bim.structure.plan import Plan, without_ceiling
from scan2bim.structure.storeys import Layers

SHORTEST = 0.8
"""Length, metres, of the shortest glass front looked for; windows in walls are found in their walls."""
FEWEST_BINS = 4
"""Heights of 10 cm with returns that a column of a pane must have."""
FULLEST = 0.5
"""Share of its length that a glass front's columns must fill."""
TALL_BINS = 8
"""Heights of 10 cm with returns that tell a pane from an opening in a wall, of which one sees the lintel alone."""
BEYOND = 0.3
"""Metres behind a face at which a pulse must still fly to have gone through it."""
THROUGH = 0.4
"""Share of its height that stations must have looked through a pane."""
OUTSIDE = 4.0
"""Metres behind a glass front up to which a ceiling is asked for from where it was seen: deeper ones are rooms."""
ENTERED = 0.5
"""Share of the ceiling behind a glass front that was seen from elsewhere, from which on there is a room."""
SAW = 0.1
"""Metres by which what a station saw may lie before or behind a place for it to have seen that."""
CLEAR, FEWEST = 0.8, 0.25
"""Share of the whole face that they must have looked through for it to be glass where fewer of its columns send pulses
back: clean panes return few.
"""
APART = 0.15
"""Distance, metres, from a seen wall face within which nothing is taken for another."""
CROWD = (0.05, 0.25)
"""Metres before and behind a pane between which the air is nearly empty, unlike in a crowd of reflections and mixed
pixels, through which many lines can be laid.
"""
DENSER = 5.0
"""How many times denser a pane is than what stands there (measured: panes 9 and more, lines in crowds below 4)."""


def with_panes(
    plan: Plan, faces: Sequence[Face], doubtful: Surfels, layers: Layers, stations: F64
) -> tuple[Plan, list[Face]]:
    """The plan with the ``doubtful`` surfels' columns added after its own, and the glass fronts found among those.

    ``layers`` are those of the doubtful surfels of the storey. Panes over the sills of a seen wall are none.
    """
    columns = gather_columns(doubtful, layers, plan.grid, stations)
    tall = columns.bins >= FEWEST_BINS
    found = grow_faces(columns, plan.floor.shape, tall, tall)
    panes = [f for f in found if f.length >= SHORTEST and f.tall >= FULLEST * f.length and f.sided]
    panes = [f for f in without_recesses(panes, faces) if not any(_beside(f, other) for other in faces)]
    joined = replace(plan, columns=plan.columns.joined(columns))
    first = len(plan.columns)
    panes = [replace(f, columns=f.columns + first, glass=True) for f in panes if not _in_crowd(f, joined)]
    return joined, [f for f in panes if not over_sills(joined, f, faces)]


def _in_crowd(pane: Face, plan: Plan) -> bool:
    """Whether as much stands before and behind a pane as on it."""
    offset = plan.columns.xy - pane.centre
    along, away = offset @ pane.direction, np.abs(offset @ pane.normal)[:, None]
    within = ((along > pane.low) & (along < pane.high))[:, None]
    on, beside = (within & (away >= [0.0, CROWD[0]]) & (away < [BAND, CROWD[1]])).sum(0)
    return bool(on / BAND < DENSER * beside / (CROWD[1] - CROWD[0]))


def as_glass(face: Face, plan: Plan, panoramas: Sequence[Panorama]) -> Face:
    """The face, marked as glass if it sends pulses back over its height and lets others through all the same."""
    if face.length < SHORTEST or not face.sided:
        return face
    told, through = seen_beyond(face, plan, panoramas, BEYOND)
    along = (plan.columns.xy[face.columns] - face.centre) @ face.direction
    tall = plan.columns.bins[face.columns] >= TALL_BINS
    steps = np.floor((along[tall] - face.low) / 0.1).astype(np.int64)
    upright = np.zeros(len(told), bool)
    upright[steps[(steps >= 0) & (steps < len(told))]] = True
    share = through.sum(1) / np.maximum(told.sum(1), 1)
    least = FEWEST if share.mean() > CLEAR else FULLEST
    return replace(face, glass=bool((upright & (share > THROUGH)).mean() > least))


def without_outside(plan: Plan, faces: Sequence[Face], panoramas: Sequence[Panorama]) -> Plan:
    """The plan without the ceiling behind glass fronts that was seen through the glass alone: eaves, balconies, and
    rooms that nobody entered.
    """
    row, col = np.nonzero(plan.ceiling)
    xy = plan.origin + (np.stack([col, row], 1) + 0.5) * PLAN
    points = np.column_stack([xy, plan.grid.roof[row, col]]).astype(np.float32)
    outside = np.zeros(len(points), bool)
    for face in (face for face in faces if face.glass):
        depth, along = -((xy - face.centre) @ face.normal), (xy - face.centre) @ face.direction
        behind = np.flatnonzero((depth > 0) & (depth < OUTSIDE) & (along > face.low) & (along < face.high))
        if len(behind):
            past = np.zeros(len(behind), bool)
            for panorama in panoramas:
                before, beside = np.array([face.normal, face.direction]) @ (panorama.position[:2] - face.centre)
                crossing = beside + (along[behind] - beside) * before / np.maximum(before + depth[behind], 1e-6)
                glazed = (before > 0) & (crossing > face.low) & (crossing < face.high)
                past |= (panorama.said(points[behind], np.float32(SAW)) == 2) & ~glazed
            outside[behind] |= ~past & (past.mean() < ENTERED)
    hidden = np.zeros(plan.ceiling.shape, bool)
    hidden[row[outside], col[outside]] = True
    return without_ceiling(plan, hidden)


def _beside(pane: Face, face: Face) -> bool:
    """Whether a pane lies along a seen face: the same surface, seen badly."""
    ends = pane.ends() - face.centre
    along = np.sort(ends @ face.direction)
    near = np.abs(ends @ face.normal).max() < APART
    return bool(near and min(along[1], face.high) - max(along[0], face.low) > 0.5 * pane.length)
