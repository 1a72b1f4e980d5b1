"""The whole way on the sample flat: what ``./run demo`` promises."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import ifcopenshell
import laspy
import numpy as np
import pytest
import shapely
from conftest import FLAT_OUTPUTS
from modelled import rectangle_overlap
from numpy.typing import NDArray
from pxr import Usd

import scan2bim

FLAT = Path(scan2bim.__file__).parent.parent / "samples" / "flat"
F64 = NDArray[np.float64]


@pytest.fixture(scope="module")
def storey(converted_flat: tuple[Path, str]) -> dict[str, Any]:
    return json.loads((converted_flat[0] / "flat.json").read_text(encoding="utf-8"))["storeys"][0]


@pytest.fixture(scope="module")
def truth() -> dict[str, Any]:
    return json.loads((FLAT / "truth.json").read_text(encoding="utf-8"))


def test_all_outputs_appear_and_are_named_on_stdout(converted_flat: tuple[Path, str]) -> None:
    folder, said = converted_flat
    for name in FLAT_OUTPUTS:
        assert (folder / name).stat().st_size > 1000
        assert name in said


def test_the_storey_lies_where_truth_has_it(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    assert storey["elevation"]["value"] == pytest.approx(truth["storeys"][0]["elevation"], abs=0.01)
    assert storey["height"]["value"] == pytest.approx(truth["storeys"][0]["height"], abs=0.01)


def test_every_room_is_found_with_its_outline(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    found = [shapely.Polygon(space["outline"], space["holes"]) for space in storey["spaces"]]
    assert len(found) == len(truth["spaces"])
    for space in truth["spaces"]:
        true = shapely.Polygon(space["outline"], space["holes"])
        best = max(found, key=lambda other: other.intersection(true).area)
        assert best.intersection(true).area / best.union(true).area > 0.95, space["name"]


def test_inner_walls_have_their_true_thickness(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    measured = [w for w in storey["walls"] if w["thickness"]["source"] == "measured"]
    assert len(measured) >= 5
    for wall in measured:
        middle = (np.array(wall["start"]) + np.array(wall["end"])) / 2
        true = min(
            truth["walls"], key=lambda t: shapely.LineString([t["start"], t["end"]]).distance(shapely.Point(middle))
        )
        assert wall["thickness"]["value"] == pytest.approx(true["thickness"], abs=0.015), true["name"]


def rectangles(storey: dict[str, Any], kinds: tuple[str, ...]) -> list[F64]:
    """The openings of a storey that hold one of the kinds ("door", "window", "" for nothing), each (4, 3)."""
    found: list[F64] = []
    for wall in storey["walls"]:
        start, end = np.array(wall["start"]), np.array(wall["end"])
        along = (end - start) / np.linalg.norm(end - start)
        for opening in wall["openings"]:
            if (opening["fill"] or {"kind": ""})["kind"] in kinds:
                offset, sill, width, height = (opening[key]["value"] for key in ("offset", "sill", "width", "height"))
                low = wall["base"] + sill
                near, far = start + along * offset, start + along * (offset + width)
                found.append(np.array([[*near, low], [*far, low], [*far, low + height], [*near, low + height]]))
    return found


def best_overlap(true: list[list[float]], found: list[F64]) -> float:
    return max((rectangle_overlap(np.array(true), other, across=0.4) for other in found), default=0.0)


def test_every_window_is_found(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    found = rectangles(storey, ("window",))
    assert len(found) == len(truth["windows"])
    for window in truth["windows"]:
        assert best_overlap(window["corners"], found) > 0.5, window["name"]


def test_every_door_that_stands_open_is_found(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    found = rectangles(storey, ("door", ""))
    for door in truth["doors"]:
        if door["state"] != "closed":
            assert best_overlap(door["corners"], found) > 0.7, door["name"]
    assert len(found) <= len(truth["doors"])


def test_doors_that_stand_open_have_their_leaves(storey: dict[str, Any], truth: dict[str, Any]) -> None:
    fills = [(opening["fill"] or {}) for wall in storey["walls"] for opening in wall["openings"]]
    found = sorted((fill["angle"], fill["state"]) for fill in fills if fill.get("angle"))
    true = sorted((door["angle"], door["state"]) for door in truth["doors"] if door["state"] in ("open", "ajar"))
    assert [state for _, state in found] == [state for _, state in true]
    assert [angle for angle, _ in found] == pytest.approx([angle for angle, _ in true], abs=math.radians(10))


def test_ifc_and_usd_hold_the_same_rooms(converted_flat: tuple[Path, str], storey: dict[str, Any]) -> None:
    folder, _ = converted_flat
    file = ifcopenshell.open(str(folder / "flat.ifc"))
    assert len(file.by_type("IfcSpace")) == len(storey["spaces"])
    assert len(file.by_type("IfcOpeningElement")) == sum(len(wall["openings"]) for wall in storey["walls"])
    assert Usd.Stage.Open(str(folder / "flat.usdz")).GetDefaultPrim().IsValid()


def test_every_point_is_in_the_classified_cloud(converted_flat: tuple[Path, str]) -> None:
    told = re.search(r"([\d,]+) points, \d+%", converted_flat[1])
    assert told is not None
    with laspy.open(converted_flat[0] / "flat.laz") as file:
        assert file.header.point_count == int(told[1].replace(",", ""))
        share = np.count_nonzero(file.read()["element"]) / file.header.point_count
    assert share > 0.85
