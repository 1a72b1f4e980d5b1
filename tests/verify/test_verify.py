"""The whole way: scans of a simulated flat against drawings of it with known changes."""

from __future__ import annotations

import json
import math
import warnings
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ifcopenshell
import ifcopenshell.util.element
import ifcopenshell.validate
import jsonschema
import laspy
import numpy as np
import pytest
from bcf.v3.bcfxml import BcfXml
from pxr import Usd, UsdGeom
from synthetic import l_shaped, scanned, two_rooms, write_scene
from verify.bcf_reader import read_bcf, reads_bcf
from verify.browser import answer, chromium
from verify.drawn import Change, draw

from scan2bim.cli import main
from scan2bim.simulate.truth import truth_of
from scan2bim.verify.ifc_model import conversion_of, read_model
from scan2bim.verify.result import ElementResult, Report, load_report, report_schema

SCENE = two_rooms(yaw=0.3)


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("verify")
    write_scene(folder / "scans", SCENE)
    return folder


def verified(scans: Path, name: str, *options: str, changes: dict[str, Change] | None = None, code: int = 0) -> Report:
    model = draw(truth_of(SCENE), scans / f"{name}.ifc", changes)
    work = ["--work", str(scans / "work"), "--quiet"]
    arguments = ["verify", str(model), str(scans / "scans"), "-o", str(scans / name), *work, *options]
    assert main(arguments) == code
    return load_report(scans / name / "report.json")


def element(report: Report, name: str) -> ElementResult:
    return next(e for e in report.elements if e.name == name)


def test_a_building_that_was_built_as_drawn_is_in_tolerance(scans: Path) -> None:
    report = verified(scans, "same", "--tolerance", "10mm", "--fail-on", "out-of-tolerance,missing")
    assert {e.status for e in report.elements if e.ifc_class == "IfcWall"} == {"in_tolerance"}
    assert {e.loa for e in report.elements if e.ifc_class == "IfcWall"} <= {"LOA30", "LOA40", "LOA50"}
    assert report.placing.method == "identity"
    jsonschema.validate(json.loads((scans / "same" / "report.json").read_text()), json.loads(report_schema()))


def test_a_shifted_a_turned_and_an_unbuilt_wall_are_told_from_the_others(scans: Path) -> None:
    changes = {"middle wall": Change(left=0.03), "outer wall 2": Change(turn=math.radians(0.8))}
    report = verified(scans, "changed", "--fail-on", "out-of-tolerance", changes=changes, code=1)
    shifted, turned = element(report, "middle wall"), element(report, "outer wall 2")
    assert shifted.status == turned.status == "out_of_tolerance"
    assert shifted.fit is not None
    assert turned.fit is not None
    assert math.hypot(*shifted.fit.shift) == pytest.approx(0.03, abs=0.003)
    assert turned.fit.turn == pytest.approx(-math.radians(0.8), abs=math.radians(0.1))
    assert element(report, "outer wall 1").status == "in_tolerance"
    assert element(report, "floor").status == "in_tolerance"


def test_the_findings_are_told_in_a_page_in_bcf_and_in_a_copy_of_the_model(scans: Path) -> None:
    report = verified(scans, "told", changes={"middle wall": Change(left=0.05)})
    guid = element(report, "middle wall").guid
    page = (scans / "told" / "report.html").read_text()
    assert guid in page
    assert "http://" not in page
    assert "https://" not in page
    with zipfile.ZipFile(scans / "told" / "findings.bcf") as file:
        texts = {n: file.read(n) for n in file.namelist() if not n.endswith(".png")}
    roots = [ElementTree.fromstring(text).tag for text in texts.values()]
    assert {"Version", "Markup", "VisualizationInfo", "Extensions", "ProjectInfo"} == set(roots)
    assert any(guid.encode() in text for name, text in texts.items() if name.endswith(".bcfv"))
    read = BcfXml.load(scans / "told" / "findings.bcf")
    assert read is not None
    topics = {t.topic.title: t for t in read.topics.values()}
    assert len(read.topics) == len(report.faults()) + sum(a.guess != "object" for a in report.additions)
    for topic in read.topics.values():
        assert [v.snapshot[:4] for v in topic.viewpoints.values() if v.snapshot] == [b"\x89PNG"]
    view = next(iter(next(t for name, t in topics.items() if "middle wall" in name).viewpoints.values()))
    parts = view.visualization_info.components
    assert parts is not None
    assert parts.selection is not None
    assert [c.ifc_guid for c in parts.selection.component] == [guid]
    copy = ifcopenshell.open(str(scans / "told" / "told.verified.ifc"))
    sets = ifcopenshell.util.element.get_psets(copy.by_guid(guid))
    assert sets["Scan2BIM_Verification"]["Status"] == "out_of_tolerance"


def test_the_copy_of_the_model_and_a_copy_of_that_are_valid(scans: Path) -> None:
    model = draw(truth_of(SCENE), scans / "copied.ifc", {"middle wall": Change(left=0.05)})
    before, apart = problems(model), left_over(model)
    for name in ("copied", "copied.verified"):
        folder = scans / name
        source = model if name == "copied" else scans / "copied" / "copied.verified.ifc"
        options = ["--work", str(scans / "work"), "--quiet"]
        assert main(["verify", str(source), str(scans / "scans"), "-o", str(folder), *options]) == 0
        assert problems(folder / f"{name}.verified.ifc") == before
        assert left_over(folder / f"{name}.verified.ifc") == apart


def left_over(path: Path) -> int:
    """Entities without a GlobalId that nothing refers to, but styles, which refer to what they colour."""
    file = ifcopenshell.open(str(path))
    bare = (e for e in file if not e.is_a("IfcRoot") and not e.is_a("IfcStyledItem"))
    return sum(not file.get_total_inverses(e) for e in bare)


def problems(path: Path) -> list[str]:
    """What the validator finds, schema and rules, without the numbers of the entities."""
    log = ifcopenshell.validate.json_logger()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # the library leaves its rule file open
        ifcopenshell.validate.validate(ifcopenshell.open(str(path)), log, express_rules=True)
    return sorted(str(statement["message"]) for statement in log.statements)


@pytest.mark.skipif(not reads_bcf(), reason="needs Node with @parametricos/bcf-js")
def test_a_second_reader_finds_the_same_topics_and_viewpoints(scans: Path) -> None:
    report = verified(scans, "second", changes={"middle wall": Change(left=0.05)})
    told = read_bcf(scans / "second" / "findings.bcf")
    guid = element(report, "middle wall").guid
    assert len(told) == len(report.faults()) + sum(a.guess != "object" for a in report.additions)
    assert all(topic["camera"] and topic["snapshot"].endswith(".png") for topic in told)
    assert [topic["selected"] for topic in told if "middle wall" in topic["title"]] == [[guid]]


def test_a_georeferenced_model_is_placed_by_its_map_conversion(scans: Path) -> None:
    model = draw(truth_of(SCENE), scans / "map.ifc")
    file: Any = ifcopenshell.open(str(model))
    east, north, height = 40.0, -7.0, 2.0
    for place in file.by_type("IfcLocalPlacement"):
        point = place.RelativePlacement.Location
        if place.PlacementRelTo is None:
            x, y, z = point.Coordinates
            moved = file.create_entity("IfcCartesianPoint", (x - east, y - north, z - height))
            axes = place.RelativePlacement
            place.RelativePlacement = file.create_entity("IfcAxis2Placement3D", moved, axes.Axis, axes.RefDirection)
    crs = file.create_entity("IfcProjectedCRS", "EPSG:25832")
    context = file.by_type("IfcGeometricRepresentationContext")[0]
    file.create_entity("IfcMapConversion", context, crs, east, north, height, 1.0, 0.0, 1.0)
    file.write(str(model))
    folder = scans / "map"
    main(["verify", str(model), str(scans / "scans"), "-o", str(folder), "--work", str(scans / "work"), "--quiet"])
    report = load_report(folder / "report.json")
    assert report.placing.method == "map"
    assert element(report, "middle wall").status == "in_tolerance"


def test_a_map_conversion_tells_quarter_turns_and_feet(tmp_path: Path) -> None:
    model = draw(truth_of(SCENE), tmp_path / "feet.ifc")
    file: Any = ifcopenshell.open(str(model))
    make = file.create_entity
    metre = make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    factor = make("IfcMeasureWithUnit", make("IfcLengthMeasure", 0.3048), metre)
    powers = make("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
    foot = make("IfcConversionBasedUnit", powers, "LENGTHUNIT", "FOOT", factor)
    crs = make("IfcProjectedCRS", "EPSG:2229", MapUnit=foot)
    context = file.by_type("IfcGeometricRepresentationContext")[0]
    make("IfcMapConversion", context, crs, 1000.0, 2000.0, 10.0, 0.0, 1.0, 1.0)
    found = conversion_of(file)
    assert found is not None
    assert (found.eastings, found.northings, found.height) == pytest.approx((304.8, 609.6, 3.048))
    assert found.turn == pytest.approx(math.pi / 2)


@pytest.mark.skipif(chromium() is None, reason="needs Chromium")
def test_the_page_sorts_filters_and_shows_an_element_in_a_browser(scans: Path, tmp_path: Path) -> None:
    report = verified(scans, "page", changes={"middle wall": Change(left=0.05)})
    guid = element(report, "middle wall").guid
    script = """
      const rows=()=>[...document.querySelectorAll("#table tbody tr")];
      const column=n=>rows().map(r=>r.children[n].textContent);
      const out={first:rows()[0].dataset.guid,all:rows().length};
      document.querySelector("#table th[data-key=name]").click(); out.up=column(2);
      document.querySelector("#table th[data-key=name]").click(); out.down=column(2);
      const text=document.getElementById("text"); text.value="outer"; text.oninput(); out.filtered=column(2);
      text.value=""; text.oninput();
      document.querySelector('.tile[data-status="out_of_tolerance"]').click(); out.faults=rows().map(r=>r.dataset.guid);
      document.querySelector('polygon[data-guid="GUID"]').onclick();
      const detail=document.getElementById("detail");
      out.shown=detail.style.display; out.text=detail.textContent; out.picture=!!detail.querySelector("img");
      out.marked=document.querySelectorAll("polygon.on").length; return out;"""
    told = answer(scans / "page" / "report.html", script.replace("GUID", guid), tmp_path)
    assert told["errors"] == []
    assert told["first"] == guid
    assert told["all"] == len(report.elements)
    assert told["up"] == sorted(told["up"], key=str.lower)
    assert told["down"] == told["up"][::-1]
    assert told["filtered"]
    assert all(name.startswith("outer wall") for name in told["filtered"])
    assert set(told["faults"]) == {e.guid for e in report.elements if e.status == "out_of_tolerance"}
    assert told["shown"] == "block"
    assert "shifted by" in told["text"]
    assert told["picture"]
    assert told["marked"] == 1


def test_all_points_come_with_their_element_and_the_unexplained_ones_apart(scans: Path) -> None:
    extras = [part for name in ("classified", "remainder", "usd") for part in ("--also", name)]
    report = verified(scans, "also", *extras, changes={"middle wall": Change(left=0.05)})
    points = laspy.read(scans / "also" / "classified.laz")
    assert points.evlrs is not None
    table = json.loads(points.evlrs[0].record_data)
    rest = laspy.read(scans / "also" / "remainder.laz")
    assert len(points) == report.points
    assert len(rest) == report.unexplained_points
    assert set(np.unique(rest["element"])) <= {0}
    number = next(row["element"] for row in table if row["GlobalId"] == element(report, "middle wall").guid)
    assert set(np.unique(points["classification"][points["element"] == number])) == {64}
    assert (points["element"] == number).sum() > 1000
    stage = Usd.Stage.Open(str(scans / "also" / "deviations.usdc"))
    meshes = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.GetTypeName() == "Mesh"]
    walls = {m.GetPrim().GetAttribute("ifc:GlobalId").Get(): m for m in meshes}
    wall = walls[element(report, "middle wall").guid]
    assert wall.GetPrim().GetAttribute("s2b:status").Get() == "out_of_tolerance"
    assert len(wall.GetDisplayColorAttr().Get()) == len(wall.GetFaceVertexCountsAttr().Get())
    places = np.array(wall.GetPointsAttr().Get())
    drawn = read_model(scans / "also.ifc").elements
    corners = next(e.vertices for e in drawn if e.name == "middle wall")
    assert places.min(axis=0) == pytest.approx(corners.min(axis=0), abs=0.06)
    assert places.max(axis=0) == pytest.approx(corners.max(axis=0), abs=0.06)


def test_a_model_drawn_elsewhere_is_aligned(scans: Path) -> None:
    truth = truth_of(two_rooms(yaw=1.1))
    model = draw(truth, scans / "elsewhere.ifc")
    main(["verify", str(model), str(scans / "scans"), "-o", str(scans / "e"), "--work", str(scans / "work"), "--quiet"])
    report = load_report(scans / "e" / "report.json")
    assert report.placing.method == "automatic"
    assert element(report, "middle wall").status == "in_tolerance"


def test_the_model_of_another_building_is_refused_in_words(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = draw(truth_of(l_shaped()), scans / "another.ifc")
    assert (
        main(["verify", str(model), str(scans / "scans"), "-o", str(scans / "a"), "--work", str(scans / "work")]) == 4
    )
    assert "not that of the scanned building" in capsys.readouterr().err
    assert not (scans / "a" / "report.json").exists()


def test_a_merged_cloud_tells_deviations_and_what_it_cannot_tell(tmp_path: Path) -> None:
    cloud = tmp_path / "merged.ply"
    points = scanned(SCENE).points().astype("<f8")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    cloud.write_bytes(
        (head + "".join(f"property double {c}\n" for c in "xyz") + "end_header\n").encode() + points.tobytes()
    )
    model = draw(truth_of(SCENE), tmp_path / "model.ifc", {"middle wall": Change(left=0.03)})
    main(["verify", str(model), str(cloud), "-o", str(tmp_path / "out"), "--tolerance", "10mm", "--quiet"])
    report = load_report(tmp_path / "out" / "report.json")
    assert element(report, "middle wall").status == "out_of_tolerance"
    assert element(report, "outer wall 1").status == "in_tolerance"
    assert not {"occluded", "missing"} & {e.status for e in report.elements if e.opening is None}
    assert any("scanner positions" in note for note in report.notes)


def test_the_scene_is_scanned_from_two_stations() -> None:
    assert len(scanned(SCENE).sweeps) == 2
