"""Clouds whose files do not tell where the scanner stood."""

from __future__ import annotations

import math
from pathlib import Path

import laspy
import numpy as np
import pytest
from modelled import Modelled, Scan, merged_scan, model_of, overlap, rectangle_of, rectangle_overlap, true_spaces
from shapely.geometry import Point
from synthetic import Scanned, l_shaped, scanned, two_rooms

from scan2bim.cloud.scan import Chunk
from scan2bim.model.elements import Door
from scan2bim.openings.virtual import FIRST, is_virtual, virtual_panoramas
from scan2bim.readers import read_chunks, read_headers
from scan2bim.simulate.scanner import ScannerSpec

SPEC = ScannerSpec(step=math.radians(0.5))


def write_laz(path: Path, truth: Scanned) -> Path:
    points = truth.points()
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = np.full(3, 0.0001), np.floor(points.min(0))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.red, las.green, las.blue = truth.colours().astype(np.uint16).T * 257
    las.write(str(path))
    return path


def write_ply(path: Path, truth: Scanned) -> Path:
    points = truth.points()
    record = np.dtype([(axis, "<f4") for axis in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")])
    data = np.zeros(len(points), record)
    for k, axis in enumerate("xyz"):
        data[axis] = points[:, k]
    for k, colour in enumerate(("red", "green", "blue")):
        data[colour] = truth.colours()[:, k]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [f"property float {axis}" for axis in "xyz"] + [f"property uchar {c}" for c in ("red", "green", "blue")]
    path.write_bytes("\n".join([*lines, "end_header", ""]).encode() + data.tobytes())
    return path


def read(path: Path) -> Scan:
    (header,) = read_headers(path)
    chunks = list(read_chunks(header))
    rgb = [c.rgb for c in chunks if c.rgb is not None]
    return Scan(
        header, Chunk(np.concatenate([c.xyz.astype(np.float64) for c in chunks]), np.concatenate(rgb) if rgb else None)
    )


@pytest.fixture(scope="module")
def truth() -> Scanned:
    return scanned(two_rooms(0.4), SPEC)


@pytest.fixture(scope="module", params=[write_laz, write_ply], ids=["LAZ", "PLY"])
def model(request: pytest.FixtureRequest, truth: Scanned, tmp_path_factory: pytest.TempPathFactory) -> Modelled:
    suffix = "laz" if request.param is write_laz else "ply"
    return model_of([read(request.param(tmp_path_factory.mktemp("merged") / f"merged.{suffix}", truth))])


def test_the_rooms_are_found_without_scanner_positions(model: Modelled, truth: Scanned) -> None:
    assert len(model.spaces) == 2
    for room, polygon in true_spaces(truth, model.shift).items():
        assert max(overlap(polygon, space) for space in model.spaces) > 0.95, room


def test_the_wall_between_them_has_both_faces(model: Modelled) -> None:
    (between,) = [w for w in model.walls if w.left and w.right]
    assert between.thickness == pytest.approx(0.1, abs=0.015)
    assert between.thickness_sigma is not None


def test_the_open_door_is_found_without_scanner_positions(model: Modelled, truth: Scanned) -> None:
    (found,) = [o for o in model.openings if o.state == "open"]
    (true,) = [d for d in truth.truth.doors if d.state == "open"]
    assert rectangle_overlap(np.array(true.corners), rectangle_of(found, model)) > 0.8
    assert (found.kind, found.state) == ("door", "open")
    assert is_virtual(found.stations)


def test_the_model_says_that_no_positions_are_known(model: Modelled) -> None:
    assert any("No scanner positions are known" in note for note in model.building.notes)
    assert [scan.position for scan in model.building.scans] == [None]


def test_no_scan_is_named_that_only_was_made_up(model: Modelled) -> None:
    known = {scan.id for scan in model.building.scans}
    for wall in model.building.storeys[0].walls:
        assert set(wall.evidence.scans) <= known
        for opening in wall.openings:
            # Only a closed leaf has points of its own, and those are of the cloud itself.
            assert set(opening.evidence.scans) <= (known if isinstance(opening.fill, Door) else set())


def test_a_larger_merged_cloud_has_its_rooms_and_doors() -> None:
    truth = scanned(l_shaped(0.2), SPEC)
    model = model_of([merged_scan(truth.points(), truth.colours())])
    for room, polygon in true_spaces(truth, model.shift).items():
        assert max(overlap(polygon, space) for space in model.spaces) > 0.95, room
    assert len(model.spaces) == 3
    assert len(model.walls) == len(truth.truth.walls)
    doors = [np.array(d.corners) for d in truth.truth.doors]
    scores = [max(rectangle_overlap(c, rectangle_of(o, model)) for o in model.openings) for c in doors]
    assert min(scores) > 0.6
    windows = [np.array(w.corners) for w in truth.truth.windows]
    others = [o for o in model.openings if max(rectangle_overlap(c, rectangle_of(o, model)) for c in doors) < 0.6]
    assert len(others) >= 2  # windows whose panes return nothing are told by their reveals
    for opening in others:
        assert opening.kind == "window"
        assert max(rectangle_overlap(c, rectangle_of(opening, model)) for c in windows) > 0.9


def test_with_scanner_positions_nothing_is_made_up(truth: Scanned) -> None:
    assert not is_virtual([0, 1, 59_999])
    assert is_virtual([0, FIRST])


def test_virtual_stations_stand_in_the_spaces_at_eye_height(truth: Scanned) -> None:
    model = model_of([merged_scan(truth.points())])
    (storey,) = model.structure.storeys
    panoramas = virtual_panoramas(storey, model.cloud.surfels)
    assert min(panoramas) >= FIRST
    for panorama in panoramas.values():
        x, y, z = panorama.position
        assert any(space.buffer(-0.3).contains(Point(x, y)) for space in model.spaces)
        assert storey.floor + 1.0 < z < storey.floor + 2.0
        # A room of 4 m lies round it: nothing is nearer than the furniture, nothing but the doorway is farther.
        seen = panorama.ranges[panorama.ranges > 0]
        assert len(seen) > 0.9 * panorama.ranges.size
        assert 0.3 < np.median(seen) < 4.0
    inside = [sum(space.contains(Point(*p.position[:2])) for p in panoramas.values()) for space in model.spaces]
    assert min(inside) >= 1
