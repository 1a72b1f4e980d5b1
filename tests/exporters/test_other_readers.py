"""What one library wrote another one reads: DXF by GDAL, LAZ by LASzip, SVG by resvg, each to the same content."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import laspy
import numpy as np
import pyogrio
import pyogrio.raw
import pytest
import resvg_py
import shapely
from buildings import building, turned

from scan2bim.exporters import dxf, laz
from scan2bim.model.ids import ifc_guid
from scan2bim.model.points import LocalPoints
from scan2bim.model.shapes import opening_outline, wall_footprints
from scan2bim.report.plan_file import export as export_plan


class Drawing:
    """A DXF file's entities as GDAL has them: layer, text, shape."""

    def __init__(self, path: Path) -> None:
        # GDAL takes the code page of the header for that of the text, which is UTF-8 since AutoCAD 2007
        pyogrio.set_gdal_config_options({"DXF_ENCODING": "UTF-8"})
        meta, _, shapes, fields = pyogrio.raw.read(path)
        names: list[str] = list(meta["fields"])
        self.layers: list[str] = fields[names.index("Layer")].tolist()
        self.texts: list[str | None] = fields[names.index("Text")].tolist()
        self.shapes: list[Any] = shapely.from_wkb(shapes).tolist()

    def on(self, layer: str) -> list[Any]:
        """The shapes on a layer."""
        return [shape for shape, name in zip(self.shapes, self.layers, strict=True) if name == layer]


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> Drawing:
    path = tmp_path_factory.mktemp("dxf") / "house.dxf"
    dxf.export(building(), path)
    return Drawing(path)


def test_gdal_finds_each_storeys_walls_where_the_model_has_them(drawing: Drawing):
    for number, storey in enumerate(building().storeys):
        rings = [shapely.Polygon(shape.coords) for shape in drawing.on(f"0{number}_WALL")]
        solid = shapely.union_all([shapely.Polygon(ring) for ring in wall_footprints(storey).values()])
        voids = shapely.union_all([shapely.Polygon(opening_outline(w, o)) for w in storey.walls for o in w.openings])
        expected = shapely.difference(solid, voids)
        assert shapely.union_all(rings).symmetric_difference(expected).area < 0.002 * expected.area


def test_gdal_reads_the_rooms_names_and_areas(drawing: Drawing):
    assert {"Hall", "Küche", "21.94 m²", "Attic & store"} <= set(drawing.texts)


def test_gdal_finds_the_swing_of_a_door_about_its_hinge(drawing: Drawing):
    arcs = [shape for shape in drawing.on("00_DOOR") if len(shape.coords) > 8]
    hinge = shapely.Point(turned(6.06, 1.204))
    (arc,) = [arc for arc in arcs if np.ptp([shapely.Point(p).distance(hinge) for p in arc.coords]) < 0.005]
    assert shapely.Point(arc.coords[0]).distance(hinge) == pytest.approx(0.9, abs=0.05)


def test_laszip_reads_the_classes_and_elements_that_lazrs_wrote(tmp_path: Path):
    places = np.array([(*turned(2.1, 0.16), 1.5), (*turned(1.5, 0.10), 1.0), (*turned(4.0, 4.0), 1.0)])

    def points():
        yield LocalPoints(places, None, np.full(3, 0.5, np.float32), np.ones(3, np.uint16))

    laz.export(building(), tmp_path / "house.laz", points)
    with laspy.open(tmp_path / "house.laz", laz_backend=laspy.LazBackend.Laszip) as file:
        records: Any = file.read()
        table = json.loads(file.evlrs[0].record_data_bytes()) if file.evlrs else []
    guids = {row["element"]: row["GlobalId"] for row in table}
    assert [guids.get(number) for number in records["element"].tolist()] == [
        ifc_guid("wall-g-south"),
        ifc_guid("door-g1"),
        None,
    ]
    assert list(records["classification"]) == [64, 71, 1]
    xyz = np.array([records[name] for name in "xyz"]).T - np.array(building().frame.shift)
    assert np.abs(xyz - places).max() < 2e-4


def test_resvg_draws_the_plan_that_we_draw(tmp_path: Path):
    for suffix in ("svg", "png"):
        export_plan(building(), tmp_path / f"plan.{suffix}")
    drawn = resvg_py.svg_to_bytes(svg_path=str(tmp_path / "plan.svg"), dpi=96.0)
    theirs = cv2.imdecode(np.frombuffer(bytes(drawn), np.uint8), cv2.IMREAD_COLOR)
    ours = cv2.imread(str(tmp_path / "plan.png"))
    assert theirs is not None and ours is not None and theirs.shape == ours.shape
    off = np.abs(theirs.astype(np.int16) - ours).max(axis=2) > 40
    assert off.mean() < 0.03  # what it has other fonts for
    dark = (ours.max(axis=2) < 80).astype(np.uint8)
    walls = cv2.erode(np.asarray(dark), np.ones((5, 5), np.uint8)) > 0
    assert walls.sum() > 20_000
    assert not off[walls].any()
