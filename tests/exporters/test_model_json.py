from __future__ import annotations

from buildings import building

from scan2bim.exporters.model_json import export
from scan2bim.model.io import load_building


def test_the_json_file_is_the_whole_model(tmp_path):
    assert export(building(), tmp_path / "house.json") == ()
    assert load_building(tmp_path / "house.json") == building()


def test_two_runs_write_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        export(building(), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
