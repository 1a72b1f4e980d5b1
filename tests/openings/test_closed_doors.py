"""Closed doors: orthoimages, contrasts, edges and judgement, on painted faces whose truth is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scan2bim.config import OpeningSettings
from scan2bim.openings.closed.edges import edges_of, moved
from scan2bim.openings.closed.evidence import evidence_of
from scan2bim.openings.closed.find import ACCEPTED, closed_doors, judged
from scan2bim.openings.closed.rectangles import Rectangle, candidates, contrasted
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.orthoimage import Orthoimage, orthoimage
from scan2bim.openings.paper.closed import closed_doors_of
from scan2bim.openings.paper.clusters import adaptive_k_means
from scan2bim.openings.paper.discontinuities import discontinuities
from scan2bim.openings.paper.segmentation import rgbd, segment_wall
from scan2bim.structure.shapes import WallShape

DOOR = Rectangle(1.5, 2.4, 2.1)


def face(
    recess: float = 0.02,
    colour: float = 0.0,
    trim: float = 0.0,
    box: Rectangle = DOOR,
    bottom: float = 0.0,
    side: str = "left",
) -> Orthoimage:
    """A face of 4 x 2.6 m with noise, and a rectangle that lies ``recess`` behind it and differs by ``colour``."""
    rng = np.random.default_rng(3)
    shape = (260, 400)
    rgb = np.full((*shape, 3), 0.8, np.float32) + rng.normal(0, 0.01, (*shape, 3)).astype(np.float32)
    depth = rng.normal(0, 0.002, shape).astype(np.float32)
    rows = slice(round(bottom * 100), round(box.top * 100))
    inside = rows, slice(round(box.left * 100), round(box.right * 100))
    if trim:
        depth[0 : rows.stop + 7, inside[1].start - 7 : inside[1].stop + 7] += trim
        depth[inside] -= trim
    depth[inside] -= recess
    rgb[inside] -= colour
    count = (rng.random(shape) < 0.6).astype(np.uint16)
    coarse = np.zeros((52, 80), np.uint8)
    image = Orthoimage("left", count, np.clip(rgb, 0, 1), depth, np.ones(shape, bool), coarse + 1, coarse, coarse)
    return image if side == "left" else replace(image, side="right")


@pytest.mark.parametrize("recess", [0.006, 0.02, 0.05])
def test_a_recessed_leaf_is_a_door(recess: float) -> None:
    (found,) = closed_doors(contrasted([face(recess), face(recess, side="right")]))
    assert found.box.overlap(DOOR) > 0.93  # a line of the image; its edges are refined
    assert found.evidence["left"].recess == pytest.approx(recess, abs=0.001)


def test_a_picture_that_does_not_reach_the_floor_is_none() -> None:
    assert not closed_doors(contrasted([face(-0.02, 0.3, bottom=1.1), face(0.0, side="right")]))


def test_a_panel_that_stands_before_one_face_is_none() -> None:
    assert not closed_doors(contrasted([face(-0.04, 0.2), face(0.0, side="right")]))


def test_a_flush_leaf_of_nearly_the_walls_colour_is_a_door_though_half_of_a_side_is_hidden() -> None:
    image = face(0.0, 0.06)
    image.count[:110, 130:170] = 0
    image.known[:110, 130:170] = False
    (found,) = closed_doors(contrasted([image]))
    assert found.box.overlap(DOOR) > 0.93


@pytest.mark.parametrize("top", [2.55, 2.6])
def test_a_leaf_that_reaches_the_ceiling_is_a_door_as_high_as_the_wall(top: float) -> None:
    tall = Rectangle(DOOR.left, DOOR.right, top)
    both = contrasted([face(0.0, 0.06, box=tall), face(0.06, box=tall, side="right")])
    (found,) = closed_doors(both)
    assert found.box.overlap(Rectangle(DOOR.left, DOOR.right, 2.6)) > 0.93
    assert closed_doors(both[1:])


def test_rectangles_of_which_less_is_asked_are_those_that_would_not_be_kept() -> None:
    faces = contrasted([face(0.0, 0.03, trim=0.01), face(0.006, side="right")])
    boxes = [*candidates(faces), Rectangle(0.3, 1.2, 2.05), Rectangle(2.6, 3.6, 2.3)]
    whole, short = ([judged(faces, box, to_keep=keep) for box in boxes] for keep in (False, True))
    assert any(door.confidence >= ACCEPTED for door in whole)
    assert any(a.evidence != b.evidence for a, b in zip(whole, short, strict=True))
    for full, brief in zip(whole, short, strict=True):
        assert brief.confidence < ACCEPTED or brief.evidence == full.evidence
        assert brief.confidence >= full.confidence


def test_a_strip_that_reaches_the_ceiling_on_one_face_or_by_its_colour_alone_is_none() -> None:
    tall = Rectangle(DOOR.left, DOOR.right, 2.6)
    assert not closed_doors(contrasted([face(0.06, box=tall), face(0.0, side="right")]))
    assert not closed_doors(contrasted([face(0.0, 0.2, box=tall), face(0.0, 0.2, box=tall, side="right")]))
    assert not closed_doors(contrasted([face(-0.04, 0.2, box=tall)]))


def test_a_bare_wall_has_none() -> None:
    assert not closed_doors(contrasted([face(0.0), face(0.0, side="right")]))


@pytest.mark.parametrize(("recess", "colour"), [(0.02, 0.0), (0.0, 0.2)])
def test_a_step_of_depth_or_colour_is_the_openings_edge(recess: float, colour: float) -> None:
    rough = Rectangle(DOOR.left - 0.04, DOOR.right + 0.03, DOOR.top + 0.03)
    edges = edges_of(contrasted([face(recess, colour)]), rough)
    box = moved(rough, edges)
    assert [edge.kind for edge in edges if edge] == ["step"] * 3
    assert (box.left, box.right, box.top) == pytest.approx((DOOR.left, DOOR.right, DOOR.top), abs=0.006)


def test_a_trim_is_not_part_of_the_opening() -> None:
    outline = Rectangle(DOOR.left - 0.07, DOOR.right + 0.07, DOOR.top + 0.07)
    edges = edges_of(contrasted([face(0.03, trim=0.015)]), outline)
    box = moved(outline, edges)
    assert [edge.kind for edge in edges if edge] == ["trim"] * 3
    assert (box.left, box.right, box.top) == pytest.approx((DOOR.left, DOOR.right, DOOR.top), abs=0.01)


def test_a_board_beside_a_door_is_not_its_trim() -> None:
    image = face(0.0, 0.2)
    image.depth[:200, 255:262] += 0.02
    box = moved(DOOR, edges_of(contrasted([image]), DOOR))
    assert box.right == pytest.approx(DOOR.right, abs=0.006)


def test_stations_of_different_exposure_agree_in_the_orthoimage() -> None:
    rng = np.random.default_rng(1)
    n = 60_000
    along, up = rng.uniform(0, 3, n), rng.uniform(0, 2.5, n)
    station = rng.integers(0, 2, n).astype(np.uint16)
    rgb = np.where(station[:, None] == 0, 150, 120).repeat(3, 1).astype(np.uint8)
    across = 0.05 + rng.normal(0, 0.001, n) + np.where(station == 0, 0.002, -0.002)
    points = WallPoints(along.astype(np.float32), across.astype(np.float32), up.astype(np.float32), rgb, station)
    wall = WallShape((0, 0), (3, 0), 0.1, 0.001, 0, 2.5, True, (0,), (), 0, 0, 1, 1, (), (0, 0, 0))
    stations = np.array([[1.0, 3.0, 1.5], [2.0, 3.0, 1.5]])
    image = orthoimage(wall, "left", points, stations, {})
    assert image is not None
    assert image.rgb[image.known].std() < 0.01
    assert abs(np.median(image.depth[image.known])) < 0.001
    assert orthoimage(wall, "right", points, stations, {}) is None


def test_adaptive_k_means_finds_how_many_clusters_there_are() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.normal(m, 0.02, (60, 4)) for m in (0.2, 0.5, 0.9)])
    found = adaptive_k_means(values)
    assert found.count == 3
    assert found.silhouette.min() > 0.7
    assert adaptive_k_means(rng.normal(0.5, 0.01, (60, 4))).dominant == 1.0


def test_the_papers_wall_area_is_the_wall_and_not_the_door() -> None:
    image = face(0.02, 0.3)
    area = segment_wall(rgbd(image), image.known, OpeningSettings()).wall_area
    assert area[:, :140].mean() > 0.95
    assert area[10:200, 160:230].mean() < 0.05


def test_the_papers_discontinuities_lie_on_the_doors_outline() -> None:
    image = face(0.02, 0.3)
    white = discontinuities(rgbd(image), image.known).combined
    assert white[20:190, 148:152].any(1).mean() > 0.9
    assert white[20:190, 170:220].mean() < 0.1


@pytest.mark.parametrize(("recess", "colour"), [(0.03, 0.0), (0.0, 0.3), (0.03, 0.3)])
def test_the_paper_finds_doors_that_differ_in_depth_colour_or_both(recess: float, colour: float) -> None:
    found = closed_doors_of(face(recess, colour), OpeningSettings()).doors
    assert max(box.overlap(DOOR) for box in found) > 0.94


def test_the_papers_thresholds_are_settings() -> None:
    strict = OpeningSettings(paper_outline=1.0, paper_wall=0.0, paper_dominant=1.0)
    assert not closed_doors_of(face(0.03, 0.1), strict).doors


def test_leaves_that_are_more_alike_in_depth_than_the_wall_are_not_taken_for_it() -> None:
    """The wall's own line follows it by 15 mm only, and two wide leaves hang in one plane before that line."""
    rng = np.random.default_rng(2)
    along, up = rng.uniform(0, 3.9, 30_000), rng.uniform(0, 3.0, 30_000)
    leaf = (up < 2.2) & (((along > 0.7) & (along < 1.85)) | ((along > 2.85) & (along < 3.85)))
    depth = np.where(leaf, -0.004, 0.010 + 0.004 * along) + rng.normal(0, 0.001, len(along))
    wall = WallShape((0, 0), (3.9, 0), 0.3, 0.001, 0, 3.0, True, (0,), (), 0, 0, 1, 1, (), (0, 0, 0))
    points = WallPoints(
        along.astype(np.float32),
        (depth + 0.15).astype(np.float32),
        up.astype(np.float32),
        np.full((len(along), 3), 180, np.uint8),
        np.zeros(len(along), np.uint16),
    )
    image = orthoimage(wall, "left", points, np.array([[2.0, 3.0, 1.5]]), {})
    assert image is not None
    assert abs(float(np.median(image.depth[250:, 20:370]))) < 0.005
    assert float(np.median(image.depth[50:200, 90:170])) < -0.012


def test_a_leaf_that_has_drawn_the_plane_to_itself_in_a_short_wall_lies_behind_what_is_above_it() -> None:
    image = face(0.0)
    wide = np.ones(image.depth.shape, bool)
    wide[: round(DOOR.top * 100), round(DOOR.left * 100) : round(DOOR.right * 100)] = False
    image.depth[wide] += 0.025  # the wall, of which 20 cm on the left and what is above are seen
    image.depth[:, round(DOOR.right * 100) :] = 0.0  # the next room's, in another plane
    image.known[:, : round(DOOR.left * 100) - 20] = False
    (evidence,) = evidence_of(contrasted([image]), DOOR)
    assert evidence.recess == pytest.approx(0.025, abs=0.002)
    assert evidence.lintel > 0.9
