from __future__ import annotations

import json
import math
from pathlib import Path

import jsonschema
import pytest
from buildings import building, measured

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.model.elements import Building, Frame, Storey
from scan2bim.model.io import SCHEMA_FILE, dump_building, load_building, schema, schema_text

SCHEMAS = Path(__file__).parents[2] / "scan2bim" / "schemas"


@pytest.fixture
def model(tmp_path) -> Path:
    path = tmp_path / "model.json"
    path.write_text(dump_building(building()), encoding="utf-8")
    return path


def changed(model: Path, change) -> Path:
    data = json.loads(model.read_text(encoding="utf-8"))
    change(data)
    model.write_text(json.dumps(data), encoding="utf-8")
    return model


def test_a_model_that_is_written_and_read_is_the_same(model):
    assert load_building(model) == building()
    assert dump_building(load_building(model)) == model.read_text(encoding="utf-8")


@pytest.mark.parametrize("value", [0.1 + 0.2, math.pi, 1e-300, 5e-324, 123456789.123456789, -0.0, 1e22, 3.0])
def test_floats_come_back_bit_for_bit(tmp_path, value):
    house = Building(id="b", name="b", frame=Frame(shift=(value, 0.0, 0.0)))
    path = tmp_path / "model.json"
    path.write_text(dump_building(house))
    found = load_building(path).frame.shift[0]
    assert found.hex() == value.hex()


def test_the_same_model_gives_the_same_text():
    assert dump_building(building()) == dump_building(building())


def test_the_published_schema_is_the_models():
    published = (SCHEMAS / SCHEMA_FILE).read_text(encoding="utf-8")
    assert published == schema_text(), (
        "write scan2bim.model.io.schema_text() to the file, and a new version if it broke"
    )


def test_the_schema_is_valid_and_a_written_model_fits_it(model):
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.Draft202012Validator(schema()).validate(json.loads(model.read_text(encoding="utf-8")))


def test_the_schema_refuses_what_the_reader_refuses(model):
    validator = jsonschema.Draft202012Validator(schema())
    data = json.loads(model.read_text(encoding="utf-8"))
    data["storeys"][0]["walls"][0]["colour"] = [0.1, 0.2]
    assert not validator.is_valid(data)
    data = json.loads(model.read_text(encoding="utf-8"))
    data["more"] = 1
    assert not validator.is_valid(data)


def test_an_unknown_key_is_named_with_its_place(model):
    path = changed(model, lambda data: data["storeys"][1]["walls"][0].update(hight=2))
    with pytest.raises(InputError, match=r"model.json: .*storeys\[1\]\.walls\[0\]\.hight: Extra inputs") as found:
        load_building(path)
    assert found.value.exit_code == 3


def test_another_version_is_refused_by_its_number(model):
    with pytest.raises(InputError, match=r"version 1\.0, got version '2\.0'"):
        load_building(changed(model, lambda data: data.update(version="2.0")))


def test_text_in_place_of_a_number_is_refused(model):
    with pytest.raises(InputError, match=r"elevation\.value"):
        load_building(changed(model, lambda data: data["storeys"][0]["elevation"].update(value="1.5")))


def test_two_things_with_one_id_are_refused(model):
    with pytest.raises(InputError, match="'wall-g-south' stands for more than one thing"):
        load_building(changed(model, lambda data: data["storeys"][0]["walls"][1].update(id="wall-g-south")))


def test_many_problems_make_one_short_message(model):
    def spoil(data):
        for wall in data["storeys"][0]["walls"]:
            wall["base"] = None
            wall["start"] = 1

    with pytest.raises(InputError, match="and 7 more"):
        load_building(changed(model, spoil))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "line 1 column 1"),
        (b'{"id": "a", "name": "b"', "line 1 column 24"),
        (b'{"id": "a", "id": "b", "name": "b"}', "'id' stands twice"),
        (b'{"id": "a", "name": NaN}', "NaN is no JSON number"),
        (b"\xff\xfe\x00", "byte 0 is not UTF-8"),
        (b"[" * 100_000, "expected a model"),
        (b'{"a":' * 50_000 + b"1" * 5000, "expected a model"),
    ],
)
def test_what_is_no_json_is_damaged(tmp_path, content, words):
    path = tmp_path / "model.json"
    path.write_bytes(content)
    with pytest.raises(DamagedFileError, match=words):
        load_building(path)


@pytest.mark.parametrize(
    "content", ["[]", "1", "null", '"text"', '{"id": "a"}', '{"id": "a", "name": "b", "frame": 1e999}']
)
def test_json_that_is_no_model_is_refused(tmp_path, content):
    path = tmp_path / "model.json"
    path.write_text(content)
    with pytest.raises(InputError, match=r"model\.json"):
        load_building(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            load_building(path)


def test_a_byte_order_mark_does_no_harm(tmp_path):
    path = tmp_path / "model.json"
    path.write_bytes(b"\xef\xbb\xbf" + dump_building(building()).encode())
    assert load_building(path) == building()


def test_an_empty_storey_is_a_model(tmp_path):
    path = tmp_path / "model.json"
    house = Building(id="b", name="b", storeys=(Storey(id="s", name="s", elevation=measured(0.0)),))
    path.write_text(dump_building(house))
    assert load_building(path) == house
