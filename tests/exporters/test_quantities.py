"""Quantities add up, are the same in both forms, and are read by others."""

from __future__ import annotations

import csv
import math

import openpyxl
import pytest
from buildings import building, special_storey

from scan2bim.exporters.quantities import export
from scan2bim.model.ids import ifc_guid


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "house.csv"
    export(building(), path)
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    path = tmp_path_factory.mktemp("xlsx") / "house.xlsx"
    export(building(), path)
    return openpyxl.load_workbook(path)


def row_of(rows: list[dict[str, str]], name: str) -> dict[str, str]:
    return next(row for row in rows if row["name"] == name)


def test_a_walls_quantities_are_gross_and_without_its_openings(rows):
    wall = row_of(rows, "Wall g-middle")
    assert wall["GlobalId"] == ifc_guid("wall-g-middle")
    cut = (0.9 + 1.6) * 2.05
    assert float(wall["length [m]"]) == pytest.approx(8.0)
    assert float(wall["gross area [m²]"]) == pytest.approx(8 * 2.6)
    assert float(wall["net area [m²]"]) == pytest.approx(8 * 2.6 - cut)
    assert float(wall["net volume [m³]"]) == pytest.approx((7.7 * 2.6 - cut) * 0.12, abs=1e-4)
    assert float(wall["gross volume [m³]"]) == pytest.approx(7.7 * 2.6 * 0.12, abs=1e-4)


def test_what_hangs_on_an_assumed_length_says_so(rows):
    assert row_of(rows, "Wall g-north")["basis"] == "assumed"
    assert row_of(rows, "Wall g-south")["basis"] == "measured"


def test_every_element_has_a_row_with_its_storey(rows):
    kinds = [row["kind"] for row in rows]
    counts = {kind: kinds.count(kind) for kind in set(kinds)}
    assert counts["Door"] == 8 and counts["Window"] == 6 and counts["Opening"] == 1 and counts["Space"] == 6
    assert {row["storey"] for row in rows} == {"Ground floor", "Upper floor"}
    assert row_of(rows, "Door g2")["state"] == "open"


def test_a_spreadsheet_reads_the_same_numbers(book, rows):
    assert book.sheetnames[0] == "Summary"
    header, *lines = book["Walls"].iter_rows(values_only=True)
    found = {line[header.index("name")]: line[header.index("net area [m²]")] for line in lines}
    for row in rows:
        if row["kind"] == "Wall":
            assert found[row["name"]] == pytest.approx(float(row["net area [m²]"]))


def test_the_summary_adds_up(book, rows):
    _, *lines = book["Summary"].iter_rows(values_only=True)
    spaces = {line[0]: (line[2], line[3]) for line in lines if line[1] == "Space"}
    own = [float(row["net area [m²]"]) for row in rows if row["kind"] == "Space" and row["storey"] == "Upper floor"]
    assert spaces["Upper floor"] == (3, pytest.approx(math.fsum(own)))


def test_a_name_that_looks_like_a_formula_stays_a_name(tmp_path):
    storey = building().storeys[0].model_copy(update={"name": "=1+1"})
    export(building().model_copy(update={"storeys": (storey,)}), tmp_path / "x.xlsx")
    cell = openpyxl.load_workbook(tmp_path / "x.xlsx")["Walls"]["A2"]
    assert (cell.value, cell.data_type) == ("=1+1", "s")


def test_seldom_elements_are_measured_and_reruns_are_equal(tmp_path):
    special = building().model_copy(update={"storeys": (special_storey(),)})
    for name in ("a.csv", "a.xlsx", "b.csv", "b.xlsx"):
        export(special, tmp_path / name)
    for form in ("csv", "xlsx"):
        assert (tmp_path / f"a.{form}").read_bytes() == (tmp_path / f"b.{form}").read_bytes()
    with (tmp_path / "a.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(row_of(rows, "Gable")["gross area [m²]"]) == pytest.approx(12.0)
    assert float(row_of(rows, "Curved")["length [m]"]) == pytest.approx(math.pi, abs=1e-4)
    assert float(row_of(rows, "Roof")["gross area [m²]"]) == pytest.approx(4 * math.hypot(3, 2), abs=1e-3)
    assert float(row_of(rows, "Beam")["length [m]"]) == pytest.approx(4.0, abs=1e-4)
