"""Faces of walls: how far off those are that look into rooms, and which walls of a model are right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from scan2bim.evaluate.openings import Value
from scan2bim.truth.values import SpaceTruth, WallTruth

F64 = NDArray[np.float64]

STEP = 0.05
"""Metres between the places on faces that are compared."""
BEFORE = 0.10
"""Metres before a face at which there must be a room for the face to look into it: past plaster and skirting."""
SAME_FACE = 0.10
"""Metres between two faces that are the same."""
RIGHT_FACE = 0.05
"""Metres between faces up to which a wall's place is right."""
RIGHT_SHARE = 0.7
"""Least share of what a wall shows to rooms that must be right for the wall to be: the rest may be a niche's or a
neighbour's."""
TURNED = math.cos(math.radians(10.0))
SHARED_HEIGHT = 0.3
"""Share of the lower wall's height that two walls must share to be compared."""


class FaceScores(Value):
    """Medians, metres, over places each ``STEP`` along true faces that look into rooms and that the model has: of the
    distance of the two faces, and of the difference of the thickness where the wall has rooms on both sides. found:
    share of the places with a face of the model within ``SAME_FACE``.
    """

    found: float | None
    position_error: float | None
    thickness_error: float | None


@dataclass(frozen=True, slots=True, eq=False)
class FaceSamples:
    """Places (n, 2) on walls' faces, the faces' outward normals (n, 2), the walls' numbers (n,), feet and tops (n, 2),
    and the number of each place's step along all walls, equal for both faces of one (n,).
    """

    points: F64
    normals: F64
    walls: NDArray[np.int64]
    heights: F64
    steps: NDArray[np.int64]


def score_faces(true: Sequence[WallTruth], predicted: Sequence[WallTruth], rooms: Sequence[SpaceTruth]) -> FaceScores:
    """Score the faces of ``true`` walls that look into ``rooms``."""
    samples = face_samples(true, rooms)
    off = _offsets(samples, predicted)
    hit = np.abs(off) <= SAME_FACE
    if not len(off):
        return FaceScores(found=None, position_error=None, thickness_error=None)
    one, other = _two_faced(samples, hit)
    return FaceScores(
        found=float(hit.mean()),
        position_error=float(np.median(np.abs(off[hit]))) if hit.any() else None,
        thickness_error=float(np.median(np.abs(off[one] + off[other]))) if len(one) else None,
    )


def right_walls(
    predicted: Sequence[WallTruth], rooms: Sequence[SpaceTruth], true: Sequence[WallTruth]
) -> NDArray[np.bool_]:
    """Which predicted walls (n,) are right: most of what they show to the model's ``rooms``, or of both faces if they
    show nothing to any, lies within ``RIGHT_FACE`` of a true face that looks the same way.
    """
    samples = face_samples(predicted, rooms)
    hidden = np.setdiff1d(np.arange(len(predicted)), samples.walls)
    bare = face_samples([predicted[i] for i in hidden.tolist()], None)
    walls = np.concatenate([samples.walls, hidden[bare.walls]])
    right = np.concatenate([np.abs(_offsets(s, true)) <= RIGHT_FACE for s in (samples, bare)])
    count = np.bincount(walls, minlength=len(predicted))
    return np.bincount(walls, right, minlength=len(predicted)) >= RIGHT_SHARE * np.maximum(count, 1)


def face_samples(walls: Sequence[WallTruth], rooms: Sequence[SpaceTruth] | None) -> FaceSamples:
    """Places on the walls' faces, of those alone that look into one of ``rooms``, or of all."""
    outlines = None if rooms is None else [shapely.make_valid(Polygon(r.outline, r.holes)) for r in rooms]
    points, normals, numbers, heights, steps = (list[F64]() for _ in range(5))
    count = 0
    for number, wall in enumerate(walls):
        start, end = np.array(wall.start), np.array(wall.end)
        length = float(np.linalg.norm(end - start))
        along = (end - start) / max(length, 1e-9)
        places = start + along * np.arange(STEP / 2, length, STEP)[:, None]
        for side in (1.0, -1.0):
            normal = side * np.array([-along[1], along[0]])
            face = places + normal * wall.thickness / 2
            seen = np.ones(len(face), bool)
            if rooms is not None and outlines is not None:
                seen = _in_rooms(face + normal * BEFORE, wall, rooms, outlines)
            points.append(face[seen])
            normals.append(np.tile(normal, (int(seen.sum()), 1)))
            numbers.append(np.full(int(seen.sum()), number))
            heights.append(np.tile([wall.base, wall.base + wall.height], (int(seen.sum()), 1)))
            steps.append(np.asarray(count + np.flatnonzero(seen), np.float64))
        count += len(places)
    empty = np.zeros((0, 2))
    return FaceSamples(
        np.concatenate([empty, *points]),
        np.concatenate([empty, *normals]),
        np.concatenate([empty[:, 0], *numbers]).astype(np.int64),
        np.concatenate([empty, *heights]),
        np.concatenate([empty[:, 0], *steps]).astype(np.int64),
    )


def _in_rooms(
    points: F64, wall: WallTruth, rooms: Sequence[SpaceTruth], outlines: Sequence[BaseGeometry]
) -> NDArray[np.bool_]:
    inside = np.zeros(len(points), bool)
    for room, outline in zip(rooms, outlines, strict=True):
        shared = min(wall.base + wall.height, room.base + room.height) - max(wall.base, room.base)
        if shared >= SHARED_HEIGHT * min(wall.height, room.height):
            inside |= np.asarray(shapely.contains_xy(outline, points[:, 0], points[:, 1]))
    return inside


def _offsets(samples: FaceSamples, walls: Sequence[WallTruth]) -> F64:
    """How far (n,) outwards of each place the nearest face of ``walls`` lies that looks the same way, metres; infinite
    where none runs past it.
    """
    best = np.full(len(samples.points), np.inf)
    for wall in walls:
        start, end = np.array(wall.start), np.array(wall.end)
        length = float(np.linalg.norm(end - start))
        if length < 1e-6:
            continue
        along = (end - start) / length
        shared = np.minimum(samples.heights[:, 1], wall.base + wall.height) - np.maximum(
            samples.heights[:, 0], wall.base
        )
        level = shared >= SHARED_HEIGHT * np.minimum(np.diff(samples.heights, axis=1)[:, 0], wall.height)
        for side in (1.0, -1.0):
            normal = side * np.array([-along[1], along[0]])
            place = samples.points - start - normal * wall.thickness / 2
            on = (place @ along >= -STEP) & (place @ along <= length + STEP) & level
            on &= samples.normals @ normal > TURNED
            off = -(place @ normal)
            better = on & (np.abs(off) < np.abs(best))
            best[better] = off[better]
    return best


def _two_faced(samples: FaceSamples, hit: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The places on two opposite faces of one wall, both found: numbers of the one and of the other (k,)."""
    kept = np.flatnonzero(hit)
    order = kept[np.argsort(samples.steps[kept], kind="stable")]
    twice = np.flatnonzero(np.diff(samples.steps[order]) == 0)
    return order[twice], order[twice + 1]
