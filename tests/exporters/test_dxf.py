"""DXF plans: read back by an audit, in place and to scale, with every length that the model has."""

from __future__ import annotations

import math

import ezdxf
import pytest
import shapely
from buildings import building, special_storey, turned

from scan2bim.exporters.dxf import APPLICATION, export
from scan2bim.model.ids import ifc_guid


@pytest.fixture(scope="module")
def drawing(tmp_path_factory):
    path = tmp_path_factory.mktemp("dxf") / "house.dxf"
    export(building(), path)
    return ezdxf.readfile(path)


def of(drawing, identifier: str, layer: str):
    guid = ifc_guid(identifier)
    found = [
        entity
        for entity in drawing.modelspace()
        if entity.has_xdata(APPLICATION) and entity.get_xdata(APPLICATION)[0].value == guid
    ]
    return [entity for entity in found if entity.dxf.layer.endswith(layer)]


def test_an_audit_finds_no_error(drawing):
    audit = drawing.audit()
    assert (audit.errors, audit.fixes) == ([], [])
    assert drawing.units == ezdxf.units.M


def test_walls_stand_where_the_model_has_them_without_their_openings(drawing):
    parts = of(drawing, "wall-g-middle", "00_WALL")
    assert len(parts) == 3
    areas = [shapely.Polygon(part.get_points("xy")).area for part in parts]
    assert sum(areas) == pytest.approx((7.7 - 0.9 - 1.6) * 0.12, abs=1e-3)
    assert len(of(drawing, "wall-g-middle", "00_WALL_FILL")) == 3


def test_a_door_shows_its_leaf_and_swing(drawing):
    (arc,) = (entity for entity in of(drawing, "door-g2", "00_DOOR") if entity.dxftype() == "ARC")
    assert tuple(arc.dxf.center)[:2] == pytest.approx(turned(6.06, 1.204), abs=1e-3)
    sweep = (arc.dxf.end_angle - arc.dxf.start_angle) % 360
    assert sweep == pytest.approx(90)
    assert len(of(drawing, "door-g3", "00_DOOR")) == 4


def test_rooms_are_named_with_their_areas(drawing):
    words = {text.dxf.text for text in drawing.modelspace().query("TEXT")}
    assert {"Hall", "Küche", "21.94 m²", "29.18 m²"} <= words


def test_outer_walls_are_dimensioned_and_so_is_the_whole(drawing):
    lengths = sorted(
        round(dimension.get_measurement(), 3)
        for dimension in drawing.modelspace().query("DIMENSION")
        if dimension.dxf.layer.startswith("00")
    )
    for length in (10.3, 8.3, 1.0, 2.2, 1.4, 1.5):
        assert length in lengths
    south = [1.15, 1.0, 4.8, 2.2, 1.15]
    assert all(any(math.isclose(length, x, abs_tol=0.002) for x in lengths) for length in south)


def test_each_storey_has_a_sheet_to_scale_that_shows_it_alone(drawing):
    names = [name for name in drawing.layout_names() if name != "Model"]
    assert [name[:2] for name in names] == ["00", "01"]
    for name in names:
        (view,) = (v for v in drawing.layout(name).query("VIEWPORT") if v.dxf.id != 1)
        scale = view.dxf.view_height / view.dxf.height * 1000
        assert scale == pytest.approx(int(name.split("-")[1]))
        assert {layer[:2] for layer in view.frozen_layers} == {"00", "01"} - {name[:2]}


def test_a_rerun_writes_the_same_bytes_and_an_empty_building_is_valid(tmp_path):
    for name in ("a.dxf", "b.dxf"):
        export(building(), tmp_path / name)
    assert (tmp_path / "a.dxf").read_bytes() == (tmp_path / "b.dxf").read_bytes()
    export(building().model_copy(update={"storeys": ()}), tmp_path / "c.dxf")
    assert not ezdxf.readfile(tmp_path / "c.dxf").audit().errors


def test_seldom_elements_are_drawn(tmp_path):
    export(building().model_copy(update={"storeys": (special_storey(),)}), tmp_path / "x.dxf")
    drawing = ezdxf.readfile(tmp_path / "x.dxf")
    assert not drawing.audit().errors
    for identifier, layer in (("wall-curved", "WALL"), ("beam-1", "BEAM"), ("roof-1", "ROOF"), ("stair-1", "STAIR")):
        assert of(drawing, identifier, layer)
