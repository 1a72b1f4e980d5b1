"""The opening behind trims and linings, on made points and painted faces whose truth is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from scan2bim.openings.closed.edges import Edge, edges_of, moved
from scan2bim.openings.closed.rectangles import Rectangle, contrasted
from scan2bim.openings.closed.reveals import behind_trims, opening_edges
from scan2bim.openings.closed.trims import LAP
from scan2bim.openings.door_linings import flush_lining
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.orthoimage import Orthoimage

DOOR = Rectangle(1.5, 2.4, 2.1)
HALF, TRIM, RECESS = 0.1, 0.015, 0.06
RNG = np.random.default_rng(4)
F64 = NDArray[np.float64]


def face(trim: bool, strip: float = 0.0, tint: float = 0.0) -> Orthoimage:
    """A face of 4 x 2.6 m with a recessed leaf, within a trim, or a strip of another colour in the wall's plane."""
    shape = (260, 400)
    depth = RNG.normal(0, 0.001, shape).astype(np.float32)
    rgb = np.full((*shape, 3), 0.7, np.float32) + RNG.normal(0, 0.01, (*shape, 3)).astype(np.float32)
    up, along = ((np.arange(n) + 0.5) / 100 for n in shape)
    wide = 0.07 if trim else strip
    around = np.ix_(up < DOOR.top + wide, (along > DOOR.left - wide) & (along < DOOR.right + wide))
    inside = np.ix_(up < DOOR.top, (along > DOOR.left) & (along < DOOR.right))
    depth[around] += TRIM * trim
    rgb[around] += tint
    depth[inside] = RNG.normal(-RECESS, 0.001, depth[inside].shape)
    coarse = np.zeros((52, 80), np.uint8)
    return Orthoimage("left", np.ones(shape, np.uint16), rgb, depth, np.ones(shape, bool), coarse + 1, coarse, coarse)


def points(reveal: float, trim: float, farthest: float = HALF) -> WallPoints:
    """Points of a reveal ``reveal`` metres outwards from the door and of a trim from ``trim`` on, on all three sides;
    the reveal's go ``farthest`` across the wall.
    """
    parts: list[F64] = []
    for outwards, across in (
        (RNG.normal(reveal, 0.001, 900), RNG.uniform(-farthest, farthest, 900)),
        (RNG.uniform(trim, 0.07, 2000), np.full(2000, HALF + TRIM)),
    ):
        up, along = RNG.uniform(0, DOOR.top, len(across)), RNG.uniform(DOOR.left, DOOR.right, len(across))
        parts.append(np.column_stack([DOOR.left - outwards, across, up]))
        parts.append(np.column_stack([DOOR.right + outwards, across, up]))
        parts.append(np.column_stack([along, across, DOOR.top + outwards]))
    xyz = np.concatenate(parts).astype(np.float32)
    return WallPoints(xyz[:, 0], xyz[:, 1], xyz[:, 2], np.zeros((len(xyz), 3), np.uint8), np.zeros(len(xyz), np.uint16))


def outwards(edges: list[Edge | None]) -> list[float]:
    box = moved(DOOR, edges)
    return [DOOR.left - box.left, box.right - DOOR.right, box.top - DOOR.top]


@pytest.mark.parametrize(
    ("reveal", "expected"),
    [(0.0, 0.0), (0.02, 0.02), (-0.015, LAP)],
    ids=["that begins at the reveal", "that laps over the wall's own reveal", "that stands back from a lining's"],
)
def test_a_door_ends_behind_a_trim(reveal: float, expected: float) -> None:
    near, faces = points(reveal, 0.0), contrasted([face(True)])
    assert outwards(opening_edges(faces, DOOR, near, HALF)) == pytest.approx([expected] * 3, abs=0.005)
    clear = Rectangle(DOOR.left - reveal, DOOR.right + reveal, DOOR.top + reveal)
    found = moved(clear, behind_trims(faces, clear, near, HALF))
    assert DOOR.left - found.left == pytest.approx(expected, abs=0.006)


def test_another_walls_face_beside_a_door_is_no_reveal() -> None:
    edges = opening_edges(contrasted([face(True)]), DOOR, points(0.03, 0.0, farthest=0.2), HALF)
    assert outwards(edges) == pytest.approx([0.0] * 3, abs=0.006)


@pytest.mark.parametrize("tint", [-0.03, 0.2])
def test_a_flush_lining_ends_where_its_colour_does(tint: float) -> None:
    image = face(False, 0.05, tint)
    assert flush_lining([image], (DOOR.left, DOOR.right, DOOR.top)) == pytest.approx(0.05, abs=0.005)
    edges = opening_edges(contrasted([image]), DOOR, points(0.0, 0.065), HALF)
    assert outwards(edges) == pytest.approx([0.05] * 3, abs=0.008)


def test_a_wall_of_one_colour_shows_no_lining() -> None:
    assert flush_lining([face(False)], (DOOR.left, DOOR.right, DOOR.top)) is None


def test_a_strip_on_one_side_is_no_lining() -> None:
    image = face(False)
    image.rgb[:210, 145:150] -= 0.2
    assert flush_lining([image], (DOOR.left, DOOR.right, DOOR.top)) is None


def test_a_side_behind_furniture_is_where_a_trim_as_wide_as_the_others_ends() -> None:
    image = face(True)
    along = (np.arange(400) + 0.5) / 100
    image.count[:, (along > DOOR.left - 0.05) & (along < DOOR.left + 0.2)] = 0  # the trim's outer edge is seen
    image.count[:, (along > DOOR.right - 0.2) & (along < DOOR.right + 0.2)] = 0  # nothing is
    outline = Rectangle(DOOR.left - 0.07, DOOR.right + 0.07, DOOR.top + 0.07)
    found = moved(outline, edges_of(contrasted([image]), outline))
    assert (found.left, found.right, found.top) == pytest.approx((DOOR.left, DOOR.right, DOOR.top), abs=0.01)


def test_the_head_of_a_door_taken_to_be_as_high_as_the_room_is_where_its_trim_ends() -> None:
    whole = Rectangle(DOOR.left, DOOR.right, 2.17, whole=True)
    faces = contrasted([cut(face(True), 217)])
    found = moved(whole, opening_edges(faces, whole, points(0.0, 0.0), HALF))
    assert found.top == pytest.approx(DOOR.top, abs=0.01)
    assert not found.whole
    bare = moved(whole, opening_edges(contrasted([cut(face(False), 217)]), whole, points(0.0, 0.065), HALF))
    assert bare.whole


def cut(image: Orthoimage, rows: int) -> Orthoimage:
    """A face below a ceiling."""
    return replace(
        image, count=image.count[:rows], rgb=image.rgb[:rows], depth=image.depth[:rows], known=image.known[:rows]
    )
