"""Plans show rooms, walls and doors where they are, and where a room is not closed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest
from buildings import box, building, ground_floor, measured, space, turned, upper_floor, wall

from scan2bim.model.elements import Building, Storey
from scan2bim.model.queries import point_on_wall
from scan2bim.report import palette
from scan2bim.report.plan import PlanBackground, building_sheet, draw_plan, find_open_edges, storey_sheet
from scan2bim.report.plan_file import export
from scan2bim.report.raster import encode_png, sheet_image
from scan2bim.report.sheet import Picture, Shape, Sheet, Text, View
from scan2bim.report.svg import sheet_svg


def words(sheet: Sheet) -> list[str]:
    return [mark.words for mark in sheet.marks if isinstance(mark, Text)]


def view_of(storey: Storey, sheet: Sheet) -> View:
    """The view of a sheet of one storey, from where it drew the first space."""
    first = storey.spaces[0]
    ring = next(mark.rings[0] for mark in sheet.marks if isinstance(mark, Shape) and mark.fill == palette.SPACES[0])
    plan = np.array(first.outline)
    scale = float(np.linalg.norm(ring[1] - ring[0]) / np.linalg.norm(plan[1] - plan[0]))
    return View(scale, ring[0, 0] - scale * plan[0, 0], ring[0, 1] + scale * plan[0, 1])


def pixel(image: np.ndarray, view: View, point: tuple[float, float]) -> tuple[int, ...]:
    x, y = view.page([point])[0]
    return tuple(image[int(y), int(x)].tolist())


@pytest.fixture(scope="module")
def drawn():
    storey = ground_floor()
    sheet = storey_sheet(storey, building())
    return storey, sheet, sheet_image(sheet), view_of(storey, sheet)


def test_spaces_are_named_with_their_areas(drawn):
    _, sheet, _, _ = drawn
    for name in ("Hall", "Küche", "Living room", "21.9 m²", "29.2 m²"):
        assert name in words(sheet)


def test_the_title_counts_doors_by_state(drawn):
    _, sheet, _, _ = drawn
    assert "Test house · Ground floor" in words(sheet)
    assert any("5 doors (1 open, 2 ajar, 1 closed, 1 unknown) · 4 windows · 1 passage" in line for line in words(sheet))
    assert not any(line.endswith("not closed") and "space" in line for line in words(sheet))


def test_walls_are_dark_where_measured_and_light_where_assumed(drawn):
    _, _, image, view = drawn
    assert pixel(image, view, turned(4.0, 0.0)) == palette.WALL
    assert pixel(image, view, turned(5.0, 8.0)) == palette.ASSUMED_WALL
    assert pixel(image, view, turned(1.0, 1.0)) == palette.SPACES[0]


def test_a_closed_leaf_stands_in_its_opening_and_an_open_one_in_the_room_that_it_swings_to(drawn):
    storey, _, image, view = drawn
    south = storey.walls[0]
    assert pixel(image, view, point_on_wall(south, 1.5, 0.13, 0)[:2]) == palette.DOORS["closed"]
    middle = next(w for w in storey.walls if w.id == "wall-g-middle")
    leaf = point_on_wall(middle, 1.2 + 0.5 * np.cos(1.4), -0.06 - 0.5 * np.sin(1.4), 0)[:2]
    assert pixel(image, view, leaf) == palette.DOORS["open"]


def test_the_gap_of_an_opening_has_the_colour_of_its_state(drawn):
    storey, _, image, view = drawn
    middle = next(w for w in storey.walls if w.id == "wall-g-middle")
    assert pixel(image, view, point_on_wall(middle, 1.6, 0, 0)[:2]) == palette.pale(palette.DOORS["open"], 0.3)


def test_what_is_not_known_of_a_door_is_a_question_mark(drawn):
    _, sheet, _, _ = drawn
    assert words(sheet).count("?") == 2


def test_closed_rooms_have_no_open_edges():
    edges = find_open_edges(ground_floor())
    assert (edges.shared, edges.leaks, edges.leaking) == ((), (), ())


def test_a_missing_wall_is_a_leak_of_the_rooms_beside_it():
    storey = ground_floor()
    west = [w for w in storey.walls if w.id != "wall-g-west"]
    edges = find_open_edges(storey.model_copy(update={"walls": tuple(west)}))
    assert edges.leaking == ("space-g1", "space-g2")
    assert sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in edges.leaks) == pytest.approx(
        7.2, abs=0.3
    )
    sheet = storey_sheet(storey.model_copy(update={"walls": tuple(west)}), building())
    assert any(line.endswith("2 spaces not closed") for line in words(sheet))


def test_rooms_that_go_over_into_each_other_share_an_edge_and_do_not_leak():
    storey = ground_floor()
    kept = tuple(w for w in storey.walls if w.id != "wall-g-cross")
    edges = find_open_edges(storey.model_copy(update={"walls": kept}))
    assert len(edges.shared) == 2
    assert edges.leaking == ()


def test_a_hole_in_a_space_that_no_wall_bounds_is_a_leak():
    assert find_open_edges(upper_floor()).leaking == ("space-u3",)


def test_scanners_are_drawn_in_their_storey(drawn):
    def count(sheet: Sheet) -> int:
        rings = [m for m in sheet.marks if isinstance(m, Shape) and m.stroke == palette.SCANNER and m.closed]
        return len(rings) - 1  # less the one in the legend

    assert count(drawn[1]) == 2
    assert count(storey_sheet(upper_floor(), building())) == 1


@pytest.mark.parametrize("cell", [0.01, 0.05, 0.2])
def test_a_slice_of_the_scan_lies_where_the_model_is(cell):
    storey = ground_floor()
    counts = np.zeros((round(20 / cell), round(20 / cell)), int)
    spot = turned(3.0, 1.0)
    counts[int((spot[1] + 6) / cell), int((spot[0] + 6) / cell)] = 50
    background = PlanBackground(counts, (-6.0, -6.0), cell)
    sheet = storey_sheet(storey, building(), background=background)
    image, view = sheet_image(sheet), view_of(storey, sheet)
    x, y = view.page([spot])[0]
    reach = int(cell * view.scale) + 2
    patch = image[int(y) - reach : int(y) + reach + 1, int(x) - reach : int(x) + reach + 1]
    assert patch[..., 0].min() < 90
    assert pixel(image, view, turned(3.0, 1.0 + 4 * cell + 0.1))[0] > 200
    assert draw_plan(storey, building(), background=background).shape == image.shape


def test_a_slice_far_from_the_model_or_empty_changes_nothing():
    storey = ground_floor()
    plain = draw_plan(storey, building(), background=PlanBackground(np.zeros((5, 5)), (0, 0), 0.1))
    far = draw_plan(storey, building(), background=PlanBackground(np.ones((5, 5)), (500.0, 500.0), 0.1))
    assert np.array_equal(plain, far)


def test_a_background_that_is_no_picture_is_refused():
    for counts, size in ((np.zeros(3), 0.1), (np.zeros((3, 3)), 0.0)):
        with pytest.raises(ValueError, match="must be"):
            PlanBackground(counts, (0, 0), size)


def test_svg_and_png_are_readable_and_the_same_on_every_run(tmp_path: Path):
    for suffix in ("svg", "png"):
        for name in ("a", "b"):
            assert export(building(), tmp_path / f"{name}.{suffix}")
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    root = ET.parse(tmp_path / "a.svg").getroot()
    texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"Hall", "Attic & store", "Test house · Upper floor"} <= set(texts)
    image = cv2.imread(str(tmp_path / "a.png"))
    assert image is not None
    size = [float(root.attrib[name].removesuffix("mm")) / 25.4 * 96 for name in ("height", "width")]
    assert size == pytest.approx(image.shape[:2], abs=0.1)


def test_svg_holds_the_slice_of_the_scan():
    background = PlanBackground(np.ones((100, 100)), (0.0, 0.0), 0.05)
    assert "data:image/png;base64," in sheet_svg(storey_sheet(ground_floor(), building(), background=background))


def test_png_keeps_red_red():
    image = np.zeros((2, 2, 3), np.uint8)
    image[..., 0] = 255
    decoded = cv2.imdecode(np.frombuffer(encode_png(image), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert decoded[0, 0].tolist() == [0, 0, 255]


def test_a_dashed_line_has_gaps_and_a_see_through_shape_lets_through():
    ring = np.array([[10.0, 10], [90, 10]])
    dashed = Shape((ring,), None, (0, 0, 0), 1, dash=10, closed=False)
    faint = Shape((np.array([[0.0, 50], [100, 50], [100, 100], [0, 100]]),), fill=(0, 0, 0), opacity=0.5)
    empty = Picture(np.zeros((0, 0, 3), np.uint8), np.eye(2, 3))
    image = sheet_image(Sheet(100, 100, (dashed, faint, empty)))
    row = image[8:12, :, 0].min(axis=0)
    assert row[15] < 128 < row[25]
    assert 120 < image[80, 50, 0] < 135


def test_storeys_share_one_scale_and_stand_in_rows():
    storeys = tuple(ground_floor().model_copy(update={"id": f"s{k}"}) for k in range(5))
    one = building_sheet(building().model_copy(update={"storeys": storeys[:1]}))
    five = building_sheet(building().model_copy(update={"storeys": storeys}))
    assert five.width == pytest.approx(3 * one.width, abs=3)
    assert five.height > 1.8 * one.height


def test_odd_buildings_have_a_plan_too():
    line = space("line", "Line", box(0, 0, 1, 1)[:2], 0.0, 0.0)
    flat = space("flat", "Flat", (turned(0, 0), turned(1, 0), turned(2, 0)), 0.0, 0.0)
    bow = space("bow", "Bow", (turned(0, 0), turned(1, 1), turned(1, 0), turned(0, 1)), 0.0, 0.5)
    point = wall("point", (3, 3), (3, 3), 0.2, 0.0)
    storey = Storey(id="s", name="Odd <&>", elevation=measured(0.0), spaces=(line, flat, bow), walls=(point,))
    bare = Storey(id="t", name="Bare", elevation=measured(3.0))
    for storeys in ((), (bare,), (storey, bare)):
        odd = Building(id="b", name="B", storeys=storeys)
        assert sheet_image(building_sheet(odd)).ndim == 3
        ET.fromstring(sheet_svg(building_sheet(odd)))


def test_a_huge_building_does_not_make_a_huge_picture():
    far = wall("far", (0, 0), (40_000, 0), 0.2, 0.0)
    sheet = storey_sheet(Storey(id="s", name="S", elevation=measured(0), walls=(far,)), building())
    assert sheet.width < 5000
    assert sheet.height < 5000


def test_a_plan_is_drawn_to_a_usual_scale(drawn):
    _, sheet, _, view = drawn
    assert any("1:50, floor at +0.00 m" in line for line in words(sheet))
    assert view.scale == pytest.approx(96 / 0.0254 / 50, rel=1e-6)


def test_outer_walls_are_dimensioned_along_their_faces(drawn):
    _, sheet, _, view = drawn
    lengths = {mark.words: mark for mark in sheet.marks if isinstance(mark, Text) and mark.angle}
    assert {"10.30", "8.30", "4.80", "2.20"} <= set(lengths)
    assert lengths["10.30"].angle == pytest.approx(20, abs=1e-3)
    south = view.page([turned(4.4, -0.15)])[0]
    assert np.hypot(lengths["4.80"].x - south[0], lengths["4.80"].y - south[1]) < 60


def test_a_pdf_has_a_page_a_storey_of_the_size_that_its_scale_asks_for(tmp_path):
    for name in ("a.pdf", "b.pdf"):
        export(building(), tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()
    document = pypdfium2.PdfDocument(tmp_path / "a.pdf")
    assert len(document) == 2
    for page, storey in zip(document, building().storeys, strict=True):
        text = page.get_textpage().get_text_range()
        assert all(space.name in text for space in storey.spaces)
        sheet = storey_sheet(storey, building())
        assert page.get_size() == pytest.approx((sheet.width * 0.75, sheet.height * 0.75), abs=0.1)
    assert "21.9 m²" in document[0].get_textpage().get_text_range()
    picture = document[0].render(scale=4 / 3).to_numpy()
    drawn = sheet_image(storey_sheet(building().storeys[0], building()))
    rows, columns = (min(a, b) for a, b in zip(picture.shape, drawn.shape[:2], strict=False))
    alike = np.abs(picture[:rows, :columns, 0].astype(int) - drawn[:rows, :columns, 2]) < 40
    assert alike.mean() > 0.95
