from __future__ import annotations

import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import ifcopenshell
import ifcopenshell.util.element as util
import ifcopenshell.util.geolocation
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import ifcopenshell.validate
import numpy as np
import pytest
from buildings import box, building, measured, opening, space, wall
from ifc_help import entity, one_storey, points, volume, whole, written

from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Building, Column, Frame, Join, Slab, Storey
from scan2bim.model.queries import openings_of, walls_of
from scan2bim.truth.ifc_file import IfcModel as TruthIfc
from scan2bim.verify.ifc_model import conversion_of


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> ifcopenshell.file:
    return whole(tmp_path_factory.mktemp("ifc"))


def problems(file: ifcopenshell.file, rules: bool = True) -> list[str]:
    """What the library's validator finds: schema and WHERE rules (these take seconds to load)."""
    log = ifcopenshell.validate.json_logger()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # the library leaves its rule file open
        ifcopenshell.validate.validate(file, log, express_rules=rules)
    return [str(statement) for statement in log.statements]


def odd_building() -> Building:
    """All that is hard to write: nothing at all, crossing outlines, odd names, repeated ids, joins to nowhere."""
    bowtie = box(0.0, 0.0, 4.0, 3.0)
    bowtie = (bowtie[0], bowtie[2], bowtie[1], bowtie[3])
    holes = (opening("x", 3.5, 1.0, -0.1, 3.5, None), opening("y", 1.0, 0.0, 0.0, 2.0, None))
    walls = (
        wall("a", (0.0, 0.0), (4.0, 0.0), 0.00001, 0.0, joins=(Join(wall="no", at="end", other_at="start", kind="L"),)),
        wall("b", (1.0, 1.0), (1.0, 1.0), 0.2, 0.0),
        wall("c", (0.0, 2.0), (4.0, 2.0), 0.2, 0.0, openings=holes),
        wall("c", (0.0, 4.0), (4.0, 4.0), 0.2, 0.0),
    )
    walls = (*walls, walls[0].model_copy(update={"id": "é'\n" * 200, "name": "Wand »é« 'x'\\ \n" * 50}))
    empty = Storey(id="empty", name="", elevation=measured(-3.0))
    filled = Storey(
        id="filled",
        name="Filled",
        elevation=measured(0.0),
        walls=walls,
        spaces=(space("bow", "Bow", bowtie, 0.0, 6.0), space("line", "Line", ((0.0, 0.0), (1.0, 0.0)), 0.0, 0.0)),
        slabs=(
            Slab(
                id="slab",
                name="Slab",
                confidence=0.0,
                outline=box(0, 0, 4, 3),
                holes=(((1.0, 1.0), (1.0, 2.0)),),
                top=measured(0.0),
                thickness=measured(0.0),
            ),
        ),
    )
    return Building(id="odd", name="Odd", storeys=(empty, filled))


def test_the_file_is_valid_by_schema_and_rules(house):
    assert problems(house) == []


def test_odd_input_gives_a_valid_file_and_says_what_was_left_out(tmp_path):
    path = tmp_path / "odd.ifc"
    notes = export(odd_building(), path)
    assert problems(ifcopenshell.open(str(path))) == []
    for words in ("'Wall b'", "'Line'", "'Opening y'", "reaches past the end", "joins a wall 'no'", "share the id"):
        assert any(words in note for note in notes), words


def test_a_building_without_storeys_gives_a_valid_file(tmp_path):
    assert problems(written(Building(id="b", name="b"), tmp_path), rules=False) == []


def test_the_unit_is_the_metre_and_the_schema_ifc4(house):
    assert ifcopenshell.util.unit.calculate_unit_scale(house) == 1.0
    assert house.schema_identifier == "IFC4"


def test_everything_in_the_model_is_in_the_file(house):
    model = building()
    counts = {
        "IfcBuildingStorey": len(model.storeys),
        "IfcWall": len(list(walls_of(model))),
        "IfcOpeningElement": len(list(openings_of(model))),
        "IfcDoor": 8,
        "IfcWindow": 6,
        "IfcSpace": 6,
        "IfcSlab": 3,
        "IfcCovering": 1,
        "IfcColumn": 1,
        "IfcStair": 1,
    }
    assert {name: len(house.by_type(name)) for name in counts} == counts


def test_every_product_has_geometry_of_some_volume(house):
    products = [p for p in house.by_type("IfcProduct") if p.Representation]
    assert len(products) >= 50
    for product in products:
        assert volume(product) > 1e-4, product


def test_everything_is_placed_and_contained_once(house):
    for product in house.by_type("IfcElement"):
        assert product.ObjectPlacement
        if product.is_a("IfcOpeningElement"):
            assert not product.ContainedInStructure
        else:
            assert util.get_container(product, should_get_direct=True).is_a("IfcBuildingStorey")
    for room in house.by_type("IfcSpace"):
        assert util.get_aggregate(room).is_a("IfcBuildingStorey")


def test_storeys_stand_at_their_elevation(house):
    for storey in building().storeys:
        found = entity(house, storey.id)
        matrix = ifcopenshell.util.placement.get_local_placement(found.ObjectPlacement)
        assert found.Elevation == storey.elevation.value == pytest.approx(matrix[2, 3])


def test_elements_stand_where_the_model_has_them(house):
    upper = points(entity(house, "wall-u-south"), openings=False)
    assert (upper[:, 2].min(), upper[:, 2].max()) == pytest.approx((2.8, 5.4))
    slab = points(entity(house, "slab-u"))
    assert (slab[:, 2].min(), slab[:, 2].max()) == pytest.approx((2.6, 2.8))
    ceiling = points(entity(house, "covering-g"))
    assert (ceiling[:, 2].min(), ceiling[:, 2].max()) == pytest.approx((2.6, 2.62))
    corners = np.array([box(7.8, 4.0, 8.1, 4.3)])[0]
    column = points(entity(house, "column-1"))
    for corner in corners:
        assert np.abs(column[:, :2] - corner).sum(axis=1).min() < 1e-4


def test_holes_of_slabs_and_spaces_are_open(house):
    assert volume(entity(house, "slab-u")) == pytest.approx((10.3 * 8.3 - 1.0 * 2.8) * 0.2, rel=1e-4)
    hole = 1.0 * 2.6
    whole_room = volume(entity(house, "space-u3")) + hole
    assert volume(entity(house, "space-u1")) < whole_room


def test_a_round_column_is_a_cylinder(tmp_path):
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    outline = tuple((2 + 0.25 * np.cos(a), 3 + 0.25 * np.sin(a)) for a in angles)
    square = ((1.75, 2.75), (2.25, 2.75), (2.25, 3.25), (1.75, 3.25))
    columns = tuple(
        Column(id=name, name=name, confidence=1, outline=ring, base=0.5, height=measured(2.0), section="round")
        for name, ring in (("inside", outline), ("about", square))
    )
    file = written(one_storey(columns=columns), tmp_path)
    assert [round(p.Radius, 6) for p in file.by_type("IfcCircleProfileDef")] == [0.25, 0.25]
    assert points(entity(file, "about"))[:, 2].min() == pytest.approx(0.5)


def test_what_was_taken_off_the_coordinates_is_the_map_conversion(house):
    (conversion,) = house.by_type("IfcMapConversion")
    assert (conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight) == (500_000.0, 5_400_000.0, 300.0)
    assert (conversion.XAxisAbscissa, conversion.XAxisOrdinate, conversion.Scale) == (1.0, 0.0, 1.0)
    assert conversion.TargetCRS.Name == "EPSG:25832"


@pytest.mark.parametrize(
    ("crs", "name"),
    [
        ("25832", "EPSG:25832"),
        ("EPSG:25832", "EPSG:25832"),
        ("ETRS89 / UTM zone 32N (EPSG:25832)", "EPSG:25832"),
        ("Site grid", 'PROJCRS["Site grid",'),
        (None, 'PROJCRS["unknown",'),
        ('"' * 300, "PROJCRS["),
    ],
)
def test_the_map_is_named_as_far_as_it_is_known(tmp_path, crs, name):
    file = written(Building(id="b", name="b", frame=Frame(crs=crs, shift=(1000.0, 0.0, 0.0))), tmp_path)
    (found,) = file.by_type("IfcProjectedCRS")
    assert found.Name == name if name.startswith("EPSG") else found.Name.startswith(name)
    assert len(found.Name) <= 255 and found.Name.count("[") == found.Name.count("]")
    assert found.Description == (crs or "unknown")[:255]


@pytest.mark.parametrize(("crs", "name"), [(None, "WKT"), ("Site grid", "WKT"), ("25832", "EPSG:25832")])
def test_the_newest_version_shifts_to_an_unknown_map_by_a_rigid_operation(tmp_path, crs, name):
    frame = Frame(crs=crs, shift=(1000.0, 2000.0, 3.0))
    export(Building(id="b", name="b", frame=frame), tmp_path / "b.ifc", ExportSettings(ifc_version="IFC4X3_ADD2"))
    file = ifcopenshell.open(str(tmp_path / "b.ifc"))
    assert [crs.Name for crs in file.by_type("IfcProjectedCRS")] == [name]
    assert len(file.by_type("IfcWellKnownText")) == (name == "WKT")
    shift = ifcopenshell.util.geolocation.get_helmert_transformation_parameters(file)
    assert (shift.e, shift.n, shift.h) == frame.shift
    found = [read(tmp_path / "b.ifc") for read in (placed_for_scores, placed_for_verification)]
    assert [tuple(matrix[:3, 3]) for matrix in found] == [frame.shift] * 2


def placed_for_scores(path: Path) -> np.ndarray:
    matrix = TruthIfc(path).map_conversion()
    assert matrix is not None
    return matrix


def placed_for_verification(path: Path) -> np.ndarray:
    conversion = conversion_of(ifcopenshell.open(str(path)))
    assert conversion is not None
    return conversion.matrix()


def test_two_runs_write_the_same_bytes_whatever_the_hash_seed_and_the_place(tmp_path):
    export(building(), tmp_path / "a.ifc")
    code = (
        "import sys; from pathlib import Path; from buildings import building;"
        "from scan2bim.exporters.ifc import export; export(building(), Path(sys.argv[1]))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "77", "PYTHONPATH": str(Path(__file__).parents[1])}
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "other name.ifc")], check=True, env=environment)
    assert (tmp_path / "a.ifc").read_bytes() == (tmp_path / "other name.ifc").read_bytes()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_or_a_missing_folder_is_an_error(tmp_path):
    for path in (Path("/dev/full"), tmp_path / "none" / "house.ifc"):
        with pytest.raises(OSError, match=re.escape(os.strerror(28)) + "|" + re.escape(os.strerror(2))):
            export(building(), path)


def test_guids_are_those_of_the_model_and_unique(house):
    guids = [root.GlobalId for root in house.by_type("IfcRoot")]
    assert len(guids) == len(set(guids))
    for storey, host in walls_of(building()):
        assert entity(house, host.id).Name == host.name
        assert entity(house, storey.id).Name == storey.name


def test_nothing_is_left_that_nothing_refers_to(house):
    items = [item for item in house.by_type("IfcRepresentationItem") if not item.is_a("IfcStyledItem")]
    assert [item for item in items if not house.get_total_inverses(item)] == []


def test_colours_of_the_scan_are_the_styles(house):
    colour = building().storeys[0].walls[0].colour
    assert colour is not None
    (style,) = util_styles(entity(house, "wall-g-south"))
    shade = style.Styles[0].SurfaceColour
    encoded = [1.055 * c ** (1 / 2.4) - 0.055 for c in colour]
    assert (shade.Red, shade.Green, shade.Blue) == pytest.approx(encoded, abs=0.003)


def util_styles(element: ifcopenshell.entity_instance) -> list[ifcopenshell.entity_instance]:
    items = [item for rep in element.Representation.Representations for item in rep.Items]
    return [style for item in items for styled in item.StyledByItem for style in styled.Styles]
