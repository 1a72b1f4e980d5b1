"""Classified points: every point with its element, streamed, read back by the readers."""

from __future__ import annotations

import json
import math

import laspy
import numpy as np
import pytest
from buildings import building, special_storey, turned

from scan2bim.errors import UsageError
from scan2bim.exporters.laz import export
from scan2bim.exporters.point_labels import point_labels
from scan2bim.model.classified import CLASSES
from scan2bim.model.ids import ifc_guid
from scan2bim.model.points import LocalPoints
from scan2bim.readers import read_chunks, read_headers

LEAF = (6.06 + 0.5 * math.sin(1.4), 1.204 + 0.5 * math.cos(1.4))
PLACES = (
    ((2.1, 0.16, 1.5), "wall-g-south"),
    ((2.0, 0.40, 1.5), None),
    ((1.5, 0.10, 1.0), "door-g1"),
    ((1.5, 0.10, 2.12), "wall-g-south"),
    ((*LEAF, 1.0), "door-g2"),
    ((6.0, 1.6, 1.0), "door-g2"),
    ((7.8, 0.0, 1.5), "window-g1"),
    ((3.0, 2.0, 0.01), "slab-g"),
    ((3.0, 2.0, 2.61), "covering-g"),
    ((8.09, 4.1, 1.0), "column-1"),
    ((4.0, 4.0, 1.0), None),
    ((3.0, 2.0, 2.81), "slab-u"),
    ((-3.0, -3.0, 1.0), None),
    ((900.0, 0.0, 1.0), None),
)


def chunks(points: np.ndarray, parts: int = 1, colour: bool = True):
    def read():
        for part in np.array_split(points, parts):
            rgb = np.tile(np.array([10, 20, 30], np.uint8), (len(part), 1)) if colour else None
            yield LocalPoints(part, rgb, np.full(len(part), 0.5, np.float32), np.ones(len(part), np.uint16))

    return read


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.array([(*turned(x, y), z) for (x, y, z), _ in PLACES])


@pytest.fixture(scope="module", params=["laz", "las"])
def path(request, tmp_path_factory, points):
    path = tmp_path_factory.mktemp("laz") / f"house.{request.param}"
    (note,) = export(building(), path, chunks(points, parts=3))
    assert note.startswith("14 points")
    return path


def test_each_point_has_its_element_and_class(path):
    with laspy.open(path) as file:
        table = json.loads(file.evlrs[0].record_data_bytes())
        records = file.read()
    guids = {row["element"]: (row["GlobalId"], row["class"]) for row in table}
    kinds = {"wall": "Wall", "door": "Door", "window": "Window", "slab": "Slab", "covering": "Covering", "column": "Column"}
    for (place, expected), number, kind in zip(PLACES, records["element"], records.classification, strict=True):
        if expected is None:
            assert (number, kind) == (0, 1), place
        else:
            assert guids[number] == (ifc_guid(expected), kind), place
            assert kind == CLASSES[kinds[expected.split("-")[0]]]


def test_the_readers_find_every_point_where_the_survey_had_it(path, points):
    (header,) = read_headers(path)
    found = np.concatenate([header.origin + chunk.xyz.astype(np.float64) for chunk in read_chunks(header)])
    assert np.abs(found - points - building().frame.shift).max() < 2e-4
    (chunk,) = read_chunks(header)
    assert chunk.rgb is not None and tuple(chunk.rgb[0]) == (10, 20, 30)
    assert chunk.intensity == pytest.approx(0.5, abs=1e-3)


def test_classes_beyond_the_standards_are_named_as_it_says(path):
    with laspy.open(path) as file:
        (lookup,) = (vlr for vlr in file.header.vlrs if (vlr.user_id, vlr.record_id) == ("LASF_Spec", 0))
        data = lookup.record_data_bytes()
    names = {data[k]: data[k + 1 : k + 16].rstrip(b"\0").decode() for k in range(0, len(data), 16)}
    assert (names[64], names[70], names[71]) == ("wall", "roof", "door")


def test_seldom_elements_take_their_points():
    labels = point_labels(building().model_copy(update={"storeys": (special_storey(),)}))
    places = {
        "wall-curved": (1.0, 1.02, 2.3),
        "wall-gable": (2.0, 5.1, 3.9),
        "beam-1": (8.0, 3.1, 2.2),
        "roof-1": (8.0, 6.5, 3.0),
        "stair-1": (7.0, 0.2, 1.35),
    }
    numbers = labels.of(np.array([(*turned(x, y), z) for x, y, z in places.values()]))
    assert [labels.elements[n - 1].id for n in numbers.tolist()] == list(places)


def test_without_scans_it_says_that_it_needs_them(tmp_path):
    with pytest.raises(UsageError, match="need the scans"):
        export(building(), tmp_path / "x.laz", None)


def test_a_rerun_writes_the_same_bytes_and_points_without_colour_are_written(tmp_path, points):
    for name in ("a.laz", "b.laz"):
        export(building(), tmp_path / name, chunks(points, colour=False))
    assert (tmp_path / "a.laz").read_bytes() == (tmp_path / "b.laz").read_bytes()
